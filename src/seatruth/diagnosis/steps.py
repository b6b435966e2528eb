"""Steps towards the most probable values of all unknowns, and the objective that they lower.

Unknowns that would leave their bounds are held there, and everything else steps as is best beside them: a step that is
cut off at a bound afterwards leads astray, since what was to move with the one that is cut off moves alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.compensation import along, can_compensate
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Linearization, Point, Problem
from seatruth.diagnosis.sizes import Sizes, noise_shapes
from seatruth.diagnosis.unknowns import Solution
from seatruth.statistics.state_space_noise import whiten

_PARTS = (1.0, 0.5, 0.2, 0.05, 0.01)
"""Parts of a step that are tried, the longest first."""
_LARGE_PART = 0.5
"""Part of a step from which no other step is tried. [S]"""
_CORRECTIONS = 4
"""Corrections of a step. [S] Each costs a simulation; three bring most."""
_DAMPINGS = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5)
"""Dampings (Marquardt 1963) that are tried else. [S] At 1e5 hardly anything moves."""
_DIVERGED = 1e8
"""Error, in SI units, beyond which a run counts as diverged."""


def step(problem: Problem, at: Linearization, sizes: Sizes, likelihood: Likelihood) -> tuple[Point, float]:
    """One step from a linearization: the new point, and the fall of the objective (nats).

    A Gauss-Newton step with backtracking. Where only a small part of the step is of use, coefficients and forces trade
    along a curved valley: corrected steps are tried, then those of Levenberg and Marquardt, which hold back what the
    trials hardly determine, and not what they do.
    """
    point, effects = at.point, at.effects
    before = objective(problem, point, at.errors, sizes, effects, likelihood)
    best, reached = point, before

    def better(trial: Point, errors: Array) -> bool:
        nonlocal best, reached
        after = objective(problem, trial, errors, sizes, effects, likelihood)
        if not after < reached:
            return False
        best, reached = trial, after
        return True

    def simulated(trial: Point) -> bool:
        return better(trial, problem.errors(trial))

    try:
        within = likelihood.bounded(sizes, effects)
        whole = within.solve(sizes, effects)
        forced = bool(np.isfinite(sizes.forces).any()) and can_compensate(problem)
        near: Callable[[float], Point] | None = None

        def useful(part: float) -> bool:
            nonlocal near
            if simulated(problem.moved(point, whole.shared, whole.local, part)):
                return True
            if forced and near is None:
                near = along(problem, point, whole)
            return near is not None and simulated(near(part))

        part = next((part for part in _PARTS if useful(part)), 0.0)
        # With derivatives lent from another point, new ones bring more than other steps.
        if part < _LARGE_PART and not problem.lent:
            for longer in (part for part in _PARTS if part <= _LARGE_PART):
                if any(better(*nearer) for nearer in corrected(problem, at, sizes, within, whole, longer)):
                    break
            else:
                for damping in _DAMPINGS:
                    held_back = within.damped(damping).solve(sizes, effects)
                    simulated(problem.moved(point, held_back.shared, held_back.local))
    except np.linalg.LinAlgError:
        pass
    return best, before - reached


def corrected(
    problem: Problem, at: Linearization, sizes: Sizes, likelihood: Likelihood, whole: Solution, part: float
) -> Iterator[tuple[Point, Array]]:
    """Points, with their errors, nearer and nearer to where a part of a step was to lead had the model been linear.

    What the errors there deviate from the linear ones is taken back by further steps with the same derivatives
    (simplified Newton steps: Deuflhard 2011, Newton Methods for Nonlinear Problems, section 2.1), as long as they
    contract. The first of them is the geodesic acceleration of Transtrum and Sethna (2012, arXiv:1201.5885).
    """
    shared, local, last = part * whole.shared, part * whole.local, math.inf
    linear = at.errors + at.shared @ shared + np.einsum("nl,nl->n", at.local, local[problem.trial_of])
    for _ in range(_CORRECTIONS):
        trial = problem.moved(at.point, shared, local)
        errors = problem.errors(trial)
        if not np.isfinite(errors).all():
            return
        deviation = weighted_squares(problem, errors - linear, sizes)
        if deviation > last:
            return
        yield trial, errors
        last = deviation
        back = likelihood.without_priors_pull(errors - linear).solve(sizes, at.effects)
        shared, local = shared + back.shared, local + back.local


def likelihood_at(problem: Problem, at: Linearization, sizes: Sizes, effects: Sequence[str]) -> Likelihood:
    """The likelihood at a linearization, with what would leave its bounds held there."""
    free = Likelihood(problem, at)
    held = free.held_at_bounds(sizes, effects)
    return Likelihood(problem, at, held=held) if held else free


def objective(
    problem: Problem,
    point: Point,
    errors: Array,
    sizes: Sizes,
    effects: Sequence[str],
    likelihood: Likelihood,
) -> float:
    """Minus the log-posterior of a point (nats) up to a constant; inf where the model diverges there."""
    if not np.isfinite(errors).all() or np.abs(errors).max(initial=0.0) > _DIVERGED:
        return math.inf
    return 0.5 * (weighted_squares(problem, errors, sizes) + likelihood.energy(sizes, effects, point))


def weighted_squares(problem: Problem, errors: Array, sizes: Sizes) -> float:
    """Sum of the squares of errors (N,) whitened by the noise."""
    shapes, total = noise_shapes(problem.settings), 0.0
    for one in problem.series:
        white, _ = whiten(errors[one.rows], one.t, shapes[sizes.shape[one.channel]])
        total += float(white @ white) * math.exp(-2.0 * sizes.white[one.channel])
    return total
