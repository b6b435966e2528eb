"""Costs with known minima, for tests of optimizers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability, Block, Cost, Regression
from seatruth.models.parameter import Parameter

ALL: frozenset[Ability] = frozenset({"values", "residuals", "derivatives", "regression"})
SMOOTH: frozenset[Ability] = ALL - {"regression"}


class ResidualCost(Cost):
    """Half the sum of squares of residuals r(x), which are given for a population: (P, K) -> (P, M)."""

    def __init__(
        self,
        name: str,
        parameters: Sequence[Parameter],
        residuals: Callable[[Array], Array],
        derivative: Callable[[Array], Array],
        gives: frozenset[Ability] = SMOOTH,
    ) -> None:
        self.parameters = tuple(parameters)
        self.gives = gives
        self.description = {"problem": name}
        self._residuals, self._derivative = residuals, derivative

    def values(self, X: Array) -> Array:
        r = self._residuals(X)
        return np.asarray(0.5 * (r * r).sum(axis=1))

    def residuals(self, x: Array) -> Array:
        return np.asarray(self._residuals(x[None])[0])

    def jacobian(self, x: Array) -> Array:
        return self._derivative(x)


class LinearRegression(Cost):
    """Targets y (n,) from regressors A (n, k) and, where `intercept`, a constant that is the last parameter."""

    gives = ALL

    def __init__(self, parameters: Sequence[Parameter], A: Array, y: Array, *, intercept: bool, sigma: float) -> None:
        self.parameters = tuple(parameters)
        self.description = {"problem": "linear regression", "A": A, "y": y, "sigma": sigma}
        self._A, self._y, self._sigma, self._intercept = A, y, sigma, intercept
        self._full = np.column_stack([A, np.ones(len(A))]) if intercept else A

    def values(self, X: Array) -> Array:
        r = (self._y - X @ self._full.T) / self._sigma
        return np.asarray(0.5 * (r * r).sum(axis=1))

    def residuals(self, x: Array) -> Array:
        return np.asarray((self._y - self._full @ x) / self._sigma)

    def jacobian(self, x: Array) -> Array:
        return np.asarray(-self._full / self._sigma)

    def regression(self) -> Regression:
        k = self._A.shape[1]
        weights = np.full(len(self._y), 1 / self._sigma)
        last = k if self._intercept else None
        return Regression((Block("y", self._y, self._A, np.arange(k), weights, self._intercept, last),))


class Wrapped(Cost):
    """A cost that does something besides: `before(x)` is called with each candidate or population."""

    def __init__(self, inner: Cost, before: Callable[[Array], Any], gives: frozenset[Ability] | None = None) -> None:
        self.inner, self._before = inner, before
        self.parameters, self.description = inner.parameters, inner.description
        self.gives = inner.gives if gives is None else gives

    def values(self, X: Array) -> Array:
        self._before(X)
        return self.inner.values(X)

    def residuals(self, x: Array) -> Array:
        self._before(x)
        return self.inner.residuals(x)

    def residuals_of(self, X: Array) -> Array:
        self._before(X)
        return self.inner.residuals_of(X)

    def jacobian(self, x: Array) -> Array:
        self._before(x)
        return self.inner.jacobian(x)

    def regression(self) -> Regression:
        return self.inner.regression()


@dataclass(frozen=True)
class Known:
    """A cost with its minimum: where it is and what it costs."""

    name: str
    cost: Cost
    x: Array
    value: float


def parameters(
    start: Sequence[float], low: Sequence[float] | float = -math.inf, high: Sequence[float] | float = math.inf
) -> tuple[Parameter, ...]:
    """Free parameters p0, p1, ... with these starts and bounds."""
    lows, highs = np.broadcast_to(low, len(start)), np.broadcast_to(high, len(start))
    return tuple(
        Parameter(f"p{k}", float(value), min=float(a), max=float(b), vary=True)
        for k, (value, a, b) in enumerate(zip(start, lows, highs))
    )


def ellipsoid(name: str, dimension: int, condition: float, **box: Any) -> Known:
    """sum c_k (x_k - x*_k)^2 / 2 with c from 1 to `condition`; the minimum at 0.3, -0.4, 0.5, ..."""
    scale = np.sqrt(np.geomspace(1, condition, dimension))
    centre = np.array([(-1) ** k * (0.3 + 0.1 * (k % 5)) for k in range(dimension)])
    cost = ResidualCost(
        name, parameters([0.9] * dimension, **box), lambda X: scale * (X - centre), lambda x: np.diag(scale)
    )
    return Known(name, cost, centre, 0.0)


def at_bound() -> Known:
    """A coupled quadratic whose free minimum (2, -1) lies outside; within [-1, 1] x [-0.5, 1] it is at (1, -0.5)."""
    A = np.array([[1.0, 0.3], [0.0, 1.0]])
    centre = np.array([2.0, -1.0])
    cost = ResidualCost(
        "minimum at a bound",
        parameters([-0.5, 0.7], [-1.0, -0.5], [1.0, 1.0]),
        lambda X: (X - centre) @ A.T,
        lambda x: A,
    )
    x = np.array([1.0, -0.5])
    return Known("at_bound", cost, x, float(cost.values(x[None])[0]))


def rosenbrock(dimension: int = 2, low: float = -2.0, high: float = 2.0, start: Sequence[float] = (-1.2, 1.0)) -> Known:
    """Rosenbrock's valley, sum 100 (x_k+1 - x_k^2)^2 + (1 - x_k)^2; the minimum 0 at (1, ..., 1)."""
    root = math.sqrt(2.0)

    def residuals(X: Array) -> Array:
        return np.asarray(root * np.hstack([10 * (X[:, 1:] - X[:, :-1] ** 2), 1 - X[:, :-1]]))

    def derivative(x: Array) -> Array:
        k = np.arange(dimension - 1)
        J = np.zeros((2 * dimension - 2, dimension))
        J[k, k], J[k, k + 1], J[dimension - 1 + k, k] = -20 * x[:-1], 10.0, -1.0
        return root * J

    first = list(np.resize(np.asarray(start, dtype=float), dimension))
    cost = ResidualCost("Rosenbrock", parameters(first, low, high), residuals, derivative)
    return Known("rosenbrock", cost, np.ones(dimension), 0.0)


def half_diverges() -> Known:
    """A quadratic that diverges (inf) where p0 + p1 < 0; its minimum (0.5, -0.1) is on the good side."""
    centre = np.array([0.5, -0.1])

    def residuals(X: Array) -> Array:
        return np.where((X.sum(axis=1) < 0)[:, None], np.inf, X - centre)

    cost = ResidualCost("half diverges", parameters([0.8, 0.9], -1.0, 1.0), residuals, lambda x: np.eye(2))
    return Known("half_diverges", cost, centre, 0.0)


def linear_regression(seed: int = 5) -> Known:
    """Forty noisy samples of a line in three regressors of very different size, with a constant."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(40, 3)) * np.array([1.0, 30.0, 0.1])
    truth = np.array([1.5, -0.02, 8.0, 0.7])
    y = A @ truth[:3] + truth[3] + 0.05 * rng.normal(size=40)
    box = parameters([1.0, 0.01, 5.0, 0.2], [-5.0, -1.0, -20.0, -5.0], [5.0, 1.0, 20.0, 5.0])
    cost = LinearRegression(box, A, y, intercept=True, sigma=0.05)
    x = np.linalg.lstsq(np.column_stack([A, np.ones(40)]), y, rcond=None)[0]
    return Known("linear_regression", cost, x, float(cost.values(x[None])[0]))


def known_problems() -> tuple[Known, ...]:
    """The problems of the conformance suite."""
    return (
        ellipsoid("quadratic", 2, 10.0),
        at_bound(),
        rosenbrock(),
        linear_regression(),
        half_diverges(),
        ellipsoid("one_parameter", 1, 1.0, low=-2.0, high=2.0),
        ellipsoid("twelve_parameters", 12, 100.0, low=-1.0, high=1.0),
    )
