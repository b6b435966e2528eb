"""What evidence counts for, on numbers made by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seatruth.arrays import Array
from seatruth.diagnosis.tempering import (
    beyond_the_form,
    errors_beside_forces,
    form_limit,
    in_another_form,
    sensors_alone,
    tempered,
    tempered_deviation,
)

COUNTS = np.array([0, 1, 1, 2, 2, 3])


def counted(evidence: list[float], beside: float = 0.2, ahead: float = 0.0) -> Array:
    return tempered(np.array(evidence), COUNTS, 0.0, temperature=2.0, model_form=0.02, beside=beside, ahead=ahead)


def test_rivals_of_one_size_share_what_the_form_of_the_best_one_leaves() -> None:
    found = counted([0.0, 100.0, 90.0, 0.0, 0.0, 0.0])
    assert found[1] - found[2] == pytest.approx(10.0 / (2.0 + 0.02 * 100.0))


def test_a_further_effect_is_not_asked_for_what_the_first_one_leaves() -> None:
    found = counted([0.0, 100.0, 90.0, 140.0, 120.0, 0.0])
    whole, further = 2.0 + 0.02 * 140.0, 2.0 + 0.02 * (0.2 * 100.0 + 40.0)
    assert found[3] == pytest.approx(100.0 / whole + 40.0 / further)
    assert found[3] - found[4] == pytest.approx(20.0 / further)
    plain = counted([0.0, 100.0, 90.0, 140.0, 120.0, 0.0], beside=1.0)
    assert plain == pytest.approx(np.array([0.0, 100.0, 90.0, 140.0, 120.0, 0.0]) / whole)


def test_what_a_sensor_explains_is_not_asked_of_what_acts_on_the_vehicle() -> None:
    """A delay of a position explains 100 nats: a wind is not asked for what its form leaves, a bias of it is."""
    keys = [(), ("delay",), ("wind",), ("delay", "wind"), ("bias", "delay"), ("bias", "delay", "wind")]
    evidence, counts = np.array([0.0, 100.0, 30.0, 140.0, 140.0, 140.0]), np.array([len(key) for key in keys])

    def of(less: float = 0.0, **sensors: str) -> Array:
        one = evidence - np.array([0.0, 0.0, 0.0, less, 0.0, 0.0])
        by = sensors_alone(one, keys, {name: frozenset({channel}) for name, channel in sensors.items()})
        return tempered(one, counts, 0.0, temperature=2.0, model_form=0.02, beside=0.5, by_sensors=by)

    found, plain = of(delay="x", bias="x"), of()
    whole, further = 2.0 + 0.02 * 140.0, 2.0 + 0.02 * (0.5 * 100.0 + 40.0)
    assert plain[3:] == pytest.approx(np.full(3, 100.0 / whole + 40.0 / further))
    assert found[3] == pytest.approx(100.0 / whole + 40.0 / (2.0 + 0.02 * 40.0))
    assert found[[0, 1, 2]] == pytest.approx(plain[[0, 1, 2]])
    # But what explains as much as the wind does beside the delay does not stand behind it.
    assert found[4] == pytest.approx(found[3])
    weak = of(delay="x", bias="x", less=120.0)
    assert weak[4] == pytest.approx(of(less=120.0)[4])
    # Two sensors explain all of it: the wind beside them has nothing of its own.
    assert weak[5] == pytest.approx(weak[4])
    # Nor is the bias of another sensor asked for it.
    other = of(delay="x", bias="r")
    assert other[[0, 1, 2, 3]] == pytest.approx(found[[0, 1, 2, 3]])
    assert other[4] == pytest.approx(found[3])


def test_two_effects_that_only_explain_what_one_does_count_as_it_does() -> None:
    found = counted([0.0, 100.0, 60.0, 100.0, 80.0, 100.0])
    assert found[1] == pytest.approx(found[3]) == pytest.approx(found[5])
    assert found[4] < found[3]


def test_what_the_leading_fit_did_not_reach_counts_as_explained() -> None:
    near, far = (counted([0.0, 100.0, 90.0, 0.0, 0.0, 0.0], ahead=ahead) for ahead in (0.0, 400.0))
    assert far[1] - far[2] == pytest.approx(10.0 / (2.0 + 0.02 * 500.0))
    assert far[1] - far[2] < near[1] - near[2]


def test_a_rival_that_is_further_behind_than_a_form_can_leave_is_behind_in_full() -> None:
    evidence = np.array([5200.0 - 331.0, 5200.0, 5190.0, 0.0])
    apart = np.array([True, False, False, True])
    whole = beyond_the_form(evidence / 100.0, evidence, apart, 12.5, 2.0)
    assert whole[1] - whole[0] == pytest.approx(331.0 / 2.0), "no more than the temperature of all evidence leaves"
    assert whole[1] - whole[2] == pytest.approx(0.1), "it shares an effect with the leader"
    beside = np.array([278.0, 274.0, 358.0])
    compared = beyond_the_form(beside / 284.0, beside, np.array([False, True, False]), 6.0, 1.0, np.array([2, 0, 2]))
    assert compared == pytest.approx(beside / 284.0), "4 nats behind what is of its form"
    near = np.array([95.0, 100.0])
    kept = beyond_the_form(near / 7.0, near, np.array([True, False]), 12.5, 2.0)
    assert kept == pytest.approx(near / 7.0), "a form can leave five nats"


def test_forces_tell_of_a_form_as_much_as_they_explain_of_the_effect() -> None:
    assert form_limit(100.0, 50.0, beside=-3.0, unseen=6.0) == pytest.approx(12.0)
    assert form_limit(100.0, 100.0, beside=4.0, unseen=6.0) == pytest.approx(10.0)
    assert form_limit(100.0, -3.0, beside=-3.0, unseen=6.0) == math.inf
    assert form_limit(0.0, 0.0, beside=0.0, unseen=6.0) == math.inf


@given(st.lists(st.floats(0.0, 500.0), min_size=2, max_size=6), st.floats(0.0, 50.0))
def test_the_limit_of_a_form_takes_no_rival_nearer_and_none_beyond_its_evidence(
    evidence: list[float], limit: float
) -> None:
    values = np.array(evidence)
    counts = values / 5.0
    apart = values < values.max()
    found = beyond_the_form(counts, values, apart, limit, 1.0)
    assert (found <= counts + 1e-9).all()
    assert (found.max() - found <= values.max() - values + 1e-9).all()


@given(st.lists(st.floats(-50.0, 500.0), min_size=6, max_size=6), st.floats(0.0, 1.0))
def test_more_evidence_counts_for_more_among_sets_of_one_size(evidence: list[float], beside: float) -> None:
    found = counted(evidence, beside)
    assert np.isfinite(found).all()
    for number in (1, 2):
        a, b = np.flatnonzero(number == COUNTS)
        assert (found[a] - found[b]) * (evidence[a] - evidence[b]) >= 0.0


def test_sizes_are_as_unsure_as_the_evidence_and_no_surer_than_data_and_prior() -> None:
    """By hand: data of precision 3 about a prior of 1 have 4; divided by three they leave 2. What is fixed stays so."""
    found = tempered_deviation(np.array([0.5, 1.0, 0.0]), np.ones(3), 3.0)
    assert found == pytest.approx([2.0**-0.5, 1.0, 0.0])
    strong = tempered_deviation(np.array([1e-4]), np.array([1.0]), 1.79)
    assert strong == pytest.approx([1e-4 * math.sqrt(1.79)], rel=1e-6)
    assert tempered_deviation(np.array([0.5]), np.ones(1), 1.0) == pytest.approx([0.5])


@given(st.lists(st.floats(-200.0, 200.0), min_size=3, max_size=6), st.floats(1.0, 20.0), st.floats(0.1, 10.0))
def test_another_form_is_behind_by_no_more_than_before_and_never_ahead(
    values: list[float], temperature: float, unseen: float
) -> None:
    evidence = np.array(values)
    found = evidence / temperature
    forms = [[1], [0], *([] for _ in values[2:])]
    raised = in_another_form(found, evidence, forms, unseen)
    behind = abs(values[0] - values[1])
    assert raised[2:] == pytest.approx(found[2:]), "no form of another one"
    assert raised.max() == pytest.approx(found.max())
    assert abs(raised[0] - raised[1]) == pytest.approx(max(0.0, behind - unseen) / temperature, abs=1e-9)


def test_what_acts_on_the_vehicle_does_not_heat_an_error_of_a_sensor_beside_it_and_forces() -> None:
    keys = [("wind",), ("heading_bias", "wind"), ("gyro_bias", "heading_bias", "wind"), ("rudder_lag", "wind")]
    evidence = np.array([290.0, 320.0, 350.0, 320.0])
    found = evidence / 16.0
    sensors = {"heading_bias", "gyro_bias"}

    def counts(forces: list[bool], of: set[str]) -> Array:
        return errors_beside_forces(found, evidence, keys, forces, of, 5.0, 2.0, 0.1)

    # 30 nats less 5, at a temperature of 2 + 0.1 * 30; the third set stands upon the second one.
    assert counts([True] * 4, sensors) == pytest.approx([290.0 / 16.0, 290.0 / 16.0 + 5.0, 290.0 / 16.0 + 10.0, 20.0])
    assert counts([False] * 4, sensors) == pytest.approx(found), "without forces what the form leaves may be anywhere"
    assert counts([True] * 4, set()) == pytest.approx(found)


def test_a_set_that_explains_less_than_its_part_raises_none() -> None:
    """A recorded glider whose depth was scaled: a pair 0.02 nats ahead of either error alone had 86 %.

    Another pair, 13 nats behind its part, had been raised to that, and the first one above it.
    """
    keys = [("speed_bias",), ("depth_scale",), ("depth_scale", "speed_bias"), ("speed_bias", "speed_scale"), ()]
    evidence = np.array([1.72, 1.68, 1.74, -11.04, 0.0])
    found = errors_beside_forces(
        evidence / 1.1, evidence, keys, [True] * 5, {"speed_bias", "depth_scale", "speed_scale"}, 5.7, 1.0, 0.05
    )
    assert found == pytest.approx(evidence / 1.1)


def test_no_set_is_behind_one_that_explains_less_and_stands_beside_a_sensor() -> None:
    """A torpedo whose rate of turn and pitch came late: the planes' dead time with an arm of the log was certain."""
    late, arm = ("pitch_delay", "rate_delay"), ("log_lever_arm_vertical", "plane_delay")
    keys = [(), ("plane_delay",), ("rate_delay",), arm, late, late]
    evidence = np.array([0.0, 350.0, 213.0, 443.6, 509.5, 513.0])
    found, forces = evidence / 28.0, [True, True, True, True, True, False]
    sensors = {"pitch_delay", "rate_delay", "log_lever_arm_vertical"}
    raised = errors_beside_forces(found, evidence, keys, forces, sensors, 5.67, 1.0, 0.053)
    assert raised[3] > found[3]
    heat = 1.0 + 0.053 * 513.0
    assert raised[5] == pytest.approx(raised[3] + (513.0 - 443.6 - 5.67) / heat)
    assert raised[4] == pytest.approx(raised[3] + (509.5 - 443.6 - 5.67) / heat)
    # A set with what acts on the vehicle may take the form of the rest, and stays where it is.
    acting = [*keys[:4], ("plane_delay", "plane_gain"), ("plane_delay", "plane_gain")]
    assert errors_beside_forces(found, evidence, acting, forces, sensors, 5.67, 1.0, 0.053)[4:] == pytest.approx(
        found[4:]
    )
    # What is ahead by no more than a wrong form that forces do not show is no reason.
    evidence[4:] = 446.0
    near = errors_beside_forces(evidence / 28.0, evidence, keys, forces, sensors, 5.67, 1.0, 0.053)
    assert near[5] == near[4], "beside forces one error is not heated by the other"
    assert near[4] < near[3]


def test_a_current_does_not_heat_what_turns_with_the_vehicle_beside_it_and_forces() -> None:
    """Of a ship in a current of 0.4 m/s, a rudder 1.6 deg off explained 196 nats more, and had less than even odds."""
    keys = [("current",), ("current", "rudder_offset"), ("current", "cross_flow"), ("rudder_offset", "wind"), ("wind",)]
    evidence = np.array([820.0, 1016.0, 1000.0, 900.0, 700.0])
    found = evidence / 50.0

    def counts(forces: bool, currents: set[str]) -> Array:
        return errors_beside_forces(
            found, evidence, keys, [forces] * 5, (), 5.7, 1.0, 0.053, on_board={"rudder_offset"}, currents=currents
        )

    apart = (196.0 - 5.7) / (1.0 + 0.053 * 196.0)
    assert counts(True, {"current"}) == pytest.approx([16.4, 16.4 + apart, 20.0, 18.0, 14.0])
    assert counts(False, {"current"}) == pytest.approx(found)
    assert counts(True, set()) == pytest.approx(found), "on one course a current pushes to one side"


def test_what_stands_beside_an_error_of_a_sensor_that_leads_is_heated_by_that() -> None:
    """Whether the rest was also fitted alone does not tell a set from another that explains as much."""
    keys = [("position_delay",), ("position_delay", "wave_drift"), ("current", "position_delay"), ("wave_drift",)]
    evidence = np.array([154.6, 181.6, 180.7, 75.0])
    found = evidence / 7.0
    raised = errors_beside_forces(found, evidence, keys, [True] * 4, {"position_delay"}, 5.7, 1.0, 0.053)
    assert raised == pytest.approx(found)


def test_a_set_that_needs_no_forces_is_not_behind_itself_with_them() -> None:
    """A rudder whose order was recorded at 0.4 of its angle, in a current: with forces it would count as a term."""
    keys = [(), ("current",), ("current", "rudder_gain"), ("current", "rudder_gain"), ("current",)]
    on = [True, True, True, False, False]
    evidence = np.array([0.0, 306.0, 505.0, 520.0, -2428.0])
    beside = {"on_board": {"rudder_gain"}, "currents": {"current"}}
    found = errors_beside_forces(evidence / 28.0, evidence, keys, on, {"gyro_bias"}, 5.7, 1.0, 0.05, **beside)
    assert found[2] > found[1] + 10.0
    assert found[3] > found[2]
    assert found[4] == evidence[4] / 28.0, "far behind it keeps its own"
    near = evidence.copy()
    near[3] = 503.0  # two nats less than with forces
    found = errors_beside_forces(near / 28.0, near, keys, on, {"gyro_bias"}, 5.7, 1.0, 0.05, **beside)
    assert found[3] == pytest.approx(found[2] - 2.0)


def test_what_stands_beside_a_raised_set_is_raised_with_it() -> None:
    """Of an ROV in a current, a second thruster beside the first explained 180 nats more and was impossible, and with
    it the heading bias that acted, since the current's heat was taken from the pair alone."""
    keys = [("current",), ("bias", "current"), ("current", "port"), ("current", "port", "starboard")]
    keys.append(("bias", "current", "port", "starboard"))
    evidence, counts = np.array([897.0, 915.0, 976.0, 1155.0, 1168.0]), np.array([len(key) for key in keys])
    found = tempered(evidence, counts, 6.0, temperature=1.0, model_form=0.053, beside=0.85)
    beside = {"on_board": {"port", "starboard"}, "currents": {"current"}}
    raised = errors_beside_forces(found, evidence, keys, [True] * 5, {"bias"}, 5.7, 1.0, 0.053, **beside)
    assert raised[2] > found[2] + 5.0
    assert raised[3] - raised[2] == pytest.approx(found[3] - found[2])
    assert raised[4] - raised[3] > 3.0
    assert (raised >= found).all()


def test_a_set_that_explains_more_than_a_raised_one_is_not_behind_it() -> None:
    keys = [("current",), ("current", "port"), ("current", "tether"), ("current", "drag"), ("port", "wind")]
    evidence, beside = np.array([750.0, 846.0, 887.0, 840.0, 700.0]), {"on_board": {"port"}, "currents": {"current"}}
    found = evidence / 48.0
    raised = errors_beside_forces(found, evidence, keys, [True] * 5, set(), 5.7, 1.0, 0.053, **beside)
    assert raised[1] > found[1] + 10.0
    heat = 1.0 + 0.053 * 187.0
    assert raised[2] == pytest.approx(raised[1] + (887.0 - 846.0 - 5.7) / heat)
    assert raised[3:] == pytest.approx(found[3:]), "what explains less stays where it was"


def test_what_is_raised_to_another_set_raises_what_stands_beside_it() -> None:
    """A heading bias beside two thrusters had 37 %, though 13 nats ahead: these were raised after it."""
    keys = [("current",), ("current", "port"), ("bias", "current", "port"), ("current", "port", "starboard")]
    keys.append(("bias", "current", "port", "starboard"))
    evidence = np.array([897.0, 976.0, 1040.0, 1155.0, 1168.0])
    beside = {"on_board": {"port", "starboard"}, "currents": {"current"}}
    raised = errors_beside_forces(
        evidence / 59.0, evidence, keys, [True] * 5, {"bias"}, 5.7, 1.0, 0.053, **beside
    )  # fmt: skip
    assert raised[3] >= raised[2]
    counts = (13.0 - 5.7) / (1.0 + 0.053 * 13.0)
    assert raised[4] == pytest.approx(raised[3] + counts)
