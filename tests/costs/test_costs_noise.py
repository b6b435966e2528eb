"""The likelihood of known, estimated and correlated noise, and how its residuals touch it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.costs.noise import Noise
from seatruth.errors import BadInput

N, CHANNELS = 60, ("u", "v", "r")


def make(seed: int = 0, known: dict[str, float] | None = None, gaps: bool = True, **options: bool) -> tuple:
    rng = np.random.default_rng(seed)
    measured = rng.standard_normal((N, 3)) * [3.0, 0.5, 0.02]
    if gaps:
        measured[rng.random((N, 3)) < 0.15] = np.nan
        measured[:20, 1] = np.nan
    errors = np.where(np.isfinite(measured), rng.standard_normal((N, 3)) * [0.1, 0.05, 0.004], np.nan)
    noise = Noise(CHANNELS, measured, np.isfinite(measured), known or {}, **options)
    return noise, errors, rng


def test_known_noise_is_half_the_weighted_sum_of_squares() -> None:
    noise, errors, _ = make(known={"u": 0.1, "v": 0.2, "r": 0.01})
    r = noise.residuals(errors)
    scaled = errors / [0.1, 0.2, 0.01]
    expected = 0.5 * np.nansum(scaled**2)
    assert 0.5 * r @ r == pytest.approx(expected)
    assert noise.cost_of_residuals(r) == pytest.approx(expected)
    squares = np.nansum((errors * noise.weights) ** 2, axis=0)[None]
    assert noise.cost_of_squares(squares)[0] == pytest.approx(expected)
    assert noise.cost_of_errors(errors[None])[0] == pytest.approx(expected)
    assert not noise.estimated
    assert not noise.estimate(errors)
    assert noise.sigma == pytest.approx({"u": 0.1, "v": 0.2, "r": 0.01})


@pytest.mark.parametrize("correlated", [False, True])
def test_the_cost_does_not_depend_on_the_weights(correlated: bool) -> None:
    noise, errors, rng = make(correlated=correlated)
    before = noise.cost_of_errors(errors[None])[0]
    assert noise.cost_of_residuals(noise.residuals(errors)) == pytest.approx(before, rel=1e-12)
    assert noise.estimate(errors * rng.uniform(0.5, 2, 3))
    assert noise.cost_of_residuals(noise.residuals(errors)) == pytest.approx(before, rel=1e-12)
    if not correlated:
        squares = np.nansum((errors * noise.weights) ** 2, axis=0)[None]
        assert noise.cost_of_squares(squares)[0] == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("correlated", [False, True])
@given(seed=st.integers(0, 1000))
@settings(max_examples=25, deadline=None)
def test_residuals_majorise_the_cost_and_share_its_slope(correlated: bool, seed: int) -> None:
    noise, errors, rng = make(seed, correlated=correlated)
    noise.estimate(errors)
    assert not noise.estimate(errors)
    direction = rng.standard_normal((N, 3)) * [0.1, 0.05, 0.004]

    def cost(step: float) -> float:
        return float(noise.cost_of_errors((errors + step * direction)[None])[0])

    def half(step: float) -> float:
        r = noise.residuals(errors + step * direction)
        return 0.5 * float(r @ r)

    gap = half(0) - cost(0)
    for step in (-2.0, -0.5, 0.3, 1.0, 4.0):
        assert half(step) - cost(step) >= gap - 1e-9
    slope = noise.residuals(errors) @ noise.derivatives(direction[:, :, None])[:, 0]
    assert slope == pytest.approx((cost(1e-5) - cost(-1e-5)) / 2e-5, rel=1e-5, abs=1e-4)


def test_estimates_are_those_of_maximum_likelihood() -> None:
    noise, errors, _ = make(gaps=False)
    noise.estimate(errors)
    assert noise.sigma == pytest.approx(dict(zip(CHANNELS, np.sqrt(np.mean(errors**2, axis=0)))), rel=1e-6)
    rng = np.random.default_rng(1)
    mixed = errors @ np.linalg.cholesky(np.array([[1.0, 0.7, 0], [0.7, 1, 0.2], [0, 0.2, 1]])).T
    full = Noise(CHANNELS, rng.standard_normal((N, 3)), np.ones((N, 3), bool), {}, correlated=True)
    full.estimate(mixed)
    r = full.residuals(mixed).reshape(N, 3)
    np.testing.assert_allclose(r.T @ r / N, np.eye(3), atol=1e-3)


def test_a_perfect_fit_costs_nothing_and_not_minus_infinity() -> None:
    for correlated in (False, True):
        noise, errors, _ = make(correlated=correlated)
        nothing = np.where(np.isfinite(errors), 0.0, np.nan)
        assert noise.cost_of_errors(nothing[None])[0] == pytest.approx(0.0, abs=1e-9)
        assert noise.cost_of_errors(errors[None])[0] > 100
        noise.estimate(nothing)
        assert np.isfinite(noise.residuals(errors)).all()


def test_a_diverged_candidate_costs_infinity_and_leaves_the_weights() -> None:
    for correlated in (False, True):
        noise, errors, _ = make(correlated=correlated)
        before = noise.sigma
        wild = np.full_like(errors, np.inf)
        assert noise.cost_of_errors(wild[None])[0] == np.inf
        assert not noise.estimate(wild)
        assert noise.sigma == before


def test_a_coarse_sensor_keeps_the_noise_of_its_last_digit() -> None:
    digits = np.repeat(np.arange(12) * 0.5, 5)[:, None]
    noise = Noise(["psi"], digits, np.ones_like(digits, bool), {})
    noise.estimate(np.zeros_like(digits))
    assert 0.01 < noise.sigma["psi"] < 0.5 / np.sqrt(12)


def test_too_few_samples_for_an_estimate_are_said() -> None:
    measured = np.full((10, 1), np.nan)
    measured[:3] = 1.0
    with pytest.raises(BadInput, match="3 valid samples"):
        Noise(["u"], measured, np.isfinite(measured), {})
    assert Noise(["u"], measured, np.isfinite(measured), {"u": 0.1}).sigma == {"u": 0.1}
    with pytest.raises(BadInput, match="no channel"):
        Noise(["u"], measured, np.zeros((10, 1), bool), {})
