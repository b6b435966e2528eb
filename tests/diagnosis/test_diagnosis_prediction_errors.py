"""Errors of trials left out, relative to noise and what the others leave open."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.prediction_errors import PredictionErrors, Simulated, moved, noise_deviation
from seatruth.diagnosis.problem import Point
from seatruth.diagnosis.search import search
from seatruth.diagnosis.sizes import noise_shapes
from seatruth.trials.trial import Trial

OFFSET = ("rudder_offset",)


@pytest.fixture(scope="module")
def found(ship_folder: Path, offset_runs: list[Trial]) -> Search:
    return search(small.problem(ship_folder, offset_runs), small.silent)


@pytest.fixture(scope="module")
def named(found: Search) -> Simulated:
    return Simulated.of(found.problem, found.fits[OFFSET, False])


def measure(found: Search, left: int, named: Simulated) -> PredictionErrors:
    others = [k for k in range(len(found.problem.trials)) if k != left]
    return PredictionErrors(found.problem, noise_deviation(found.problem, found.leader.sizes), left, others, named)


def at_the_others(found: Search, fit: Fit, left: int) -> Point:
    """Where the other trials alone put the fit."""
    others = [k for k in range(len(found.problem.trials)) if k != left]
    step = fit.likelihood.shared_step(fit.sizes, fit.effects, others)
    return found.problem.moved(fit.point, step.shared, np.zeros_like(fit.point.initial))


@pytest.mark.parametrize("left", range(4))
def test_the_error_is_that_of_dense_algebra_on_a_simulation(found: Search, named: Simulated, left: int) -> None:
    problem, fit = found.problem, named.fit
    deviation = noise_deviation(problem, found.leader.sizes)
    here = problem.trial_of == left
    weight = 1.0 / deviation[problem.channel_of[here]]
    others = [k for k in range(len(problem.trials)) if k != left]
    known = fit.likelihood.shared_step(fit.sizes, fit.effects, others)
    about = problem.linearize(fit.point, fit.effects, discrepancy=False)
    starts = about.local[here] * weight[:, None]
    spread = about.shared[here][:, known.free] * weight[:, None]
    errors = problem.errors(at_the_others(found, fit, left))[here] * weight
    # The first state is free: a wide prior of it in the covariance says the same as another first state.
    wide = starts @ np.diag(problem.initial_sd**2) @ starts.T
    covariance = np.eye(len(errors)) + wide + spread @ known.covariance @ spread.T
    expected = math.sqrt(errors @ np.linalg.solve(covariance, errors) / len(errors))
    assert measure(found, left, named).of(named) == pytest.approx(expected, rel=0.01)


def test_with_the_effect_that_acts_only_noise_is_left(found: Search, named: Simulated) -> None:
    plain = Simulated.of(found.problem, found.fits[(), False])
    noise = []
    for left in range(4):
        errors = measure(found, left, named)
        noise.append(errors.noise(found.leader))
        assert errors.of(named) == pytest.approx(noise[-1], rel=0.03)
        assert errors.of(plain) > errors.of(named)
    assert np.mean(noise) == pytest.approx(1.0, abs=0.1)  # 960 samples scatter by 0.023


def test_what_the_others_leave_open_is_no_error(found: Search, named: Simulated) -> None:
    """Unknowns as far off as the others allow bring hardly anything; of what lies far beyond, nearly all shows."""
    problem, left = found.problem, 0
    errors = measure(found, left, named)
    known = named.fit.likelihood.shared_step(named.fit.sizes, named.fit.effects, [1, 2, 3])
    values, vectors = np.linalg.eigh(known.covariance)
    one = np.zeros(len(named.fit.likelihood.columns))
    one[np.isin(named.fit.likelihood.columns, known.free)] = vectors[:, -1] * math.sqrt(float(values[-1]))

    def moved(times: float, errors_before: float = 1.0) -> float:
        return errors.of(replace(named, errors=errors_before * named.errors + times * (named.slopes @ one)))

    count = int((problem.trial_of == left).sum())
    grown = (moved(1.0) ** 2 - moved(0.0) ** 2) * count
    assert grown < 5.0**2  # chi-square of one direction, with its cross term
    # Steps in proportion: past three deviations each further one adds as much as the one before.
    far, farther = moved(100.0, 0.0), moved(200.0, 0.0)
    assert far > 5.0 * moved(3.0, 0.0)
    assert farther == pytest.approx(2.0 * far, rel=0.1)


def test_a_trial_beyond_the_others_is_left_open_by_them(found: Search, named: Simulated) -> None:
    problem = found.problem
    swing = [np.ptp(trial.outputs["psi"]) for trial in problem.trials]
    left_open = [measure(found, left, named).left_open for left in range(4)]
    assert int(np.argmax(swing)) == int(np.argmax(left_open))
    assert min(left_open) > 0.0


def test_a_motion_that_diverges_has_no_error(found: Search, named: Simulated) -> None:
    errors = named.errors.copy()
    errors[found.problem.trial_of == 2] = math.inf
    broken = replace(named, errors=errors)
    assert measure(found, 2, named).of(broken) == math.inf
    assert math.isfinite(measure(found, 1, named).of(broken))


def test_no_prediction_is_worse_than_none(found: Search, named: Simulated) -> None:
    """To first order a run about to diverge errs by anything: it counts as if the mean of all trials stood for it."""
    problem = found.problem
    deviation = noise_deviation(problem, found.leader.sizes)
    astray = replace(named, errors=named.errors + 1e6)
    records = {name: np.concatenate([trial.outputs[name] for trial in problem.trials]) for name in problem.outputs}
    spread = np.array([np.std(records[name]) for name in problem.outputs])
    assert measure(found, 0, named).of(astray) == pytest.approx(math.sqrt(np.mean((spread / deviation) ** 2)), rel=1e-6)


def test_noise_deviation_holds_both_parts(found: Search) -> None:
    shapes = noise_shapes(found.problem.settings)
    ratio_one = next(k for k, shape in enumerate(shapes) if shape.ratio == 1.0)
    sizes = replace(found.null.sizes, shape=(0, ratio_one))
    expected = np.exp(sizes.white) * np.array([1.0, math.sqrt(2.0)])
    np.testing.assert_allclose(noise_deviation(found.problem, sizes), expected)


def test_what_an_effect_moves_is_what_leaving_it_out_changes(found: Search, named: Simulated) -> None:
    problem, point = found.problem, named.fit.point
    deviation = noise_deviation(problem, found.leader.sizes)
    absent = point.shared.copy()
    absent[problem.columns["rudder_offset"]] = 0.0
    weight = 1.0 / deviation[problem.channel_of]
    changed = (named.errors - problem.errors(replace(point, shared=absent))) * weight
    rows = moved(problem, named, "rudder_offset", deviation)
    # To first order, and less what other first states do as well.
    for trial in range(len(problem.trials)):
        here = problem.trial_of == trial
        starts = (named.starts[here].T * weight[here]).T
        left = changed[here] - starts @ np.linalg.lstsq(starts, changed[here], rcond=None)[0]
        assert np.linalg.norm(rows[here] - left) < 0.05 * np.linalg.norm(left)
        np.testing.assert_allclose(starts.T @ rows[here], 0.0, atol=1e-6 * np.abs(starts).max())
