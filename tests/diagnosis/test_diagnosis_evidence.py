"""The average over the unknown order of an effect's magnitude, against the densities themselves."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, truncnorm

from seatruth.diagnosis.evidence import scale_gain

SCALES = (1.0, 0.5, 0.1)


@pytest.mark.parametrize("powers", [None, [2, 1, 1]])
@pytest.mark.parametrize("groups", [[[0]], [[0, 1]], [[0], [1, 2]], [[0], [1], [2]]])
def test_it_is_the_mean_of_the_evidence_over_the_scales(groups: list[list[int]], powers: list[int] | None) -> None:
    rng = np.random.default_rng(0)
    n = max(max(group) for group in groups) + 1
    J, sd = rng.normal(size=(30, n)), np.array([2.0, 0.5, 1.0])[:n]
    y = J @ (0.3 * sd) + rng.normal(size=30)

    def log_density(own: np.ndarray) -> float:
        return float(multivariate_normal(np.zeros(30), np.eye(30) + J @ np.diag(own**2) @ J.T).logpdf(y))

    values = []
    for scales in itertools.product(SCALES, repeat=len(groups)):
        own = sd.copy()
        for group, scale, power in zip(groups, scales, powers or [1, 1, 1]):
            own[group] *= scale**power
        values.append(log_density(own))
    expected = float(logsumexp(values)) - math.log(len(values)) - log_density(sd)
    got = scale_gain(J.T @ J, J.T @ y, sd, [np.array(group) for group in groups], SCALES, powers=powers)
    assert got == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("low", "high"), [(0.0, math.inf), (-math.inf, 0.0), (-0.5, 2.0), (0.0, 0.3)])
@pytest.mark.parametrize("pull", [-30.0, -3.0, 0.0, 2.0, 30.0])
def test_a_parameter_keeps_to_its_bounds(low: float, high: float, pull: float) -> None:
    """Against the integral: the mean of the likelihood over the prior that is cut at the bounds."""
    information = 9.0
    values = []
    for scale in SCALES:
        prior = truncnorm(low / scale, high / scale, scale=scale)
        ends = max(low, -12.0), min(high, 12.0)
        q = np.linspace(*ends, 400_001)
        density = np.exp(pull * q - 0.5 * information * q**2 - 0.5 * pull**2 / information) * prior.pdf(q)
        values.append(float(trapezoid(density, q)))
    whole = 0.5 * pull**2 / (information + 1.0) - 0.5 * math.log(1.0 + information)
    expected = math.log(float(np.mean(values))) + 0.5 * pull**2 / information - whole
    got = scale_gain(
        np.array([[information]]),
        np.array([pull]),
        np.ones(1),
        [np.array([0])],
        SCALES,
        np.array([low]),
        np.array([high]),
    )
    assert got == pytest.approx(expected, abs=1e-3)


def test_an_effect_that_would_have_to_be_negative_gains_nothing() -> None:
    """A delay that the trials ask to be -12 standard errors: 72 nats about its bound, of values that it cannot have."""
    information, pull = np.array([[1e4]]), np.array([-1200.0])
    about = 0.5 * float(pull[0] ** 2) / (1e4 + 1.0) - 0.5 * math.log(1e4 + 1.0)
    gain = scale_gain(information, pull, np.ones(1), [np.array([0])], (1.0,), np.zeros(1), np.array([math.inf]))
    assert -10.0 < about + gain < -5.0


def test_weak_effects_gain_and_none_loses_more_than_the_number_of_scales() -> None:
    information, sd = np.eye(1), np.array([100.0])
    gains = [scale_gain(information, np.array([z]), sd, [np.array([0])], SCALES) for z in (0.0, 3.0, 60.0)]
    assert gains[0] > gains[2]
    assert all(gain >= -math.log(len(SCALES)) for gain in gains)


def test_shape_parameters_keep_their_prior() -> None:
    """An effect whose group is empty has one evidence at all scales."""
    none = [np.array([], dtype=np.intp)]
    assert scale_gain(np.eye(1), np.ones(1), np.ones(1), none, SCALES) == pytest.approx(0.0)


def test_no_effect_and_too_many() -> None:
    assert scale_gain(np.zeros((0, 0)), np.zeros(0), np.zeros(0), [], SCALES) == 0.0
    many = [np.array([k]) for k in range(4)]
    assert scale_gain(np.eye(4), np.ones(4), np.ones(4), many, SCALES) == 0.0
