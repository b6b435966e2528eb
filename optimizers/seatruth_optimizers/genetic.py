"""Real-coded genetic algorithm: tournaments, parent-centric or simulated binary crossover, polynomial mutation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

CROSSINGS = ("parent_centric", "sbx")


@dataclass(frozen=True)
class Genetic(Optimizer):
    """Parents and children compete for survival (mu + lambda). Children are made in one of two ways:

    parent_centric   a child lies about its parent, by normal steps along the differences of K + 1 random members from
                     their mean: the parent-centric crossover of Deb, Anand and Joshi (2002), with those differences in
                     place of orthogonal directions. Steps then have the population's own shape, so that correlated
                     parameters cost nothing
    sbx              simulated binary crossover (Deb and Agrawal 1995), parameter by parameter, pymoo's. It does not
                     reach the best fit of a vehicle's model: its coefficients are correlated

    The defaults were chosen by experiments/tuning.py. Liu, Yue and Yu print population 200, crossover 0.8, mutation
    0.15 (a gene) and 2000 generations, which are an upper limit here beside the budget; the algorithm has no rule of
    convergence. pymoo's operators run on plain arrays: with its objects for individuals and its comparison of all pairs
    for duplicates, a candidate would cost more than ten times as much. A child that would be a copy of its parent gets
    one gene mutated.
    """

    name: ClassVar[str] = "genetic"
    title: ClassVar[str] = "Genetic algorithm (real-coded)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    population: int = option(70, "candidates a generation", low=4, high=100_000)
    generations: int = option(2000, "largest number of generations", low=1)
    crossing: str = option("parent_centric", "how children are made of parents", choices=CROSSINGS)
    reach: float = option(1.2, "parent-centric: steps about the parent, in differences of members", low=0.0, high=10.0)
    crossover: float = option(0.9, "probability that parents are crossed", low=0.0, high=1.0)
    mutation: float = option(
        0.02, "probability that a gene (one parameter of a candidate) is mutated", low=0.0, high=1.0
    )
    crossover_index: float = option(15.0, "sbx: the higher, the closer children stay to their parents", low=1.0)
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

        def sbx(_: Array, parents: Array) -> Array:
            # A pair that is not crossed has probability 0 for each of its genes.
            gene = half * (rng.random((pairs, 1)) < self.crossover)
            couples = parents.reshape(2, pairs, d)
            children: Array = cross_sbx(couples, low, high, crossover_index, gene, half, random_state=rng)
            return children.reshape(2 * pairs, d)

        def parent_centric(members: Array, parents: Array) -> Array:
            # With K + 1 members the differences span all directions, in the population's own proportions.
            family = members[rng.integers(0, n, (2 * pairs, d + 1))]
            mean = family.mean(axis=1)
            weights = rng.standard_normal((2 * pairs, d + 1)) * (self.reach / np.sqrt(d + 1))
            step = np.einsum("nm,nmd->nd", weights, family - mean[:, None])
            step += self.reach * rng.standard_normal((2 * pairs, 1)) * (parents - mean)
            children = parents + step * (rng.random((2 * pairs, 1)) < self.crossover)
            outside = (children < low) | (children > high)
            inside: Array = np.where(outside, low + rng.random(children.shape) * width, children)
            return inside

        cross = sbx if self.crossing == "sbx" else parent_centric

        def breed(members: Array) -> Array:
            # Members are sorted by cost, so the one with the smaller index wins a tournament.
            parents = members[rng.integers(0, n, (2, 2 * pairs)).min(axis=0)]
            crossed = cross(members, parents)
            children: Array = mut_pm(crossed, low, high, mutation_index, mutation, False, random_state=rng)
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
