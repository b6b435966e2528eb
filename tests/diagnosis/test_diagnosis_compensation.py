"""Missing forces that take the place of others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.compensation import along, can_compensate, compensated
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.unknowns import Solution
from seatruth.trials.trial import Trial


@pytest.fixture(scope="module")
def problem(ship_folder: Path, plain_runs: list[Trial]) -> Problem:
    """With a knot every two seconds: the rudder moves in steps."""
    return small.problem(ship_folder, plain_runs, settings=Settings(knots=60))


def changed(problem: Problem, gain: float, offset: float) -> np.ndarray:
    """The shared unknowns with another rudder gain and a rudder that stands off."""
    shared = problem.start.shared.copy()
    shared[[q.name for q in problem.unknowns].index("K")] *= gain
    shared[problem.columns["rudder_offset"]] = offset
    return shared


def test_each_run_stays_where_it_was(problem: Problem) -> None:
    """A gain half as large and an offset would drive each run far away."""
    assert can_compensate(problem)
    start = problem.start
    shared = changed(problem, 0.5, 0.05)
    alone = Point(shared, start.initial, start.forces)
    before = problem.errors(start)
    astray = np.abs(problem.errors(alone) - before)
    left = np.abs(problem.errors(compensated(problem, start, shared)) - before)
    for c in range(len(problem.outputs)):
        own = problem.channel_of == c
        assert left[own].max() < 0.1 * astray[own].max()


def test_what_bends_is_taken_from_the_forces_and_the_slope_is_not(problem: Problem) -> None:
    """The gain is linear in the rate, its time constant is not."""
    start, names = problem.start, [q.name for q in problem.unknowns]

    def beyond(name: str, part: float) -> float:
        shared, local = np.zeros(len(names)), np.zeros((len(problem.trials), len(problem.local_offset(start)[0])))
        shared[names.index(name)] = 0.5 * start.shared[names.index(name)]
        whole = Solution(shared, np.zeros(0, dtype=np.intp), np.zeros((0, 0)), local)
        to = along(problem, start, whole)(part)
        plain = problem.moved(start, shared, local, part)
        np.testing.assert_array_equal(to.shared, plain.shared)
        return float(np.abs(to.forces - plain.forces).max())

    assert beyond("K", 1.0) < 1e-6 * beyond("T", 1.0)
    assert beyond("T", 0.01) == pytest.approx(1e-4 * 1.5 * beyond("T", 1.0), rel=0.05)


def test_a_step_of_what_bends_goes_further_with_it(problem: Problem) -> None:
    """To a time constant three times as long, with the forces that the slope asks for beside it."""
    start, names = problem.start, [q.name for q in problem.unknowns]
    shared = np.zeros(len(names))
    shared[names.index("T")] = 2.0 * start.shared[names.index("T")]
    bent = start.shared + shared
    slope = compensated(problem, start, start.shared + 1e-3 * shared).forces * 1e3
    local = np.concatenate([np.zeros_like(start.initial), slope.reshape(len(problem.trials), -1)], axis=1)
    whole = Solution(shared, np.zeros(0, dtype=np.intp), np.zeros((0, 0)), local)
    before = problem.errors(start)
    plain = np.abs(problem.errors(Point(bent, start.initial, slope)) - before).max()
    assert np.abs(problem.errors(along(problem, start, whole)(1.0)) - before).max() < 0.1 * plain


def test_each_run_moves_as_the_slope_has_it_though_its_motion_changes(problem: Problem) -> None:
    """The time constant divides the rate of turn, which changes with it: a product of two changes."""
    start, names = problem.start, [q.name for q in problem.unknowns]
    shared, local = np.zeros(len(names)), np.zeros((len(problem.trials), len(problem.local_offset(start)[0])))
    shared[names.index("T")] = 2.0 * start.shared[names.index("T")]
    at = problem.linearize(start, ())
    straight = at.errors + at.shared @ shared
    plain = np.abs(problem.errors(problem.moved(start, shared, local)) - straight)
    whole = Solution(shared, np.zeros(0, dtype=np.intp), np.zeros((0, 0)), local)
    left = np.abs(problem.errors(along(problem, start, whole)(1.0)) - straight)
    for c in range(len(problem.outputs)):
        own = problem.channel_of == c
        assert left[own].max() < 0.05 * plain[own].max()
