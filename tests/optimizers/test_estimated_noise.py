"""Costs whose noise is estimated: the driver reweights for solvers that do not, and books one and the same cost."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.costs.base import Cost
from seatruth.models.parameter import Parameter
from seatruth.optimizers import Budget, Optimizer, Problem, from_callable, minimise

RNG = np.random.default_rng(0)
A = RNG.standard_normal((80, 2))
B = RNG.standard_normal((40, 2))
TRUTH = np.array([1.0, -2.0])
Y = A @ TRUTH + 0.01 * RNG.standard_normal(80)
Z = B @ (TRUTH + 0.3) + 1.0 * RNG.standard_normal(40)  # noisy and biased: its weight decides the answer


class TwoSources(Cost):
    """Two sets of data with unknown noise each; the likelihood is sum n/2 log(SS / n)."""

    gives = frozenset({"values", "residuals", "derivatives"})
    noise_known = False

    def __init__(self) -> None:
        self.parameters = tuple(Parameter(name, 0.0, min=-10, max=10, vary=True) for name in "ab")
        self.description = {"problem": "two sources"}
        self.sigma = np.ones(2)
        self.estimates = 0

    def values(self, X: Array) -> Array:
        return np.array([sum(len(e) / 2 * math.log(e @ e / len(e)) for e in self._errors(x)) for x in X])

    def residuals(self, x: Array) -> Array:
        return np.concatenate([e / s for e, s in zip(self._errors(x), self.sigma)])

    def jacobian(self, x: Array) -> Array:
        return np.concatenate([-A / self.sigma[0], -B / self.sigma[1]])

    def value_of(self, residuals: Array) -> float:
        parts = (residuals[:80] * self.sigma[0], residuals[80:] * self.sigma[1])
        return sum(len(e) / 2 * math.log(e @ e / len(e)) for e in parts)

    def reweight(self, x: Array) -> bool:
        found = np.array([np.sqrt(e @ e / len(e)) for e in self._errors(x)])
        changed = bool((np.abs(found / self.sigma - 1) > 1e-6).any())
        if changed:
            self.sigma = found
            self.estimates += 1
        return changed

    def _errors(self, x: Array) -> tuple[Array, Array]:
        return Y - A @ x, Z - B @ x


def gauss_newton(problem: Problem, rng: np.random.Generator) -> str:
    """Knows nothing of weights."""
    z = problem.start
    for _ in range(3):
        z = z - np.linalg.lstsq(problem.jacobian(z), problem.residuals(z), rcond=None)[0]
    problem.residuals(z)
    return "three steps"


PLAIN = from_callable(gauss_newton, needs=frozenset({"residuals", "derivatives"}), name="gauss_newton")


@pytest.mark.parametrize("solver", ["least_squares", "newton", PLAIN, ["differential_swarm", PLAIN]])
def test_solvers_of_residuals_end_at_the_likelihood_of_solvers_of_values(solver: str | Optimizer | list[str]) -> None:
    reference = minimise(TwoSources(), "nelder_mead", budget=Budget(5000))
    cost = TwoSources()
    outcome = minimise(cost, solver, budget=Budget(8000), seed=1)
    np.testing.assert_allclose(outcome.x, reference.x, atol=1e-5)
    assert outcome.value == pytest.approx(reference.value, abs=1e-6)
    assert outcome.value == pytest.approx(cost.values(outcome.x[None])[0], abs=1e-9)
    assert cost.estimates >= 1
    # the cost is left with the noise at the answer
    np.testing.assert_allclose(cost.sigma, [np.sqrt(np.mean(e**2)) for e in cost._errors(outcome.x)], rtol=1e-5)
    best = outcome.history["best"].to_numpy()
    assert (np.diff(best[np.isfinite(best)]) <= 1e-9).all()  # one scale, whatever the weights were


def test_a_second_run_on_the_same_cost_gives_the_same() -> None:
    cost = TwoSources()
    first = minimise(cost, "least_squares")
    again = minimise(cost, "least_squares")
    np.testing.assert_allclose(again.x, first.x, rtol=1e-9)
