"""The noise floor: whitening leaves independent samples of unit variance from the first on; Burg finds the model."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_toeplitz, toeplitz
from scipy.signal import lfilter
from seatruth.diagnosis.noise import Series, noise_floor

AR = {"white": [], "first order": [0.8], "second order": [1.2, -0.5], "alternating": [-0.6]}


def autocovariance(a: list[float], lags: int) -> np.ndarray:
    """Autocovariances (lags,) of an autoregression of unit innovation, by its impulse response."""
    response = lfilter([1.0], [1.0, *(-x for x in a)], np.eye(1, 4000)[0])
    return np.array([response[: 4000 - k] @ response[k:] for k in range(lags)])


def draws(a: list[float], count: int, n: int, seed: int = 1) -> np.ndarray:
    """Stationary series (count, n), as the autoregression has them from the first sample on."""
    rng = np.random.default_rng(seed)
    return lfilter([1.0], [1.0, *(-x for x in a)], rng.normal(size=(count, n + 500)), axis=1)[:, 500:]


def cut(rows: np.ndarray, step: float = 0.5) -> tuple[list[Series], np.ndarray]:
    count, n = rows.shape
    t = np.arange(n) * step
    return [Series(f"trial {k}", "r", np.arange(k * n, (k + 1) * n), t, step) for k in range(count)], rows.ravel()


@pytest.mark.parametrize("kind", AR)
def test_pooled_burg_finds_the_coefficients(kind: str) -> None:
    series, residuals = cut(draws(AR[kind], 6, 800))
    (channel,) = noise_floor(series, 0.3 * residuals).channels
    wanted = np.zeros(8)
    wanted[: len(AR[kind])] = AR[kind]
    found = np.zeros(8)
    found[: len(channel.predictor)] = channel.predictor
    assert found == pytest.approx(wanted, abs=0.06)
    assert channel.innovation == pytest.approx(0.3, rel=0.05)
    assert channel.sd == pytest.approx(0.3 * np.sqrt(autocovariance(AR[kind], 1)[0]), rel=0.1)


@pytest.mark.parametrize("kind", AR)
def test_whitened_noise_has_unit_variance_from_the_first_sample(kind: str) -> None:
    series, residuals = cut(draws(AR[kind], 20, 400))
    (channel,) = noise_floor(series, residuals).channels
    fresh = channel.whiten(draws(AR[kind], 4000, 30, seed=2).T)
    assert fresh.var(axis=1) == pytest.approx(np.ones(30), abs=0.12)
    lag = (fresh[1:] * fresh[:-1]).mean(axis=1)
    assert np.abs(lag).max() < 0.12


def test_whitening_is_the_inverse_root_of_the_covariance() -> None:
    """|whitened|^2 is the quadratic form of the exact covariance."""
    a = [1.1, -0.4]
    series, residuals = cut(draws(a, 30, 2000))
    floor = noise_floor(series, residuals)
    (channel,) = floor.channels
    n = 12
    b = list(channel.predictor)
    covariance = toeplitz(autocovariance(b, n)) * channel.innovation**2
    x = np.random.default_rng(3).normal(size=n)
    assert float(np.sum(channel.whiten(x) ** 2)) == pytest.approx(float(x @ np.linalg.solve(covariance, x)), rel=1e-6)
    columns = np.random.default_rng(4).normal(size=(n, 3))
    assert channel.whiten(columns)[:, 1] == pytest.approx(channel.whiten(columns[:, 1]))


def test_effective_samples_and_memory() -> None:
    series, residuals = cut(draws([0.9], 10, 3000))
    (channel,) = noise_floor(series, residuals).channels
    assert channel.effective == pytest.approx(channel.samples * 0.1 / 1.9, rel=0.25)
    assert channel.memory == pytest.approx(-0.5 / np.log(0.9), rel=0.2)
    white, values = cut(draws([], 3, 500))
    (channel,) = noise_floor(white, values).channels
    assert channel.effective == pytest.approx(channel.samples, rel=0.1)


def test_series_of_another_step_have_a_model_of_their_own() -> None:
    slow, first = cut(draws([], 2, 300), step=1.0)
    quick, second = cut(draws([0.9], 2, 300), step=0.1)
    moved = [Series(s.trial, s.channel, s.rows + first.size, s.t, s.step) for s in quick]
    floor = noise_floor([*slow, *moved], np.concatenate([first, second]))
    assert [channel.step for channel in floor.channels] == [1.0, 0.1]
    assert floor.of == (0, 0, 1, 1)
    assert floor.whiten(np.concatenate([first, second])).std() == pytest.approx(1.0, abs=0.06)


def test_no_noise_is_less_than_half_a_digit() -> None:
    series, _ = cut(draws([], 1, 50))
    (channel,) = noise_floor(series, np.zeros(50), least={"r": 0.02}).channels
    assert channel.sd >= 0.02
    assert channel.innovation >= 0.02
    assert np.isfinite(channel.whiten(np.ones(50))).all()


def test_parameters_taken_raise_the_noise() -> None:
    series, residuals = cut(draws([], 1, 100))
    plain = noise_floor(series, residuals).channels[0].sd
    assert noise_floor(series, residuals, taken=20).channels[0].sd == pytest.approx(plain / np.sqrt(0.8))


def test_the_model_is_that_of_yule_and_walker_for_long_series() -> None:
    rows = draws([0.5, 0.3], 1, 20_000)
    (channel,) = noise_floor(*cut(rows)).channels
    c = np.array([rows[0][: rows.size - k] @ rows[0][k:] / rows.size for k in range(3)])
    found = np.zeros(2)
    found[: min(2, len(channel.predictor))] = channel.predictor[:2]
    assert found == pytest.approx(solve_toeplitz(c[:2], c[1:]), abs=0.03)
