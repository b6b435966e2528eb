"""Slopes of the marginal likelihood against differences, and its average information against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from dense_likelihood import CASES, EFFECTS, Dense, boat_problem, linearized, sizes_of

from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Linearization, Problem
from seatruth.diagnosis.size_slopes import slopes


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A boat with sway and yaw; three short trials."""
    return boat_problem()


@pytest.fixture(scope="module")
def at(problem: Problem) -> Linearization:
    """Away from the prior means in everything."""
    return linearized(problem)


@pytest.mark.parametrize(("terms", "forces"), CASES)
@pytest.mark.parametrize("hold", [False, True])
def test_slopes_are_differences(problem: Problem, at: Linearization, terms: bool, forces: bool, hold: bool) -> None:
    likelihood = Likelihood(problem, at, held=(int(problem.coefficients[1]),) if hold else ())
    sizes, h = sizes_of(problem, terms=terms, forces=forces), 1e-4
    slope, _ = slopes(likelihood, sizes, EFFECTS, noise=True)
    for k in range(len(slope)):
        if not np.isfinite(sizes.vector[k]):
            assert slope[k] == 0.0
            continue
        ends = []
        for step in (h, -h):
            moved = sizes.vector
            moved[k] += step
            ends.append(likelihood.log_likelihood(sizes.at(moved), EFFECTS))
        assert slope[k] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), abs=2e-4)


@pytest.mark.parametrize(("terms", "forces"), CASES)
def test_average_information(problem: Problem, at: Linearization, terms: bool, forces: bool) -> None:
    """Half of q' V^-1 q of working variates q = (dV/ds) V^-1 e, with every matrix written out."""
    sizes, h = sizes_of(problem, terms=terms, forces=forces), 1e-5
    _, information = slopes(Likelihood(problem, at), sizes, EFFECTS, noise=True)

    def covariance(vector: np.ndarray) -> np.ndarray:
        dense = Dense(problem, at, sizes.at(vector), EFFECTS)
        return np.asarray(dense.noise + dense.J @ dense.P @ dense.J.T)

    dense = Dense(problem, at, sizes, EFFECTS)
    inverse = np.linalg.inv(covariance(sizes.vector))
    weighed = inverse @ (dense.errors + dense.J @ dense.offset)
    variates = np.zeros((len(weighed), len(sizes.vector)))
    for k in np.flatnonzero(np.isfinite(sizes.vector)):
        step = h * np.eye(len(sizes.vector))[k]
        change = (covariance(sizes.vector + step) - covariance(sizes.vector - step)) / (2.0 * h)
        variates[:, k] = change @ weighed
    expected = 0.5 * variates.T @ inverse @ variates
    # A correlation of which no size is there changes nothing.
    np.testing.assert_allclose(information, expected, atol=1e-6 * np.abs(expected).max())


def test_without_noise_nothing_is_said_of_it(problem: Problem, at: Linearization) -> None:
    sizes = sizes_of(problem, terms=True, forces=True)
    likelihood, C = Likelihood(problem, at), len(sizes.white)
    whole, all_information = slopes(likelihood, sizes, EFFECTS, noise=True)
    slope, information = slopes(likelihood, sizes, EFFECTS, noise=False)
    assert not slope[:C].any()
    assert not information[:C].any()
    np.testing.assert_allclose(slope[C:], whole[C:])
    np.testing.assert_allclose(information[C:, C:], all_information[C:, C:])
