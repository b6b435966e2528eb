"""How far runs grow apart along a record: exact for a linear vehicle, the same for any length of pieces."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from small_case import SHIP, rudders

import seatruth.sample
from seatruth.diagnosis import search as searching
from seatruth.diagnosis.growth import Growth
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.models import load_model
from seatruth.storage.checkpoint import Checkpoint
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

T = 10.0


def problem_of(folder: Path, time_constant: float, step: float = 1.0) -> Problem:
    """A vehicle whose rate of turn grows by exp(t / time_constant), and a small record, as a pilot makes it."""
    (folder / "ship.py").write_text(SHIP.replace("- s.r) / p.T", "+ s.r) / p.T").replace("min=1.0,", "min=1e-99,"))
    model = load_model("ship.py:Nomoto", folder)
    t, angles = rudders(step=step)
    rng = np.random.default_rng(1)
    runs = [
        Trial(f"run {k}", t, {"delta": delta}, {"r": 0.01 * rng.normal(size=t.size), "psi": rng.normal(size=t.size)})
        for k, delta in enumerate(angles)
    ]
    parameters = tuple(p.replace(value=time_constant) if p.name == "T" else p for p in model.parameters)
    return Problem(Study(name="held", model=model, trials=Trials(runs), parameters=parameters), [], Settings())


def expected(problem: Problem, seconds: float, time_constant: float) -> float:
    """The largest singular value of the transition from the start to the end, in the spreads of the record."""
    r, psi = (np.concatenate([trial.outputs[name] for trial in problem.trials]).std() for name in ("r", "psi"))
    grown = math.exp(seconds / time_constant)
    return float(np.linalg.norm([[grown, 0.0], [time_constant * (grown - 1.0) * r / psi, 1.0]], ord=2))


@pytest.mark.parametrize("step", [1.0, 0.25])
def test_growth_over_trials_and_sections_is_that_of_the_linear_vehicle(tmp_path: Path, step: float) -> None:
    problem = problem_of(tmp_path, T, step)
    growth, last = Growth(problem), 120.0 - step
    assert growth.over(1) == pytest.approx(expected(problem, last, T), rel=1e-3)
    assert len(growth.over(4)) == 4 * len(problem.trials)
    # A section of whole pieces may be one of them longer or shorter.
    piece = max(5 * step, 1.2)
    low, high = (expected(problem, last / 4 + more, T) for more in (-piece, piece))
    assert low < growth.over(4).min() <= growth.over(4).max() < high


def test_a_vehicle_that_holds_its_course_is_not_cut_and_one_that_a_pilot_holds_is(tmp_path: Path) -> None:
    steady, held = Growth(problem_of(tmp_path, 60.0)), Growth(problem_of(tmp_path, T, 0.25))
    assert not steady.is_too_far
    assert held.is_too_far
    # exp(120 / 10) in all: three sections would let errors grow by 55 each, two by 400.
    assert held.sections == 3
    assert Growth(problem_of(tmp_path, 2.0, 2.0)).sections == 2  # as many as 60 samples allow


def test_a_coarser_trial_and_a_piece_that_diverges_do_no_harm(tmp_path: Path) -> None:
    problem = problem_of(tmp_path, T)
    finer = Growth(problem).over(1)
    problem.trials = Trials([problem.trials[0].samples(np.arange(0, 120, 20)), *list(problem.trials)[1:]])
    assert Growth(problem).over(1)[1:] == pytest.approx(finer[1:], rel=1e-3)
    diverging = Growth(problem_of(tmp_path, 1e-90))
    assert np.isfinite(diverging.over(1)).all()


def test_trials_along_which_runs_part_are_cut_before_anything_is_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a vehicle held by its pilot, four minutes of fits to whole trials ended in a false answer."""
    problem = Problem(seatruth.sample.load("diagnose.toml"), load_effects(["current"]), Settings())
    assert not Growth(problem).is_too_far
    fitted: list[int] = []
    monkeypatch.setattr(searching, "fit_null", lambda found, _: fitted.append(found.problem.settings.sections))
    for too_far, sections in ((False, [1]), (True, [2])):
        fitted.clear()
        monkeypatch.setattr(Growth, "is_too_far", property(lambda _: too_far))  # noqa: B023
        monkeypatch.setattr(Growth, "sections", property(lambda _: 2))
        searching._begun(problem, Checkpoint(None, ""), lambda *_: None, 10, may_cut=True)
        assert fitted == sections
