"""CMA-ES of Hansen and Ostermeier (2001): the reference implementation, pycma (which pymoo's CMA-ES wraps too)."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

_LARGEST_COST = 1e300
"""Replaces an infinite cost, because pycma's stopping rules need finite ones; near the largest double."""


@dataclass(frozen=True)
class CMAES(Optimizer):
    """Covariance matrix adaptation evolution strategy; a whole generation is evaluated in one call.

    It searches from the start with first steps of `sigma` search coordinates, so it needs no bounds. When it has
    converged, `restarts` repeat the search from a random start with twice the population (Auger and Hansen 2005).
    """

    name: ClassVar[str] = "cma_es"
    title: ClassVar[str] = "CMA-ES (covariance matrix adaptation)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    sigma: float = option(0.3, "first step, in search coordinates", low=1e-9, high=10.0)
    population: int | None = option(None, "candidates a generation (None: 4 + 3 ln K)", low=4, high=100_000)
    restarts: int = option(0, "restarts with doubled population", low=0, high=20)
    tolerance: float = option(1e-11, "step, in search coordinates, at which it has converged", low=0.0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        size, reason = self.population, ""
        start = problem.start
        for _ in range(self.restarts + 1):
            size, reason = self._search(problem, start, size, rng)
            size, start = 2 * size, problem.sample(rng, 1)[0]
        return reason

    def _search(self, problem: Problem, start: Array, size: int | None, rng: np.random.Generator) -> tuple[int, str]:
        """One run: (population, why it ended)."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pycma warns on import of optional packages that it does not need
            import cma

        d = problem.dimension
        # pycma needs two dimensions: a single one gets a second coordinate that the cost ignores.
        pad = 1 if d == 1 else 0
        options: dict[str, Any] = {
            "bounds": [[*problem.lower, *[-1.0] * pad], [*problem.upper, *[1.0] * pad]],
            "randn": lambda *shape: rng.standard_normal(shape),
            "seed": np.nan,
            "verbose": -9,
            "verb_log": 0,
            "verb_disp": 0,
            "tolx": self.tolerance,
            "tolfun": 0.0,
            "tolfunhist": 0.0,
            "tolfunrel": 0.0,
            "tolstagnation": np.inf,
            "tolflatfitness": 100,
            "maxiter": np.inf,
            "maxfevals": np.inf,
        }
        if size is not None:
            options["popsize"] = size
        strategy = cma.CMAEvolutionStrategy(np.concatenate([start, np.zeros(pad)]), self.sigma, options)
        while not strategy.stop():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the reason why it ended is in the result
                candidates = strategy.ask()
                values = problem.values(np.asarray(candidates)[:, :d])
                strategy.tell(candidates, np.minimum(values, _LARGEST_COST).tolist())
        reasons = ", ".join(sorted(strategy.stop()))
        return strategy.popsize, f"the search distribution has shrunk to a point ({reasons})"
