"""The start from the equations at the recorded motion."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import boat_case as boat
import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.initial_guess import from_equation_error
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.trials.trial import Trial

INPUTS = [{"delta": boat.zigzag(200, 0.2, 17.0)}, {"delta": np.full(200, 0.15)}]
FAR = {"K": 0.2, "T": 4.5, "U": 2.3}


@pytest.fixture(scope="module")
def problem() -> Problem:
    """Runs of a boat whose coefficients are three prior deviations from those declared."""
    runs = boat.trials(boat.Boat(), INPUTS, headings=(0.0, 2.0), effects=FAR)
    return Problem(boat.study(boat.Boat(), runs), load_effects(("gyro_bias",)), Settings(), threads=1)


def distance(problem: Problem, errors: np.ndarray) -> float:
    deviation = np.array([boat.NOISE[name] for name in problem.outputs])
    return float(np.sqrt(np.mean((errors / deviation[problem.channel_of]) ** 2)))


def test_runs_come_nearer_to_their_records(problem: Problem) -> None:
    guess = from_equation_error(problem)
    assert guess is not None
    assert distance(problem, problem.errors(guess)) < 0.3 * distance(problem, problem.errors(problem.start))


def test_it_keeps_bounds_and_initial_states(problem: Problem) -> None:
    guess = from_equation_error(problem)
    assert guess is not None
    assert (guess.shared >= problem.low).all()
    assert (guess.shared <= problem.high).all()
    np.testing.assert_array_equal(guess.initial, problem.start.initial)
    (bias,) = problem.columns["gyro_bias"]
    assert guess.shared[bias] == 0.0


def test_a_missing_force_goes_to_discrepancy(ship_folder: Path, offset_runs: list[Trial]) -> None:
    """A rudder that stands off asks for a constant yaw acceleration, as terms or as functions of time."""
    problem = small.problem(ship_folder, offset_runs, ("gyro_bias",))
    guess = from_equation_error(problem)
    assert guess is not None
    assert np.isfinite(problem.errors(guess)).all()
    before, after = problem.errors(problem.start), problem.errors(guess)
    heading = problem.channel_of == problem.outputs.index("psi")
    assert np.abs(after[heading]).max() < 0.5 * np.abs(before[heading]).max()


def test_none_without_recorded_speeds(ship_folder: Path, offset_runs: list[Trial]) -> None:
    bare = [dataclasses.replace(t, outputs={"psi": t.outputs["psi"]}) for t in offset_runs]
    study = small.study(ship_folder, bare)
    problem = Problem(study, load_effects(("heading_bias",)), Settings(), threads=1)
    assert from_equation_error(problem) is None
