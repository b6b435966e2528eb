"""Least squares from many starts at once: Levenberg and Marquardt's steps, all starts in one population."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option
from seatruth_optimizers.least_squares import polish

_STEP = 1e-6
"""Forward difference in search coordinates: the root of a simulated run's rounding, 1e-12. Chosen here [S]."""
_FIRST, _DOWN, _UP, _MOST = 1e-3, 0.2, 5.0, 1e8
"""Damping: first, after a step that lowers the cost, after one that does not, and where a start is given up. Marquardt
(1963), with factors of five for ten: a refused step costs one evaluation here, a Jacobian K. Chosen here [S]."""
_ALIKE = 1e-3
"""Distance in search coordinates at which two starts have met: the later one ends. Chosen here [S]."""


@dataclass(frozen=True)
class MultiStart(Optimizer):
    """Levenberg-Marquardt from `starts` random starts; each round simulates all that are left in one population.

    Derivatives are forward differences, so that the K + 1 candidates of every start go into one call; the engine then
    works at the pace of a swarm. Each start has a damping of its own (Levenberg 1944, Marquardt 1963, on the diagonal
    of J'J). A start that meets a better one ends there. The best end is then polished with exact derivatives.
    """

    name: ClassVar[str] = "multi_start"
    title: ClassVar[str] = "Least squares from many starts at once"
    needs: ClassVar[frozenset[Ability]] = frozenset({"residuals", "derivatives"})

    starts: int = option(20, "number of starts, the study's own among them", low=1, high=10_000)
    rounds: int = option(200, "largest number of steps of each start", low=1)
    tolerance: float = option(1e-8, "relative fall of the cost at which a start has converged", low=1e-15)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        Z = problem.population(rng, self.starts)
        R = problem.residuals_of(Z)
        cost = _costs(R)
        alive = np.isfinite(cost)
        if not alive.any():
            problem.finish("failed", f"none of the {self.starts} starts could be simulated")
        damping = np.full(len(Z), _FIRST)
        gradient, hessian = np.zeros(Z.shape), np.zeros((*Z.shape, Z.shape[1]))
        stale = alive.copy()  # whose derivatives are those of another place
        for _ in range(self.rounds):
            now = np.flatnonzero(stale & alive)
            if now.size:
                self._differentiate(problem, Z, R, now, gradient, hessian)
                stale[now] = False
            live = np.flatnonzero(alive)
            trial = Z[live] + np.array([_step(gradient[k], hessian[k], damping[k], Z[k], problem) for k in live])
            trial = np.clip(trial, problem.lower, problem.upper)
            tried = problem.residuals_of(trial)
            value = _costs(tried)
            better = value < cost[live]
            fall = np.where(better, cost[live] - value, 0.0)
            done = better & (fall <= self.tolerance * cost[live])
            for place, k in enumerate(live):
                if better[place]:
                    Z[k], R[k], cost[k] = trial[place], tried[place], value[place]
                    damping[k], stale[k] = max(damping[k] * _DOWN, 1e-12), True
                else:
                    damping[k] *= _UP
            alive[live[done | (damping[live] > _MOST)]] = False
            alive &= ~_met(Z, cost, alive)
            if not alive.any():
                break
        at = int(np.argmin(cost))
        polish(problem, Z[at].copy(), 20)
        reached = int(np.count_nonzero(2 * (cost - cost[at]) <= 1.0))
        return f"{reached} of {self.starts} starts ended within 1 chi-square of the best"

    @staticmethod
    def _differentiate(
        problem: Problem,
        Z: Array,
        R: Array,
        now: NDArray[np.intp],
        gradient: Array,
        hessian: Array,
    ) -> None:
        """J'r and J'J of these starts, by differences in one population."""
        d = Z.shape[1]
        step = np.where(Z[now] + _STEP > problem.upper, -_STEP, _STEP)  # (n, K), inside the bounds
        moved = Z[now][:, None, :] + step[:, :, None] * np.eye(d)
        found = problem.residuals_of(moved.reshape(-1, d)).reshape(len(now), d, -1)
        for place, k in enumerate(now):
            with np.errstate(invalid="ignore"):
                J = (found[place] - R[k]) / step[place][:, None]
            J[~np.isfinite(J).all(axis=1)] = 0.0  # a difference that diverges tells nothing of its direction
            gradient[k], hessian[k] = J @ R[k], J @ J.T


def _costs(R: Array) -> Array:
    """Half the sums of squares (P,)."""
    with np.errstate(over="ignore", invalid="ignore"):
        costs = 0.5 * np.einsum("pm,pm->p", R, R)
    return np.where(np.isfinite(costs), costs, np.inf)


def _step(gradient: Array, hessian: Array, damping: float, z: Array, problem: Problem) -> Array:
    """A damped step (K,); 0 for parameters that a bound holds."""
    free = ~(((z <= problem.lower) & (gradient > 0)) | ((z >= problem.upper) & (gradient < 0)))
    step = np.zeros(len(z))
    size = np.sqrt(np.diag(hessian)[free])
    size[size == 0] = 1.0
    scaled = hessian[np.ix_(free, free)] / np.outer(size, size) + damping * np.eye(int(free.sum()))
    step[free] = -np.linalg.solve(scaled, gradient[free] / size) / size
    return step if np.isfinite(step).all() else np.zeros(len(z))


def _met(Z: Array, cost: Array, alive: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Starts (P,) that are close to another with a cost as low or lower."""
    met = np.zeros(len(Z), dtype=np.bool_)
    order = np.argsort(cost, kind="stable")
    for place, k in enumerate(order):
        if alive[k] and place:
            before = order[:place]
            near = np.abs(Z[before] - Z[k]).max(axis=1) <= _ALIKE
            met[k] = bool((near & ~met[before] & (cost[k] - cost[before] < math.inf)).any())
    return met
