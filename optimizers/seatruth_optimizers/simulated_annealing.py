"""Simulated annealing: SciPy's dual annealing, with the cost scaled to its temperature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

_TEMPERATURE = 5230.0
"""SciPy's first temperature. It also sets the length of the first jumps, so the cost is scaled instead."""


@dataclass(frozen=True)
class SimulatedAnnealing(Optimizer):
    """scipy.optimize.dual_annealing: generalised annealing (Xiang and others 1997) with local searches between.

    Annealing accepts a rise of the cost in proportion to the temperature, so the cost needs a scale. The scale is the
    interquartile range of the cost over `probes` random starts: at the first temperature, the largest rise that can
    be accepted is `heat` times that range.

    A local search ends where a step lowers the scaled cost by less than `precision` of it. SciPy's own 2e-9 ends it
    short of the minimum where parameters are correlated; experiments/tuning.py chose the default.
    """

    name: ClassVar[str] = "simulated_annealing"
    title: ClassVar[str] = "Simulated annealing (dual annealing)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    heat: float = option(1.0, "first temperature in units of the spread of the cost", low=1e-9)
    probes: int = option(40, "random candidates that measure the spread of the cost", low=4)
    visit: float = option(2.62, "tail of the jumps: the higher, the longer the jumps", low=1.01, high=2.99)
    accept: float = option(
        -5.0, "acceptance parameter: the lower, the fewer rises of the cost are accepted", low=-1e4, high=-5.0
    )
    local: bool = option(True, "local searches (L-BFGS-B) whenever the best has improved")
    precision: float = option(1e-12, "relative fall of the cost at which a local search ends", low=0.0, high=1e-3)
    iterations: int = option(1000, "steps of the annealing schedule, of 2 K jumps each", low=1)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        from scipy.optimize import dual_annealing

        first = problem.population(rng, self.probes)
        costs = problem.values(first)
        scale = _TEMPERATURE / (6.0 * self.heat * _spread(costs))  # 1 - 6 rise / T > 0 is SciPy's limit for accept = -5
        reference = float(costs.min()) if np.isfinite(costs).any() else 0.0
        low, high = problem.box

        def energy(z: Array) -> float:
            return (problem.value(z) - reference) * scale

        def slope(z: Array, *_: Any) -> Array:
            # All differences in one call: forward ones, or backward ones near the upper bound.
            step = np.where(z + 1e-7 > high, -1e-7, 1e-7)
            values = problem.values(np.vstack([z, z + np.diag(step)]))
            with np.errstate(invalid="ignore"):
                change = (values[1:] - values[0]) * scale / step
            return np.where(np.isfinite(change), change, 0.0)

        search: Any = {"method": "L-BFGS-B", "jac": slope, "bounds": list(zip(low, high))}
        search["options"] = {"ftol": self.precision, "gtol": 0.0}  # the cost has no scale that a slope could be held to
        with np.errstate(invalid="ignore", over="ignore"):  # infinite energies meet inside SciPy
            dual_annealing(
                energy,
                list(zip(low, high)),
                maxiter=self.iterations,
                minimizer_kwargs=search,
                initial_temp=_TEMPERATURE,
                visit=self.visit,
                accept=self.accept,
                maxfun=float(2**62),
                rng=rng,
                no_local_search=not self.local,
                x0=first[costs.argmin()],
            )
        return f"the annealing schedule of {self.iterations} steps is finished"


def _spread(values: Array) -> float:
    """Interquartile range of the finite values, or their size, or 1."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 1.0
    quarter, half, three = np.quantile(finite, [0.25, 0.5, 0.75])
    return float(three - quarter) or abs(float(half)) or 1.0
