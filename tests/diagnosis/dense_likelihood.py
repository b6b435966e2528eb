"""The marginal likelihood as a multivariate normal density that is built entry by entry."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cache

import boat_case as boat
import numpy as np
from scipy.stats import multivariate_normal

from seatruth.diagnosis.problem import Linearization, Point, Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import PAIRS, Sizes, noise_shapes
from seatruth.effects import load_effects

FEW = Settings(knots=4, initial_width=0.02)
"""Wide priors of initial states would leave the dense matrices, not what is tested, few correct digits."""
EFFECTS = ("rudder_offset", "gyro_bias")


@cache
def boat_problem() -> Problem:
    """A boat with sway and yaw, whose missing forces are correlated; three short trials."""
    inputs = [{"delta": boat.zigzag(14, 0.2, 5.0)}, {"delta": boat.zigzag(18, 0.1, 4.0)}, {"delta": np.full(12, 0.1)}]
    runs = boat.trials(boat.Boat(), inputs, headings=(0.0, 1.0, 2.0))
    return Problem(boat.study(boat.Boat(), runs), load_effects(EFFECTS), FEW, threads=1)


def linearized(problem: Problem) -> Linearization:
    """Away from the prior means in everything."""
    rng = np.random.default_rng(3)
    start = problem.start
    shared = start.shared.copy()
    shared[problem.coefficients] *= 1.02
    shared[problem.columns["rudder_offset"]] = 0.01
    shared[problem.terms] = 1e-5 * rng.normal(size=len(problem.terms))
    initial = start.initial + 0.002 * rng.normal(size=start.initial.shape)
    forces = 1e-3 * rng.normal(size=start.forces.shape)
    return problem.linearize(Point(shared, initial, forces), EFFECTS)


@cache
def case() -> tuple[Problem, Linearization]:
    """The boat's problem, and a linearization away from the prior means in everything."""
    problem = boat_problem()
    return problem, linearized(problem)


def sizes_of(problem: Problem, *, terms: bool = False, forces: bool = False) -> Sizes:
    """Some slow noise in two channels, sizes that differ, and a coupling of sway and yaw."""
    shapes = noise_shapes(problem.settings)
    shape = [0] * len(problem.outputs)
    shape[1], shape[4] = 8, len(shapes) - 3
    white = np.log([boat.NOISE[name] for name in problem.outputs])
    E = len(problem.equations)
    none = np.full(E, -math.inf)
    spread = np.log(np.linspace(0.05, 0.2, E))
    return Sizes(white, tuple(shape), spread if terms else none, spread - 0.3 if forces else none, np.array([0.6]))


CASES = [(False, False), (True, False), (False, True), (True, True)]


def equation_covariance(problem: Problem, log_sizes: np.ndarray, coupling: np.ndarray) -> np.ndarray:
    E = len(problem.equations)
    correlation = np.eye(E)
    pairs = [(a, b) for a, b in PAIRS if a in problem.equations and b in problem.equations]
    for (a, b), value in zip(pairs, coupling):
        i, j = problem.equations.index(a), problem.equations.index(b)
        correlation[i, j] = correlation[j, i] = value
    size = np.where(np.isfinite(log_sizes), np.exp(log_sizes), 0.0) * problem.usual
    return np.asarray(correlation * np.outer(size, size))


class Dense:
    """errors ~ N(mean, noise + J P J') about a linearization, with every matrix written out."""

    def __init__(self, problem: Problem, at: Linearization, sizes: Sizes, effects: Sequence[str]) -> None:
        settings, N, S = problem.settings, problem.count, len(problem.unknowns)
        L, T = at.local.shape[1], len(problem.trials)
        self.J = np.zeros((N, S + T * L))
        self.J[:, :S] = at.shared
        for n, trial in enumerate(problem.trial_of):
            self.J[n, S + trial * L : S + (trial + 1) * L] = at.local[n]
        self.P = np.zeros((S + T * L,) * 2)
        for c in [*problem.coefficients, *(c for name in effects for c in problem.columns[name])]:
            self.P[c, c] = problem.sd[c] ** 2
        discrepancy = problem.discrepancy
        assert discrepancy is not None
        of_terms = equation_covariance(problem, sizes.terms, sizes.coupling)
        for (a, one), (b, other) in itertools.product(zip(problem.terms, discrepancy.terms), repeat=2):
            if one.text == other.text:
                e, f = problem.equations.index(one.state), problem.equations.index(other.state)
                self.P[a, b] = of_terms[e, f]
        knots = np.arange(settings.knots)
        memory = np.exp(-np.abs(knots[:, None] - knots) / settings.force_memory)
        of_forces = np.kron(equation_covariance(problem, sizes.forces, sizes.coupling), memory)
        count = len(problem.initial_names)
        self.offset = np.zeros(S + T * L)
        self.offset[:S] = problem.mean - at.point.shared
        for trial in range(T):
            here = S + trial * L
            self.P[here : here + count, here : here + count] = np.diag(problem.initial_sd**2)
            self.P[here + count : here + L, here + count : here + L] = of_forces
            self.offset[here : here + count] = problem.initial_mean[trial] - at.point.initial[trial]
            self.offset[here + count : here + L] = -at.point.forces[trial].ravel()
        shapes = noise_shapes(settings)
        self.noise = np.zeros((N, N))
        for a, b in itertools.product(range(N), repeat=2):
            if problem.trial_of[a] == problem.trial_of[b] and problem.channel_of[a] == problem.channel_of[b]:
                c = problem.channel_of[a]
                lag = problem.time_of[a] - problem.time_of[b]
                self.noise[a, b] = math.exp(2.0 * sizes.white[c]) * shapes[sizes.shape[c]].correlation(lag)
        self.errors, self.trial_of, self.S = at.errors, problem.trial_of, S

    def log_density(self, keep: np.ndarray | None = None) -> float:
        keep = np.ones(len(self.errors), dtype=bool) if keep is None else keep
        covariance = (self.noise + self.J @ self.P @ self.J.T)[np.ix_(keep, keep)]
        # `J` is the slope of the errors: those at the truth, e + J (truth - point), are
        # the noise.
        mean = -(self.J @ self.offset)[keep]
        return float(multivariate_normal(mean, covariance).logpdf(self.errors[keep]))

    def posterior(self, keep: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Mean step from the point, and covariance, of all unknowns."""
        keep = np.ones(len(self.errors), dtype=bool) if keep is None else keep
        J = self.J[keep]
        total = self.noise[np.ix_(keep, keep)] + J @ self.P @ J.T
        gain = self.P @ J.T @ np.linalg.inv(total)
        left = self.errors[keep] + J @ self.offset
        return self.offset - gain @ left, self.P - gain @ J @ self.P
