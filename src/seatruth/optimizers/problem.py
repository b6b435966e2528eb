"""What a solver sees of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Ability, Regression
from seatruth.optimizers.budget import Code
from seatruth.optimizers.evaluator import Evaluator, StageOver

if TYPE_CHECKING:
    from seatruth.optimizers.base import Optimizer


_MAX_REWEIGHTINGS = 60
"""Solutions under newly estimated noise; the later ones cost few steps. Chosen here [S]."""


class Problem:
    """A cost in search coordinates z (K,), with its bounds, its start and a budget that the driver watches.

    Bounded parameters run over [0, 1] (in the logarithm where the parameter says so), others in units of their own
    size around their value; see `seatruth.optimizers.coordinates`. Candidates outside the bounds are evaluated at the
    nearest point inside. A candidate that diverges costs inf. Arrays given are never changed.
    """

    def __init__(self, evaluator: Evaluator, start: Array | None = None) -> None:
        self._evaluator = evaluator
        self._coordinates = evaluator.coordinates
        self.start: Array = (self._coordinates.start if start is None else start).copy()
        """Where a search from one point starts: the parameters' values, or the best of the stage before."""

    @property
    def dimension(self) -> int:
        """K, the number of search coordinates."""
        return self._coordinates.dimension

    @property
    def names(self) -> tuple[str, ...]:
        return self._evaluator.cost.names

    @property
    def gives(self) -> frozenset[Ability]:
        """What the cost gives beyond what the optimizer needs."""
        return self._evaluator.cost.gives

    @property
    def noise_known(self) -> bool:
        """Whether the weights of the residuals stay as they are; otherwise `reweight` estimates them."""
        return self._evaluator.cost.noise_known

    @property
    def lower(self) -> Array:
        """Lower bounds (K,), -inf where there are none."""
        return self._coordinates.lower.copy()

    @property
    def upper(self) -> Array:
        """Upper bounds (K,), inf where there are none."""
        return self._coordinates.upper.copy()

    @property
    def box(self) -> tuple[Array, Array]:
        """Finite bounds for solvers that need them: the bounds, or ten scales either side of the value."""
        low, high = self._coordinates.box_lower.copy(), self._coordinates.box_upper.copy()
        return np.minimum(low, self.start), np.maximum(high, self.start)

    @property
    def evaluations(self) -> int:
        """Evaluations spent so far by the whole run."""
        return self._evaluator.evaluations

    @property
    def remaining(self) -> float:
        """Evaluations left to this solver; inf where only time or a stall limits it."""
        return self._evaluator.limit - self._evaluator.evaluations

    @property
    def best_value(self) -> float:
        """The lowest cost so far, inf before there is one."""
        return self._evaluator.best_value

    @property
    def best(self) -> Array:
        """The candidate of the lowest cost so far (the start before there is one)."""
        return self._evaluator.best_z.copy() if np.isfinite(self._evaluator.best_value) else self.start.copy()

    def x_of(self, z: Array) -> Array:
        """Parameters in their own units: (..., K) -> (..., K)."""
        return self._coordinates.x_of(z)

    def z_of(self, x: Array) -> Array:
        """Search coordinates of parameters: (..., K) -> (..., K)."""
        return self._coordinates.z_of(x)

    def sample(self, rng: np.random.Generator, n: int) -> Array:
        """n random starts (n, K) from the parameters' start regions (bounds where there is none)."""
        return self._coordinates.sample(rng, n)

    def population(self, rng: np.random.Generator, n: int) -> Array:
        """n first candidates (n, K): the start, then random ones."""
        Z = self.sample(rng, n)
        Z[0] = self.start
        return Z

    def simulated_start(self, rng: np.random.Generator, tries: int) -> tuple[Array, Array]:
        """A start (K,) that can be simulated, and its residuals (M,): `start`, else the first of `tries` random ones.

        Where none can be, the search ends as failed.
        """
        z = self.start
        for tried in range(tries + 1):
            r = self.residuals(z)
            if np.isfinite(r).all():
                return z, r
            if tried < tries:
                z = self.sample(rng, 1)[0]
        self.finish("failed", f"the start and {tries} random starts could not be simulated")

    def values(self, Z: Array) -> Array:
        """Cost of each candidate, (P, K) -> (P,), in one call of the cost. Counts P evaluations."""
        return self._evaluator.values(np.asarray(Z, dtype=float))

    def value(self, z: Array) -> float:
        """Cost of one candidate (K,). Counts 1."""
        return float(self._evaluator.values(np.asarray(z, dtype=float)[None])[0])

    def residuals(self, z: Array) -> Array:
        """Weighted residuals (M,) at z (K,); the cost is half their sum of squares. Counts 1; inf where it diverges."""
        return self._evaluator.residuals(np.asarray(z, dtype=float))

    def residuals_of(self, Z: Array) -> Array:
        """Weighted residuals of each candidate, (P, K) -> (P, M), in one call of the cost. Counts P; inf where one
        diverges."""
        return self._evaluator.residuals_of(np.asarray(Z, dtype=float))

    def jacobian(self, z: Array) -> Array:
        """Derivative (M, K) of the residuals by z at z (K,). Counts K."""
        return self._evaluator.jacobian(np.asarray(z, dtype=float))

    def reweight(self, z: Array) -> bool:
        """Updates the weights (measurement-noise covariance) at z if they are estimated; True if they changed."""
        return self._evaluator.reweight(np.asarray(z, dtype=float))

    def regression(self) -> Regression:
        """The cost as linear regressions, in the parameters' own units x (not z)."""
        return self._evaluator.cost.regression()

    def propose(self, x: Array) -> float:
        """Sets the answer, in the parameters' own units (K,), whatever its cost; returns its cost. Counts 1."""
        return self._evaluator.propose(x)

    def finish(self, code: Code, reason: str) -> NoReturn:
        """Ends the run with this code: for a solver whose own limit is reached without having converged."""
        if not self._evaluator.last_stage:
            raise StageOver(code, reason)
        self._evaluator.end(code, reason)


def solve(solver: Optimizer, evaluator: Evaluator, rng: np.random.Generator, start: Array | None = None) -> str | None:
    """Runs a solver from a start to its own end and returns its reason.

    Where the noise is estimated, a solver of residuals works with fixed weights. The weights are estimated at the
    start and again at each solution, and the solver runs again from there until they no longer change (iteratively
    reweighted least squares). Solvers that use values need none of this.
    """
    problem = Problem(evaluator, start)
    weighted = "residuals" in solver.needs and not evaluator.cost.noise_known
    if weighted:
        evaluator.reweight(problem.start)
    reason = solver.run(problem, rng)
    rounds = 0
    while weighted and rounds < _MAX_REWEIGHTINGS and evaluator.reweight(problem.best):
        rounds += 1
        reason = solver.run(Problem(evaluator, problem.best), rng)
    return reason
