"""Differential evolution of Storn and Price (1997), from SciPy; a whole generation is evaluated in one call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

STRATEGIES = (
    "best1bin",
    "best1exp",
    "rand1bin",
    "rand1exp",
    "rand2bin",
    "rand2exp",
    "randtobest1bin",
    "randtobest1exp",
    "currenttobest1bin",
    "currenttobest1exp",
    "best2exp",
    "best2bin",
)


@dataclass(frozen=True)
class DifferentialEvolution(Optimizer):
    """scipy.optimize.differential_evolution, deferred updates, no polishing (chain a local optimizer instead).

    The defaults were chosen by experiments/tuning.py. SciPy's own ("best1bin", crossover 0.7) leaves more parameters
    of a candidate as they are, which is slow where parameters are correlated.
    """

    name: ClassVar[str] = "differential_evolution"
    title: ClassVar[str] = "Differential evolution (Storn and Price)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    population: int = option(30, "candidates a generation", low=5, high=100_000)
    strategy: str = option("randtobest1bin", "rule that makes the trial vectors", choices=STRATEGIES)
    mutation_low: float = option(0.5, "smallest weight of the difference (drawn in each generation)", low=0.0, high=1.9)
    mutation_high: float = option(1.0, "largest weight of the difference", low=0.0, high=1.99)
    recombination: float = option(0.9, "crossover probability", low=0.0, high=1.0)
    tolerance: float = option(1e-8, "spread of a generation's costs over their mean at which it has converged", low=0.0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        from scipy.optimize import Bounds, differential_evolution

        function: Any = lambda columns: problem.values(columns.T)  # noqa: E731 - SciPy's stubs know no vectorised one
        strategy: Any = self.strategy
        low, high = sorted((self.mutation_low, self.mutation_high))
        with np.errstate(invalid="ignore"):  # candidates that diverge have infinite cost: inf - inf in SciPy's spread
            differential_evolution(
                function,
                Bounds(*problem.box),
                strategy=strategy,
                maxiter=2**31,
                init=problem.population(rng, self.population),
                mutation=(low, high) if low < high else high,
                recombination=self.recombination,
                tol=self.tolerance,
                polish=False,
                updating="deferred",
                vectorized=True,
                rng=rng,
            )
        return f"the costs of the generation agree to {self.tolerance:g}"
