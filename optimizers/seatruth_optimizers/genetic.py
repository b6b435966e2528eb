"""Real-coded genetic algorithm: tournaments, and pymoo's simulated binary crossover and polynomial mutation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option


@dataclass(frozen=True)
class Genetic(Optimizer):
    """Parents and children compete for survival (mu + lambda); Deb and Agrawal's operators (1995).

    The defaults are the settings of Liu, Yue and Yu: population 200, crossover 0.8, mutation 0.15 (a gene). Their 2000
    generations are an upper limit beside the budget; the algorithm has no rule of convergence. pymoo's operators run
    on plain arrays here: with its objects for individuals and its comparison of all pairs for duplicates, a candidate
    would cost more than ten times as much. A child that would be a copy of its parent gets one gene mutated.
    """

    name: ClassVar[str] = "genetic"
    title: ClassVar[str] = "Genetic algorithm (real-coded, SBX and polynomial mutation)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    population: int = option(200, "candidates a generation", low=4, high=100_000)
    generations: int = option(2000, "largest number of generations", low=1)
    crossover: float = option(0.8, "probability that a pair of parents is crossed", low=0.0, high=1.0)
    mutation: float = option(
        0.15, "probability that a gene (one parameter of a candidate) is mutated", low=0.0, high=1.0
    )
    crossover_index: float = option(15.0, "the higher, the closer children stay to their parents", low=1.0)
    mutation_index: float = option(20.0, "the higher, the smaller the mutations", low=1.0, high=100.0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        low, high = problem.box
        members = problem.population(rng, self.population)
        cost = problem.values(members)
        order = np.argsort(cost, kind="stable")
        members, cost = members[order], cost[order]
        breed = self._breeder(low, high, rng)
        for _ in range(self.generations):
            children = breed(members)
            costs = np.concatenate([cost, problem.values(children)])
            order = np.argsort(costs, kind="stable")[: self.population]
            members, cost = np.concatenate([members, children])[order], costs[order]
        problem.finish("budget", f"the limit of {self.generations} generations is reached")

    def _breeder(self, low: Array, high: Array, rng: np.random.Generator) -> Callable[[Array], Array]:
        """The function that makes new candidates (n, d) inside the search range from members (n, d), the best first."""
        from pymoo.operators.crossover.sbx import cross_sbx
        from pymoo.operators.mutation.pm import mut_pm

        n, d = self.population, len(low)
        pairs = (n + 1) // 2
        half = np.full((pairs, 1), 0.5)  # each gene of a crossed pair with probability 1/2, as in Deb and Agrawal
        crossover_index = np.full((pairs, 1), self.crossover_index)
        mutation_index, mutation = np.full(2 * pairs, self.mutation_index), np.full(2 * pairs, self.mutation)
        width = high - low

        def breed(members: Array) -> Array:
            # Members are sorted by cost, so the one with the smaller index wins a tournament.
            parents = members[rng.integers(0, n, (2, 2 * pairs)).min(axis=0)]
            # A pair that is not crossed has probability 0 for each of its genes.
            gene = half * (rng.random((pairs, 1)) < self.crossover)
            couples = parents.reshape(2, pairs, d)
            crossed = cross_sbx(couples, low, high, crossover_index, gene, half, random_state=rng)
            children: Array = mut_pm(
                crossed.reshape(2 * pairs, d), low, high, mutation_index, mutation, False, random_state=rng
            )
            copies = np.flatnonzero((children == parents).all(axis=1))
            if len(copies):
                u, at = rng.random(len(copies)), rng.integers(0, d, len(copies))
                moved = children[copies, at] + self._step(u) * width[at]
                children[copies, at] = np.minimum(np.maximum(moved, low[at]), high[at])
            return children[:n]

        return breed

    def _step(self, u: Array) -> Array:
        """Polynomial mutation of one gene, in widths of its range, from random numbers u in [0, 1)."""
        v = 2 * u - 1
        step: Array = np.sign(v) * (1 - (1 - np.abs(v)) ** (1 / (self.mutation_index + 1)))
        return step
