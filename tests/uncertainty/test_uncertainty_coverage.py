"""Standard errors by Monte Carlo: intervals of 95 % hold the truth about that often, whatever colours the noise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from seatruth.costs.study_cost import ResidualBlock
from seatruth.uncertainty import covariance

Array = NDArray[np.float64]


def coloured(rng: np.random.Generator, rho: float, n: int, size: int) -> Array:
    """Unit-variance autoregressive noise of first order, (n, size)."""
    white = rng.normal(size=(n + 300, size))
    return np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white, axis=0)[300:])


def coverage(rho: float, n: int, cross: float, runs: int = 150, channels: int = 2) -> tuple[Array, Array]:
    """Share of runs whose interval holds the truth, for the estimate's and for the Cramer-Rao errors."""
    rng = np.random.default_rng(7)
    t = np.arange(n) * 0.1
    mixing = np.linalg.cholesky(np.full((channels, channels), cross) + (1.0 - cross) * np.eye(channels))
    held = np.zeros((2, 4))
    for _ in range(runs):
        blocks, noise, groups = [], [], []
        for trial in range(2):
            errors = coloured(rng, rho, n, channels) @ mixing.T
            for channel in range(channels):
                waves = [np.sin((0.3 + 0.2 * k + 0.1 * channel) * t + k + trial) for k in range(3)]
                first = len(blocks) * n
                blocks.append(np.column_stack([*waves, np.ones(n)]))
                noise.append(errors[:, channel])
                groups.append(
                    ResidualBlock("data", f"run {trial}", f"y{channel}", first + np.arange(n), t, np.arange(n))
                )
        jacobian, y = np.concatenate(blocks), np.concatenate(noise)
        x = np.linalg.lstsq(jacobian, y, rcond=None)[0]  # the truth is zero
        found = covariance(y - jacobian @ x, jacobian, groups)
        held += np.abs(x) < np.array([found.half_width(), 1.96 * found.crlb])
    return held[0] / runs, held[1] / runs


@pytest.mark.parametrize(
    ("rho", "cross", "least"), [(0.0, 0.0, 0.92), (0.0, 0.6, 0.92), (0.9, 0.0, 0.88), (0.9, 0.6, 0.88)]
)
def test_intervals_hold_the_truth(rho: float, cross: float, least: float) -> None:
    found, naive = coverage(rho, 400, cross)
    assert least <= found.mean() <= 0.985
    assert (found > least - 0.05).all()
    if rho:
        assert naive.mean() < 0.6  # what white noise would have claimed


def test_white_noise_of_the_stated_size_reaches_the_bound() -> None:
    rng = np.random.default_rng(1)
    n = 4000
    jacobian = rng.normal(size=(n, 3))
    groups = [ResidualBlock("data", "run", "y", np.arange(n), np.arange(n) * 0.1, np.arange(n))]
    found = covariance(rng.normal(size=n), jacobian, groups)
    assert found.stderr == pytest.approx(found.crlb, rel=0.06)
    assert covariance(np.zeros(n), jacobian, groups, white=True).stderr == pytest.approx(found.crlb, rel=1e-9)


def test_noise_larger_than_stated_widens_the_errors() -> None:
    rng = np.random.default_rng(1)
    n = 2000
    jacobian = rng.normal(size=(n, 2))
    groups = [ResidualBlock("data", "run", "y", np.arange(n), np.arange(n) * 0.1, np.arange(n))]
    found = covariance(3.0 * rng.normal(size=n), jacobian, groups)
    assert found.stderr == pytest.approx(3.0 * found.crlb, rel=0.1)


def test_a_prior_counts_once() -> None:
    """One datum of sd 1 and one prior of sd 1: the sd is 1 / sqrt(2), and a prior alone gives its own."""
    n = 500
    rng = np.random.default_rng(2)
    jacobian = np.concatenate([np.full((n, 1), 1.0 / np.sqrt(n)), np.ones((1, 1))])
    none = np.zeros(0)
    groups = [
        ResidualBlock("data", "run", "y", np.arange(n), np.arange(n) * 1.0, np.arange(n)),
        ResidualBlock("prior", "", "k", np.array([n]), none, none.astype(int)),
    ]
    residuals = np.concatenate([rng.normal(size=n), [0.0]])
    assert covariance(residuals, jacobian, groups).stderr[0] == pytest.approx(np.sqrt(0.5), rel=0.06)
    blind = np.concatenate([np.zeros((n, 1)), np.ones((1, 1))])
    assert covariance(residuals, blind, groups).stderr[0] == pytest.approx(1.0)


def test_what_the_data_do_not_see_has_an_infinite_error() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 300))
    jacobian = np.column_stack([a, b, np.zeros(300), a + b, rng.normal(size=300)])
    groups = [ResidualBlock("data", "run", "y", np.arange(300), np.arange(300) * 1.0, np.arange(300))]
    found = covariance(rng.normal(size=300), jacobian, groups)
    assert found.unidentifiable.tolist() == [True, True, True, True, False]
    assert np.isinf(found.stderr[:4]).all()
    assert np.isfinite(found.stderr[4])


def test_a_parameter_at_its_bound_is_held() -> None:
    rng = np.random.default_rng(4)
    jacobian = rng.normal(size=(200, 3))
    groups = [ResidualBlock("data", "run", "y", np.arange(200), np.arange(200) * 1.0, np.arange(200))]
    residuals = rng.normal(size=200)
    found = covariance(residuals, jacobian, groups, np.array([False, True, False]))
    assert np.isnan(found.stderr[1])
    alone = covariance(residuals, jacobian[:, [0, 2]], groups)
    assert found.stderr[[0, 2]] == pytest.approx(alone.stderr)
