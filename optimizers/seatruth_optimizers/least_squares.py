"""Nonlinear least squares: SciPy's trust-region reflective method on the residuals, with their exact derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

_POLISHED = 1e-9
"""Length of a step, in standard errors, that no longer matters: six digits of a value are then right even where its
standard error is a thousand times as large as the value. Chosen here [S]."""
_SHORT = 1e-3
"""Length of a step, in standard errors, below which the cost changes by rounding alone. Chosen here [S]."""
_REFLECTIVE = 50
"""Trial steps of the first method. On 20 studies of a glider and a tug, what needed more took hundreds. [S]"""
_FIRST_TOLERANCE = 1e-3
"""Tolerance of the first solution under estimated noise; each new estimate divides it by ten. Chosen here [S]."""


@dataclass(frozen=True)
class LeastSquares(Optimizer):
    """scipy.optimize.least_squares(method="trf") from the start values; bounds are kept at every step.

    Branch, Coleman and Li (1999). The default for smooth problems with a fair start. Where the start itself cannot be
    simulated, it tries `tries` random ones from the start regions.

    A change of the cost is too coarse a sign where residuals are large: at 1e-10 of the cost the parameters still miss
    1e-5 of a standard error. So `polish` Gauss-Newton steps follow, while each is shorter than the one before.
    """

    name: ClassVar[str] = "least_squares"
    title: ClassVar[str] = "Nonlinear least squares (trust region reflective)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"residuals", "derivatives"})

    tolerance: float = option(1e-10, "relative change of cost, step and gradient at which it has converged", low=1e-15)
    iterations: int = option(1000, "largest number of trial steps", low=1)
    tries: int = option(20, "random starts to try where the start diverges", low=0)
    polish: int = option(20, "largest number of Gauss-Newton steps after that, until none moves the answer", low=0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        from scipy.optimize import least_squares

        z, _ = problem.simulated_start(rng, self.tries)
        # A rough solution is enough while the weights still change.
        tolerance = self.tolerance if problem.noise_known else max(self.tolerance, _FIRST_TOLERANCE)
        while True:
            compact = _Compact(problem)
            # What still creeps after that many steps lies along bounds, which the second method walks along.
            stages: list[tuple[Literal["trf", "dogbox"], int]] = [("trf", min(self.iterations, _REFLECTIVE))]
            if self.iterations > _REFLECTIVE:
                stages.append(("dogbox", self.iterations - _REFLECTIVE))
            for method, steps in stages:
                result = least_squares(
                    compact.residuals,
                    z,
                    jac=compact.jacobian,
                    bounds=(problem.lower, problem.upper),
                    method=method,
                    x_scale="jac",
                    ftol=tolerance,
                    xtol=tolerance,
                    gtol=tolerance,
                    max_nfev=steps,
                )
                z = result.x
                if result.status != 0:
                    break
            if result.status == 0:
                problem.finish("budget", f"the limit of {self.iterations} trial steps is reached")
            if tolerance <= self.tolerance:
                break
            problem.reweight(z)
            tolerance = max(self.tolerance, tolerance / 10)
        if self.polish:
            polish(problem, z, self.polish)
        reasons = {1: "the gradient vanished", 2: "the cost no longer falls", 3: "the steps became negligible"}
        return reasons.get(result.status, "the cost and the steps no longer change")


def polish(problem: Problem, z: Array, steps: int) -> Array:
    """Gauss-Newton steps from z (K,) while each is shorter than the one before; makes the end the answer.

    The length of a step is that of the change of the weighted residuals: in standard errors along its direction. Where
    steps are short, costs differ by rounding alone, and only the lengths tell.
    """
    r = problem.residuals(z)
    value, length, best = float(r @ r), math.inf, z
    for _ in range(steps):
        if not math.isfinite(value):
            break
        J = problem.jacobian(z)
        gradient = J.T @ r
        free = ~(((z <= problem.lower) & (gradient > 0)) | ((z >= problem.upper) & (gradient < 0)))
        if not free.any():
            break
        size = np.linalg.norm(J[:, free], axis=0)
        size[size == 0] = 1.0
        step = np.zeros(len(z))
        # The shortest step: along a scale that cancels, any other would do as well.
        step[free] = np.linalg.lstsq(J[:, free] / size, -r, rcond=None)[0] / size
        now = float(np.linalg.norm(J @ step))
        if not now < length:
            break
        best, length = z, now
        if length <= _POLISHED * min(1.0, math.sqrt(value / len(r))):  # smaller residuals than the noise tell more
            break
        z = np.clip(z + step, problem.lower, problem.upper)
        r = problem.residuals(z)
        if not (float(r @ r) <= value or now < _SHORT):
            break
        value = min(value, float(r @ r))
    if not np.array_equal(best, problem.best):
        problem.propose(problem.x_of(best))
    return best


class _Compact:
    """The same problem with K + 1 residuals instead of M, for K parameters.

    SciPy decomposes the whole Jacobian (M, K) at every step; for long records that costs more than the simulations.
    A trust-region step depends on J'J, J'r and |r| alone. These stay the same if r becomes (0, ..., 0, |r|), and J the
    triangular factor of its part perpendicular to r, with its part along r as the last row.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._at, self._full = np.zeros(0), np.zeros(0)

    def residuals(self, z: Array) -> Array:
        residuals = self._problem.residuals(z)
        self._at, self._full = z.copy(), residuals
        compact = np.zeros(len(z) + 1)
        with np.errstate(invalid="ignore", over="ignore"):
            compact[-1] = np.linalg.norm(residuals)
        return compact

    def jacobian(self, z: Array) -> Array:
        r = self._full if np.array_equal(z, self._at) else self._problem.residuals(z)
        J = self._problem.jacobian(z)
        size = float(np.linalg.norm(r))
        direction = r / size if size > 0 else r
        along = direction @ J
        compact = np.zeros((len(z) + 1, len(z)))
        rest = J - np.outer(direction, along)
        triangle = np.linalg.qr(rest, mode="r")
        compact[: len(triangle)] = triangle
        compact[-1] = along
        return compact
