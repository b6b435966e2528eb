"""Where a fit begins whose runs stray: the equations at the recorded states give the missing force."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any, cast

import boat_case as boat
import numpy as np
import pytest

from seatruth.diagnosis.initial_guess import (
    forces_instead,
    from_equation_error,
    in_all_trials,
    in_each_trial,
    likely_values,
    moved_to,
    started,
    without_effects,
)
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.trials.trial import Trial

SURGE = 0.02
"""m/s2 that act in surge and that the model does not have."""


@pytest.fixture(scope="module")
def pushed() -> list[Trial]:
    """Noise-free trials of a boat on which a constant force acts in surge."""
    runs = boat.trials(boat.Boat(), [{"delta": boat.zigzag(120, 0.2, 15.0)}], headings=[0.0])
    problem = problem_of(runs)
    forces = np.zeros_like(problem.start.forces)
    forces[:, problem.equations.index("u")] = SURGE
    simulated = problem.simulate(Point(problem.start.shared, problem.start.initial, forces))
    return [
        dataclasses.replace(run, outputs={name: y[:, k] for k, name in enumerate(problem.outputs)})
        for run, y in zip(runs, simulated)
    ]


def problem_of(runs: list[Trial]) -> Problem:
    return Problem(boat.study(boat.Boat(), runs), load_effects(["current"]), Settings(knots=5))


def test_the_missing_force_is_near(pushed: list[Trial]) -> None:
    """Terms and coefficients share in it: what counts is that the run is much nearer to its record."""
    problem = problem_of(pushed)
    guess = from_equation_error(problem)
    assert guess is not None
    u = problem.channel_of == problem.outputs.index("u")

    def size(point: Point) -> float:
        return float(np.sqrt(np.mean(problem.errors(point)[u] ** 2)))

    assert size(guess) < 0.2 * size(problem.start)


def test_speeds_that_are_not_recorded_are_taken_from_positions_and_headings(pushed: list[Trial]) -> None:
    """Fits begin nearer to the trials than the declared model, and far nearer than one that begins from rest.

    Without a heading there is nothing to begin from.
    """

    def with_only(names: tuple[str, ...]) -> list[Trial]:
        return [dataclasses.replace(run, outputs={n: run.outputs[n] for n in names}) for run in pushed]

    problem = problem_of(with_only(("x", "y", "psi")))
    begin = from_equation_error(problem)
    assert begin is not None
    at_rest = dataclasses.replace(problem.start, initial=problem.start.initial.copy())
    at_rest.initial[:, problem.initial_names.index("u")] = 0.0
    far, declared, near = (float(np.mean(problem.errors(point) ** 2)) for point in (at_rest, problem.start, begin))
    assert near < declared
    assert near < 0.5 * far
    assert from_equation_error(problem_of(with_only(("y",)))) is None


def test_an_effect_in_the_place_of_forces_leaves_a_run_where_it_was(pushed: list[Trial]) -> None:
    """A force that holds a run near its record makes room for an effect that pushes it the same way."""
    problem = problem_of(pushed)
    begin = from_equation_error(problem)
    assert begin is not None
    values = np.array([0.1, -0.1])
    near = cast(Any, SimpleNamespace(discrepancy=True, point=begin))
    moved = started(problem, near, "current", values)
    assert moved.shared[problem.columns["current"]] == pytest.approx(values)
    alone = Point(moved.shared, begin.initial, begin.forces)

    def far(point: Point) -> float:
        return float(np.abs(problem.errors(point) - problem.errors(begin)).max())

    assert far(moved) < 0.2 * far(alone)


def test_forces_take_the_place_of_an_effect_that_is_left_out(pushed: list[Trial]) -> None:
    problem = problem_of(pushed)
    shared = problem.start.shared.copy()
    shared[problem.columns["current"]] = 0.1, -0.1
    drifting = Point(shared, problem.start.initial, problem.start.forces)
    left_out, replaced = (out(problem, drifting, ["current"]) for out in (without_effects, forces_instead))
    assert (replaced.shared == left_out.shared).all()
    assert (replaced.shared[problem.columns["current"]] == 0.0).all()

    def far(point: Point) -> float:
        return float(np.abs(problem.errors(point) - problem.errors(drifting)).max())

    assert far(replaced) < 0.5 * far(left_out)


@pytest.mark.parametrize("way", ["moved", "started", "without", "instead"])
def test_a_heading_that_is_off_begins_where_its_record_does(pushed: list[Trial], way: str) -> None:
    """A compass half a turn off: the vehicle lies the other way, and the record begins as it did."""
    problem = Problem(boat.study(boat.Boat(), pushed), load_effects(["heading_bias"]), Settings(knots=5))
    half = np.array([np.pi])
    off = moved_to(problem, problem.start, "heading_bias", half)
    near = cast(Any, SimpleNamespace(discrepancy=True, point=problem.start))
    to = {
        "moved": lambda: off,
        "started": lambda: started(problem, near, "heading_bias", half),
        "without": lambda: without_effects(problem, off, ["heading_bias"]),
        "instead": lambda: forces_instead(problem, off, ["heading_bias"]),
    }
    point, psi = to[way](), problem.initial_names.index("psi")
    turned = np.pi if way in ("moved", "started") else 0.0
    assert problem.start.initial[:, psi] - point.initial[:, psi] == pytest.approx(turned)
    column = problem.outputs.index("psi")
    first = problem.simulate(point)[0][0, column], problem.simulate(problem.start)[0][0, column]
    assert first[0] == pytest.approx(first[1])


def test_a_heading_far_off_is_likely_where_its_track_says(pushed: list[Trial]) -> None:
    turned = [dataclasses.replace(run, outputs={**run.outputs, "psi": run.outputs["psi"] + 2.0}) for run in pushed]
    for runs, expected in ((turned, [2.0]), (pushed, [])):
        problem = Problem(boat.study(boat.Boat(), runs), load_effects(["heading_bias", "current"]), Settings(knots=5))
        found = [values[0] for values in likely_values(problem, "heading_bias", shown=True)]
        assert found == pytest.approx(expected, abs=0.1)
        assert likely_values(problem, "current") == []


def test_values_of_each_trial_and_back_keep_their_mean_and_their_first_samples(pushed: list[Trial]) -> None:
    runs = [dataclasses.replace(run, name=f"run_{k}") for run in pushed for k in range(3)]
    names = [run.name for run in runs]
    own = [effect.of_trials(names) for effect in load_effects(["heading_bias", "trial_heading_bias"])]
    problem = Problem(boat.study(boat.Boat(), runs), own, Settings(knots=5))
    psi = problem.initial_names.index("psi")
    off = moved_to(problem, problem.start, "trial_heading_bias", np.array([0.0, 0.3, -0.6]))
    assert (problem.start.initial - off.initial)[:, psi] == pytest.approx([0.0, 0.3, -0.6])
    same = in_all_trials(problem, off, "trial_heading_bias", "heading_bias")
    assert same.shared[problem.columns["heading_bias"]] == pytest.approx(-0.1)
    assert (same.shared[problem.columns["trial_heading_bias"]] == 0.0).all()
    assert (problem.start.initial - same.initial)[:, psi] == pytest.approx([-0.1] * 3)
    back = in_each_trial(problem, same, "heading_bias", "trial_heading_bias")
    assert back.shared[problem.columns["trial_heading_bias"]] == pytest.approx([-0.1] * 3)
