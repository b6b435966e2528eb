"""The Differential Swarm of Chen, Yan and Wang (2011), in each reading that its printed symbols allow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

VARIANTS = ("A", "A_prime", "B_component", "B_scalar", "C", "D")


@dataclass(frozen=True)
class DifferentialSwarm(Optimizer):
    """A swarm that moves by differences of personal bests.

    The paper prints symbols only: personal bests p_i, swarm best p_g, a random r in [0, 1], omega (usually 1) and the
    personal bests of two random particles i1, i2. Variants (each particle, each step):

    A            r p_i + (1 - r) p_g + omega (p_i1 - p_i2), one r a particle; the preferred reading
    A_prime      the same with one r a component
    B_component  as A, the difference also times a random number, one a component
    B_scalar     as B_component with one random number a particle
    C            x_i + r1 (p_i1 - p_i2) + r2 (p_g - x_i), omega on the difference
    D            p_i + r (p_g - p_i) + omega r (p_i1 - p_i2), the same r

    A component outside the bounds is drawn at random within them; a personal best changes only on improvement. Only A
    finds exact minima in the published setting, and it needs 1000 steps and more. Whether i1 and i2 may coincide is
    open too: independent draws (`distinct` off) often converge much faster, but with 40 to 50 particles one run in ten
    ends early in the wrong place (Rosenbrock in 11 dimensions, 600 steps of 40: median 6e-3, worst 2 to 30), while
    distinct ones do not (median 4e-5, worst 4e-3).

    The swarm must be large enough, or it collapses before it arrives: on a trajectory with 11 parameters 24 of 24 runs
    with 40 or with 50 particles reached the minimum and none with 30; Rosenbrock needs 3.5 particles a parameter in 11
    dimensions and more than 5 in 18. These figures are of omega = 1, as published. The default of 0.7, chosen by
    experiments/tuning.py, needs a third of the evaluations. It is less sure: with 50 particles it ends early in 8 of 20
    searches of that trajectory's 11 parameters (experiments/standard_comparison.py), where omega = 1 did in none of 8.
    """

    name: ClassVar[str] = "differential_swarm"
    title: ClassVar[str] = "Differential Swarm (Chen, Yan and Wang 2011)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    particles: int = option(50, "size of the swarm", low=4, high=100_000)
    omega: float = option(0.7, "weight of the difference of personal bests", low=0.0)
    distinct: bool = option(True, "draw i1 and i2 different from each other and from the particle")
    variant: str = option("A", "reading of the update", choices=VARIANTS)
    spread: float = option(1e-10, "extent of the swarm, in search coordinates, at which it has converged", low=0.0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        low, high = problem.box
        position = problem.population(rng, self.particles)
        best, cost = position.copy(), problem.values(position)
        while True:
            leader = best[cost.argmin()]
            if np.isfinite(cost).all() and np.ptp(best, axis=0).max() <= self.spread:
                return f"the swarm has gathered within {self.spread:g} of the search range in every parameter"
            position = self._move(position, best, leader, rng)
            outside = (position < low) | (position > high)
            if outside.any():
                fresh = low + rng.random(position.shape) * (high - low)
                position = np.where(outside, fresh, position)
            values = problem.values(position)
            better = values < cost
            best[better], cost[better] = position[better], values[better]

    def _move(self, position: Array, best: Array, leader: Array, rng: np.random.Generator) -> Array:
        """New positions (n, d)."""
        moved: Array
        n, d = best.shape
        first, second = _pairs(n, rng, self.distinct)
        difference = self.omega * (best[first] - best[second])
        if self.variant == "C":
            moved = position + rng.random((n, 1)) * difference + rng.random((n, 1)) * (leader - position)
            return moved
        r = rng.random((n, d) if self.variant == "A_prime" else (n, 1))
        if self.variant == "D":
            moved = best + r * (leader - best) + r * difference
            return moved
        if self.variant == "B_component":
            difference = rng.random((n, d)) * difference
        elif self.variant == "B_scalar":
            difference = rng.random((n, 1)) * difference
        moved = r * best + (1 - r) * leader + difference
        return moved


def _pairs(n: int, rng: np.random.Generator, distinct: bool) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Two random particles for each particle: any, or all three different."""
    if not distinct:
        return rng.integers(0, n, n), rng.integers(0, n, n)
    particle = np.arange(n)
    first = (particle + rng.integers(1, n, n)) % n
    # An offset among the n - 2 other particles, counted from the particle; it steps over `first`.
    second = rng.integers(1, n - 1, n)
    second += second >= (first - particle) % n
    return first, (particle + second) % n
