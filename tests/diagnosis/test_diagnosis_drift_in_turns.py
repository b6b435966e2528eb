"""Errors of a position that a model with another drift in turns shows as well."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from boat_case import Boat, study, trials, zigzag
from decided_by_hand import decided, hypotheses

from seatruth.diagnosis.drift_in_turns import drift_error, look_like_drift, without_drift
from seatruth.diagnosis.initial_guess import moved_to
from seatruth.diagnosis.parts import Fold, Validation
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.models import Dimensions

EFFECTS = ("position_lever_arm", "position_delay", "heading_bias", "current")


@pytest.fixture(scope="module")
def problem() -> Problem:
    """Of a boat that slides outward by 2 m/s for each rad/s of its turn."""
    runs = trials(Boat(), [{"delta": zigzag(120, 0.2, 20.0)}, {"delta": zigzag(120, 0.1, 40.0)}], headings=(0.0, 1.0))
    return Problem(study(Boat(), runs), load_effects(EFFECTS), Settings())


def like(problem: Problem, name: str, values: Mapping[str, float]) -> list[str]:
    at = moved_to(problem, problem.start, name, problem.mean[problem.columns[name]] * 0.0 + [*values.values()])
    return look_like_drift(problem, cast(Any, SimpleNamespace(point=at)), EFFECTS)


@pytest.mark.parametrize(
    ("name", "values", "found"),
    [
        ("position_lever_arm", {"forward": 0.15, "starboard": 0.0}, True),  # 0.15 of 2 m
        ("position_lever_arm", {"forward": -0.15, "starboard": 0.02}, True),
        ("position_lever_arm", {"forward": 0.5, "starboard": 0.0}, False),  # more than a model is wrong by
        ("position_lever_arm", {"forward": 0.05, "starboard": 0.15}, False),  # abeam: no drift shows that
        ("position_delay", {"tau": 0.07}, True),  # 0.14 m astern at 2 m/s
        ("position_delay", {"tau": 0.5}, False),
        ("heading_bias", {"b": 0.05}, False),
    ],
)
def test_small_places_ahead_and_delays_look_like_drift(
    problem: Problem, name: str, values: dict[str, float], found: bool
) -> None:
    assert [q.name for q in problem.effects[name].parameters] == [*values]
    assert like(problem, name, values) == ([name] if found else [])


def test_what_is_no_error_of_a_sensor_does_not(problem: Problem) -> None:
    assert like(problem, "current", {"north": 0.01, "east": 0.0}) == []
    assert look_like_drift(problem, None, EFFECTS) == []


def test_it_is_not_named_where_the_model_lacks_something_and_the_gap_does_not_surely_shrink() -> None:
    entries = (("position_delay",), 0.95, True), ((), 0.05)
    said, found = decided(*entries), hypotheses(*entries)
    fold = Fold("turn", ("position_delay",), 3.0, 2.5, 1.3, 1.3, 1.0, 0.1, 5.0)

    def left(lower: float, like: tuple[str, ...] = ("position_delay",)) -> Any:
        return without_drift(said, found, like, lambda key: Validation((fold,), 0.1, lower, 0.3, 0.0))

    assert (left(-0.1).kind, left(-0.1).clusters, left(-0.1).drift) == ("unknown", (), ("position_delay",))
    assert left(0.05) == said
    assert left(-0.1, ()) == said
    alone = decided((("position_delay",), 0.95), ((), 0.05))
    assert without_drift(alone, found, ("position_delay",), lambda key: None) == alone


def test_an_antenna_does_not_stay_for_what_it_predicts() -> None:
    """Of a boat with 12 % more mass an arm of 0.22 m closed 28 % of the gap, surely more than 1 %."""
    entries = (("position_lever_arm",), 0.95, True), ((), 0.05)
    said, found = decided(*entries), hypotheses(*entries)
    fold = Fold("turn", ("position_lever_arm",), 3.0, 2.5, 1.3, 1.3, 1.0, 0.1, 5.0)
    left = without_drift(said, found, ("position_lever_arm",), lambda key: Validation((fold,), 0.28, 0.01, 0.56, 0.0))
    assert (left.kind, left.drift) == ("unknown", ("position_lever_arm",))


class Long(Boat):
    """The boat with its length, 6 m; its model has hardly any drift about the origin."""

    name = "long"

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(6.0, 2.0, 0.4, 1000.0, 1000.0)


def test_an_arm_of_a_part_of_the_length_looks_like_drift_too() -> None:
    runs = trials(Long(), [{"delta": zigzag(120, 0.2, 20.0)}, {"delta": zigzag(120, 0.1, 40.0)}], headings=(0.0, 1.0))
    of = Problem(study(Long(), runs), load_effects(EFFECTS), Settings())
    assert like(of, "position_lever_arm", {"forward": 0.33, "starboard": 0.0}) == ["position_lever_arm"]
    assert like(of, "position_lever_arm", {"forward": 0.39, "starboard": 0.0}) == []
    assert like(of, "position_delay", {"tau": 0.16}) == []
    at = moved_to(of, of.start, "position_lever_arm", of.mean[of.columns["position_lever_arm"]] * 0.0 + [0.5, 0.0])
    seen = cast(Any, SimpleNamespace(point=at, discrepancy=True))
    assert drift_error(of, seen, "position_lever_arm") == 0.0  # v is recorded


def test_a_planing_craft_drifts_less_as_its_model_says() -> None:
    """Of two boats antennas that were where the study had them were 0.2 to 0.6 of the length off, at 96 to 99 %."""
    inputs = [{"delta": zigzag(120, 0.2, 20.0)}, {"delta": zigzag(120, 0.1, 40.0)}]
    size = Long.dimensions(None).length

    def found(boat: type[Boat], part: float, size: float = size) -> list[str]:
        of = Problem(study(boat(), trials(boat(), inputs, headings=(0.0, 1.0))), load_effects(EFFECTS), Settings())
        return like(of, "position_lever_arm", {"forward": part * size, "starboard": 0.0})

    assert found(Skimming, 0.35) == ["position_lever_arm"]
    assert found(Skimming, 0.45) == []
    assert found(Logged, 0.35) == [], "where the speed abeam is recorded, it shows the drift"
    # So does a ship that is as fast: of a workboat an antenna that stood in its place was 1.45 m ahead, at 96.8 %.
    assert found(Fast, 0.35, 1.5) == ["position_lever_arm"]
    assert found(Slow, 0.35) == []


def test_what_stands_beside_it_stays() -> None:
    entries = (("heading_bias", "position_delay"), 0.97, True), ((), 0.03)
    said = decided(*entries)
    left = without_drift(said, hypotheses(*entries), ("position_delay",), lambda key: None)
    assert ([one.effects for one in left.clusters], left.shown) == ([("heading_bias",)], ("heading_bias",))
    assert left.drift == ("position_delay",)


class Tracked(Boat):
    """The boat as most logs have it: without its speed abeam."""

    name = "tracked"
    outputs = tuple(channel for channel in Boat.outputs if channel.name != "v")

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return y.u, 0.0, y.r, y.psi, y.x, y.y


class Skimming(Tracked):
    """A planing boat of the same length as the long one."""

    name, kind = "skimming", "planing"
    dimensions = staticmethod(Long.dimensions)


class Slow(Skimming):
    """The same as a ship, at a quarter of the speed of a wave of its length."""

    name, kind = "slow", "ship"


class Fast(Slow):
    """A short ship, at half of that speed: 2 m/s over 1.5 m."""

    name = "fast"

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(1.5, 0.5, 0.1, 15.0, 1000.0)


class Logged(Skimming):
    """The same with its speed abeam."""

    name = "logged"
    outputs = Boat.outputs


def test_the_usual_error_of_the_drift_stays_in_an_arm_and_a_delay() -> None:
    """A drift of about 2 m/s for each rad/s shows as an arm of 2 m: 0.03 of it is 0.06 m, 0.06 of it 0.06 s."""
    inputs = [{"delta": zigzag(120, 0.2, 20.0)}, {"delta": zigzag(120, 0.1, 40.0)}]
    problem = Problem(
        study(Tracked(), trials(Tracked(), inputs, headings=(0.0, 1.0))), load_effects(EFFECTS), Settings()
    )

    def part(name: str, values: Mapping[str, float], discrepancy: bool = True, of: Problem = problem) -> float:
        at = moved_to(of, of.start, name, of.mean[of.columns[name]] * 0.0 + [*values.values()])
        return drift_error(of, cast(Any, SimpleNamespace(point=at, discrepancy=discrepancy)), name)

    arm = {"forward": 0.5, "starboard": 0.0}
    assert part("position_lever_arm", arm) * 0.5 == pytest.approx(0.06, rel=0.2)
    assert part("position_delay", {"tau": 0.5}) * 0.5 == pytest.approx(0.06, rel=0.2)
    assert part("position_lever_arm", arm, discrepancy=False) == 0.0  # the model lacks nothing
    assert part("position_lever_arm", {"forward": 0.05, "starboard": 0.5}) == 0.0  # no drift is abeam
    assert part("position_lever_arm", {"forward": 0.0, "starboard": 0.0}) == 0.0
    assert part("heading_bias", {"b": 0.05}) == part("current", {"north": 0.1, "east": 0.0}) == 0.0
    seen = Problem(study(Boat(), trials(Boat(), inputs, headings=(0.0, 1.0))), load_effects(EFFECTS), Settings())
    assert part("position_lever_arm", arm, of=seen) == 0.0  # the trials show the drift itself
    # A model that has the speed abeam shows nothing of it where no trial records it.
    bare = [replace(run, outputs={**run.outputs, "v": np.full(len(run), np.nan)}) for run in seen.trials]
    unseen = Problem(study(Boat(), bare), load_effects(EFFECTS), Settings())
    assert part("position_lever_arm", arm, of=unseen) * 0.5 == pytest.approx(0.06, rel=0.2)
