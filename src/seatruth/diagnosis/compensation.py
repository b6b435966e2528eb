"""What a change of parameters does to the forces along a motion, so that missing forces can take its place.

Over a long run a small change of any parameter drives the model away from its record, and no step that is linear in the
parameters survives. With each trial's own missing forces changed by as much the other way, the motion stays: what the
equations of motion say along it needs no simulation.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.model import DiscrepancyModel, hats
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.unknowns import Solution
from seatruth.simulate import evaluate_rhs

_SLOPE = 1e-4
"""Part of a step by which its slope is taken: differences of doubles keep twelve digits by it, and bend by 1e-4."""
_RIDGE = 1e-10
"""Ridge over the trace when lines between knots are fitted: rounding."""


def can_compensate(problem: Problem) -> bool:
    """Whether missing forces can take the place of others: not those of a black box, whose equations are unknown."""
    return isinstance(problem.discrepancy, DiscrepancyModel)


def compensated(problem: Problem, point: Point, shared: Array) -> Point:
    """The point with other shared unknowns (S,), and their change of force taken from each trial's own forces.

    Those of a black box stay: its equations would be needed.
    """
    if not can_compensate(problem):
        return Point(shared, point.initial, point.forces)
    change = _changes(problem, point, problem.states(point), shared)[0]
    return Point(shared, point.initial, point.forces - change)


def along(problem: Problem, point: Point, whole: Solution) -> Callable[[float], Point]:
    """Where parts of a step lead, with missing forces in the place of what the step's slope leaves out.

    To first order that is the step itself. Whatever the shared unknowns change beyond, a wind by its square or a rudder
    by the flow of the propeller, is taken from the forces, so that each trial moves as the slope has it.
    """
    states = problem.states(point)

    def to(part: float) -> Point:
        moved = problem.moved(point, whole.shared, whole.local, part)
        change, slope = _changes(problem, point, states, moved.shared)
        return Point(moved.shared, moved.initial, moved.forces - (change - slope))

    return to


def _changes(problem: Problem, point: Point, states: list[Array], shared: Array) -> tuple[Array, Array]:
    """Change of the forces (T, E, K) by other shared unknowns along a motion, states (n, S) by trial; and its slope."""
    model, found = problem.discrepancy, np.zeros((2, *point.forces.shape))
    columns = np.flatnonzero(shared != point.shared)
    if not isinstance(model, DiscrepancyModel) or not columns.size:
        return found[0], found[1]
    names = [problem.unknowns[k].name for k in columns]
    here, there = point.shared[columns], shared[columns]
    candidates = np.stack([here, there, here + _SLOPE * (there - here)])
    order = [channel.name for channel in model.states]
    rows = [order.index(state) for state in problem.equations]
    nominal = {**problem.space.nominal(), **problem.named(point)}
    for number, (trial, motion) in enumerate(zip(problem.trials, states)):
        t = np.asarray(trial.t)
        inputs = np.stack([np.asarray(trial.inputs[channel.name]) for channel in model.inputs], axis=1)
        own = np.full(t.size, model.number_of(trial.name))
        before, after, beside = evaluate_rhs(model, candidates, names, nominal, motion, inputs, t, trial=own)[..., rows]
        both = np.concatenate([after - before, (beside - before) / _SLOPE], axis=1)
        finite = np.isfinite(both).all(axis=1)
        basis = hats(t[finite] - t[0], model.spacing, problem.settings.knots)
        gram = basis.T @ basis
        # Knots beyond the end of a trial hold nothing.
        gram[np.diag_indices_from(gram)] += _RIDGE * max(float(np.trace(gram)), 1.0)
        found[:, number] = np.linalg.solve(gram, basis.T @ both[finite]).T.reshape(2, len(rows), -1)
    return found[0], found[1]
