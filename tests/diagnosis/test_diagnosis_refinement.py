"""How finely the forces of each trial follow time."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis import refinement
from seatruth.diagnosis.discrepancy.model import hats
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.hypothesis_fits import fit_null
from seatruth.diagnosis.problem import Point
from seatruth.diagnosis.refinement import between, refine
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import noise_prior
from seatruth.trials.trial import Trial


def gusty(folder: Path, runs: list[Trial], knots: int, size: float) -> list[Trial]:
    """The trials with a moment of each one's own, random straight lines between so many knots (rad/s2)."""
    problem = small.problem(folder, runs, settings=Settings(knots=knots))
    rng = np.random.default_rng(3)
    start = problem.start
    pushed = problem.simulate(Point(start.shared, start.initial, rng.normal(0.0, size, start.forces.shape)))
    still = problem.simulate(start)
    return [
        dataclasses.replace(trial, outputs={c: trial.outputs[c] + (a - b)[:, k] for k, c in enumerate(problem.outputs)})
        for trial, a, b in zip(runs, pushed, still, strict=True)
    ]


def fitted(folder: Path, runs: list[Trial]) -> Search:
    """The model alone."""
    problem = small.problem(folder, runs, settings=Settings(knots=6))
    found = Search(problem, noise_prior(problem))
    fit_null(found)
    return found


def test_more_knots_hold_the_same_broken_line() -> None:
    forces = np.random.default_rng(1).normal(size=(2, 3, 5))
    t = np.linspace(0.0, 8.0, 33)
    assert np.allclose(hats(t, 1.0, 9) @ between(forces)[1, 2], hats(t, 2.0, 5) @ forces[1, 2])


def test_quick_forces_get_more_knots_and_less_is_taken_for_noise(ship_folder: Path, plain_runs: list[Trial]) -> None:
    runs = gusty(ship_folder, plain_runs, 21, 0.002)
    coarse, tried = fitted(ship_folder, runs), list[int]()
    fine = refine(coarse, tried.append)
    assert tried[0] == 11
    assert fine.problem.settings.knots >= 21
    assert fine.null.evidence > coarse.null.evidence + 50.0
    rate = fine.problem.outputs.index("r")
    assert np.exp(fine.null.sizes.white[rate]) == pytest.approx(small.NOISE["r"], rel=0.3)
    assert set(fine.fits) == set(coarse.fits), "with discrepancy and without"
    assert fine.fits[(), False].evidence == pytest.approx(coarse.fits[(), False].evidence, abs=0.5)


def test_where_forces_explain_little_their_spacing_is_left(ship_folder: Path, plain_runs: list[Trial]) -> None:
    coarse, tried = fitted(ship_folder, plain_runs), list[int]()
    assert refine(coarse, tried.append) is coarse
    assert not tried


def test_a_finer_spacing_that_promises_nothing_is_not_fitted(
    ship_folder: Path, plain_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forces as slow as the spacing: they explain much, and finer ones no more."""
    coarse, tried = fitted(ship_folder, gusty(ship_folder, plain_runs, 6, 0.002)), list[int]()
    assert coarse.null.evidence > coarse.fits[(), False].evidence + 100.0

    def never(*_: Any) -> None:
        raise AssertionError("it was fitted")

    monkeypatch.setattr(refinement, "_loose", never)
    assert refine(coarse, tried.append) is coarse
    assert tried == [11]


def test_a_finer_spacing_whose_fit_does_not_converge_is_not_taken(
    ship_folder: Path, plain_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six unstable runs of a model ship: over 45 knots no fit converged, and nothing could be named."""
    coarse, tried = fitted(ship_folder, gusty(ship_folder, plain_runs, 21, 0.002)), list[int]()
    loose = refinement._loose

    def short(*arguments: Any) -> Fit | None:
        got = loose(*arguments)
        return None if got is None else dataclasses.replace(got, settled=False)

    monkeypatch.setattr(refinement, "_loose", short)
    assert coarse.fits[(), True].settled
    assert refine(coarse, tried.append) is coarse
    assert tried == [11, 21, 41], "a finer one yet might converge"
    tried.clear()
    little = coarse.fits[(), True].evidence + 12.0
    monkeypatch.setattr(
        refinement, "_loose", lambda *a: dataclasses.replace(coarse.fits[(), True], settled=False, evidence=little)
    )
    assert refine(coarse, tried.append) is coarse
    assert tried == [11], "it brings too little for a finer one"


def test_the_search_goes_on_with_the_finer_forces(ship_folder: Path, plain_runs: list[Trial]) -> None:
    runs = gusty(ship_folder, plain_runs, 23, 0.002)
    found = search(small.problem(ship_folder, runs), small.silent)
    assert found.problem.settings.knots > Settings().knots
    assert all(fit.point.forces.shape[2] == found.problem.settings.knots for fit in found.fits.values())
