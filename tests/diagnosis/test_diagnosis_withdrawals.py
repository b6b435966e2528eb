"""What is taken back of a decision, on probabilities and errors made by hand."""

from __future__ import annotations

import math

import pytest
from decided_by_hand import SETTINGS, decided, hypotheses

from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.parts import Fold, Validation
from seatruth.diagnosis.withdrawals import without_outdone, without_small, without_unseen


def test_what_terms_of_no_name_predict_better_is_not_named_where_the_gap_does_not_shrink_surely() -> None:
    entries = (("wind",), 0.9, True), (("wind",), 0.05), ((), 0.05)
    said, found = decided(*entries), hypotheses(*entries)

    def checked(explained: float, lower: float, control: float, both: float = 1.3) -> Decision:
        fold = Fold("turn", ("wind",), 3.0, 2.5, 1.3, both, 1.0, 0.1, 5.0)
        return without_outdone(said, found, Validation((fold,), explained, lower, 1.5, control))

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
    assert without_outdone(said, found, None) == said
    # One trial that it does not help to predict is not enough to refuse it.
    folds = [Fold("turn", ("wind",), 3.0, 2.5, 1.3, both, 1.0, 0.1, 5.0) for both in (1.2, 1.25, 2.3)]
    assert without_outdone(said, found, Validation(tuple(folds), 0.1, -0.5, 1.5, 0.8)) == said
    assert without_outdone(said, found, Validation(tuple(folds[1:]), 0.1, -0.5, 1.5, 0.8)) == unknown


def test_what_follows_each_trial_is_not_named_of_a_model_that_meets_its_noise() -> None:
    """Of a vehicle of cubic damping, whose controller swings: waves of 1.9 s had 97 %, at 1.00 of the noise."""
    entries = (("wave_forces",), 0.9), (("wave_forces",), 0.07, True), ((), 0.03, True)
    said, found = decided(*entries), hypotheses(*entries)
    assert said.kind == "effects"
    left = without_unseen(said, found, ["wave_forces"])
    assert (left.kind, left.clusters, left.shown, left.small) == ("unknown", (), (), ("wave_forces",))
    assert left.probability == pytest.approx(1.0)
    assert without_unseen(said, found, ["trial_current"]) == said
    entries = (("current", "wave_forces"), 0.9), ((), 0.1)
    both = decided(*entries)
    kept = without_unseen(both, hypotheses(*entries), ["wave_forces"])
    assert (kept.kind, kept.shown, kept.small) == ("effects", ("current",), ())
    assert [cluster.effects for cluster in kept.clusters] == [("current",)]


def test_an_error_of_a_sensor_stays_where_terms_of_no_name_predict_better() -> None:
    """Of a ship whose turning rate is off by 0.03 deg/s, in runs that a model of another form misses by far more."""
    fold = Fold("turn", ("gyro_bias",), 3.0, 3.0, 1.3, 1.3, 1.0, 0.1, 5.0)
    checked = Validation((fold,), 0.0, -0.2, 0.2, 0.85)
    entries = (("gyro_bias",), 0.9, True), ((), 0.1, True)
    said = decided(*entries)
    assert without_outdone(said, hypotheses(*entries), checked) == said
    entries = (("gyro_bias", "wind"), 0.9, True), ((), 0.1, True)
    both = decided(*entries)
    assert [cluster.effects for cluster in both.clusters] == [("gyro_bias",), ("wind",)]
    left = without_outdone(both, hypotheses(*entries), checked)
    assert [cluster.effects for cluster in left.clusters] == [("gyro_bias",)]
    assert (left.kind, left.shown, left.outdone, left.discrepancy) == ("effects", ("gyro_bias",), ("wind",), True)


def test_beside_an_unknown_cause_what_closes_nothing_of_the_gap_is_not_named() -> None:
    found = hypotheses((("current",), 0.9, True), (("current",), 0.05), ((), 0.05))
    said = decided((("current",), 0.9, True), (("current",), 0.05), ((), 0.05))
    assert said.discrepancy
    unknown = without_small(said, found, {"current": 0.01}.__getitem__, SETTINGS)
    assert unknown.kind == "unknown"
    assert unknown.clusters == ()
    assert unknown.small == ("current",)
    assert unknown.probability == pytest.approx(0.9)
    for share in (0.3, math.nan):
        assert without_small(said, found, {"current": share}.__getitem__, SETTINGS) == said
    alone = decided((("current",), 0.95), ((), 0.05))
    assert without_small(alone, found, {"current": 0.01}.__getitem__, SETTINGS) == alone


def test_waves_of_no_size_beside_another_cause_are_not_named() -> None:
    """Of a ship in a calm basin whose heading came late: waves of 0.0001 m/s2, with a phase in each zigzag."""
    entries = (("gyro_bias", "wave_forces"), 0.95, True), ((), 0.05, True)
    said, found = decided(*entries), hypotheses(*entries)
    assert [cluster.effects for cluster in said.clusters] == [("gyro_bias",), ("wave_forces",)]
    shares = {"gyro_bias": 0.99, "wave_forces": 0.01}
    left = without_small(said, found, shares.__getitem__, SETTINGS, own=["wave_forces"])
    assert ([cluster.effects for cluster in left.clusters], left.shown) == ([("gyro_bias",)], ("gyro_bias",))
    assert without_small(said, found, shares.__getitem__, SETTINGS) == said
    large = {"gyro_bias": 0.6, "wave_forces": 0.4}
    assert without_small(said, found, large.__getitem__, SETTINGS, own=["wave_forces"]) == said


def test_what_has_a_phase_in_each_trial_stays_where_others_do_not_predict_it() -> None:
    fold = Fold("turn", ("wave_forces",), 3.0, 3.0, 1.3, 1.3, 1.0, 0.1, 5.0)
    checked = Validation((fold,), 0.0, -0.2, 0.2, 0.85)
    entries = (("wave_forces",), 0.9, True), ((), 0.1, True)
    said = decided(*entries)
    assert without_outdone(said, hypotheses(*entries), checked, own=["wave_forces"]) == said
    assert without_outdone(said, hypotheses(*entries), checked).kind == "unknown"
