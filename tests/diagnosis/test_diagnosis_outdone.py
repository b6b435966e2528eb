"""What trials left out are predicted better without, on probabilities and errors made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from decided_by_hand import EFFECTS, decided, hypotheses

from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.outdone import without_hindering, without_outdone
from seatruth.diagnosis.parts import Fold, Validation
from seatruth.diagnosis.sensor_errors import SensorErrors
from seatruth.diagnosis.verdict import Hypothesis


def outdone(
    said: Decision,
    found: list[Hypothesis],
    validation: Validation | None,
    moved: float = 0.0,
    rest: Validation | None = None,
) -> Decision:
    """What is left where the set has this validation, and any part of it has that of `rest`."""
    by_key = {said.shown: validation}
    return without_outdone(said, found, EFFECTS, lambda key: by_key.get(key, rest), lambda name: moved)


def test_what_terms_of_no_name_predict_better_is_not_named_where_the_gap_does_not_shrink_surely() -> None:
    entries = (("wind",), 0.9, True), (("wind",), 0.05), ((), 0.05)
    said, found = decided(*entries), hypotheses(*entries)

    def checked(explained: float, lower: float, control: float, both: float = 1.3) -> Decision:
        fold = Fold("turn", ("wind",), 3.0, 2.5, 1.3, both, 1.0, 0.1, 5.0)
        return outdone(said, found, Validation((fold,), explained, lower, 1.5, control))

    unknown = checked(0.24, -0.21, 0.84)
    assert (unknown.kind, unknown.clusters, unknown.shown, unknown.outdone) == ("unknown", (), (), ("wind",))
    assert unknown.probability == pytest.approx(0.95)
    # A right cause may close less than terms that can take its shape, or not surely: not both.
    for kept in (checked(0.84, 0.46, 0.97), checked(0.45, -0.56, 0.11), checked(math.nan, math.nan, math.nan)):
        assert kept == said
    # What makes the gap grow is not named because terms do worse still.
    assert checked(-1.06, -3.5, -8.9) == unknown
    # It may close nothing where the form is far off: beside the terms it is seen.
    assert checked(0.0, -0.5, 0.8, both=1.2) == said
    assert checked(0.0, -0.5, 0.8, both=math.nan) == unknown
    assert outdone(said, found, None) == said
    # One trial that it does not help to predict is not enough to refuse it.
    folds = [Fold("turn", ("wind",), 3.0, 2.5, 1.3, both, 1.0, 0.1, 5.0) for both in (1.2, 1.25, 2.3)]
    assert outdone(said, found, Validation(tuple(folds), 0.1, -0.5, 1.5, 0.8)) == said
    assert outdone(said, found, Validation(tuple(folds[1:]), 0.1, -0.5, 1.5, 0.8)) == unknown


def test_sizes_of_their_own_in_each_trial_do_not_stand_by_what_they_add_to_terms() -> None:
    """Of a planing boat whose model lacks the hump of its resistance: a wind of 1 to 4 m/s from everywhere."""
    folds = tuple(Fold("turn", ("wind",), 3.0, 2.5, 1.3, both, 1.0, 0.1, 5.0) for both in (1.2, 1.25, 2.3))
    checked = Validation(folds, 0.3, -0.5, 1.5, 0.9)

    def checked_with(*key: str, lower: float = -0.5) -> tuple[Decision, Decision]:
        entries = (key, 0.9, True), ((), 0.1, True)
        said = decided(*entries)
        return said, outdone(said, hypotheses(*entries), replace(checked, lower=lower))

    said, left = checked_with("wind")
    assert left == said
    _, left = checked_with("trial_wind")
    assert (left.kind, left.clusters, left.outdone) == ("unknown", (), ("trial_wind",))
    said, left = checked_with("trial_wind", lower=0.1)
    assert left == said
    # Another cause beside it stands by itself.
    _, left = checked_with("plane_lag", "trial_wind")
    assert ([one.effects for one in left.clusters], left.outdone) == ([("plane_lag",)], ("trial_wind",))


@pytest.mark.parametrize(("control", "after", "stands"), [(0.004, 1.3, True), (0.3, 1.3, False), (0.004, 4.5, False)])
def test_sizes_of_their_own_in_each_trial_stand_where_terms_close_nothing(
    control: float, after: float, stands: bool
) -> None:
    """Of a glider in a current of its own in each dive: left open in both, that current hid itself."""
    entries = (("trial_current",), 0.9, True), ((), 0.1, True)
    said, found = decided(*entries), hypotheses(*entries)
    # With the current left open the refit misses as little; without, 7.7 deviations of the noise.
    open_ = Fold("dive", ("trial_current",), after, after, after - 0.1, after, 1.0, 12.0, 40.0)
    bare = Fold("dive", (), 7.7, 7.7, 7.67, math.nan, 1.0, 0.2, 0.0)
    answers = {
        said.shown: Validation((open_, open_), 0.0, -0.04, 0.05, 0.3),
        (): Validation((bare, bare), 0.0, 0.0, 0.0, control),
    }
    left = without_outdone(said, found, EFFECTS, answers.__getitem__, lambda _: 0.0)
    assert (left == said) == stands


def test_an_error_of_a_sensor_stays_where_terms_of_no_name_predict_better() -> None:
    """Of a ship whose turning rate is off by 0.03 deg/s, in runs that a model of another form misses by far more."""
    fold = Fold("turn", ("gyro_bias",), 3.0, 3.0, 1.3, 1.3, 1.0, 0.1, 5.0)
    checked = Validation((fold,), 0.0, -0.2, 0.2, 0.85)
    entries = (("gyro_bias",), 0.9, True), ((), 0.1, True)
    said = decided(*entries)
    assert outdone(said, hypotheses(*entries), checked) == said
    entries = (("gyro_bias", "wind"), 0.9, True), ((), 0.1, True)
    both = decided(*entries)
    assert [cluster.effects for cluster in both.clusters] == [("gyro_bias",), ("wind",)]
    left = outdone(both, hypotheses(*entries), checked)
    assert [cluster.effects for cluster in left.clusters] == [("gyro_bias",)]
    assert (left.kind, left.shown, left.outdone, left.discrepancy) == ("effects", ("gyro_bias",), ("wind",), True)


def test_an_error_of_a_sensor_that_would_show_on_trials_left_out_and_does_not_is_not_named() -> None:
    """Of a glider that is slower than its model: 10 % of the depth, 4 % of what trials left out miss."""
    fold = Fold("dive", ("depth_scale",), 33.0, 32.0, 3.0, 2.7, 1.0, 0.1, 5.0)
    entries = (("depth_scale",), 0.9, True), ((), 0.1, True)
    said, found = decided(*entries), hypotheses(*entries)

    def checked(explained: float, moved: float, terms: float = 34.0) -> Decision:
        here = replace(fold, error_effects=33.0 - explained * 32.0, error_discrepancy=terms, error_both=0.9 * terms)
        validation = Validation((here,), explained, -0.06, 0.14, 0.9)
        return outdone(said, found, validation, moved)

    assert checked(0.04, 31.0).outdone == ("depth_scale",)
    assert checked(0.04, 31.0).kind == "unknown"
    # It would close 1 - sqrt(1 - 0.5^2) = 13 % of the gap: too little to miss.
    assert checked(0.04, 16.0) == said
    assert checked(0.04, 0.2) == said
    # Terms come nearer, and beside them it would close all, or little.
    assert checked(0.04, 16.0, 3.0).outdone == ("depth_scale",)
    assert checked(0.04, 0.2, 3.0) == said
    assert checked(0.8, 31.0) == said
    # Beside another cause the set without it is the measure.
    entries = (("depth_scale", "net_weight"), 0.9, True), ((), 0.1, True)
    both, found = decided(*entries), hypotheses(*entries)
    having = Validation((replace(fold, error_effects=16.0),), 0.5, 0.1, 0.9, 0.9)
    no_better = Validation((replace(fold, error_effects=15.0),), 0.55, 0.1, 0.9, 0.9)
    left = outdone(both, found, having, 31.0, no_better)
    assert ([one.effects for one in left.clusters], left.outdone) == ([("net_weight",)], ("depth_scale",))
    worse = Validation((replace(fold, error_effects=33.0),), 0.0, -0.1, 0.1, 0.9)
    assert outdone(both, found, having, 31.0, worse) == both


def test_an_error_of_a_sensor_stays_where_it_shows_beside_terms_of_no_name() -> None:
    """Of a ferry whose receiver was 2.5 s late, in runs that its model misses by far: nothing of the gap, and 60 % of
    what terms leave."""
    errors = [(6.06, 4.13, 1.59, 1.13), (3.69, 3.45, 1.5, 1.22), (20.9, 23.5, 42.8, 17.0), (9.2, 10.3, 42.8, 10.5)]
    folds = tuple(Fold("run", ("receiver_delay",), *each, 0.95, 0.3, 30.0) for each in errors)
    entries = (("receiver_delay",), 0.99, True), ((), 0.01, True)
    said, found = decided(*entries), hypotheses(*entries)
    assert outdone(said, found, Validation(folds, -0.02, -0.4, 0.36, -2.0), 7.3) == said
    hardly = tuple(replace(fold, error_both=fold.error_discrepancy - 0.05) for fold in folds)
    assert outdone(said, found, Validation(hardly, -0.02, -0.4, 0.36, -2.0), 7.3).outdone == ("receiver_delay",)


def test_an_error_of_a_sensor_stays_where_it_shows_in_the_channels_of_that_sensor() -> None:
    """Of a launch whose gyro read 8 % too much: a fifth of the gap, and all that terms leave of the rate of turn."""
    errors = [(1.31, 1.33, 1.16, 1.15, 0.91), (1.81, 1.64, 1.52, 0.83, 0.78), (2.12, 1.73, 2.02, 1.42, 0.71)]
    folds = tuple(Fold("run", ("gyro_bias",), *each, 0.3, 20.0) for each in errors)
    validation = Validation(folds, 0.199, -0.05, 0.4, 0.271)
    entries = (("gyro_bias",), 0.99, True), ((), 0.01, True)
    said, found = decided(*entries), hypotheses(*entries)

    def left(*own: tuple[float, float, float]) -> Decision:
        shown = [SensorErrors(*each) for each in own]
        moves, shows = (lambda name: 1.5), (lambda name, key: shown if name in key else [])
        return without_outdone(said, found, EFFECTS, lambda key: validation, moves, shows=shows)

    turns = (0.97, 3.2, 0.99), (0.83, 3.52, 0.95)
    assert left((0.96, 1.01, 1.01), *turns) == said, "a straight run shows nothing"
    assert left((0.96, 1.01, 0.95), (0.97, 1.05, 0.98), turns[0]).outdone == ("gyro_bias",), "as noise does"
    assert left((0.97, 3.2, 2.5), (0.83, 3.52, 2.3)).outdone == ("gyro_bias",), "less than half"
    assert left().outdone == ("gyro_bias",), "no fit with terms"


def test_of_two_that_predict_nothing_together_the_one_that_predicts_alone_stays() -> None:
    """Of a ship on a pond: a position 0.9 s late closed 35 % of its gap, and beside a lag of the thruster none."""
    entries = (("position_delay", "thruster_lag"), 0.9, True), ((), 0.1, True)
    said, found = decided(*entries), hypotheses(*entries)
    assert [one.effects for one in said.clusters] == [("position_delay",), ("thruster_lag",)]

    def validation(error: float) -> Validation:
        fold = Fold("turn", (), 100.0, error, 290.0, math.nan, 1.0, 0.1, 5.0)
        return Validation((fold,), (100.0 - error) / 99.0, -0.5, 1.5, -1.9)

    known = {said.shown: validation(120.0), ("position_delay",): validation(65.0), ("thruster_lag",): validation(90.0)}

    def left(tried: dict[tuple[str, ...], Validation]) -> Decision:
        return without_outdone(said, found, EFFECTS, tried.get, lambda name: 90.0)

    stays = left(known)
    assert ([one.effects for one in stays.clusters], stays.outdone) == ([("position_delay",)], ("thruster_lag",))
    assert stays.discrepancy
    neither = left({**known, ("position_delay",): validation(110.0), ("thruster_lag",): validation(105.0)})
    assert (neither.kind, neither.clusters) == ("unknown", ())
    assert neither.outdone == ("position_delay", "thruster_lag")


def test_a_direction_that_trials_share_stays_whatever_runs_that_stray_say() -> None:
    """Of an ROV whose runs ended 4 to 150 deviations of the noise off, with the current that acted and without."""
    entries = (("current",), 0.9, True), ((), 0.1, True)
    said, found = decided(*entries), hypotheses(*entries)
    fold = Fold("spin", ("current",), 25.0, 26.0, 20.0, 33.0, 1.0, 0.1, 95.0)
    tried = {("current",): Validation((fold,), -0.04, -0.4, 0.4, 0.2)}
    assert without_outdone(said, found, EFFECTS, tried.get, lambda _: 0.0).outdone == ("current",)
    assert without_outdone(said, found, EFFECTS, tried.get, lambda _: 0.0, ["current"]) == said


def test_an_error_that_grew_by_more_than_a_sensor_moves_the_trial_is_not_the_sensors() -> None:
    """Of a ship on a pond whose model misses runs by 100 times the noise: a late position moves them by 7."""
    entries = (("position_delay",), 0.9, True), ((), 0.1, True)
    said, found = decided(*entries), hypotheses(*entries)
    fold = Fold("turn", ("position_delay",), 100.0, 140.0, 290.0, math.nan, 1.0, 0.1, 5.0)
    checked = Validation((fold,), -0.4, -0.9, 0.1, -1.9)
    assert outdone(said, found, checked, moved=7.0) == said
    # Of one that moves them by half of what they miss, trials left out should come nearer.
    assert outdone(said, found, checked, moved=50.0).outdone == ("position_delay",)


def test_what_has_a_phase_in_each_trial_stays_where_others_do_not_predict_it() -> None:
    fold = Fold("turn", ("wave_forces",), 3.0, 3.0, 1.3, 1.3, 1.0, 0.1, 5.0)
    checked = Validation((fold,), 0.0, -0.2, 0.2, 0.85)
    entries = (("wave_forces",), 0.9, True), ((), 0.1, True)
    said = decided(*entries)
    assert outdone(said, hypotheses(*entries), checked) == said
    steady = (("wind",), 0.9, True), ((), 0.1, True)
    assert outdone(decided(*steady), hypotheses(*steady), checked).kind == "unknown"


def test_an_error_of_a_sensor_that_comes_no_nearer_falls_where_no_run_strays() -> None:
    """Of a boat on which nothing acted, an antenna 0.17 m from its place; the model met its noise nearly everywhere."""
    for p in (0.995, 0.9):
        entries = (("gyro_bias",), p, True), ((), 1.0 - p, True)
        said, found = decided(*entries), hypotheses(*entries)

        def left(error: float, *, strays: bool, said: Decision = said, found: list[Hypothesis] = found) -> Decision:
            fold = Fold("turn", ("gyro_bias",), 1.4, error, 1.3, math.nan, 1.0, 0.1, 5.0)
            validation = Validation((fold,), (1.4 - error) / 0.4, -1.0, 0.5, 0.24)
            return without_outdone(said, found, EFFECTS, lambda key: validation, lambda _: 0.1, strays=strays)

        assert left(1.48, strays=True) == said
        assert left(1.48, strays=False).outdone == ("gyro_bias",)
        # A receiver 0.8 s late, over 99.9 %, came no nearer by 0.002 of what a ferry's model misses.
        assert (left(1.41, strays=False) == said) == (p == 0.995)
        assert left(1.38, strays=False) == said


def test_what_keeps_the_others_from_predicting_trials_left_out_goes_where_these_surely_do_alone() -> None:
    """Of a ship on a pond in wind, whose positions were late and whose thrusters seemed to be late as well."""
    late, thrusters, wind, drift = "position_delay", "thruster_lag", "wind", "wave_drift"
    entries = ((late, thrusters, wind), 0.5, True), ((late, thrusters, drift), 0.45, True), ((late,), 0.05, True)
    said, found = decided(*entries), hypotheses(*entries)
    assert [cluster.effects for cluster in said.clusters] == [(late,), (thrusters,), (wind, drift)]

    def left(closing: dict[frozenset[str], tuple[float, float]], unfitted: str = "") -> Decision:
        def validated(key: Key) -> Validation | None:
            explained, lower = closing.get(frozenset(key), (0.0, -0.1))
            return Validation((), explained, lower, 1.0, -2.0)

        return without_hindering(said, found, validated, lambda key: None if unfitted in key else key)

    all_three, alone = frozenset((late, thrusters, wind)), frozenset((late, wind))
    kept = left({all_three: (0.35, -0.4), alone: (0.58, 0.35)})
    assert [cluster.effects for cluster in kept.clusters] == [(late,), (wind, drift)]
    assert (kept.shown, kept.refused, kept.discrepancy) == ((late, wind), (thrusters,), True)
    # The others stand by whichever of their effects predicts, as far as it is fitted beside them.
    other = frozenset((late, drift))
    assert left({all_three: (0.35, -0.4), other: (0.4, 0.1)}).shown == (late, drift)
    assert left({all_three: (0.35, -0.4), other: (0.4, 0.1)}, unfitted=drift) == said
    # All stay where they surely close a part together, where nothing surely does, or where they close more.
    assert left({all_three: (0.5, 0.1), alone: (0.58, 0.35)}) == said
    assert left({all_three: (0.35, -0.4), alone: (0.58, -0.01)}) == said
    assert left({all_three: (0.7, -0.4), alone: (0.58, 0.35)}) == said
    # An error of a sensor, which is small beside such a gap, takes nothing away and is not taken.
    assert left({all_three: (0.35, -0.4), frozenset((thrusters, wind)): (0.6, 0.3)}) == said
