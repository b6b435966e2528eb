"""Effects that can stand in each other's place are one cause, named at the level that they have in common."""

from __future__ import annotations

import pytest
from decided_by_hand import decided


@pytest.mark.parametrize(
    ("pair", "cause"),
    [
        (("wind", "wave_drift"), "environment.force_fixed_to_earth"),
        (("rudder_lag", "rudder_delay"), "actuator.steering.dynamics"),
        (("current", "heading_bias"), ""),
    ],
)
def test_look_alikes_are_named_by_their_lowest_common_ancestor(pair: tuple[str, str], cause: str) -> None:
    said = decided(((pair[0],), 0.5), ((pair[1],), 0.45), ((), 0.05))
    assert said.kind == "inseparable"
    (cluster,) = said.clusters
    assert (cluster.effects, cluster.cause) == (pair, cause)
    assert cluster.probability == pytest.approx(0.95)
    assert said.shown == (pair[0],)


def test_a_rival_that_is_near_counts_even_where_the_leader_holds_most() -> None:
    entries = ((("wind",), 0.80), (("wave_drift",), 0.15), ((), 0.05))
    assert decided(*entries, near={frozenset(("wind", "wave_drift")): 5.0}).kind == "inseparable"
    far = decided((("wind",), 0.90), (("wave_drift",), 0.05), ((), 0.05))
    assert far.kind == "effects"


def test_a_rival_of_little_probability_is_none() -> None:
    said = decided((("wind",), 0.9), (("wave_drift",), 0.05), near={frozenset(("wind", "wave_drift")): 1.0})
    assert said.kind == "effects"
    assert said.clusters[0].effects == ("wind",)


def test_look_alikes_beside_an_effect_that_is_sure() -> None:
    said = decided(
        (("rudder_offset", "wind"), 0.5), (("rudder_offset", "wave_drift"), 0.45), (("rudder_offset",), 0.05)
    )
    assert said.kind == "inseparable"
    by_first = {cause.effects[0]: cause for cause in said.clusters}
    assert by_first["rudder_offset"].effects == ("rudder_offset",)
    assert by_first["wind"].effects == ("wind", "wave_drift")
    assert by_first["rudder_offset"].probability == pytest.approx(1.0)


def test_two_effects_that_stand_in_for_one_another_are_one_cause() -> None:
    said = decided(
        (("wave_drift", "wind"), 0.4),
        (("wind",), 0.3),
        (("wave_drift",), 0.3),
        near={frozenset(("wind", "wave_drift")): 1.0},
    )
    names = [name for cause in said.clusters for name in cause.effects]
    assert len(names) == len(set(names))


def test_a_factor_on_an_actuator_stands_in_no_other_cause_s_place_beside_missing_forces() -> None:
    for discrepancy, members in ((True, ("gyro_bias",)), (False, ("gyro_bias", "rudder_gain"))):
        sets = ((("gyro_bias",), 0.6), (("rudder_gain",), 0.35), ((), 0.05))
        said = decided(*((key, p, True) if discrepancy else (key, p) for key, p in sets))
        assert [cause.effects for cause in said.clusters] == [members]
        assert said.probability == pytest.approx(0.6 if discrepancy else 0.95)


def test_the_same_effect_with_a_value_for_each_trial_is_no_other_cause() -> None:
    said = decided((("current",), 0.6), (("trial_current",), 0.35), ((), 0.05))
    assert [cause.effects for cause in said.clusters] == [("current",)]
    assert said.clusters[0].probability == pytest.approx(0.95)
    hardly = decided((("current",), 0.9), (("trial_current",), 0.06), ((), 0.04))
    assert hardly.clusters[0].probability == pytest.approx(0.96)
    other = decided((("trial_current",), 0.6), (("current",), 0.35), ((), 0.05))
    assert other.clusters[0].effects == ("trial_current", "current")


def test_a_value_for_each_trial_leaves_open_whether_they_differ() -> None:
    """It also takes up what differs for another reason, a model of another form say."""
    may = decided((("trial_wind",), 0.985), (("wind",), 0.009), ((), 0.006))
    assert [cause.effects for cause in may.clusters] == [("trial_wind", "wind")]
    assert may.clusters[0].cause == "environment.force_fixed_to_earth.wind"
    assert may.probability == pytest.approx(0.994)
    do = decided((("trial_wind",), 0.994), (("wind",), 1e-6), ((), 0.006))
    assert [cause.effects for cause in do.clusters] == [("trial_wind",)]


def test_a_lag_and_a_dead_time_of_one_servo_are_one_cause() -> None:
    late = decided((("depth_scale", "plane_delay", "plane_lag"), 0.9), (("plane_delay", "plane_lag"), 0.07), ((), 0.03))
    assert [cause.effects for cause in late.clusters] == [("depth_scale",), ("plane_delay", "plane_lag")]
    assert late.clusters[1].cause == "actuator.steering.dynamics"
    assert late.shown == ("depth_scale", "plane_delay", "plane_lag")
    band = decided((("plane_dead_band", "plane_lag"), 0.97), ((), 0.03))
    assert [cause.effects for cause in band.clusters] == [("plane_dead_band",), ("plane_lag",)]


def test_a_form_of_the_model_stands_beside_no_cause() -> None:
    """It takes its part of the probability, and is not named with what it looks like."""
    sure = decided((("thrust_gain",), 0.8), (("drag_curve",), 0.15), ((), 0.05))
    assert [cause.effects for cause in sure.clusters] == [("thrust_gain",)]
    assert sure.probability == pytest.approx(0.8)
    for entries in (
        ((("drag_curve",), 0.55), (("thrust_gain",), 0.4), ((), 0.05)),
        ((("thrust_gain",), 0.55), (("drag_curve",), 0.4), ((), 0.05)),
    ):
        said = decided(*entries)
        assert (said.kind, {*said.form}, said.discrepancy) == ("unknown", {"thrust_gain", "drag_curve"}, True)
        assert said.probability == pytest.approx(0.95)
    alone = decided((("drag_curve",), 0.9), ((), 0.1))
    assert (alone.kind, alone.form) == ("unknown", ("drag_curve",))
    chance = decided(((), 0.9, True), (("drag_curve",), 0.03), (("wind",), 0.02), ((), 0.05))
    assert (chance.kind, chance.form) == ("unknown", ())
    many = [((name,), 0.05) for name in ("drag_curve", "wind", "current", "munk", "gyro_bias", "tether", "bank")]
    assert decided(((), 0.3), *many, ((), 0.2, True), (("rudder_lag",), 0.15)).kind == "underpowered"
    beside = decided((("drag_curve", "gyro_bias"), 0.9), (("gyro_bias",), 0.09), ((), 0.01))
    assert [cause.effects for cause in beside.clusters] == [("gyro_bias",)]
    assert (beside.form, beside.discrepancy) == (("drag_curve",), True)


@pytest.mark.parametrize(("apart", "joins"), [(100.0, False), (5.0, True)])
def test_waves_that_are_told_from_a_steady_cause_do_not_stand_in_its_place(apart: float, joins: bool) -> None:
    """Of a boat on a pond the force of a wind was "the environment" for the sake of waves of a tenth."""
    entries = ((("wind",), 0.45), (("wave_drift",), 0.4), (("wave_forces",), 0.1), ((), 0.05))
    near = {frozenset(("wind", name)): far for name, far in (("wave_drift", 5.0), ("wave_forces", apart))}
    (cluster,) = decided(*entries, near=near).clusters
    assert ("wave_forces" in cluster.effects) == joins
    assert cluster.cause == ("environment" if joins else "environment.force_fixed_to_earth")
    assert cluster.probability == pytest.approx(0.95 if joins else 0.85)
    # Waves that lead have the others beside them, as before.
    (led,) = decided((("wave_forces",), 0.5), (("wind",), 0.4), ((), 0.1)).clusters
    assert led.effects == ("wave_forces", "wind")
