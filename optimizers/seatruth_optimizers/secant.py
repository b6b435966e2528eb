"""Nonlinear least squares with secant updates of the Jacobian: for simulators whose every run counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

_DAMPING = 1e-3
"""First damping over the curvature: Madsen et al. take 1e-3 where the start is fair."""
_FRESH_AFTER = 2
"""Steps in a row that did not lower the cost, after which an updated Jacobian is computed anew. [S]"""
_WORTH = 1e-3
"""Part of the predicted fall from which a step is taken."""


@dataclass(frozen=True)
class Secant(Optimizer):
    """The Levenberg-Marquardt method, whose Jacobian is updated after each step by Broyden's rank-one formula.

    K. Madsen, H. B. Nielsen, O. Tingleff, Methods for non-linear least squares problems, 2nd ed., DTU 2004, section
    3.4 (secant version); C. G. Broyden, Math. Comp. 19 (1965) 577. The Jacobian is computed at the start, where updates
    no longer lower the cost, and once at the end: a search of few parameters takes three or four of them. Steps stay
    within the bounds.
    """

    name: ClassVar[str] = "secant"
    title: ClassVar[str] = "Nonlinear least squares with secant updates (few runs)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"residuals", "derivatives"})

    tolerance: float = option(1e-6, "relative fall of the cost, and step, at which it has converged", low=1e-14)
    iterations: int = option(500, "largest number of steps", low=1)
    tries: int = option(20, "random starts to try where the start diverges", low=0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        z, r = problem.simulated_start(rng, self.tries)
        J, fresh, failed, damping = problem.jacobian(z), True, 0, _DAMPING
        for _ in range(self.iterations):
            step, predicted = _step(J, r, z, damping, problem)
            small = bool(np.all(np.abs(step) <= self.tolerance * (1.0 + np.abs(z))))
            if small or predicted <= self.tolerance * float(r @ r):
                if fresh:
                    return "the cost no longer falls" if not small else "the steps became negligible"
                J, fresh, failed = problem.jacobian(z), True, 0
                continue
            tried = problem.residuals(z + step)
            finite = bool(np.isfinite(tried).all())
            fall = float(r @ r - tried @ tried) if finite else -np.inf
            if finite:
                J = J + np.outer(tried - r - J @ step, step) / float(step @ step)
            if fall > _WORTH * predicted:
                z, r, fresh, failed = z + step, tried, False, 0
                damping = max(damping / (5.0 if fall > 0.75 * predicted else 1.0), 1e-12)
                continue
            damping, failed = damping * 8.0, failed + 1
            if failed >= _FRESH_AFTER and not fresh:
                J, fresh, failed = problem.jacobian(z), True, 0
                damping = max(damping / 64.0, _DAMPING)
            elif fresh and damping > 1e12:
                return "no step lowers the cost"
        problem.finish("budget", f"the limit of {self.iterations} steps is reached")


def _step(J: Array, r: Array, z: Array, damping: float, problem: Problem) -> tuple[Array, float]:
    """A damped step within the bounds, and by how much it is predicted to lower the sum of squares."""
    free = np.ones(len(z), dtype=np.bool_)
    step = np.zeros(len(z))
    low, high = problem.lower - z, problem.upper - z
    for _ in range(len(z)):
        A, g = J[:, free], J.T @ (r + J[:, ~free] @ step[~free])
        scale = np.maximum((A * A).sum(axis=0), 1e-30)
        step[free] = -np.linalg.solve(A.T @ A + damping * np.diag(scale), g[free])
        outside = free & ((step < low) | (step > high))
        if not outside.any():
            break
        # What would leave the bounds ends there, and the others take the step that is then the best.
        step = np.where(outside, np.clip(step, low, high), step)
        free = free & ~outside
        if not free.any():
            break
    left = r + J @ step
    return step, float(r @ r - left @ left)
