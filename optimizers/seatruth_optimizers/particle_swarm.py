"""Particle swarm of Kennedy and Eberhart (1995), on the operators of pyswarms."""

from __future__ import annotations

import contextlib
import logging.config
import threading
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seatruth.costs.base import Ability
from seatruth.optimizers import Optimizer, Problem, option


@dataclass(frozen=True)
class ParticleSwarm(Optimizer):
    """Global-best swarm with constriction coefficients (Clerc and Kennedy 2002) by default.

    Particles move by pyswarms' operators; one that leaves the search range is put back by `boundary`. pyswarms draws
    from NumPy's global generator and writes a log file into the working directory: here it draws from the run's own
    generator and writes none.
    """

    name: ClassVar[str] = "particle_swarm"
    title: ClassVar[str] = "Particle swarm (global best)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"values"})

    particles: int = option(50, "size of the swarm", low=2, high=100_000)
    inertia: float = option(0.7298, "part of the velocity that is kept", low=0.0, high=1.5)
    cognitive: float = option(1.4962, "pull of a particle's own best", low=0.0, high=4.0)
    social: float = option(1.4962, "pull of the swarm's best", low=0.0, high=4.0)
    boundary: str = option(
        "nearest", "what happens to a particle that leaves", choices=("nearest", "reflective", "periodic")
    )
    spread: float = option(1e-10, "extent of the swarm, in search coordinates, at which it has converged", low=0.0)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        with _quiet():
            from pyswarms.backend import operators
            from pyswarms.backend.handlers import BoundaryHandler, VelocityHandler
            from pyswarms.backend.swarms import Swarm
            from pyswarms.backend.topology import Star

            boundary, velocity, star = BoundaryHandler(self.boundary), VelocityHandler("unmodified"), Star()
        move = _with_generator(operators.compute_velocity, rng)
        low, high = problem.box
        start = problem.population(rng, self.particles)
        # Half of the way to another random place: first velocities on the scale of the start region.
        first = 0.5 * (problem.sample(rng, self.particles) - start)
        swarm = Swarm(start, first, options={"w": self.inertia, "c1": self.cognitive, "c2": self.social})
        swarm.pbest_pos, swarm.pbest_cost = start.copy(), np.full(self.particles, np.inf)
        swarm.best_pos = start[0].copy()
        while True:
            swarm.current_cost = problem.values(swarm.position)
            swarm.pbest_pos, swarm.pbest_cost = operators.compute_pbest(swarm)
            swarm.best_pos, swarm.best_cost = star.compute_gbest(swarm)
            gathered = np.ptp(swarm.pbest_pos, axis=0).max() <= self.spread
            if gathered and np.isfinite(swarm.pbest_cost).all():
                return f"the swarm has gathered within {self.spread:g} of the search range in every parameter"
            swarm.velocity = move(swarm, None, velocity, bounds=(low, high))
            outside = (swarm.position + swarm.velocity < low) | (swarm.position + swarm.velocity > high)
            swarm.position = operators.compute_position(swarm, (low, high), boundary)
            if self.boundary != "periodic":
                # A particle that kept its velocity would stay at the bound; pyswarms' own handlers for this look at
                # positions that are back inside and so do nothing.
                swarm.velocity[outside] *= -0.5


def _with_generator(function: Callable[..., Any], rng: np.random.Generator) -> Callable[..., Any]:
    """pyswarms' function with `np.random.uniform` drawn from this generator instead of the global one.

    The function's own code runs over a copy of its module's names; a version of pyswarms that used more of NumPy there
    would fail at once (AttributeError), not draw from the global generator unseen.
    """
    numpy = types.SimpleNamespace(random=types.SimpleNamespace(uniform=rng.uniform))
    names = {**function.__globals__, "np": numpy}
    return types.FunctionType(function.__code__, names, function.__name__, function.__defaults__)


_LOGGING = threading.Lock()


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keeps pyswarms from reconfiguring the root logger, which it does on import and with every handler made."""
    with _LOGGING:
        original = logging.config.dictConfig
        logging.config.dictConfig = lambda config: None
        try:
            yield
        finally:
            logging.config.dictConfig = original
