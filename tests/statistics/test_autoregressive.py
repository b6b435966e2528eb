"""Autoregressive models of residuals: effective samples, covariance factor, innovations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from seatruth.arrays import Array
from seatruth.statistics.autoregressive import (
    AutoregressiveModel,
    fit_autoregressive,
    lag_one_autocorrelation,
)


def coloured(rng: np.random.Generator, rho: float, n: int, size: int) -> Array:
    """Unit-variance autoregressive noise of first order, (n, size)."""
    white = rng.normal(size=(n + 300, size))
    return np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white, axis=0)[300:])


def test_the_factor_gives_the_covariance_of_the_process() -> None:
    """Far from the first samples, which start from rest, L L' is the stationary covariance rho^|i-j|."""
    rho, n = 0.7, 80
    model = AutoregressiveModel(np.array([rho]), np.sqrt(1.0 - rho**2), 1.0)
    transpose = model.multiply_by_factor_transpose(np.eye(n))
    np.testing.assert_allclose((transpose.T @ transpose)[40:, 40:], toeplitz(rho ** np.arange(40)), atol=1e-10)


def test_innovations_undo_the_model() -> None:
    series = coloured(np.random.default_rng(3), 0.9, 5_000, 1)[:, 0]
    model = fit_autoregressive(series)
    innovations = model.innovations(series)
    assert abs(lag_one_autocorrelation(innovations)) < 0.03
    assert innovations[len(model.coefficients) :].std() == pytest.approx(model.innovation_sd, rel=0.01)
    assert (innovations[: len(model.coefficients)] == 0).all()


@pytest.mark.parametrize("rho", [0.0, 0.7, 0.95])
def test_effective_samples_of_a_known_process(rho: float) -> None:
    series = coloured(np.random.default_rng(5), rho, 20_000, 1)[:, 0]
    expected = 20_000 * (1.0 - rho) / (1.0 + rho)
    assert fit_autoregressive(series).effective_samples(20_000) == pytest.approx(expected, rel=0.15)
    assert lag_one_autocorrelation(series) == pytest.approx(rho, abs=0.03)


def test_oscillating_residuals_are_never_worth_more_than_their_number() -> None:
    series = coloured(np.random.default_rng(6), -0.8, 2_000, 1)[:, 0]
    assert fit_autoregressive(series).effective_samples(2_000) == 2_000


def test_short_and_constant_series() -> None:
    assert fit_autoregressive(np.zeros(50)).effective_samples(50) == 50
    assert fit_autoregressive(np.ones(3)).effective_samples(3) == 3
    assert fit_autoregressive(np.zeros(0)).effective_samples(0) == 0
    assert 1.0 <= fit_autoregressive(np.ones(200)).effective_samples(200) <= 2.0
    assert np.isnan(lag_one_autocorrelation(np.zeros(9)))
