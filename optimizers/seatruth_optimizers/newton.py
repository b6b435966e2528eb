"""Newton-Raphson for maximum likelihood (Zhao, Xie and Qiao 2018), as published or with Levenberg-Marquardt damping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

_MAX_DAMPING = 1e12
"""A step under this damping is lost in the rounding of the parameters. Chosen here [S]."""
_MIN_DAMPING = 1e-12
"""Below this, damping changes no digit of a scaled Hessian that can be solved. Chosen here [S]."""
_DAMPING_FACTOR = 10.0
"""Marquardt (1963): lambda rises by this factor after a refused step and falls by it after an accepted one."""


@dataclass(frozen=True)
class Newton(Optimizer):
    """Alternates an estimate of the measurement-noise covariance with one step on the likelihood.

    The residuals r are weighted by the inverse root of the covariance. With their derivatives J, the gradient is J'r
    and the Hessian is nearly J'J (Gauss-Newton). damping = "none" takes theta - H^-1 grad as published; it diverges
    from starts that are 20 to 40 % off. damping = "levenberg" solves (H + lambda diag H) step = -grad, refuses steps
    that raise the cost (or change a sign, with `keep_signs`) and then raises lambda. diag H is the largest seen so far
    (More 1978), so that a parameter stays in place when the data cease to depend on it. Steps are projected on the
    bounds; a parameter at a bound is held there while the gradient pushes it outwards.

    The damped steps are written here and not left to SciPy, because the covariance changes before each step: SciPy's
    least_squares minimises under weights that stay. The optimizer "least_squares" is the choice for known noise.
    """

    name: ClassVar[str] = "newton"
    title: ClassVar[str] = "Newton-Raphson maximum likelihood (Levenberg-Marquardt damping)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"residuals", "derivatives"})

    damping: str = option("levenberg", "how steps are damped", choices=("levenberg", "none"))
    initial_damping: float = option(1e-3, "first damping lambda", low=1e-12, high=1e6)
    iterations: int = option(500, "largest number of steps", low=1)
    tolerance: float = option(1e-10, "relative fall of the cost, or step, at which it has converged", low=1e-15)
    keep_signs: bool = option(False, "refuse steps that change a parameter's sign")
    tries: int = option(20, "random starts to try where the start diverges", low=0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        z, _ = problem.simulated_start(rng, self.tries)
        scale = np.zeros(problem.dimension)
        damping = self.initial_damping if self.damping == "levenberg" else 0.0
        for _ in range(self.iterations):
            problem.reweight(z)
            r = problem.residuals(z)
            value = 0.5 * float(r @ r)
            J = problem.jacobian(z)
            gradient, hessian = J.T @ r, J.T @ J
            scale = np.maximum(scale, np.diag(hessian))
            free = ~(((z <= problem.lower) & (gradient > 0)) | ((z >= problem.upper) & (gradient < 0)))
            if not free.any() or not gradient[free].any():
                return "the gradient vanished"
            if self.damping == "none":
                moved = self._project(problem, z + _solve(gradient, hessian, free))
                if not np.isfinite(problem.residuals(moved)).all():
                    problem.finish("failed", "an undamped step left the region that can be simulated; use damping")
            else:
                trial = self._damped(problem, z, value, gradient, hessian, free, damping, scale)
                if trial is None:
                    return "no step lowers the cost"
                moved, damping = trial
            step = np.abs(moved - z).max()
            z = moved
            predicted = float(-(gradient[free] @ _solve(gradient, hessian, free)[free]) / 2)
            # Both hold under the covariance estimated at this point, so parameters and covariance converge together.
            if predicted <= self.tolerance * value or step <= self.tolerance * (1 + np.abs(z).max()):
                return "the cost and the steps no longer change"
        problem.finish("budget", f"the limit of {self.iterations} steps is reached")

    def _damped(
        self,
        problem: Problem,
        z: Array,
        value: float,
        gradient: Array,
        hessian: Array,
        free: NDArray[np.bool_],
        damping: float,
        scale: Array,
    ) -> tuple[Array, float] | None:
        """The first point that lowers the cost and the damping of the next step; None where no step lowers it."""
        while damping <= _MAX_DAMPING:
            moved = self._project(problem, z + _solve(gradient, hessian, free, damping * scale))
            if np.array_equal(moved, z):
                return None
            if not (self.keep_signs and (np.sign(problem.x_of(moved)) * np.sign(problem.x_of(z)) < 0).any()):
                r = problem.residuals(moved)
                if 0.5 * float(r @ r) < value:
                    return moved, max(damping / _DAMPING_FACTOR, _MIN_DAMPING)
            damping *= _DAMPING_FACTOR
        return None

    @staticmethod
    def _project(problem: Problem, z: Array) -> Array:
        return np.clip(z, problem.lower, problem.upper)


def _solve(gradient: Array, hessian: Array, free: NDArray[np.bool_], added: Array | float = 0.0) -> Array:
    """The step (K,) of the free coordinates, 0 for the others; `added` (K,) goes onto the diagonal.

    The matrix is first scaled to a unit diagonal, so that units do not decide whether it counts as singular. A
    direction on which the residuals do not depend gets no step.
    """
    step = np.zeros(len(gradient))
    damped = (hessian + np.diag(np.broadcast_to(added, step.shape)))[np.ix_(free, free)]
    size = np.sqrt(np.diag(damped))
    size[size == 0] = 1.0
    scaled = damped / np.outer(size, size)
    step[free] = -np.linalg.lstsq(scaled, gradient[free] / size, rcond=1e-14)[0] / size
    return step
