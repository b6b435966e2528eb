"""The verdict's sentence: never surer than the evidence."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from seatruth.diagnosis.parts import Fold, Shares, Validation
from seatruth.diagnosis.sentences import cause_in_words, chance, verdict_sentence, whole_percent
from seatruth.diagnosis.verdict import Kind, NamedCause, least_probable

LARGE = Shares(0.1, 0.2, 0.65, 0.05, 10.0, 8.0, 1.1)
AT_NOISE = Shares(0.9, 0.08, 0.0, 0.02, 1.3, 1.05, 1.05)
CURRENT = NamedCause(
    cause="environment.moving_water.uniform_current",
    title="a uniform current",
    effects=("current",),
    probability=0.97,
    in_words="0.21 +- 0.03 m/s towards 40 +- 8 deg",
    share=0.9,
    small=False,
    implausible=False,
)
FORCE = replace(
    CURRENT,
    cause="environment.force_fixed_to_earth",
    title="a steady force fixed to the earth",
    effects=("wind", "wave_drift"),
    in_words="8.1 +- 1 m/s towards 323 +- 8 deg",
)
BIAS = replace(
    CURRENT, title="an offset of a gyro", effects=("gyro_bias",), in_words="bias 0.01 +- 0.001 deg/s", small=True
)
FOLDS = (Fold("a", ("current",), 3.0, 1.1, 2.8, 1.0, 1.0, 0.2, 9.0),)
PREDICTS = Validation(FOLDS, 0.93, 0.85, 1.0, 0.1)
FAILS = Validation(FOLDS, 0.1, -0.3, 0.5, 0.1)


def said(kind: Kind, *causes: NamedCause, shares: Shares = LARGE, **options: Any) -> str:
    settings: dict[str, Any] = {"discrepancy": False, "validation": PREDICTS, "one_trial": False, **options}
    return verdict_sentence(kind, causes, 0.97, settings.pop("discrepancy"), shares, **settings)


def test_a_named_cause_has_its_size_its_probability_and_its_prediction() -> None:
    assert said("effects", CURRENT) == (
        "The gap comes from a uniform current of 0.21 +- 0.03 m/s towards 40 +- 8 deg (probability 97 %). "
        "On trials left out, it explains 93 % of the gap (95 % interval 85 % to 100 %)."
    )


def test_a_cause_that_is_small_for_what_it_is_is_said_to_be() -> None:
    tiny = replace(CURRENT, over_typical=0.06)
    assert "(probability 97 %). Its size is small, 6 % of a typical one. On trials" in said("effects", tiny)
    assert "Of small size: a uniform current (6 % of a typical one)." in said("effects", tiny, FORCE)
    assert (
        "Its size is small, 6 % of a typical one, and so is the gap: the refitted model's error is 1.02 times the "
        "noise." in said("effects", tiny, shares=AT_NOISE)
    )
    assert "typical" not in said("effects", replace(CURRENT, over_typical=0.08))


def test_what_is_of_no_practical_size_makes_the_others_no_less_sure() -> None:
    """Of a planing boat an offset of its outboard was over 99.9 %, beside 34 ms of lateness that had 80.8 %."""
    lateness = replace(BIAS, probability=0.808)
    assert least_probable((CURRENT, lateness), 0.808) == CURRENT.probability
    assert least_probable((CURRENT, replace(lateness, small=False)), 0.808) == 0.808
    assert least_probable((lateness,), 0.9) == 0.9


def test_a_size_of_its_own_in_each_trial_is_said_to_be_fitted_to_it() -> None:
    told = said("effects", CURRENT, validation=replace(PREDICTS, own_sizes=True))
    assert told.endswith(
        "On trials left out, its size in each fitted to that one, it explains 93 % of the gap (95 % interval 85 % to "
        "100 %)."
    )


def test_effects_that_cannot_be_told_apart_are_named_at_their_common_node() -> None:
    assert cause_in_words(FORCE) == (
        "a steady force fixed to the earth, towards 323 +- 8 deg: "
        "wind or wave drift, which these trials cannot tell apart"
    )
    turned = replace(FORCE, direction="300 to 323 deg")
    assert "earth, towards 300 to 323 deg: wind or" in cause_in_words(turned)
    without = replace(FORCE, in_words="delay 0.2 +- 0.1 s")
    assert "0.2" not in cause_in_words(without)
    both = replace(FORCE, effects=("trial_wind", "wave_drift", "wind"))
    assert cause_in_words(both).endswith(": wind or wave drift, which these trials cannot tell apart")
    # What stands beside them is not one of them.
    assert "which these trials cannot tell apart, and a uniform current of" in said("inseparable", FORCE, CURRENT)
    alone = cause_in_words(replace(FORCE, effects=("trial_wind", "wind")))
    assert alone == "a steady force fixed to the earth, towards 323 +- 8 deg, which may differ from trial to trial"
    gyro = replace(
        FORCE,
        title="yaw rate bias",
        effects=("trial_gyro_bias", "gyro_bias"),
        direction="",
        in_words="b 0.03 to 0.04 deg/s",
    )
    assert cause_in_words(gyro) == "yaw rate bias (b 0.03 to 0.04 deg/s), which may differ from trial to trial"


def test_look_alikes_of_other_sizes_are_told_with_them() -> None:
    """One of two engines gives 12 % less, or the other one 14 % more: each asks for another repair."""
    engines = replace(
        CURRENT,
        title="an error of the thrust",
        effects=("thruster_gain_port", "thruster_gain_starboard"),
        in_words="k -0.124 +- 0.018",
        sizes=("k -0.124 +- 0.018", "k 0.139 +- 0.020"),
    )
    assert cause_in_words(engines) == (
        "an error of the thrust: thruster gain port (k -0.124 +- 0.018) or thruster gain starboard (k 0.139 +- 0.020), "
        "which these trials cannot tell apart"
    )
    unknown = replace(engines, sizes=("k -0.124 +- 0.018", ""))
    assert "port or thruster gain starboard, which" in cause_in_words(unknown)


def test_a_gap_that_does_not_shrink_surely_is_said_in_the_headline() -> None:
    text = said("effects", CURRENT, validation=FAILS)
    assert text.startswith("The most probable cause of the gap is a uniform current")
    assert "does not shrink surely on trials left out: 10 % of it is explained (95 % interval -30 % to 50 %)" in text
    assert "comes from" not in text
    # Of a ferry in wind runs came nearer in seven of eight trials.
    much = said("effects", CURRENT, validation=replace(FAILS, gap_explained=0.94, upper=1.5))
    assert "On trials left out it explains 94 % of the gap, which is not sure (95 % interval -30 % to 150 %)." in much
    # Of a craft that holds no course the interval was -177 to -14 %: that is more than not sure.
    worse = said("effects", CURRENT, validation=replace(FAILS, gap_explained=-0.96, lower=-1.77, upper=-0.14))
    told = "on trials left out (95 % interval of what is explained"
    assert f"But the gap surely grows by 96 % {told} -177 % to -14 %)." in worse
    # Of a river vessel 6 % were called a part that is explained.
    little = said("effects", CURRENT, validation=replace(FAILS, gap_explained=-0.06, lower=-0.3, upper=0.2))
    assert f"But the gap grows by 6 % {told} -30 % to 20 %)." in little


def test_a_cause_with_which_runs_still_stray_is_said_so() -> None:
    """As on a boat that turns by itself: forces held its runs near the record, and the cause was over 99.9 %."""
    text = said("effects", CURRENT, discrepancy=True, shares=replace(LARGE, misfit_effects=144.0))
    assert "Simulated with it alone, runs still stray by 12 times the noise: only forces of unknown cause hold" in text
    both = said("effects", CURRENT, BIAS, FORCE, shares=replace(LARGE, misfit_effects=math.inf))
    assert "Simulated with them alone, the motion still diverges." in both
    assert "stray" not in said("effects", CURRENT)


@pytest.mark.parametrize("kind", ["effects", "no_gap", "underpowered", "unknown"])
def test_a_search_that_was_stopped_says_so_first(kind: Kind) -> None:
    causes = (CURRENT,) if kind == "effects" else ()
    text = said(kind, *causes, stopped=True)
    assert text.startswith("The search was stopped before all effects were compared: this is what it had reached. ")
    assert text.endswith(said(kind, *causes))


def test_what_cannot_be_tried_is_said_to_look_the_same() -> None:
    alone = said("unknown", untried=["steady drift"])
    assert "It looks like steady drift, or like a force that cannot be tried on this model." in alone
    beside = said("effects", CURRENT, untried=["shallow water"])
    assert "The rest looks like shallow water, or like a force" in beside
    assert "cannot decide whether an effect acts, nor which" in said("underpowered")


def test_an_implausible_size_looks_like_a_cause_and_is_not_said_to_be_it() -> None:
    form = said("effects", replace(CURRENT, implausible=True, beyond="ln x ratio of 2.1"))
    assert "but the ln x ratio of 2.1 is beyond what is believed of this vehicle" in form
    text = said("effects", replace(CURRENT, implausible=True))
    assert text.startswith("The gap looks like a uniform current")
    assert "another cause may act in the same way" in text
    assert "comes from" not in text


def test_a_small_cause_stands_below_the_line() -> None:
    text = said("effects", CURRENT, BIAS)
    assert text.index("comes from a uniform current") < text.index(
        "Probable, but a negligible part of the gap: an offset"
    )
    alone = said("effects", BIAS)
    assert alone.startswith("No cause of practical size is seen. Probable, but a negligible part of the gap: an offset")
    assert "left out" not in alone


def test_discrepancy_makes_it_a_part_of_the_gap() -> None:
    text = said("effects", CURRENT, discrepancy=True, shares=replace(LARGE, misfit_effects=4.0))
    assert text.startswith("Most of the gap comes from"), "85 % surely"
    part = said("effects", CURRENT, discrepancy=True, shares=replace(LARGE, misfit_effects=4.0), validation=None)
    assert part.startswith("A part of the gap comes from")
    assert "lacks something that no effect of the library describes" in text


def test_discrepancy_of_a_model_that_meets_its_noise_is_small() -> None:
    text = said("effects", CURRENT, discrepancy=True)
    assert text.startswith("The gap comes from")
    assert "What is left is small, but more than noise" in text


def test_an_unknown_cause_of_a_model_that_meets_its_noise_is_small_first() -> None:
    text = said("unknown", shares=AT_NOISE, validation=None)
    assert text.startswith("What the refitted model leaves is small")
    assert "not in the library (probability 97 %)" in text
    assert said("unknown", validation=None).startswith("Something acts that is not in the library")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"one_trial": True, "validation": None}, "With one trial"),
        ({"validation": None}, "not tested on trials left out"),
        ({"validation": replace(PREDICTS, gap_explained=math.nan)}, "no gap to explain"),
    ],
)
def test_what_was_not_tested_is_said(options: dict[str, Any], words: str) -> None:
    assert words in said("effects", CURRENT, **options)


def test_no_gap_and_undecided() -> None:
    assert "no gap beyond the noise" in said("no_gap", validation=None)
    assert "cannot decide whether an effect acts" in said("underpowered", validation=None)
    assert "most probable cause is a uniform current" in said("underpowered", CURRENT, validation=None)
    assert said("underpowered", acts=True).startswith("Something acts, but these trials cannot decide what.")
    listed = said("underpowered", acts=True, vague=["a bank", "a rudder's offset", "wind"])
    assert listed.startswith("Something acts, but these trials cannot tell what: a bank, a rudder's offset or wind (")
    beside = said("unknown", vague=["a bank", "a rudder's offset"])
    assert "It looks like a bank or a rudder's offset, of which none is probable by itself." in beside
    both = said("unknown", form=["a cross-flow drag"], drift=["a late position"])
    assert "It looks like a cross-flow drag, or like damping" in both
    assert "It also looks like a late position; a vehicle" in both
    many = said("unknown", vague=[f"cause {k}" for k in range(30)])
    assert "cause 2 or cause 3 or one of 26 others, of which none is probable by itself." in many


def test_a_part_of_the_gap_that_is_next_to_nothing_has_no_sign() -> None:
    assert [whole_percent(part) for part in (-0.004, 0.004, -0.02, 0.93, math.nan)] == [
        "0 %",
        "0 %",
        "-2 %",
        "93 %",
        "unknown",
    ]


def test_no_probability_is_one_or_nothing() -> None:
    assert (chance(1.0), chance(0.0), chance(0.9994), chance(0.5)) == ("over 99.9 %", "under 0.05 %", "99.9 %", "50 %")


def test_what_trials_on_one_course_cannot_tell_is_said_to_be_what_it_looks_like() -> None:
    text = said("unknown", along=["wind", "a uniform current"])
    assert "It looks like wind and a uniform current, which trials on one course cannot tell from" in text
    assert "one course" not in said("unknown")


def test_what_may_be_a_part_of_another_form_is_said_to_be_what_it_looks_like() -> None:
    text = said("unknown", part=["added-mass error"])
    assert (
        "It looks like added-mass error, but forces of unknown cause are missing beside it: a model of another form"
        in text
    )
    assert "forces of unknown cause" not in said("unknown")
    assert "It looks like added-mass error" in said("underpowered", part=["added-mass error"])


def test_what_another_form_of_the_model_shows_is_said_to_be_what_it_looks_like() -> None:
    text = said("unknown", form=["thrust gain"])
    assert text.endswith("It looks like thrust gain, or like damping or drag of another form than the model's.")
    text = said("unknown", form=["bank suction"], curve=["forces that differ between turns"])
    assert text.endswith("It looks like bank suction, or like forces that differ between turns.")
    text = said("unknown", curve=["drag that rises otherwise with the speed"])
    assert text.endswith("It looks like drag that rises otherwise with the speed.")


@pytest.mark.parametrize("which", ["form", "curve"])
def test_damping_of_another_form_is_no_sign_that_anything_is_wrong(which: str) -> None:
    sound = "A vehicle with nothing wrong often differs so from its model."
    usual, far = (replace(LARGE, misfit_refit=rms**2) for rms in (2.2, 5.8))
    assert said("unknown", damping=True, shares=usual, **{which: ["cross-flow drag"]}).endswith(sound)
    assert sound not in said("unknown", damping=True, shares=usual)
    # Of a stern plane 1.5 deg off, and of a loose panel, the same was said.
    assert sound not in said("unknown", damping=True, shares=far, **{which: ["cross-flow drag"]})


def test_what_does_not_predict_is_said_to_be_what_it_looks_like() -> None:
    text = said("unknown", refused=["wind", "lag of the thrusters"])
    assert "It looks like wind and lag of the thrusters, which do not surely predict trials left out." in text
    assert "surely predict" not in said("unknown")


def test_what_terms_in_the_equations_outdo_is_said_to_be_what_it_looks_like() -> None:
    text = said("unknown", outdone=["wind", "lag of the rudder"])
    assert "It looks like wind and lag of the rudder, but trials left out do not bear them out:" in text
    assert "predicted better" not in said("unknown")
    assert "The rest looks like wind, but trials left out do not bear it out" in said(
        "effects", CURRENT, outdone=["wind"]
    )


def test_equal_delays_are_said_to_be_what_a_later_steering_shows() -> None:
    text = said("unknown", turning=["delay of the heading (0.04 s)", "delay of the rate of turn (0.04 s)"])
    assert "(0.04 s) and delay of the rate of turn (0.04 s); where both are equal, a steering that acts as much" in text


def test_what_another_drift_in_turns_shows_is_said_to_be_what_it_looks_like() -> None:
    text = said("unknown", drift=["delay of position"])
    assert "It looks like delay of position; a vehicle that drifts a little otherwise in turns shows the same." in text
    assert "drifts" not in said("unknown")
    assert "The rest looks like delay of position; a vehicle" in said("effects", CURRENT, drift=["delay of position"])


def test_the_same_cause_in_all_trials_or_in_each_is_one_that_may_differ() -> None:
    both = replace(FORCE, effects=("trial_current", "current"), in_words="0.3 to 0.4 m/s towards 354 to 6 deg")
    assert "towards 354 to 6 deg, which may differ" in cause_in_words(both)
