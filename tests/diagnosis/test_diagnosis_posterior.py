"""Probabilities of hypotheses from their evidence, on numbers made by hand."""

from __future__ import annotations

import itertools
import math
from types import SimpleNamespace
from typing import Any

import pytest
from decided_by_hand import decided

from seatruth.diagnosis import posterior
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.settings import Settings
from seatruth.effects import available

SETTINGS = Settings()
EFFECTS = {name: available()[name] for name in ("current", "wind", "heading_bias", "rudder_offset")}


def searched(fits: dict[tuple[Key, bool], float], screened: dict[tuple[Key, bool], float] | None = None) -> Any:
    """A search with this evidence of its fits and screens."""
    found = {
        (key, on): SimpleNamespace(effects=key, evidence=value, settled=True, discrepancy=on, ahead=0.0)
        for (key, on), value in fits.items()
    }
    null = max((f for (key, _), f in found.items() if not key), key=lambda f: f.evidence)
    return SimpleNamespace(
        fits=found,
        screened=screened or {},
        null=null,
        problem=SimpleNamespace(effects=dict(EFFECTS), settings=SETTINGS, trials=()),
    )


FITS: dict[tuple[Key, bool], float] = {
    ((), False): -100.0,
    ((), True): -98.0,
    (("current",), False): -90.0,
    (("current",), True): -89.5,
    (("wind",), False): -91.0,
    (("current", "wind"), False): -89.0,
}
EXPLAINED = 11.0
"""nats by which the best of FITS is above the model alone."""


def test_probabilities_sum_to_one_and_are_in_order() -> None:
    found = posterior.hypotheses(searched(FITS), SETTINGS)
    assert sum(one.probability for one in found) == pytest.approx(1.0)
    values = [one.probability for one in found]
    assert values == sorted(values, reverse=True)
    assert found[0].effects == ("current",)
    assert not found[0].discrepancy


def test_steady_forces_fixed_to_the_earth_are_not_told_apart_by_what_a_wrong_form_costs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a ship on a pond the drift of waves stood 5 nats before the wind that blew; neither has the right form."""
    monkeypatch.setitem(EFFECTS, "wave_drift", available()["wave_drift"])
    monkeypatch.setitem(EFFECTS, "trial_wind", available()["trial_wind"])

    def probabilities(behind: float) -> dict[Key, float]:
        names = {"wave_drift": 40.0, "wind": 40.0 - behind, "current": 40.0 - behind, "trial_wind": 40.0 - behind}
        fits = {((), False): 0.0, **{((name,), False): value for name, value in names.items()}}
        return posterior.answers(posterior.hypotheses(searched(fits), SETTINGS))

    near, far = probabilities(5.0), probabilities(20.0)
    assert list(near)[:2] == [("wave_drift",), ("wind",)]
    assert near["wind",] == pytest.approx(near["wave_drift",])
    assert near["current",] == pytest.approx(near["trial_wind",])
    assert near["current",] < 0.5 * near["wind",]
    assert far["wind",] < 0.1 * far["wave_drift",]


def test_the_next_trial_is_not_asked_to_tell_a_wind_from_the_drift_of_waves() -> None:
    """It would be told to by their forms, which the verdict says are not known well enough."""
    effects = available()
    names = ["position_delay", "wave_drift", "wind", "position_delay", "current", "trial_wind"]
    assert posterior.without_other_forms(names, effects) == ["position_delay", "wave_drift", "current", "trial_wind"]


def test_what_the_leading_fit_did_not_reach_makes_its_answer_less_sure() -> None:
    reached, short = searched(FITS), searched(FITS)
    short.fits[("current", "wind"), False].ahead = 400.0
    top = [posterior.hypotheses(one, SETTINGS)[0].probability for one in (reached, short)]
    assert top[1] < top[0]


def strong(beside_forces: float) -> Any:
    """A search in which forces explain most of what an effect does, but not all."""
    return searched(
        {
            ((), False): -6000.0,
            ((), True): -400.0,
            (("current",), False): 0.0,
            (("current",), True): beside_forces,
        }
    )


def test_an_effect_that_alone_explains_the_trials_to_their_noise_is_not_unknown() -> None:
    """A thruster that gave 30 % less explained 5200 nats, 331 more than forces did, and was called unknown."""
    found = strong(beside_forces=-5.0)
    left = SETTINGS.unseen_form * 6000.0 / 5600.0
    assert posterior._left_by_the_form(found, posterior._leader(found)) == pytest.approx(left)
    assert posterior.answers(posterior.hypotheses(found, SETTINGS))["current",] > 0.99


def test_where_forces_find_something_beside_an_effect_its_form_may_be_wrong() -> None:
    found = strong(beside_forces=30.0)
    left = (SETTINGS.unseen_form + 30.0) * 6030.0 / 5600.0
    assert posterior._left_by_the_form(found, posterior._leader(found)) == pytest.approx(left)


def test_forces_that_explain_nothing_do_not_tell_what_the_form_of_an_effect_leaves() -> None:
    found = searched({((), False): 0.0, ((), True): -3.0, (("current",), False): 90.0, (("current",), True): 87.0})
    assert posterior._left_by_the_form(found, posterior._leader(found)) == math.inf


def test_odds_are_evidence_times_prior() -> None:
    found = {(one.effects, one.discrepancy): one for one in posterior.hypotheses(searched(FITS), SETTINGS)}
    a, b = found[("current",), False], found[("wind",), False]
    temperature = SETTINGS.temperature + SETTINGS.model_form * EXPLAINED
    assert math.log(a.probability / b.probability) == pytest.approx(1.0 / temperature)
    none = found[(), False]
    share = SETTINGS.prior_sets[0] * (1.0 - SETTINGS.prior_discrepancy) / len(EFFECTS)
    assert math.log(a.probability / none.probability) == pytest.approx(
        10.0 / temperature + math.log(share / SETTINGS.prior_none)
    )


def test_discrepancy_alone_stands_for_an_unknown_cause() -> None:
    found = {(one.effects, one.discrepancy): one for one in posterior.hypotheses(searched(FITS), SETTINGS)}
    none, unknown = found[(), False], found[(), True]
    assert math.log(unknown.probability / none.probability) == pytest.approx(
        2.0 / (SETTINGS.temperature + SETTINGS.model_form * EXPLAINED)
        + math.log(SETTINGS.prior_unknown / SETTINGS.prior_none)
    )


def test_prior_probabilities_of_all_sets_sum_to_one() -> None:
    names = list(EFFECTS)
    total = 0.0
    for size in range(4):
        for _ in itertools.combinations(names, size):
            total += sum(math.exp(posterior.log_prior(size, on, len(names), SETTINGS)) for on in (False, True))
    assert total == pytest.approx(1.0)


def test_the_drift_of_waves_that_act_is_no_further_cause() -> None:
    """Without that a current in a sea was named 8 deg off, as it is beside the waves without their drift."""
    effects = available()
    assert posterior.causes_in(("current", "wave_drift", "wave_forces"), effects) == 2
    assert posterior.causes_in(("current", "wave_drift"), effects) == 2
    assert posterior.causes_in(("wave_drift",), effects) == posterior.causes_in(("wave_forces",), effects) == 1
    assert posterior.causes_in((), effects) == 0


def test_effects_that_were_only_screened_keep_their_share() -> None:
    screened = {(("rudder_offset",), False): -90.0, (("current",), False): 50.0, (("wind", "heading_bias"), False): 0.0}
    found = {(one.effects, one.discrepancy): one for one in posterior.hypotheses(searched(FITS, screened), SETTINGS)}
    assert found[("rudder_offset",), False].probability == pytest.approx(found[("current",), False].probability)
    assert not found[("rudder_offset",), False].settled
    assert not found[("rudder_offset",), False].fitted
    assert all(found[key].fitted for key in FITS)
    assert ("wind", "heading_bias") not in {key for key, _ in found}


def test_an_impossible_screen_is_left_out() -> None:
    screened = {(("rudder_offset",), False): -math.inf}
    assert len(posterior.hypotheses(searched(FITS, screened), SETTINGS)) == len(FITS)


def test_what_acts_wholly_or_not_at_all_is_weighed_as_fitted_alone() -> None:
    """A few per cent of an exchange of two thrusters, linearized, led beside a model of another form (54 %)."""
    name = "thrusters_exchanged_port_starboard"
    whole = SimpleNamespace(
        comes_with=(), wholly=True, cause="actuator.propulsion.arrangement", acts_on=("actuator:port",),
        each_trial=False, stochastic=False,
    )  # fmt: skip
    found = searched(FITS, {((name,), True): -80.0})
    found.problem.effects[name] = whole
    assert all(name not in one.effects for one in posterior.hypotheses(found, SETTINGS))
    fitted = searched({**FITS, ((name,), True): -80.0})
    fitted.problem.effects[name] = whole
    assert any(name in one.effects for one in posterior.hypotheses(fitted, SETTINGS))


def test_answers_inclusion_none_and_unknown_add_up() -> None:
    found = posterior.hypotheses(searched(FITS), SETTINGS)
    by_key = {(one.effects, one.discrepancy): one.probability for one in found}
    answers = posterior.answers(found)
    none, unknown = posterior.none_and_unknown(found)
    assert sum(answers.values()) + none + unknown == pytest.approx(1.0)
    assert answers["current",] == pytest.approx(by_key[("current",), False] + by_key[("current",), True])
    assert (none, unknown) == (by_key[(), False], by_key[(), True])
    acts = posterior.inclusion(found, list(EFFECTS))
    assert acts["current"] == pytest.approx(answers["current",] + answers["current", "wind"])
    assert acts["heading_bias"] == 0.0
    assert list(answers.values()) == sorted(answers.values(), reverse=True)


def test_by_cause_counts_each_hypothesis_once() -> None:
    found = posterior.hypotheses(searched(FITS), SETTINGS)
    causes = posterior.by_cause(found, EFFECTS)
    answers = posterior.answers(found)
    assert causes["environment"] == pytest.approx(sum(answers.values()))
    assert causes["environment.moving_water"] == pytest.approx(answers["current",] + answers["current", "wind"])
    assert "" not in causes
    assert all(p <= 1.0 + 1e-12 for p in causes.values())


def test_by_place_counts_each_hypothesis_once() -> None:
    found = posterior.hypotheses(searched(FITS), SETTINGS)
    places = {
        "current": ("kinematics",),
        "wind": ("surge", "sway", "kinematics"),
        "heading_bias": (),
        "rudder_offset": (),
    }
    acting = posterior.by_place(found, places)
    answers = posterior.answers(found)
    assert acting["kinematics"] == pytest.approx(sum(answers.values()))
    assert acting["surge"] == pytest.approx(answers["wind",] + answers["current", "wind"])


def test_one_of_several_of_a_family_acts_though_the_set_without_them_stands_before_each() -> None:
    """Beside a late position a wind, a drift and two currents each explain the same: one of them acts."""
    weather = ("trial_wind", "wave_drift", "wind", "current")
    sets = [(("position_delay",), 0.28), *(((*sorted(("position_delay", name)),), 0.18) for name in weather)]
    said = decided(*sets)
    found = {cluster.cause: cluster for cluster in said.clusters}
    assert found.keys() == {"sensor.timing.position", "environment"}
    assert set(found["environment"].effects) == set(weather)
    assert found["environment"].probability == pytest.approx(0.72)
    # Further effects of all families, of which none is probable, are no cause.
    others = ("gyro_bias", "bank", "munk", "rudder_offset")
    sets = [(("position_delay",), 0.28), *(((*sorted(("position_delay", name)),), 0.18) for name in others)]
    assert [cluster.effects for cluster in decided(*sets).clusters] == [("position_delay",)]


def test_what_may_stand_in_a_member_s_place_is_not_one_more() -> None:
    """A lag and a dead time of one servo explain the same; a gyro's bias beside a compass' is another sensor's."""
    effects = available()
    servo = {("rudder_lag",): 0.35, ("rudder_delay", "rudder_lag"): 0.3, ("rudder_lag", "rudder_rate_limit"): 0.1}
    assert posterior.leading(servo, effects) == ("rudder_lag",)
    sensors = {("heading_bias",): 0.4, ("gyro_bias", "heading_bias"): 0.35, ("heading_bias", "position_delay"): 0.25}
    assert posterior.leading(sensors, effects) == ("gyro_bias", "heading_bias")


def test_what_stands_for_another_form_of_the_hull_raises_no_temperature_of_what_acts_beside_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Planes that are off, of an AUV of another damping: cross-flow drag explains 392 nats beside forces."""
    monkeypatch.setitem(EFFECTS, "cross_flow", available()["cross_flow"])
    fits: dict[tuple[Key, bool], float] = {
        ((), False): -7000.0,
        ((), True): -392.0,
        (("cross_flow",), True): 0.0,
        (("cross_flow", "rudder_offset"), True): 42.0,
    }
    found = posterior.answers(posterior.hypotheses(searched(fits), SETTINGS))
    assert found["cross_flow", "rudder_offset"] > 0.9
    del fits[("cross_flow", "rudder_offset"), True]
    assert posterior.explained_from(searched(fits)) == -392.0, "where the term leads alone, it is what explains"


def test_a_form_of_the_hull_is_no_cause_that_two_sets_have_in_common(monkeypatch: pytest.MonkeyPatch) -> None:
    """An AUV whose rudder stands 1.5 deg off, with more cross-flow drag and speed loss than its model: its evidence.

    The leading set needs no forces, and explains 5000 nats beside them. Cross-flow drag without the rudder, 363 nats
    behind, had 20 % with its twin of another form, and an asymmetry, 4.5 nats behind the offset alone, had nothing.
    """
    for name in ("cross_flow", "turning_loss", "lateral_asymmetry"):
        monkeypatch.setitem(EFFECTS, name, available()[name])
    form = ("cross_flow", "turning_loss")
    fits: dict[tuple[Key, bool], float] = {
        ((), False): -4986.6,
        ((), True): 0.0,
        (("rudder_offset",), True): 278.4,
        (("rudder_offset",), False): -2673.2,
        (("lateral_asymmetry",), True): 273.9,
        (("cross_flow", "rudder_offset"), True): 305.5,
        (("cross_flow", "lateral_asymmetry"), True): 312.8,
        (("cross_flow", "rudder_offset", "turning_loss"), False): 357.8,
        (("cross_flow", "rudder_offset", "turning_loss"), True): 354.7,
        (("cross_flow", "lateral_asymmetry", "turning_loss"), False): 355.0,
        (("cross_flow", "lateral_asymmetry", "turning_loss"), True): 350.8,
    }
    screened = {((name,), True): -5.0 for name in form}
    found = posterior.hypotheses(searched(fits, screened), SETTINGS)
    acting = posterior.inclusion(found, list(EFFECTS))
    acting = {name: acting[name] for name in ("rudder_offset", "lateral_asymmetry")}
    assert sum(acting.values()) > 0.99
    assert acting["rudder_offset"] == pytest.approx(acting["lateral_asymmetry"], rel=0.2)
    # Told apart by far more than a form leaves, the two are not alike.
    fits |= {key: value - 100.0 for key, value in fits.items() if "lateral_asymmetry" in key[0]}
    apart = posterior.hypotheses(searched(fits, screened), SETTINGS)
    assert posterior.inclusion(apart, list(EFFECTS))["rudder_offset"] > 0.99


def test_what_a_sea_explains_raises_no_temperature_of_what_acts_beside_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thruster that gives 12 % less, beside waves that explain 1000 nats and their drift, which explains 370."""
    sea = ("wave_drift", "wave_forces")
    for name in ("thrust_gain", *sea):
        monkeypatch.setitem(EFFECTS, name, available()[name])
    fits: dict[tuple[Key, bool], float] = {
        ((), False): -7000.0,
        ((), True): -1370.0,
        (("wave_forces",), True): -370.0,
        (sea, True): 0.0,
        (("thrust_gain",), True): -1300.0,
        (("thrust_gain", *sea), True): 375.0,
    }
    found = posterior.answers(posterior.hypotheses(searched(fits), SETTINGS))
    assert found["thrust_gain", *sea] > 0.99
    del fits[("thrust_gain", *sea), True]
    assert posterior.explained_from(searched(fits)) == -1370.0, "where the sea leads alone, it is what explains"
