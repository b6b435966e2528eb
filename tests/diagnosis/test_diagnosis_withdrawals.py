"""What is taken back of a decision, on probabilities and errors made by hand."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace

import pytest
from decided_by_hand import EFFECTS, SETTINGS, decided, hypotheses

from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.parts import Fold, Validation
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.diagnosis.withdrawals import (
    without_disputed,
    without_leaning,
    without_little,
    without_opposed,
    without_taken_for_noise,
    without_unseen,
    without_unsure,
    without_untried,
    without_vague,
)
from seatruth.effects import available


@pytest.mark.parametrize(
    ("explained", "lower", "stays"),
    [(0.2, -0.1, False), (0.2, 0.05, True), (0.8, -0.1, True), (0.8, math.nan, True), (math.nan, math.nan, False)],
)
def test_what_may_be_something_that_cannot_be_tried_must_close_the_gap(
    explained: float, lower: float, stays: bool
) -> None:
    """Where no forces can be tried any effect, and a drift that may be leeway where the model lacks something."""
    fold = Fold("turn", ("wind",), 3.0, 2.5, 1.3, 1.3, 1.0, 0.1, 5.0)
    validation = Validation((fold,), explained, lower, 1.5, 0.0)
    drift = copy(EFFECTS["wind"])
    drift.stands_for_untried = True
    alone, beside = (("wind",), 0.95), (("wind",), 0.95, True)
    for forces, leading, effect in ((False, alone, EFFECTS["wind"]), (True, beside, drift)):
        entries = leading, ((), 0.05)
        said, found = decided(*entries), hypotheses(*entries)
        effects = {**EFFECTS, "wind": effect}
        left = without_untried(said, found, effects, lambda key: validation, forces=forces)
        if stays:
            assert left == said
        else:
            assert (left.kind, left.clusters, left.untried) == ("unknown", (), ("wind",))
            assert left.probability == pytest.approx(0.95)
    # Beside forces what stands for nothing else stays whatever it closes; so does a drift that leaves only noise.
    for leading, effect in ((beside, EFFECTS["wind"]), (alone, drift)):
        entries = leading, ((), 0.05)
        said, found = decided(*entries), hypotheses(*entries)
        assert without_untried(said, found, {**EFFECTS, "wind": effect}, lambda key: validation, forces=True) == said


def test_what_follows_each_trial_is_not_named_of_a_model_that_meets_its_noise() -> None:
    """Of a vehicle of cubic damping, whose controller swings: waves of 1.9 s had 97 %, at 1.00 of the noise."""
    entries = (("wave_forces",), 0.9), (("wave_forces",), 0.07, True), ((), 0.03, True)
    said, found = decided(*entries), hypotheses(*entries)
    assert said.kind == "effects"
    left = without_unseen(said, found, EFFECTS)
    assert (left.kind, left.clusters, left.shown, left.small) == ("unknown", (), (), ("wave_forces",))
    assert left.probability == pytest.approx(1.0)
    current = decided((("trial_current",), 0.9), ((), 0.1))
    assert without_unseen(current, found, EFFECTS) == current
    entries = (("current", "wave_forces"), 0.9), ((), 0.1)
    both = decided(*entries)
    kept = without_unseen(both, hypotheses(*entries), EFFECTS)
    assert (kept.kind, kept.shown, kept.small) == ("effects", ("current",), ())
    assert [cluster.effects for cluster in kept.clusters] == [("current",)]


def test_several_effects_of_a_family_alone_must_be_sure_where_nothing_is_left_to_explain() -> None:
    """Of a hull of another form on which nothing acted, an error of one sensor or another had 64 %."""
    entries = (("gyro_bias",), 0.4), (("heading_bias",), 0.36), ((), 0.04), ((), 0.2, True)
    said, found = decided(*entries), hypotheses(*entries)
    assert [(one.cause, len(one.effects)) for one in said.clusters] == [("sensor.bias_or_scale", 2)]
    assert without_vague(said, found) == said  # of one kind
    (cluster,) = said.clusters
    vague = replace(said, clusters=(replace(cluster, cause="sensor"),))
    left = without_vague(vague, found)
    assert (left.kind, left.clusters, left.shown) == ("underpowered", (), ())
    assert (left.acts, left.vague) == (True, cluster.effects)
    assert left.probability == pytest.approx(0.76)
    # What nothing may stand beside is not said to act.
    unsure = without_vague(vague, hypotheses((("gyro_bias",), 0.76), ((), 0.24)))
    assert (unsure.kind, unsure.acts, unsure.vague) == ("underpowered", False, ())
    sure = replace(vague, clusters=(replace(cluster, cause="sensor", probability=0.93),))
    assert without_vague(sure, found) == sure
    alone = replace(vague, clusters=(replace(cluster, cause="sensor", effects=("gyro_bias",)),))
    assert without_vague(alone, found) == alone
    both = replace(vague, clusters=(*sure.clusters, *vague.clusters))
    assert without_vague(both, found).clusters == sure.clusters


def test_what_was_significant_beside_a_refused_effect_alone_falls_with_it() -> None:
    """Of a glider: beside a depth sensor 10 % off, which was refused, it had an arm, of 0.1 +- 0.1 m without that."""
    entries = (("depth_lever_arm", "net_weight"), 0.9, True), ((), 0.1, True)
    said, found = replace(decided(*entries), outdone=("depth_scale",)), hypotheses(*entries)
    assert without_unsure(said, found, lambda name, key: True) == said
    left = without_unsure(said, found, lambda name, key: name == "net_weight")
    assert ([one.effects for one in left.clusters], left.outdone) == ([("net_weight",)], ("depth_scale",))
    none = without_unsure(said, found, lambda name, key: False)
    assert (none.kind, none.clusters, none.outdone) == ("unknown", (), ("depth_scale",))
    assert none.probability == pytest.approx(1.0)
    # Beside what stands for another form of the model, too.
    formed, asked = replace(said, form=("cross_flow_vertical",)), list[tuple[str, ...]]()

    def helps(name: str, key: tuple[str, ...]) -> bool:
        asked.append(key)
        return True

    assert without_unsure(formed, found, helps) == formed
    assert asked == [("cross_flow_vertical", "depth_lever_arm", "net_weight")] * 2


def test_what_stands_only_beside_an_effect_of_a_size_that_nobody_believes_is_not_named() -> None:
    entries = (("depth_scale", "net_weight"), 0.9), (("depth_scale",), 0.09), (("current_along",), 0.008), ((), 0.002)
    said, found = decided(*entries), hypotheses(*entries)
    assert [one.effects for one in said.clusters] == [("depth_scale",), ("net_weight",)]
    assert without_leaning(said, found, [], SETTINGS) == said
    left = without_leaning(said, found, ["depth_scale"], SETTINGS)
    assert ([one.effects for one in left.clusters], left.shown) == ([("depth_scale",)], ("depth_scale",))
    # Of a planing boat, a lag beside a wind of a size that its areas forbid: without the wind it has 76 %.
    entries = (("rudder_lag", "wind"), 0.9), (("rudder_lag",), 0.076), ((), 0.024)
    said, found = decided(*entries), hypotheses(*entries)
    left = without_leaning(said, found, ["wind"], SETTINGS)
    assert [one.effects for one in left.clusters] == [("rudder_lag",), ("wind",)]
    assert left.clusters[0].probability == pytest.approx(0.76)
    assert left.probability == pytest.approx(0.76)
    # Where no hypothesis is without it, nobody can say.
    alone = decided((("depth_scale", "net_weight"), 1.0))
    assert without_leaning(alone, hypotheses((("depth_scale", "net_weight"), 1.0)), ["depth_scale"], SETTINGS) == alone


def test_a_size_that_trials_dispute_is_named_where_the_gap_surely_shrinks() -> None:
    entries = (("position_lever_arm", "rudder_lag"), 0.9, True), ((), 0.1)
    said, found = decided(*entries), hypotheses(*entries)

    def left(sure: tuple[str, ...], lower: float) -> Decision:
        folds = (Fold("turn", said.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0),)
        validation = Validation(folds, 0.2, lower, 1.0, 0.8)
        return without_disputed(said, found, EFFECTS, sure, lambda key: validation)

    one = left(("rudder_lag",), -0.1)
    assert ([cause.effects for cause in one.clusters], one.refused) == ([("rudder_lag",)], ("position_lever_arm",))
    assert left((), -0.1).kind == "unknown"
    assert left((), 0.1) == left(said.shown, -0.1) == said
    # Trials may well disagree about the weather.
    wind = (("wind",), 0.9, True), ((), 0.1)
    folds = (Fold("turn", ("wind",), 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0),)
    named = decided(*wind)
    validation = Validation(folds, 0.2, -0.1, 1.0, 0.8)
    assert without_disputed(named, hypotheses(*wind), EFFECTS, (), lambda key: validation) == named


def test_what_is_doubtful_does_not_stay_for_what_another_cause_closes() -> None:
    """Of a glider 60 g too heavy the weight closed the gap, and a depth that was right was 2.5 +- 1.1 % off."""
    entries = (("heading_bias", "position_lever_arm"), 0.99, True), ((), 0.01)
    said, found = decided(*entries), hypotheses(*entries)

    def left(alone: float) -> Decision:
        folds = (Fold("turn", said.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0),)
        known = {said.shown: 0.98, ("heading_bias",): alone}
        return without_disputed(
            said, found, EFFECTS, ("heading_bias",), lambda key: Validation(folds, known[key], 0.9, 1.0, 0.1)
        )

    one = left(0.97)
    assert ([cause.effects for cause in one.clusters], one.refused) == ([("heading_bias",)], ("position_lever_arm",))
    assert left(0.6) == said


def test_what_is_neither_sure_nor_much_is_not_named() -> None:
    """Of a boat whose outer propeller drew air in turns: a rate limit of the thrusters, 81 % and 9 % of the gap."""

    def left(probability: float, share: float, lower: float = -0.4, beside: bool = True) -> Decision:
        lacking = (True,) if beside else ()
        entries = (("rudder_rate_limit",), probability, *lacking), ((), 1.0 - probability, *lacking)
        said, found = decided(*entries), hypotheses(*entries)
        folds = (Fold("turn", said.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0),)
        validation = Validation(folds, 0.14, lower, 0.7, 0.2)
        return without_little(said, found, lambda name: share, lambda key: validation, lambda name: True)

    assert (left(0.81, 0.09).kind, left(0.81, 0.09).refused) == ("unknown", ("rudder_rate_limit",))
    for stays in (left(0.95, 0.09), left(0.81, 0.5), left(0.81, math.nan), left(0.81, 0.09, 0.02)):
        assert [cause.effects for cause in stays.clusters] == [("rudder_rate_limit",)]
    assert [cause.effects for cause in left(0.81, 0.09, beside=False).clusters] == [("rudder_rate_limit",)]


def test_the_weather_about_which_all_trials_agree_is_named_though_it_is_little() -> None:
    """Of a model ship on a pond, late positions and thrusters had over 99.9 %, and the weather beside them 69 %."""

    def left(agreed: bool) -> Decision:
        entries = (("position_delay", "wind"), 0.69, True), (("position_delay",), 0.31, True)
        said, found = decided(*entries), hypotheses(*entries)
        validation = Validation((Fold("turn", said.shown, 9.0, 8.0, 9.0, 8.0, 3.0, 0.1, 5.0),), 0.3, -0.4, 1.1, 0.2)
        return without_little(said, found, lambda name: 0.14, lambda key: validation, lambda name: agreed)

    assert [one.effects for one in left(True).clusters] == [("position_delay",), ("wind",)]
    assert ([one.effects for one in left(False).clusters], left(False).refused) == ([("position_delay",)], ("wind",))


def test_where_motion_is_taken_for_noise_only_what_surely_predicts_or_trials_agree_about_is_named() -> None:
    entries = (("depth_lever_arm", "log_lever_arm_vertical"), 0.999, True), ((), 0.001)
    said, found = decided(*entries), hypotheses(*entries)

    def left(lower: float, *agreed: str) -> Decision:
        folds = (Fold("pulses", said.shown, 8.0, 8.1, 5.0, 5.0, 1.0, 0.1, 5.0),)
        return without_taken_for_noise(said, found, agreed, lambda key: Validation(folds, -0.01, lower, 0.04, 0.6))

    assert left(0.1) == said
    assert (left(-0.06).kind, left(-0.06).refused) == ("unknown", said.shown)
    assert without_taken_for_noise(said, found, (), lambda key: None).kind == "unknown"
    # In a sea, what all trials agree about stands.
    one = left(-0.06, "depth_lever_arm")
    assert ([cause.effects for cause in one.clusters], one.refused) == (
        [("depth_lever_arm",)],
        ("log_lever_arm_vertical",),
    )
    assert left(-0.06, *said.shown) == said


@pytest.mark.parametrize(
    ("bank", "offset", "stays"),
    [(-0.1, 0.2, False), (-4.6, 23.4, True), (math.nan, math.nan, True)],
)
def test_two_that_explain_the_trials_only_together_are_the_form_of_something_else(
    bank: float, offset: float, stays: bool
) -> None:
    """A rudder that stalls: the suction of a bank, and an offset against it. One alone may explain nothing."""
    key = ("bank", "rudder_offset")
    rows = [(key, 41.5, 0.9), (("bank",), bank, 0.02), (("rudder_offset",), offset, 0.03), ((), 0.0, 0.05)]
    found = [Hypothesis(one, True, value, 0.0, p, True) for one, value, p in rows if not math.isnan(value)]
    for lacks in (True, False):
        said = replace(decided((key, 0.9), ((), 0.1)), discrepancy=lacks)
        left = without_opposed(said, found)
        if stays or not lacks:
            assert left == said
        else:
            assert (left.kind, left.clusters, left.part) == ("unknown", (), key)
            assert left.probability == pytest.approx(1.0)


def test_what_stands_in_the_place_of_one_explains_alone_what_that_does() -> None:
    """A wind of a jet boat was fitted short alone, one of its own in each trial was not: they are one cause."""
    key, effects = ("rudder_delay", "wind"), available()
    rows = [(key, 92.7, 0.55), (("rudder_delay", "trial_wind"), 91.4, 0.4), ((), 0.0, 0.05), (("wind",), -18.3, 0.0)]
    found = [Hypothesis(one, True, value, 0.0, p, True) for one, value, p in rows]
    said = Decision(
        "effects",
        tuple(Cluster((n,), effects[n].cause, 0.9, (n, "trial_wind") if n == "wind" else (n,)) for n in key),
        0.9, True, key,
    )  # fmt: skip
    assert without_opposed(said, found).kind == "unknown"
    alone = [*found, Hypothesis(("trial_wind",), True, 57.2, 0.0, 0.0, True)]
    assert without_opposed(said, alone) == said
