"""Standard errors of sizes, where trials agree about them and where they do not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import boat_case as boat
import numpy as np
import pytest
import small_case as small

import seatruth.diagnosis.size_errors as module
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.hypothesis_fits import fit_once
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.size_errors import disagreement, is_sure, is_told, size_errors, sizes_of
from seatruth.diagnosis.sizes import first_sizes, noise_prior
from seatruth.diagnosis.tempering import tempered_deviation
from seatruth.effects import available
from seatruth.trials.trial import Trial

KEY = ("rudder_offset",)


@pytest.fixture(scope="module")
def found(ship_folder: Path, offset_runs: list[Trial]) -> Search:
    return search(small.problem(ship_folder, offset_runs), small.silent)


def test_trials_of_the_right_model_agree(found: Search) -> None:
    problem, fit = found.problem, found.fits[KEY, False]
    shared = [*problem.coefficients, *problem.columns["rudder_offset"]]
    assert (disagreement(problem, fit)[shared] < 2.0).all()
    # What is fixed has no error, nor do trials say anything of it.
    fixed = np.setdiff1d(np.arange(len(problem.unknowns)), shared)
    assert np.isnan(disagreement(problem, fit)[fixed]).all()
    assert (size_errors(problem, fit)[fixed] == 0.0).all()


@pytest.mark.slow
def test_the_moves_are_what_their_variance_says_where_the_model_is_right(ship_folder: Path) -> None:
    """Over twelve draws of the noise the mean square is 1, and its standard error 0.2."""
    squares = []
    for seed in range(12):
        runs = small.trials(ship_folder, {"rudder_offset_angle": small.OFFSET}, specs=["rudder_offset"], seed=seed)
        problem = small.problem(ship_folder, runs, KEY)
        again = Search(problem, noise_prior(problem))
        fit = fit_once(again, KEY, False, problem.start, first_sizes(problem, again.known))
        assert fit is not None
        squares += (disagreement(problem, fit)[problem.columns["rudder_offset"]] ** 2).tolist()
    assert 0.5 < np.mean(squares) < 1.6


def test_trials_that_ask_for_other_sizes_make_the_error_as_large_as_they_differ(
    ship_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rudder that stands off by 0.01, 0.02 and 0.03 rad: the mean is known to 0.004, and noise alone says 0.0002."""
    runs = []
    for number, angle in enumerate((0.01, 0.03, 0.02, 0.02)):
        made = small.trials(ship_folder, {"rudder_offset_angle": angle}, specs=["rudder_offset"])
        runs.append(made[number])
    mixed = search(small.problem(ship_folder, runs, KEY), small.silent)
    problem, fit = mixed.problem, mixed.fits[KEY, False]
    (column,) = problem.columns["rudder_offset"]
    error = size_errors(problem, fit)[column]
    # Beside missing forces an effect is as sure as these errors, of four trials, are: from 5.84 of them (Student's t
    # with three degrees of freedom at the level 0.01), not from 2.58.
    beside = replace(fit, discrepancy=True)
    assert 2.58 < fit.point.shared[column] / error < 5.84
    assert is_sure(problem, fit, "rudder_offset")
    assert not is_sure(problem, beside, "rudder_offset")
    offset = problem.columns["rudder_offset"]
    for errors, sure in ((5.7, False), (6.0, True)):
        shared = fit.point.shared.copy()
        shared[offset] = errors * error
        moved = replace(beside, point=replace(fit.point, shared=shared))
        assert is_sure(problem, moved, "rudder_offset") == sure
    # What no trial makes less must be as small beside it: 2.57 errors of both together.
    for part, sure in ((0.3, True), (0.45, False)):
        monkeypatch.setattr(module, "drift_error", lambda *others, part=part: part)
        assert is_sure(problem, moved, "rudder_offset") == sure
    temperature = problem.settings.size_temperature
    assert error > 2.0 * tempered_deviation(fit.stderr(problem), problem.sd, temperature)[column]
    assert abs(fit.point.shared[column] - 0.02) < 2.0 * error < 0.02


def test_a_size_within_its_reported_error_is_not_told_from_none(found: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    problem, fit = found.problem, found.fits[KEY, False]
    (column,) = problem.columns["rudder_offset"]
    least = np.sqrt(problem.settings.least_noncentrality / problem.settings.size_temperature)
    assert is_told(problem, fit, "rudder_offset")
    own = fit.stderr(problem)
    for errors, told in ((0.9 * least, False), (1.1 * least, True)):
        wide = own.copy()
        wide[column] = abs(fit.point.shared[column]) / errors
        monkeypatch.setattr(module, "size_errors", lambda *_, wide=wide: wide)
        assert is_told(problem, fit, "rudder_offset") == told


def test_a_single_trial_agrees_with_itself(ship_folder: Path, offset_runs: list[Trial]) -> None:
    alone = search(small.problem(ship_folder, offset_runs[:1], KEY), small.silent)
    problem, fit = alone.problem, alone.fits[KEY, False]
    assert np.isnan(disagreement(problem, fit)).all()
    expected = tempered_deviation(fit.stderr(problem), problem.sd, problem.settings.size_temperature)
    assert size_errors(problem, fit) == pytest.approx(expected)


def test_how_fast_a_wind_is_stays_as_open_as_the_area_that_it_blows_on() -> None:
    """By the root of the area, of which ln is known to 0.4 where it follows from the ship's dimensions."""
    model = boat.Hull()
    runs = boat.trials(
        model,
        [{"delta": boat.zigzag(80, 0.3, 12.0)} for _ in range(2)],
        headings=(0.0, 2.0),
        effects={"wind_north": 4.0, "wind_east": 3.0},
        specs=[available()["wind"]],
    )
    problem = Problem(boat.study(model, runs), [available()["wind"]], Settings(), threads=1)
    again = Search(problem, noise_prior(problem))
    at = problem.start.shared.copy()
    at[problem.columns["wind"][:2]] = 4.0, 3.0
    fit = fit_once(again, ("wind",), False, replace(problem.start, shared=at), first_sizes(problem, again.known))
    assert fit is not None
    found = {q.name: q for q in sizes_of(problem, fit, "wind")}
    plain = size_errors(problem, fit)[problem.columns["wind"]]
    for q, own in zip(found.values(), plain):
        part = 0.2 if q.name in ("north", "east") else 0.0
        assert q.systematic_error == pytest.approx(part * abs(q.value))
        assert q.stderr == pytest.approx(np.hypot(own, q.systematic_error))
        assert (q.value - q.lower, q.upper - q.value) == pytest.approx((1.96 * q.stderr, 1.96 * q.stderr))
    assert found["north"].systematic_error > 0.4


@pytest.mark.parametrize(("lacking", "part"), [(True, 0.05), (False, 0.0)])
def test_what_shows_by_forces_is_as_open_as_their_form_where_the_model_lacks_something(
    found: Search, lacking: bool, part: float
) -> None:
    """Of an ROV's thruster 15 % weak, beside forces of another form, -0.135 +- 0.005."""
    fit = found.fits[KEY, True]
    (q, *_) = sizes_of(found.problem, fit, KEY[0], lacking=lacking)
    own = size_errors(found.problem, fit)[found.problem.columns[KEY[0]][0]]
    assert q.systematic_error == pytest.approx(part * abs(q.value - q.null))
    assert q.stderr == pytest.approx(np.hypot(own, q.systematic_error))
