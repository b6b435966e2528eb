"""Real-coded genetic algorithm: tournaments, and pymoo's simulated binary crossover and polynomial mutation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seatruth.costs.base import Ability, Array
from seatruth.optimizers import Optimizer, Problem, option


@dataclass(frozen=True)
class Genetic(Optimizer):
    """Parents and children compete for survival (mu + lambda); Deb and Agrawal's operators (1995).

    The defaults are the settings of Liu, Yue and Yu: population 200, crossover 0.8, mutation 0.15 (a gene). Their 2000
    generations are an upper limit besides the budget; it has no rule of convergence of its own. pymoo's operators run
    on plain arrays here: its objects for individuals and its comparison of every pair for duplicates would cost more
    than ten times as much a candidate.
    A child that would be a copy of its parent has one gene mutated instead.
    """

    name: ClassVar[str] = "genetic"
    title: ClassVar[str] = "Genetic algorithm (real-coded, SBX and polynomial mutation)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    population: int = option(200, "candidates a generation", low=4, high=100_000)
    generations: int = option(2000, "most generations", low=1)
    crossover: float = option(0.8, "probability that a pair of parents is crossed", low=0.0, high=1.0)
    mutation: float = option(0.15, "probability that a gene is mutated", low=0.0, high=1.0)
    crossover_index: float = option(15.0, "the higher, the closer children stay to their parents", low=1.0)
    mutation_index: float = option(20.0, "the higher, the smaller the mutations", low=1.0, high=100.0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        low, high = problem.box
        people = problem.population(rng, self.population)
        cost = problem.values(people)
        for _ in range(self.generations):
            children = self._children(people, cost, low, high, rng)
            everyone, costs = np.vstack([people, children]), np.concatenate([cost, problem.values(children)])
            order = np.argsort(costs, kind="stable")[: self.population]
            people, cost = everyone[order], costs[order]
        problem.finish("budget", f"the {self.generations} generations it was given are used up")

    def _children(self, people: Array, cost: Array, low: Array, high: Array, rng: np.random.Generator) -> Array:
        """The next candidates (n, d), inside the search range."""
        from pymoo.operators.crossover.sbx import cross_sbx
        from pymoo.operators.mutation.pm import mut_pm

        n, d = people.shape
        pairs = (n + 1) // 2
        parents = people[_tournament(cost, 2 * pairs, rng)].reshape(2, pairs, d)
        crossed = cross_sbx(
            parents,
            low,
            high,
            np.full((pairs, 1), self.crossover_index),
            np.full((pairs, 1), 0.5),  # each gene of a crossed pair with probability 1/2, as in Deb and Agrawal
            np.full((pairs, 1), 0.5),
            random_state=rng,
        )
        together = rng.random(pairs) < self.crossover
        children = np.where(together[:, None], crossed, parents).reshape(2 * pairs, d)
        copies = (children == parents.reshape(2 * pairs, d)).all(axis=1)
        eta = np.full(2 * pairs, self.mutation_index)
        mutated: Array = mut_pm(children, low, high, eta, np.full(2 * pairs, self.mutation), False, random_state=rng)
        copies &= (mutated == children).all(axis=1)
        if copies.any():
            same = int(copies.sum())
            mutated[copies] = mut_pm(
                children[copies], low, high, eta[:same], np.full(same, self.mutation), True, random_state=rng
            )
        return mutated[:n]


def _tournament(cost: Array, n: int, rng: np.random.Generator) -> Array:
    """Indices (n,) of the winners of binary tournaments, each candidate in as many as any other (within one)."""
    rounds = -(-2 * n // len(cost))
    entrants = np.concatenate([rng.permutation(len(cost)) for _ in range(rounds)])[: 2 * n].reshape(n, 2)
    winners: Array = np.where(cost[entrants[:, 0]] <= cost[entrants[:, 1]], entrants[:, 0], entrants[:, 1])
    return winners
