"""Particle swarm of Kennedy and Eberhart (1995), with the neighbourhoods and boundary rules of pyswarms."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option

DRAWS = ("particle", "component")
TOPOLOGIES = ("star", "ring", "fixed")
_LOGGING = Path(__file__).with_name("pyswarms_logging.yaml")
_ENVIRONMENT = threading.Lock()


@dataclass(frozen=True)
class ParticleSwarm(Optimizer):
    """Particle swarm with constriction (Clerc and Kennedy 2002).

    Each step, a particle's velocity is `inertia` times its last one, plus random pulls to the best place that the
    particle has seen and to the best place that its neighbours have seen. The neighbours are all particles ("star", the
    global-best swarm), the `neighbours` nearest ones ("ring", the local-best swarm of pyswarms), or those that were the
    nearest when the search began ("fixed").

    The pulls have one random weight for each particle ("particle"), or as in the first papers one for each component
    ("component"), which favours the axes and is lost where parameters are correlated, as a vehicle's coefficients are.
    One weight a particle leaves the swarm few directions; with fixed neighbours it keeps them longer. The defaults
    were chosen by experiments/tuning.py.

    pyswarms keeps the personal bests, finds the best neighbour and puts particles back that leave the search range.
    The velocity rule is ours, because pyswarms draws its random numbers from NumPy's global generator, and a result
    must depend on the run's own seed alone.
    """

    name: ClassVar[str] = "particle_swarm"
    title: ClassVar[str] = "Particle swarm (global or local best)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    particles: int = option(100, "size of the swarm", low=2, high=100_000)
    inertia: float = option(0.7298, "part of the velocity that is kept", low=0.0, high=1.5)
    cognitive: float = option(1.4962, "pull to the best place that the particle has seen", low=0.0, high=4.0)
    social: float = option(1.4962, "pull to the best place that its neighbours have seen", low=0.0, high=4.0)
    draw: str = option("particle", "random weights of the pulls: one a particle, or one a component", choices=DRAWS)
    topology: str = option(
        "fixed", "the neighbours: all particles, the nearest ones, or those nearest at first", choices=TOPOLOGIES
    )
    neighbours: int = option(10, "number of neighbours, the particle itself included", low=2, high=100_000)
    boundary: str = option(
        "reflective", "where a particle is put that leaves the range", choices=("nearest", "reflective", "periodic")
    )
    spread: float = option(1e-10, "extent of the swarm, in search coordinates, at which it has converged", low=0.0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        with unlogged_pyswarms():
            from pyswarms.backend import compute_pbest, compute_position
            from pyswarms.backend.handlers import BoundaryHandler
            from pyswarms.backend.swarms import Swarm
            from pyswarms.backend.topology import Ring, Star

            boundary = BoundaryHandler(self.boundary)
            topology = Star() if self.topology == "star" else Ring(static=self.topology == "fixed")
        # pyswarms' Ring takes the neighbours by distance: p is the norm, k their number.
        metric = {} if self.topology == "star" else {"p": 2, "k": min(self.neighbours, self.particles)}
        low, high = problem.box
        start = problem.population(rng, self.particles)
        # Half of the way to another random place: first velocities on the scale of the start region.
        first = 0.5 * (problem.sample(rng, self.particles) - start)
        swarm = Swarm(start, first)
        swarm.pbest_pos, swarm.pbest_cost = start.copy(), np.full(self.particles, np.inf)
        swarm.best_pos = start[0].copy()
        while True:
            swarm.current_cost = problem.values(swarm.position)
            swarm.pbest_pos, swarm.pbest_cost = compute_pbest(swarm)
            swarm.best_pos, swarm.best_cost = topology.compute_gbest(swarm, **metric)
            gathered = np.ptp(swarm.pbest_pos, axis=0).max() <= self.spread
            if gathered and np.isfinite(swarm.pbest_cost).all():
                return f"the swarm has gathered within {self.spread:g} of the search range in every parameter"
            swarm.velocity = self._velocity(swarm, rng)
            outside = (swarm.position + swarm.velocity < low) | (swarm.position + swarm.velocity > high)
            swarm.position = compute_position(swarm, (low, high), boundary)
            if self.boundary != "periodic":
                # A particle that kept its velocity would stay at the bound. pyswarms' velocity handlers do not help:
                # they look at positions that are back inside the range already.
                swarm.velocity[outside] *= -0.5

    def _velocity(self, swarm: Any, rng: np.random.Generator) -> Array:
        """New velocities (particles, K) of a pyswarms Swarm: Clerc and Kennedy (2002)."""
        particles, d = swarm.position.shape
        shape = (particles, d if self.draw == "component" else 1)
        cognitive = self.cognitive * rng.random(shape) * (swarm.pbest_pos - swarm.position)
        social = self.social * rng.random(shape) * (swarm.best_pos - swarm.position)
        velocity: Array = self.inertia * swarm.velocity + cognitive + social
        return velocity


@contextlib.contextmanager
def unlogged_pyswarms() -> Iterator[None]:
    """Within it, pyswarms can be imported and its objects made without a change to the root logger.

    pyswarms sets up the root logger, and opens the file report.log in the working directory, when it is imported and
    whenever one of its objects is made, unless the environment variable LOG_CFG names a YAML file with another set-up.
    Here it names one that changes nothing; the variable is then left as it was.
    """
    with _ENVIRONMENT:
        before = os.environ.get("LOG_CFG")
        os.environ["LOG_CFG"] = str(_LOGGING)
        try:
            yield
        finally:
            if before is None:
                del os.environ["LOG_CFG"]
            else:
                os.environ["LOG_CFG"] = before
