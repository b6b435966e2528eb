"""Sizes of noise and discrepancy: where they start, and their prior."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import (
    NoisePrior,
    Sizes,
    first_sizes,
    is_no_noise,
    log_prior,
    log_prior_slopes,
    noise_prior,
    noise_shapes,
    price_of_sizes,
    proposed_shapes,
)
from seatruth.effects import load_effects
from seatruth.statistics.state_space_noise import NoiseShape
from seatruth.trials.trial import Trial

SETTINGS = Settings()
NOTHING = NoisePrior({}, {})


def sizes(**changes: object) -> Sizes:
    start = Sizes(np.log([0.1, 0.5]), (0, 0), np.log([0.1, 0.1]), np.log([0.1, 0.1]), np.zeros(1))
    return replace(start, **changes)


def test_the_grid_begins_with_white_noise() -> None:
    shapes = noise_shapes(SETTINGS)
    assert shapes[0] == NoiseShape()
    assert len(shapes) == 1 + len(SETTINGS.noise_ratios) * len(SETTINGS.noise_times)
    assert len(set(shapes)) == len(shapes)


def test_priors_of_noise_shapes_sum_to_one() -> None:
    base = log_prior(SETTINGS, sizes(), NOTHING) - math.log(0.5)
    shapes = noise_shapes(SETTINGS)
    priors = [math.exp(log_prior(SETTINGS, sizes(shape=(k, 0)), NOTHING) - base) for k in range(len(shapes))]
    assert sum(priors) == pytest.approx(1.0)
    assert priors[0] == pytest.approx(0.5)


def test_the_largest_slow_part_of_most_channels_of_stated_noise_is_no_noise() -> None:
    last = len(noise_shapes(SETTINGS)) - 1
    both, one = NoisePrior({0: 0.1, 1: 0.5}, {}), NoisePrior({0: 0.1}, {})
    assert noise_shapes(SETTINGS)[last].ratio == max(SETTINGS.noise_ratios)
    assert is_no_noise(sizes(shape=(last, 0)), both, SETTINGS)
    assert is_no_noise(sizes(shape=(last, 0)), one, SETTINGS)
    assert not is_no_noise(sizes(shape=(0, last)), one, SETTINGS)
    assert not is_no_noise(sizes(shape=(last, last)), NOTHING, SETTINGS), "a record that was filtered may have it"
    three = NoisePrior({0: 0.1, 1: 0.5, 2: 0.3}, {})
    assert not is_no_noise(sizes(shape=(last, 0, 0)), three, SETTINGS)
    assert is_no_noise(sizes(shape=(last, 0, 0)), three, SETTINGS, forces=False), "it has nowhere else to go"
    assert not is_no_noise(sizes(shape=(0, 0, 0)), three, SETTINGS, forces=False)


def test_declared_noise_is_log_normal() -> None:
    known = NoisePrior({0: 0.1}, {})
    here = log_prior(SETTINGS, sizes(), known)
    twice = log_prior(SETTINGS, sizes(white=np.log([0.2, 5.0])), known)
    assert here - twice == pytest.approx(0.5 * (math.log(2.0) / SETTINGS.declared_noise_sd) ** 2)


def test_no_size_goes_beyond_its_walls() -> None:
    here = log_prior(SETTINGS, sizes(), NOTHING)
    assert log_prior(SETTINGS, sizes(terms=np.log([0.9, 2e-4])), NOTHING) == pytest.approx(here)
    assert log_prior(SETTINGS, sizes(terms=np.log([5.0, 0.1])), NOTHING) < here - 50.0
    assert log_prior(SETTINGS, sizes(forces=np.log([1e-5, 0.1])), NOTHING) < here - 50.0
    assert log_prior(SETTINGS, sizes(coupling=np.array([0.999])), NOTHING) < here - 5.0
    assert log_prior(SETTINGS, sizes(white=np.log([0.01, 0.5])), NoisePrior({}, {0: 0.05})) < here - 50.0


def test_no_discrepancy_is_allowed() -> None:
    bare = sizes().without_discrepancy()
    assert not bare.discrepancy
    assert math.isfinite(log_prior(SETTINGS, bare, NOTHING))
    again = bare.with_discrepancy(math.log(0.02))
    np.testing.assert_allclose(again.terms, math.log(0.02))
    np.testing.assert_allclose(sizes().with_discrepancy(math.log(0.02)).forces, math.log(0.1))


def test_a_vector_of_sizes_and_back() -> None:
    one = sizes(shape=(3, 0), coupling=np.array([-0.4]))
    again = one.at(one.vector)
    assert again.shape == one.shape
    for part in ("white", "terms", "forces", "coupling"):
        np.testing.assert_allclose(getattr(again, part), getattr(one, part))
    assert len(one.vector) == 7


@pytest.mark.parametrize("terms", [[0.1, 0.2], [3.0, 1e-6]])
def test_slopes_and_curvature_of_the_prior(terms: list[float]) -> None:
    """Against differences, inside the walls and beyond them."""
    known = NoisePrior({0: 0.08}, {})
    one = sizes(coupling=np.array([0.3]), terms=np.log(terms))
    slope, curvature = log_prior_slopes(SETTINGS, one, known)

    def at(k: int, h: float) -> float:
        moved = one.vector
        moved[k] += h
        return log_prior(SETTINGS, one.at(moved), known)

    h = 1e-4
    for k in range(len(slope)):
        assert slope[k] == pytest.approx((at(k, h) - at(k, -h)) / (2.0 * h), abs=1e-5)
        assert curvature[k] == pytest.approx(-(at(k, h) - 2.0 * at(k, 0.0) + at(k, -h)) / h**2, abs=1e-3)


def test_first_sizes_are_the_declared_noise_or_that_of_second_differences(
    ship_folder: Path, plain_runs: list[Trial]
) -> None:
    study = small.study(ship_folder, plain_runs).replace(noise={"r": 0.002})
    problem = Problem(study, load_effects(("gyro_bias",)), SETTINGS, threads=1)
    known = noise_prior(problem)
    assert known.declared == {0: 0.002}
    first = first_sizes(problem, known)
    assert math.exp(first.white[0]) == pytest.approx(0.002)
    assert math.exp(first.white[1]) == pytest.approx(small.NOISE["psi"], rel=0.2)
    assert first.shape == (0, 0)
    assert first.discrepancy


def test_rounding_to_the_last_digit_bounds_the_noise(ship_folder: Path, plain_runs: list[Trial]) -> None:
    step = 0.01
    rounded = [
        dataclasses.replace(t, outputs={**t.outputs, "psi": np.round(np.asarray(t.outputs["psi"]) / step) * step})
        for t in plain_runs
    ]
    known = noise_prior(small.problem(ship_folder, rounded))
    assert known.least[1] == pytest.approx(step / math.sqrt(12.0))
    spread = max(float(np.std(t.outputs["r"])) for t in plain_runs)
    assert known.least[0] == pytest.approx(1e-5 * spread)


@pytest.fixture(scope="module")
def problem(ship_folder: Path, offset_runs: list[Trial]) -> Problem:
    return small.problem(ship_folder, offset_runs)


def test_residuals_propose_the_shape_of_their_noise(problem: Problem) -> None:
    """Residuals drawn with a slow part get a shape with one; white residuals do not."""
    rng = np.random.default_rng(3)
    residuals = 0.2 * rng.standard_normal(problem.count)
    assert proposed_shapes(problem, residuals)[0][0][0] == 0
    for one in problem.series:
        lag = np.abs(one.t[:, None] - one.t)
        slow = np.linalg.cholesky(0.6**2 * np.exp(-lag / 10.0) + 1e-9 * np.eye(len(one.t)))
        residuals[one.rows] += slow @ rng.standard_normal(len(one.t))
    number, log_white = proposed_shapes(problem, residuals)[0][0]
    shape = noise_shapes(problem.settings)[number]
    assert shape.tau in (3.0, 10.0, 30.0)
    assert math.exp(log_white) * shape.ratio == pytest.approx(0.6, rel=0.5)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_residuals_that_overflow_propose_no_noise(ship_folder: Path, plain_runs: list[Trial]) -> None:
    """A step that leads nowhere: a model that runs away."""
    problem = small.problem(ship_folder, plain_runs[:1], ["gyro_bias"])
    assert proposed_shapes(problem, np.full(problem.count, 1e200)) == {}


def test_exact_data_propose_no_noise(ship_folder: Path, plain_runs: list[Trial]) -> None:
    """Noise of no size has a weight that no number holds."""
    problem = small.problem(ship_folder, plain_runs[:1], ["gyro_bias"])
    assert not any(proposed_shapes(problem, np.zeros(problem.count)).values())


def test_sizes_that_do_nothing_cost_nothing() -> None:
    assert price_of_sizes(lambda one: 0.0, sizes(), SETTINGS) == pytest.approx(0.0, abs=1e-9)


def test_a_size_that_the_trials_fix_costs_the_width_of_its_curve() -> None:
    """A normal curve in the logarithm of one size: its area over the range of the prior."""
    deviation, low = 0.3, -math.log(SETTINGS.smallest_discrepancy)

    def curve(one: Sizes) -> float:
        return -0.5 * ((float(one.forces[0]) - math.log(0.1)) / deviation) ** 2

    expected = -math.log(deviation * math.sqrt(2.0 * math.pi) / low)
    assert price_of_sizes(curve, sizes(), SETTINGS) == pytest.approx(expected, abs=1e-6)
