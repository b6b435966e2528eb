"""From probabilities to what is said, on probabilities made by hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import pytest
from decided_by_hand import SETTINGS, decided

from seatruth.diagnosis.decision import Decision, decide
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.effects import available


def beside_forces(sets: Sequence[tuple[tuple[str, ...], float, float]], refused: Sequence[str] = ()) -> Decision:
    """What is said of sets beside missing forces: effects, log-evidence (nats) and probability of each."""
    return decide(
        [Hypothesis(key, True, evidence, 0.0, p, True) for key, evidence, p in sets],
        available(),
        SETTINGS,
        near=lambda a, b: math.inf,
        helps=lambda name, key: name not in refused,
        underpowered=False,
    )


def test_one_effect_that_holds_the_probability_is_named() -> None:
    said = decided((("current",), 0.9), (("wind",), 0.05), ((), 0.05))
    assert said.kind == "effects"
    assert said.shown == ("current",)
    (cause,) = said.clusters
    assert cause.effects == ("current",)
    assert cause.cause == "environment.moving_water.uniform_current"
    assert said.probability == pytest.approx(0.9)
    assert not said.discrepancy


def test_two_effects() -> None:
    said = decided((("current", "rudder_offset"), 0.9), (("current",), 0.05), ((), 0.05))
    assert said.kind == "effects"
    assert [cause.effects for cause in said.clusters] == [("current",), ("rudder_offset",)]
    assert said.probability == pytest.approx(0.9)


def test_a_long_list_of_effects_of_all_kinds_names_nothing() -> None:
    """Trials that show nothing leave every effect a little probability: together they are no cause."""
    few = ("current", "heading_bias", "rudder_gain")
    many = (*few, "drag_increase", "speed_delay")
    assert decided(*(((name,), 0.9 / 3) for name in few), ((), 0.1)).kind == "inseparable"
    said = decided(*(((name,), 0.9 / 5) for name in many), ((), 0.1))
    assert said.kind == "underpowered"
    assert said.clusters == ()
    sure = decided(*(((name,), 0.99 / 5) for name in many), ((), 0.01))
    assert (sure.kind, sure.acts, set(sure.vague)) == ("underpowered", True, set(many))
    assert sure.probability == pytest.approx(0.99)
    unsure = decided(*(((name,), 0.7 / 5) for name in many), ((), 0.3))
    assert (unsure.kind, unsure.acts, unsure.vague) == ("underpowered", False, ())
    # What may act is told where something does.
    assert (sure.possible, unsure.possible) == (sure.vague, ())


def test_an_undecided_answer_lists_what_was_refused_with_what_looks_like_it() -> None:
    """Of a freighter a log scaled by 2.4 %, or its bias, explained 8 nats; of four trials one was predicted worse."""
    entries = (("speed_scale",), 0.5), (("speed_bias",), 0.45), ((), 0.02), ((), 0.03, True)
    said = decided(*entries, helps=lambda name, key: False)
    assert (said.kind, said.refused, said.acts) == ("underpowered", ("speed_scale",), True)
    assert said.possible == said.alike == ("speed_scale", "speed_bias")


def test_an_unknown_answer_tells_what_was_refused_with_what_looks_like_it() -> None:
    """Of a ferry with one thruster 12 % weak it looked like its dead band, or more thrust of the other one."""
    entries = (("wind",), 0.5, True), (("wave_drift",), 0.4, True), ((), 0.1, True)
    said = decided(*entries, near={frozenset(("wind", "wave_drift")): 0.0}, helps=lambda name, key: False)
    assert (said.kind, said.refused, said.possible) == ("unknown", ("wind",), ())
    assert said.alike == ("wind", "wave_drift")


def test_what_shows_the_same_is_named_as_one_cause_though_its_families_differ() -> None:
    """A steady push to one side: four effects of several families, each as good as the other."""
    names = ("bank", "thrust_misalignment", "propeller_walk", "rudder_offset")
    sets = [((name,), 0.245) for name in names]
    same = {frozenset(pair): 0.5 for pair in itertools.combinations(names, 2)}
    said = decided(*sets, ((), 0.02), near=same)
    assert [set(cause.effects) for cause in said.clusters] == [set(names)]
    assert said.probability == pytest.approx(0.98)
    assert decided(*sets, ((), 0.02)).clusters == ()
    assert decided(*sets, ((), 0.02), near={**same, frozenset(("bank", "rudder_offset")): 30.0}).clusters == ()
    pair = (("bank",), 0.4, True), (("rudder_offset",), 0.35, True), ((), 0.25, True)  # beside missing forces
    assert (decided(*pair).kind, decided(*pair, near=same).kind) == ("unknown", "inseparable")


def test_what_is_probable_by_itself_is_no_list_with_what_the_trials_tell_from_it() -> None:
    """Of an AUV whose rudder stood off, 58 nats before an asymmetry that had 16 %, "not in the library" was said."""
    apart = [(("rudder_offset",), 0.8, True), (("lateral_asymmetry",), 0.16, True), ((), 0.04, True)]
    said = decided(*apart)
    assert (said.kind, [cause.effects for cause in said.clusters]) == ("effects", [("rudder_offset",)])
    assert said.probability == pytest.approx(0.8)
    # Both are said where the other has a third of its probability or more.
    two = decided((("lateral_asymmetry",), 0.63, True), (("rudder_offset",), 0.34, True), ((), 0.03, True))
    assert [cause.effects for cause in two.clusters] == [("lateral_asymmetry", "rudder_offset")]
    assert two.probability == pytest.approx(0.97)
    # Not where it is not probable by itself, and together where trials cannot tell the two apart.
    list_ = decided((("rudder_offset",), 0.5, True), (("lateral_asymmetry",), 0.46, True), ((), 0.04, True))
    assert (list_.kind, list_.clusters, list_.vague) == ("unknown", (), ("rudder_offset", "lateral_asymmetry"))
    # Nor is a node of the tree, of effects of which none is probable by itself.
    node = [(("wind",), 0.4, True), (("wave_drift",), 0.35, True), (("heading_bias",), 0.2, True), ((), 0.05, True)]
    said = decided(*node, near={frozenset(("wind", "wave_drift")): 0.5})
    assert [(cause.effects, cause.cause) for cause in said.clusters] == [
        (("wind", "wave_drift"), "environment.force_fixed_to_earth")
    ]
    # What trials cannot tell from it, if of another family, stays beside it.
    near = {frozenset(("rudder_offset", "bank")): 0.5}
    three = [(("rudder_offset",), 0.66, True), (("bank",), 0.1, True), (("lateral_asymmetry",), 0.2, True)]
    assert [cause.effects for cause in decided(*three, ((), 0.04, True), near=near).clusters] == [
        ("rudder_offset", "bank")
    ]
    same = decided(*apart, near={frozenset(("rudder_offset", "lateral_asymmetry")): 0.5})
    assert [set(cause.effects) for cause in same.clusters] == [{"rudder_offset", "lateral_asymmetry"}]


def test_nothing_is_named_that_does_not_predict() -> None:
    said = decided((("current",), 0.95), ((), 0.05), refused=("current",))
    assert said.kind == "unknown"
    assert said.clusters == ()
    assert said.shown == ()
    assert said.discrepancy


def test_where_a_look_alike_predicts_both_are_the_cause() -> None:
    """A wind that does not surely predict is not refused for a wave drift that looks like it and does."""
    near = {frozenset(("wind", "wave_drift")): 3.0}
    sets = [(("wind",), 0.75), (("wave_drift",), 0.2), ((), 0.05)]
    said = decided(*sets, near=near, refused=("wind",))
    assert [cause.effects for cause in said.clusters] == [("wind", "wave_drift")]
    assert said.clusters[0].cause == "environment.force_fixed_to_earth"
    assert said.probability == pytest.approx(0.95)
    assert decided(*sets, near=near, refused=("wind", "wave_drift")).clusters == ()


def test_of_two_effects_only_the_one_that_predicts_is_named() -> None:
    said = decided((("current", "rudder_offset"), 0.95), (("rudder_offset",), 0.04), ((), 0.01), refused=("current",))
    assert said.kind == "effects"
    assert said.shown == ("rudder_offset",)


def test_no_gap() -> None:
    said = decided(((), 0.8), (("current",), 0.2))
    assert said.kind == "no_gap"
    assert said.probability == pytest.approx(0.8)
    assert decided(((), 0.8), (("current",), 0.2), underpowered=True).kind == "underpowered"


def test_a_cause_outside_the_library() -> None:
    said = decided(((), 0.9, True), (("current",), 0.1))
    assert said.kind == "unknown"
    assert said.discrepancy
    assert said.probability >= 0.9


def test_nothing_is_sure() -> None:
    said = decided((("current",), 0.4), (("rudder_offset",), 0.05), ((), 0.3), ((), 0.25, True))
    assert said.kind == "underpowered"
    assert said.shown == ()


def test_discrepancy_beside_a_named_effect() -> None:
    said = decided((("current",), 0.6, True), (("current",), 0.3), ((), 0.1))
    assert said.kind == "effects"
    assert said.discrepancy


def test_probabilities_stay_within_their_bounds() -> None:
    for entries in (
        [((), 1.0)],
        [((), 1.0, True)],
        [(("current",), 1.0)],
        [(("current",), 0.5, True), (("current",), 0.5)],
        [(("current",), 0.5, True), ((), 0.5, True)],
    ):
        assert 0.0 <= decided(*entries).probability <= 1.0


def test_what_needs_an_effect_that_is_refused_falls_with_it() -> None:
    """Two effects explain the trials together; one does not predict, and alone the other explains little."""
    entries = ((("current", "wind"), 0.98), (("current",), 0.001), ((), 0.01))
    assert decided(*entries, refused=("wind",)).kind != "effects"
    stands = ((("current", "wind"), 0.80), (("current",), 0.19), ((), 0.01))
    said = decided(*stands, refused=("wind",))
    assert [cause.effects for cause in said.clusters] == [("current",)]


def test_a_term_of_the_hull_that_is_refused_takes_nothing_with_it() -> None:
    """It stands for another form of the model, beside which the other effect is as sure as before."""

    def said(second: str) -> Decision:
        sets = [(("gyro_bias", second), 31.0, 0.9998), (("gyro_bias",), 16.0, 1.5e-4), ((), 0.0, 5e-5)]
        return decide(
            [Hypothesis(key, False, evidence, 0.0, p, True) for key, evidence, p in sets],
            available(),
            SETTINGS,
            near=lambda a, b: math.inf,
            helps=lambda name, key: name != second,
            underpowered=False,
        )

    left = said("munk")
    assert (left.kind, [cause.effects for cause in left.clusters]) == ("effects", [("gyro_bias",)])
    assert left.clusters[0].probability == pytest.approx(0.75)
    assert left.discrepancy
    assert said("current").kind == "unknown"


def test_what_breaks_the_symmetry_of_a_hull_is_no_form_of_its_damping() -> None:
    """Beside missing forces a Munk moment may be their form; lift of a hull at no incidence may not."""

    def said(name: str) -> Decision:
        found = [Hypothesis(key, True, 30.0, 0.0, p, True) for key, p in (((name,), 0.96), ((), 0.04))]
        return decide(
            found,
            available(),
            SETTINGS,
            near=lambda a, b: math.inf,
            helps=lambda name, key: True,
            underpowered=False,
        )

    assert said("munk").kind == "unknown"
    left = said("asymmetry")
    assert (left.kind, [cause.effects for cause in left.clusters]) == ("effects", [("asymmetry",)])


def test_where_the_answer_does_not_predict_the_next_one_is_asked() -> None:
    """A current beside a delay leads and predicts nothing; the wind that comes after them does."""
    sets = [(("current", "rudder_delay"), 14.0, 0.9), (("wind",), 11.5, 0.08), ((), 0.0, 0.02)]
    found = [Hypothesis(key, False, evidence, 0.0, p, True) for key, evidence, p in sets]

    def said(refused: tuple[str, ...]) -> Decision:
        return decide(
            found,
            available(),
            SETTINGS,
            near=lambda a, b: math.inf,
            helps=lambda name, key: name not in refused,
            underpowered=False,
        )

    second = said(("current", "rudder_delay"))
    assert (second.kind, [cause.effects for cause in second.clusters]) == ("effects", [("wind",)])
    assert second.probability == pytest.approx(0.8)
    third = said(("current", "rudder_delay", "wind"))
    # What leads is what it looks like.
    assert (third.kind, third.refused) == ("unknown", ("current", "rudder_delay"))


def test_what_is_only_improbable_beside_the_form_of_the_model_takes_nothing_with_it() -> None:
    """A rudder of half its effect explains much, and is the model's form; beside it either of two others may act."""
    sets = [
        (("gyro_bias", "rudder_gain", "speed_bias"), 170.0, 0.99),
        (("speed_bias", "trial_current"), 124.0, 0.006),
        (("gyro_bias", "speed_bias"), 120.0, 0.002),
        ((), 0.0, 0.0),
    ]
    said = beside_forces(sets)
    assert [cause.effects for cause in said.clusters] == [("speed_bias",)]


@pytest.mark.parametrize("gain", ["rudder_gain", "plane_gain", "thrust_gain"])
def test_a_factor_on_an_actuator_is_a_part_of_another_form_of_the_model(gain: str) -> None:
    """It is the same as an error of coefficients; without missing forces beside it nothing else is wrong."""
    beside = decided((("speed_bias", gain), 0.98, True), (("speed_bias",), 0.0195, True), ((), 0.0005))
    assert [cause.effects for cause in beside.clusters] == [("speed_bias",)]
    assert beside.discrepancy
    alone = decided(((gain,), 0.98), ((), 0.02))
    assert [cause.effects for cause in alone.clusters] == [(gain,)]


def test_damping_that_another_form_shows_as_well_is_not_named() -> None:
    alone = decided((("cross_flow",), 0.98), ((), 0.02))
    assert (alone.kind, alone.form, alone.discrepancy) == ("unknown", ("cross_flow",), True)
    assert alone.probability == pytest.approx(0.98)
    beside = decided((("cross_flow", "rate_delay"), 0.9), (("rate_delay",), 0.09), ((), 0.01))
    assert (beside.kind, [cause.effects for cause in beside.clusters]) == ("effects", [("rate_delay",)])
    assert (beside.form, beside.discrepancy) == (("cross_flow",), True)


def test_beside_another_form_a_cause_predicts_with_what_stands_for_the_form() -> None:
    """Of a planing boat the engine stood 2.5 deg off, beside a thrust that stood for the hump of its resistance.

    Without that one trial was predicted worse, and the cause was unknown.
    """
    said = decided(
        (("rudder_offset", "thrust_gain"), 0.9), ((), 0.1, True), helps=lambda name, key: "thrust_gain" in key
    )
    assert [cluster.effects for cluster in said.clusters] == [("rudder_offset",)]
    assert (said.shown, said.discrepancy) == (("rudder_offset",), True)


def test_a_factor_on_all_thrust_is_no_cause_beside_another_one() -> None:
    """A resistance that is steeper than the model's looks the same."""
    beside = decided((("speed_bias", "thrust_gain"), 0.9), (("speed_bias",), 0.09), ((), 0.01))
    assert [cause.effects for cause in beside.clusters] == [("speed_bias",)]
    assert (beside.form, beside.discrepancy, beside.shown) == (("thrust_gain",), True, ("speed_bias",))


@pytest.mark.parametrize("second", ["wind", "wave_forces"])
@pytest.mark.parametrize("one_course", [False, True])
@pytest.mark.parametrize("discrepancy", [False, True])
def test_a_direction_on_the_earth_needs_trials_on_several_courses(
    one_course: bool, discrepancy: bool, second: str
) -> None:
    """A calm basin: along the only course, wind stands for what the model's hull lacks, and waves for what keeps a
    frequency. Alone either may be named."""

    def said(*keys: tuple[str, ...]) -> Decision:
        return decide(
            [Hypothesis(key, discrepancy, 350.0 * len(key), 0.0, p, True) for key, p in zip(keys, (0.99, 0.01))],
            available(),
            SETTINGS,
            near=lambda a, b: math.inf,
            helps=lambda name, key: True,
            underpowered=False,
            one_course=one_course,
        )

    alone, beside = said(("trial_current", second)), said(("heading_bias", second), ("heading_bias",))
    if one_course and discrepancy:
        assert (alone.kind, alone.clusters, alone.along) == ("unknown", (), ("trial_current", second))
        assert [cause.effects for cause in beside.clusters] == [("heading_bias",)]
        assert beside.along == (second,)
    else:
        assert [cause.effects for cause in alone.clusters] == [("trial_current",), (second,)]
        assert [cause.effects for cause in beside.clusters] == [("heading_bias",), (second,)]
        assert alone.along == beside.along == ()


def test_what_is_needed_is_judged_by_evidence_where_the_temperature_is_high() -> None:
    """A calm basin: two errors of the rudder that do not predict explain most, and a wave drift helps beside them."""
    sets = [
        (("rudder_delay", "rudder_gain", "wave_drift"), 304.0, 0.98),
        (("wave_drift",), 134.0, 0.02),
        ((), 0.0, 0.0),
    ]
    said = decide(
        [Hypothesis(key, True, evidence, 0.0, p, True) for key, evidence, p in sets],
        available(),
        SETTINGS,
        near=lambda a, b: math.inf,
        helps=lambda name, key: name == "wave_drift",
        underpowered=False,
    )
    assert said.kind == "unknown"


def test_beside_a_form_of_the_model_a_cause_is_as_sure_as_its_sets_are() -> None:
    """A loss in turns is not named; sets with it fit as those of another form do, and its heading bias stays sure.

    The thrust curve of another form, thrust that falls with the load, is named as little.
    """
    sets = [
        (("heading_bias", "turning_loss", "voltage_sag"), 365.0, 0.96),
        (("heading_bias", "turning_loss"), 256.0, 0.0399),
        (("heading_bias",), 126.0, 6e-5),
        ((), 0.0, 4e-5),
    ]
    said = beside_forces(sets)
    assert [cause.effects for cause in said.clusters] == [("heading_bias",)]
    assert said.probability > 0.99
    assert said.form == ("turning_loss",)
    assert said.discrepancy


def test_waves_that_are_refused_take_no_error_of_a_sensor_with_them() -> None:
    """In a basin they find a band in what the model leaves, and the gyro's bias stands in the record without them."""
    sets = [(("gyro_bias", "wave_forces"), 86.0, 0.99), (("gyro_bias",), 52.0, 0.009), ((), 0.0, 1e-6)]

    def said(second: str) -> Decision:
        keys = [(tuple(second if name == "wave_forces" else name for name in key), e, p) for key, e, p in sets]
        return beside_forces(keys, refused=(second,))

    assert [cause.effects for cause in said("wave_forces").clusters] == [("gyro_bias",)]
    assert said("current").kind == "unknown"
