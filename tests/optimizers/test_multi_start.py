"""Least squares from many starts at once: the conformance suite, several optima, one population a round."""

from __future__ import annotations

from typing import Any

import known_glide
import numpy as np
import pytest

from seatruth import Parameter
from seatruth.arrays import Array
from seatruth.costs.registry import cost_of
from seatruth.optimizers import Budget, Optimizer, minimise
from seatruth.testing.optimizers import OptimizerConformance
from seatruth.testing.problems import ResidualCost
from seatruth_optimizers.multi_start import MultiStart


class TestMultiStart(OptimizerConformance):
    @pytest.fixture
    def optimizer(self) -> Optimizer:
        return MultiStart(starts=10)


def two_valleys() -> ResidualCost:
    """(x^2 - 1)^2 tilted: a minimum near 1 and a lower one near -1."""

    def residuals(X: Array) -> Array:
        return np.stack([X[:, 0] ** 2 - 1.0, 0.3 * (X[:, 0] + 1.0)], axis=1)

    def derivative(x: Array) -> Array:
        return np.array([[2.0 * x[0]], [0.3]])

    return ResidualCost("two valleys", [Parameter("x", 1.5, min=-3.0, max=3.0, vary=True)], residuals, derivative)


def test_it_finds_the_lower_of_two_valleys() -> None:
    alone = minimise(two_valleys(), "least_squares", seed=1)
    many = minimise(two_valleys(), MultiStart(starts=20), seed=1)
    assert alone.x[0] > 0.8
    assert many.x[0] == pytest.approx(-1.0, abs=1e-8)
    assert "20 starts" in many.reason


def test_a_population_has_the_residuals_of_its_candidates() -> None:
    cost = cost_of(known_glide.study(initial="fixed"), threads=1)
    rng = np.random.default_rng(0)
    low, high = cost.bounds
    X = np.clip(cost.start * (1 + 0.02 * rng.standard_normal((5, len(cost.start)))), low, high)
    for row, x in zip(cost.residuals_of(X), X):
        assert row == pytest.approx(cost.residuals(x), rel=1e-9, abs=1e-9)


def test_each_round_is_one_population() -> None:
    cost = cost_of(known_glide.study(initial="fixed"), threads=1)
    sizes: list[int] = []
    whole = type(cost).residuals_of

    class Counted(type(cost)):
        def residuals_of(self, X: Array) -> Any:
            sizes.append(len(X))
            return whole(self, X)

    cost.__class__ = Counted
    outcome = minimise(cost, MultiStart(starts=12), budget=Budget(20_000), seed=2)
    assert outcome.code == "converged"
    assert sizes[0] == 12
    assert max(sizes) == 12 * len(cost.parameters)
    assert len(sizes) < 60  # however many starts there are
