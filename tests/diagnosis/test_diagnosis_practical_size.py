"""What is of no practical size, on probabilities, shares and errors made by hand."""

from __future__ import annotations

import math

import pytest
from decided_by_hand import EFFECTS, SETTINGS, decided, hypotheses

from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.parts import Fold, Validation
from seatruth.diagnosis.practical_size import without_negligible, without_small, without_tiny
from seatruth.diagnosis.sensor_errors import SensorErrors
from seatruth.diagnosis.verdict import Hypothesis


class Measured:
    """How large the effects of an answer are: all alike, or by their names."""

    def __init__(
        self,
        moved: float | dict[str, float] = math.nan,
        size: float | dict[str, float] = math.nan,
        closed: float = math.nan,
        closes: dict[str, float] | None = None,
        late: float = math.inf,
        strays: bool = False,
    ) -> None:
        self.moved, self.size, self.closed, self.closes, self.late = moved, size, closed, closes or {}, late
        self.strays = strays

    def share(self, name: str) -> float:
        return self.closes[name]

    def part_moved(self, name: str) -> float:
        return self.moved[name] if isinstance(self.moved, dict) else self.moved

    def typical_sizes(self, name: str) -> float:
        return self.size[name] if isinstance(self.size, dict) else self.size

    def is_of_evidence(self, name: str) -> bool:
        return self.strays

    def steps_late(self, name: str) -> float:
        return self.late

    def closed_in_its_sensor(self, name: str) -> float:
        return self.closed


def test_what_surely_closes_nothing_on_trials_left_out_is_not_named_of_runs_that_stray() -> None:
    """A lag of 0.06 s that acts is no cause of a gap of which it closes -5 to 4 %."""
    entries = (("rudder_lag",), 0.9, True), (("rudder_lag",), 0.05), ((), 0.05)
    said, found = decided(*entries), hypotheses(*entries)

    def left(
        decision: Decision, upper: float, found: list[Hypothesis] = found, moved: float = 0.01, size: float = 0.2
    ) -> Decision:
        fold = Fold("turn", decision.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0)
        validation = Validation((fold,), 0.0, -0.05, upper, 0.8)
        gap = Measured(moved, size)
        return without_negligible(decision, found, EFFECTS, lambda key: validation, gap, SETTINGS)

    unknown = left(said, 0.04)
    assert (unknown.kind, unknown.clusters, unknown.small) == ("unknown", (), ("rudder_lag",))
    assert unknown.probability == pytest.approx(0.95)
    for kept in (0.12, math.inf, math.nan):  # it may close a part, or the trials do not bound it
        assert left(said, kept) == said
    # What moves the trials by much of what runs miss is not small, though with it they come no nearer.
    assert left(said, 0.04, moved=0.3) == said
    # Nor is what is as large as such errors are, whatever else the model lacks.
    assert left(said, 0.04, size=1.2) == said
    # An error of a sensor is small beside what that sensor shows; beside it the lag is said to be small.
    both = (("heading_bias", "rudder_lag"), 0.995, True), ((), 0.005)
    named = left(decided(*both), 0.04, hypotheses(*both))
    assert [one.effects for one in named.clusters] == [("heading_bias",)]
    assert (named.shown, named.small) == (("heading_bias",), ("rudder_lag",))
    # Of several, one is small without which the others close as much.
    pair = (("rudder_lag", "rudder_offset"), 0.9, True), ((), 0.1)
    two, checked = decided(*pair), hypotheses(*pair)

    def closing(whole: float, rest: float) -> Decision:
        folds = (Fold("turn", two.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0),)
        known = {
            two.shown: Validation(folds, whole, -0.4, 1.0, 0.8),
            ("rudder_offset",): Validation(folds, rest, -0.4, 1.0, 0.8),
        }
        gap = Measured({"rudder_offset": 0.9, "rudder_lag": 0.001}, 0.2)
        return without_negligible(two, checked, EFFECTS, known.__getitem__, gap, SETTINGS)

    assert (closing(0.31, 0.3).shown, closing(0.31, 0.3).small) == (("rudder_offset",), ("rudder_lag",))
    for whole, rest in ((0.31, 0.2), (0.31, math.nan), (math.nan, 0.3)):
        assert closing(whole, rest) == two
    # Where nothing is missing beside it, a small gap is a small gap.
    alone = (("rudder_lag",), 0.95), ((), 0.05)
    assert left(decided(*alone), 0.04, hypotheses(*alone)) == decided(*alone)


@pytest.mark.parametrize(("closed", "named"), [(0.004, False), (0.98, True), (math.nan, True)])
def test_an_error_of_a_speed_closes_what_runs_miss_of_that_speed(closed: float, named: bool) -> None:
    """Where runs stray: a log pitched by 2 deg that closed 0.5 % of what an ROV's model missed of the speed down.

    A log turned by 3 deg closed 98 % of what an AUV's model missed of the speed across.
    """
    entries = (("log_misalignment",), 0.995, True), ((), 0.005)
    said, found = decided(*entries), hypotheses(*entries)
    fold = Fold("turn", said.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0)
    validation = Validation((fold,), 0.0, -0.05, 0.04, 0.8)
    gap = Measured(0.001, 0.9, closed)
    left = without_negligible(said, found, EFFECTS, lambda key: validation, gap, SETTINGS)
    assert (left == said) == named
    assert named or (left.kind, left.small) == ("unknown", ("log_misalignment",))


@pytest.mark.parametrize(("having", "named"), [(1.2, True), (3.4, False)])
def test_an_error_of_a_speed_that_its_sensor_shows_beside_free_terms_is_named(having: float, named: bool) -> None:
    """A tanker's log scaled by 3 %, at 94 %: its runs stray by 24 times the noise, and come no nearer with it."""
    entries = (("speed_scale",), 0.94, True), ((), 0.06)
    said, found = decided(*entries), hypotheses(*entries)
    fold = Fold("zigzag", said.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0)
    validation = Validation((fold,), 0.0, -0.01, 0.01, 0.8)
    errors = [SensorErrors(1.0, 3.5, having), SensorErrors(1.0, 2.0, having - 0.1), SensorErrors(1.0, 1.0, 1.0)]
    asked = dict[str, Key]()

    def shows(name: str, key: Key) -> list[SensorErrors]:
        asked[name] = key
        return errors

    gap = Measured(0.001, 0.9, 0.004)
    left = without_negligible(said, found, EFFECTS, lambda key: validation, gap, SETTINGS, shows)
    assert asked == {"speed_scale": said.shown}
    assert (left == said) == named
    assert named or (left.kind, left.small) == ("unknown", ("speed_scale",))


@pytest.mark.parametrize(
    ("p", "size", "rest", "named"),
    [(0.97, 0.15, 0.9, False), (0.97, 0.15, 0.8, True), (0.97, 0.9, 0.9, True), (0.995, 0.15, 0.9, True)],
)
def test_a_doubtful_small_error_of_a_sensor_beside_another_cause_must_close_something(
    p: float, size: float, rest: float, named: bool
) -> None:
    """A gyro scaled by 0.5 %, at 97 %, beside the antenna of a tanker in a basin, which closes the gap alone."""
    entries = (("gyro_scale", "position_lever_arm"), p, True), (("position_lever_arm",), 1.0 - p, True)
    said, found = decided(*entries), hypotheses(*entries)
    folds = (Fold("zigzag", said.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0),)
    known = {
        said.shown: Validation(folds, 0.91, 0.8, 1.0, 0.8),
        ("position_lever_arm",): Validation(folds, rest, 0.7, 1.0, 0.8),
    }
    gap = Measured(0.3, {"gyro_scale": size, "position_lever_arm": 1.0})
    left = without_negligible(said, found, EFFECTS, known.__getitem__, gap, SETTINGS)
    assert (left == said) == named
    assert named or (left.shown, left.small) == (("position_lever_arm",), ("gyro_scale",))


def test_a_rate_limit_within_the_clock_of_the_record_is_next_to_nothing() -> None:
    """28 deg/s of rudders that moved by 30 made them late by 0.16 sampling steps."""
    entries = (("rudder_rate_limit",), 0.999, True), ((), 0.001)
    said, found = decided(*entries), hypotheses(*entries)

    def usual(cluster: Cluster) -> float:
        return 0.4

    left = without_tiny(said, found, Measured(late=0.16), usual, SETTINGS, gap=True)
    assert (left.kind, left.small) == ("unknown", ("rudder_rate_limit",))
    assert without_tiny(said, found, Measured(late=0.9), usual, SETTINGS, gap=True) == said


def test_beside_an_unknown_cause_what_closes_nothing_of_the_gap_is_not_named() -> None:
    found = hypotheses((("current",), 0.9, True), (("current",), 0.05), ((), 0.05))
    said = decided((("current",), 0.9, True), (("current",), 0.05), ((), 0.05))
    assert said.discrepancy
    unknown = without_small(said, found, EFFECTS, Measured(closes={"current": 0.01}), SETTINGS)
    assert unknown.kind == "unknown"
    assert unknown.clusters == ()
    assert unknown.small == ("current",)
    assert unknown.probability == pytest.approx(0.9)
    for share in (0.3, math.nan):
        assert without_small(said, found, EFFECTS, Measured(closes={"current": share}), SETTINGS) == said
    alone = decided((("current",), 0.95), ((), 0.05))
    assert without_small(alone, found, EFFECTS, Measured(closes={"current": 0.01}), SETTINGS) == alone


def test_waves_of_no_size_beside_another_cause_are_not_named() -> None:
    """Of a ship in a calm basin whose heading came late: waves of 0.0001 m/s2, with a phase in each zigzag."""
    entries = (("gyro_bias", "wave_forces"), 0.95, True), ((), 0.05, True)
    said, found = decided(*entries), hypotheses(*entries)
    assert [cluster.effects for cluster in said.clusters] == [("gyro_bias",), ("wave_forces",)]
    shares = {"gyro_bias": 0.99, "wave_forces": 0.01}
    left = without_small(said, found, EFFECTS, Measured(closes=shares), SETTINGS)
    assert ([cluster.effects for cluster in left.clusters], left.shown) == ([("gyro_bias",)], ("gyro_bias",))
    large = {"gyro_bias": 0.6, "wave_forces": 0.4}
    assert without_small(said, found, EFFECTS, Measured(closes=large), SETTINGS) == said


@pytest.mark.parametrize(
    ("name", "probability", "size", "named"),
    [
        ("heading_bias", 0.995, 1.0, True),
        ("heading_bias", 0.9, 1.0, False),
        ("heading_bias", 0.995, 0.3, False),
        ("rudder_lag", 0.995, 1.0, False),
    ],
)
def test_a_certain_error_of_a_sensor_stays_beside_a_large_gap(
    name: str, probability: float, size: float, named: bool
) -> None:
    """A receiver late by 0.5 s, over 0.999, closes nothing of what a model of another form misses of the heading."""
    entries = ((name,), probability, True), ((), 1.0 - probability, True)
    said, found = decided(*entries), hypotheses(*entries)
    left = without_small(said, found, EFFECTS, Measured(size=size, closes={name: 0.001}), SETTINGS)
    assert (left == said) == named
    assert named or left.small == (name,)


@pytest.mark.parametrize(
    ("probability", "upper", "named"), [(0.77, 0.04, False), (0.995, 0.04, True), (0.77, 0.5, True)]
)
def test_of_runs_that_stray_an_error_of_a_sensor_that_closes_nothing_is_named_only_if_certain(
    probability: float, upper: float, named: bool
) -> None:
    """A log of an ROV seemed scaled by 5 %, at 0.77, and closed -5 to 4 % of the gap: it was right."""
    entries = (("heading_bias",), probability, True), ((), 1.0 - probability, True)
    said, found = decided(*entries), hypotheses(*entries)
    fold = Fold("turn", said.shown, 3.0, 3.0, 3.0, 3.0, 3.0, 0.1, 5.0)
    validation = Validation((fold,), 0.0, -0.05, upper, 0.8)
    left = without_negligible(said, found, EFFECTS, lambda key: validation, Measured(0.001, 0.9), SETTINGS)
    assert (left == said) == named


@pytest.mark.parametrize(("gap", "kind"), [(True, "unknown"), (False, "underpowered")])
def test_what_is_next_to_nothing_for_what_it_is_is_no_cause(gap: bool, kind: str) -> None:
    """Of a vehicle with four thrusters on which nothing acted: a lag of 3 ms, a hundredth of a typical one, at 74 %."""
    entries = (("rudder_offset", "wind"), 0.9), ((), 0.1)
    said, found = decided(*entries), hypotheses(*entries)

    def left(**sizes: float) -> Decision:
        shares = Measured(closes=dict.fromkeys(sizes, 0.3))
        return without_tiny(said, found, shares, lambda one: sizes[one.effects[0]], SETTINGS, gap=gap)

    assert left(rudder_offset=0.08, wind=0.5) == said
    one = left(rudder_offset=0.01, wind=0.5)
    assert ([cluster.effects for cluster in one.clusters], one.shown, one.small) == (
        [("wind",)],
        ("wind",),
        ("rudder_offset",),
    )
    none = left(rudder_offset=0.01, wind=0.06)
    assert (none.kind, none.clusters, none.shown, none.small) == (kind, (), (), ("rudder_offset", "wind"))


@pytest.mark.parametrize(
    ("share", "strays", "named"),
    [(0.88, False, True), (math.nan, False, True), (0.4, False, False), (1.0, True, False)],
)
def test_what_is_next_to_nothing_is_the_cause_of_a_gap_that_is_small_as_well(
    share: float, strays: bool, named: bool
) -> None:
    """A current of 0.011 m/s past a container ship, 7 % of a typical one, which closed 88 % of what was left."""
    entries = (("current",), 0.965, True), ((), 0.035, True)
    said, found = decided(*entries), hypotheses(*entries)
    measured = Measured(closes={"current": share}, strays=strays)
    left = without_tiny(said, found, measured, lambda one: 0.066, SETTINGS, gap=True)
    assert (left == said) == named
    assert named or (left.kind, left.small) == ("unknown", ("current",))
