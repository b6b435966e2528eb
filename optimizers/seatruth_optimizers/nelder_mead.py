"""The simplex method of Nelder and Mead (1965), from SciPy, within bounds and with restarts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option


@dataclass(frozen=True)
class NelderMead(Optimizer):
    """scipy.optimize.minimize(method="Nelder-Mead"), with the dimension-adapted coefficients of Gao and Han (2012).

    The simplex may collapse before it reaches a minimum, above all with many parameters. So the search starts again
    from the best point with a new, randomly oriented simplex, until a restart no longer lowers the cost.
    """

    name: ClassVar[str] = "nelder_mead"
    title: ClassVar[str] = "Simplex (Nelder and Mead), with restarts"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    size: float = option(0.1, "edge of the first simplex, in search coordinates", low=1e-6, high=1.0)
    restarts: int = option(20, "largest number of restarts", low=0)
    tolerance: float = option(1e-9, "extent of the simplex, in search coordinates, at which it has converged", low=0.0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        from scipy.optimize import minimize

        d = problem.dimension
        bounds = list(zip(problem.lower, problem.upper))
        z, value = problem.start, np.inf
        edges = np.eye(d) * self.size
        for _ in range(self.restarts + 1):
            with np.errstate(invalid="ignore"):  # a simplex of diverged corners: inf - inf in SciPy's test
                result = minimize(
                    problem.value,
                    z,
                    method="Nelder-Mead",
                    bounds=bounds,
                    options={
                        "initial_simplex": _simplex(z, edges, problem),
                        "xatol": self.tolerance,
                        "fatol": np.inf,
                        "adaptive": d > 2,
                        "maxiter": np.iinfo(np.int64).max,
                        "maxfev": np.iinfo(np.int64).max,
                    },
                )
            fall = value - result.fun
            z, value = np.asarray(result.x), float(result.fun)
            if np.isfinite(fall) and fall <= 1e-10 * abs(value):
                return "a new simplex at the best point found nothing better"
            edges = np.linalg.qr(rng.standard_normal((d, d)))[0] * self.size
        return f"the simplex has shrunk to {self.tolerance:g} after {self.restarts} restarts"


def _simplex(z: Array, edges: Array, problem: Problem) -> Array:
    """Corners (d + 1, d): z, and one along each edge; an edge that a bound would shorten points the other way."""
    corners = np.vstack([z, z + edges])
    inside = np.clip(corners, problem.lower, problem.upper)
    turned = np.clip(np.vstack([z, z - edges]), problem.lower, problem.upper)
    short = np.abs(inside - z).sum(axis=1) < np.abs(turned - z).sum(axis=1)
    result: Array = np.where(short[:, None], turned, inside)
    return result
