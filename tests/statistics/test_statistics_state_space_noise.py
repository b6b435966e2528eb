"""Whitening by the noise's state-space model against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import cholesky, solve_triangular

from seatruth.statistics.state_space_noise import NoiseShape, joined, whiten


def covariance(t: np.ndarray, shape: NoiseShape) -> np.ndarray:
    """Of all samples, from its definition."""
    slow = shape.ratio**2 * np.exp(-np.abs(t[:, None] - t) / shape.tau)
    return np.asarray(np.eye(len(t)) + slow)


@st.composite
def times(draw: st.DrawFn) -> np.ndarray:
    """Regular sampling, sampling with gaps, or irregular sampling."""
    n = draw(st.integers(1, 60))
    step = draw(st.sampled_from([0.1, 1.0, 7.0]))
    t = 3.0 + step * np.arange(n)
    kind = draw(st.sampled_from(["regular", "gaps", "irregular"]))
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    if kind == "gaps":
        t = t[np.sort(rng.choice(n, size=max(1, n // 2), replace=False))]
    return t if kind != "irregular" else 3.0 + np.cumsum(rng.uniform(0.01, 2.0, size=n) * step)


SHAPES = st.builds(NoiseShape, st.floats(0.05, 10.0), st.floats(0.3, 100.0))


@given(times(), SHAPES)
def test_whitening_is_that_of_the_dense_cholesky_factor(t: np.ndarray, shape: NoiseShape) -> None:
    columns = np.random.default_rng(0).normal(size=(len(t), 3))
    white, log_determinant = whiten(columns, t, shape)
    factor = cholesky(covariance(t, shape), lower=True)
    np.testing.assert_allclose(white, solve_triangular(factor, columns, lower=True), rtol=1e-7, atol=1e-8)
    assert log_determinant == pytest.approx(2.0 * np.log(np.diag(factor)).sum(), rel=1e-9, abs=1e-9)


@given(times(), SHAPES)
def test_one_series_is_one_column(t: np.ndarray, shape: NoiseShape) -> None:
    values = np.random.default_rng(1).normal(size=len(t))
    np.testing.assert_array_equal(whiten(values, t, shape)[0], whiten(values[:, None], t, shape)[0][:, 0])


@given(st.lists(times(), min_size=1, max_size=4), SHAPES)
def test_series_one_after_the_other_are_whitened_as_each_by_itself(series: list[np.ndarray], shape: NoiseShape) -> None:
    rng = np.random.default_rng(2)
    parts = [(rng.normal(size=len(t)), t) for t in series]
    found, log_determinant = whiten(*joined(parts)[:2], shape, joined(parts)[2])
    alone = [whiten(values, t, shape) for values, t in parts]
    np.testing.assert_allclose(found, np.concatenate([one[0] for one in alone]), rtol=1e-12, atol=1e-14)
    assert log_determinant == pytest.approx(sum(one[1] for one in alone), rel=1e-12, abs=1e-12)


def test_long_regular_records_take_the_steady_filter_and_stay_exact() -> None:
    t = 0.1 * np.arange(800)
    shape = NoiseShape(2.0, 5.0)
    columns = np.random.default_rng(2).normal(size=(800, 2))
    factor = cholesky(covariance(t, shape), lower=True)
    np.testing.assert_allclose(
        whiten(columns, t, shape)[0], solve_triangular(factor, columns, lower=True), rtol=1e-7, atol=1e-9
    )


def test_a_gap_late_in_a_regular_record_is_seen() -> None:
    t = np.concatenate([np.arange(300.0), 500.0 + np.arange(300.0)])
    shape = NoiseShape(1.0, 30.0)
    values = np.random.default_rng(3).normal(size=600)
    factor = cholesky(covariance(t, shape), lower=True)
    np.testing.assert_allclose(
        whiten(values, t, shape)[0], solve_triangular(factor, values, lower=True), rtol=1e-7, atol=1e-9
    )


def test_white_noise_is_left_as_it_is() -> None:
    values = np.arange(5.0)
    white, log_determinant = whiten(values, np.arange(5.0), NoiseShape())
    np.testing.assert_array_equal(white, values)
    assert log_determinant == 0.0
    white[0] = 9.0
    assert values[0] == 0.0


def test_no_samples() -> None:
    white, log_determinant = whiten(np.zeros((0, 2)), np.zeros(0), NoiseShape(1.0, 1.0))
    assert white.shape == (0, 2)
    assert log_determinant == 0.0


@pytest.mark.parametrize("shape", [NoiseShape(0.5, 3.0), NoiseShape(3.0, 40.0)])
def test_simulated_noise_becomes_standard_normal(shape: NoiseShape) -> None:
    """An Ornstein-Uhlenbeck process made by its recursion, and white noise."""
    rng = np.random.default_rng(4)
    n, runs, step = 2000, 10, 0.5
    fade = np.exp(-step / shape.tau)
    slow = np.empty((n, runs))
    slow[0] = shape.ratio * rng.normal(size=runs)
    for k in range(1, n):
        slow[k] = fade * slow[k - 1] + shape.ratio * np.sqrt(1.0 - fade**2) * rng.normal(size=runs)
    white, _ = whiten(slow + rng.normal(size=(n, runs)), step * np.arange(n), shape)
    # Standard error of a variance of 20 000 normal samples: 0.01; of a correlation: 0.007.
    assert white.var() == pytest.approx(1.0, abs=0.04)
    for lag in (1, 2, 10):
        assert abs(float(np.mean(white[lag:] * white[:-lag]))) < 0.03


def test_the_correlation_is_what_the_covariance_is_made_of() -> None:
    shape = NoiseShape(0.7, 4.0)
    t = np.array([0.0, 1.5, 6.0])
    made = [[shape.correlation(a - b) for a in t] for b in t]
    np.testing.assert_allclose(made, covariance(t, shape))
