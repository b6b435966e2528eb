"""Steps towards the most probable values of all unknowns, and the objective that they lower.

Unknowns that would leave their bounds are held there, and everything else steps as is best beside them: a step that is
cut off at a bound afterwards leads astray, since what was to move with the one that is cut off moves alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.compensation import along, can_compensate
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Linearization, Point, Problem
from seatruth.diagnosis.shared_likelihood import SharedLikelihood
from seatruth.diagnosis.sizes import Sizes, noise_shapes
from seatruth.diagnosis.unknowns import Solution
from seatruth.statistics.state_space_noise import whiten

_PARTS = (1.0, 0.5, 0.2, 0.05, 0.01)
"""Parts of a step that are tried, the longest first."""
_LARGE_PART = 0.5
"""Part of a step from which no other step is tried. [S]"""
_LENGTHS = (0.2, 2.0)
"""Least and largest part of a step that a parabola through both its ends may ask for. [S]"""
_NEARLY_WHOLE = 0.15
"""Distance of that part from the whole below which another simulation brings nothing: 2 % of the step's fall. [S]"""
_SMALL_PART = 0.1
"""Part below which a corrected step goes so little of its way that steps that are held back are tried too. [S]"""
_CORRECTIONS = 4
"""Corrections of a step. [S] Each costs a simulation; three bring most."""
_DAMPING = 1e4
"""Damping (Marquardt 1963) that is tried first. [S] The priors of initial states are so wide that less holds nothing
back where long runs bend."""
_LEAST_DAMPING, _LARGEST_DAMPING = 1.0, 1e10
"""Least and largest damping. [S] The least hardly holds anything back; with the largest hardly anything moves."""
_TIMES = 10.0
"""Ratio of one damping to the next. Marquardt's."""
_WORN_OUT = 0.1
"""Part of what steps of all kinds brought below which they are all tried again. [S]"""
_DIVERGED = 1e8
"""Error, in SI units, beyond which a run counts as diverged."""


class Step(NamedTuple):
    """One step: the new point, the fall of the objective (nats), and what the next one is told.

    That is the damping with which it begins, 0 for the whole step, and what the last step of all kinds brought (nats).
    """

    point: Point
    fall: float
    damping: float
    all_kinds: float


class _Descent:
    """The lowest of the points that were tried from a linearization."""

    def __init__(self, problem: Problem, at: Linearization, sizes: Sizes, likelihood: Likelihood) -> None:
        self._problem, self._sizes, self._effects, self._likelihood = problem, sizes, at.effects, likelihood
        self.point = at.point
        self._before = self._reached = self._objective(at.point, at.errors)

    @property
    def fall(self) -> float:
        """Of the objective (nats); infinite from where the model diverges to where it does not."""
        return 0.0 if self._reached == self._before else self._before - self._reached

    def lower(self, point: Point, errors: Array) -> bool:
        """Whether a point with these errors (N,) is lower than all before, and then stands for them."""
        after = self._objective(point, errors)
        if not after < self._reached:
            return False
        self.point, self._reached = point, after
        return True

    def simulated(self, point: Point) -> bool:
        """The same for a point that is simulated."""
        return self.lower(point, self._problem.errors(point))

    def promised(self, point: Point, whole: Solution, at: Linearization) -> float:
        """Fall of the objective (nats) at the end of a whole step, were the model linear."""
        linear = linear_errors(self._problem, at, whole.shared, whole.local)
        return self._before - self._objective(point, linear)

    def _objective(self, point: Point, errors: Array) -> float:
        return objective(self._problem, point, errors, self._sizes, self._effects, self._likelihood)


def step(problem: Problem, at: Linearization, sizes: Sizes, likelihood: Likelihood, before: Step | None = None) -> Step:
    """One step from a linearization, after the one `before`.

    A Gauss-Newton step with backtracking. Where only a small part of the step is of use, coefficients and forces trade
    along a curved valley: corrected steps are tried, then those of Levenberg and Marquardt, which hold back what the
    trials hardly determine, and not what they do. Where these go furthest, the next steps are of their kind, as long as
    they bring about as much.
    """
    found, held, all_kinds = _Descent(problem, at, sizes, likelihood), 0.0, 0.0
    try:
        within = likelihood.bounded(sizes, at.effects)
        # With derivatives lent from another point, new ones bring more than other steps.
        if before is not None and before.damping > 0.0 and not problem.lent:
            held, all_kinds = _held_back(found, problem, at, sizes, within, before.damping), before.all_kinds
        if found.fall <= _WORN_OUT * all_kinds:
            whole = within.solve(sizes, at.effects)
            if _useful_part(found, problem, at, sizes, whole) < _LARGE_PART and not problem.lent:
                shorter = (part for part in _PARTS if part <= _LARGE_PART)
                tried = ((part, corrected(problem, at, sizes, within, whole, part)) for part in shorter)
                part = next((part for part, nearer in tried if any(found.lower(*one) for one in nearer)), 0.0)
                held = _held_back(found, problem, at, sizes, within, _DAMPING) if part < _SMALL_PART else 0.0
            else:
                held = 0.0
            all_kinds = found.fall
    except np.linalg.LinAlgError:
        pass
    return Step(found.point, found.fall, held / _TIMES if held > _LEAST_DAMPING else 0.0, all_kinds)


def _useful_part(found: _Descent, problem: Problem, at: Linearization, sizes: Sizes, whole: Solution) -> float:
    """The longest part of a step that lowers the objective, straight or along the motion; 0 where none does."""
    forced = bool(np.isfinite(sizes.forces).any()) and can_compensate(problem)

    def straight(part: float) -> Point:
        return problem.moved(at.point, whole.shared, whole.local, part)

    near: Callable[[float], Point] | None = None
    for part in _PARTS:
        if found.simulated(straight(part)):
            return _to_the_lowest(found, problem, at, whole, straight) if part == 1.0 else part
        if forced and near is None:
            near = along(problem, at.point, whole)
        if near is not None and found.simulated(near(part)):
            return _to_the_lowest(found, problem, at, whole, near) if part == 1.0 else part
    return 0.0


def _to_the_lowest(
    found: _Descent, problem: Problem, at: Linearization, whole: Solution, way: Callable[[float], Point]
) -> float:
    """The part of a whole step, which was taken, that lowers the objective most, by the parabola through both its ends.

    Where models bend, whole steps of Gauss and Newton overshoot or fall short by much the same each time, and twenty of
    them go to and fro about an optimum that one of the right length reaches. Where only a part of it was of use, no
    parabola holds.
    """
    promised = found.promised(problem.moved(at.point, whole.shared, whole.local), whole, at)
    bend = 2.0 - found.fall / promised if promised > 0.0 else 1.0
    lowest = float(np.clip(1.0 / bend, *_LENGTHS)) if bend > 0.0 else _LENGTHS[1]
    if abs(lowest - 1.0) > _NEARLY_WHOLE and found.simulated(way(lowest)):
        return lowest
    return 1.0


def _held_back(
    found: _Descent, problem: Problem, at: Linearization, sizes: Sizes, within: Likelihood, damping: float
) -> float:
    """The least damping, from this one on, with which a step lowers the objective most; 0 where none does.

    It falls as long as that brings more, and rises until one is of use.
    """

    def lowers(strength: float) -> bool:
        held = within.damped(strength).solve(sizes, at.effects)
        return found.simulated(problem.moved(at.point, held.shared, held.local))

    if lowers(damping):
        while damping > _LEAST_DAMPING and lowers(damping / _TIMES):
            damping /= _TIMES
        return damping
    while damping < _LARGEST_DAMPING:
        damping *= _TIMES
        if lowers(damping):
            return damping
    return 0.0


def corrected(
    problem: Problem, at: Linearization, sizes: Sizes, likelihood: Likelihood, whole: Solution, part: float
) -> Iterator[tuple[Point, Array]]:
    """Points, with their errors, nearer and nearer to where a part of a step was to lead had the model been linear.

    What the errors there deviate from the linear ones is taken back by further steps with the same derivatives
    (simplified Newton steps: Deuflhard 2011, Newton Methods for Nonlinear Problems, section 2.1), as long as they
    contract. The first of them is the geodesic acceleration of Transtrum and Sethna (2012, arXiv:1201.5885).
    """
    shared, local, last = part * whole.shared, part * whole.local, math.inf
    linear = linear_errors(problem, at, shared, local)
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


def linear_errors(problem: Problem, at: Linearization, shared: Array, local: Array) -> Array:
    """Errors (N,) after a step of shared (S,) and own unknowns (T, L), as linearized."""
    return np.asarray(at.errors + at.shared @ shared + np.einsum("nl,nl->n", at.local, local[problem.trial_of]))


def likelihood_at(problem: Problem, at: Linearization, sizes: Sizes, effects: Sequence[str]) -> Likelihood:
    """The likelihood at a linearization, with what would leave its bounds held there."""
    free = Likelihood(problem, at)
    held = free.held_at_bounds(sizes, effects)
    return free.holding(held) if held else free


def objective(
    problem: Problem,
    point: Point,
    errors: Array,
    sizes: Sizes,
    effects: Sequence[str],
    likelihood: SharedLikelihood,
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
