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
    return compensating(problem, point)(shared)


def compensating(problem: Problem, point: Point) -> Callable[[Array], Point]:
    """The same for any shared unknowns (S,) in the place of the point's, whose motion is simulated once."""
    model = problem.discrepancy
    if not isinstance(model, DiscrepancyModel):
        return lambda shared: Point(shared, point.initial, point.forces)
    equations, states = _Equations(problem, model), problem.states(point)
    before = equations.accelerations(point.shared, states)

    def to(shared: Array) -> Point:
        change = [b - a for a, b in zip(before, equations.accelerations(shared, states))]
        return Point(shared, point.initial, point.forces - _between_knots(problem, model, change))

    return to


def along(problem: Problem, point: Point, whole: Solution) -> Callable[[float], Point]:
    """Where parts of a step lead, with missing forces in the place of what the step's slope leaves out.

    To first order that is the step itself. Whatever the shared unknowns and the motion change beyond, a wind by its
    square, a rudder by the flow of the propeller or a damping by the speed, is taken from the forces, so that each
    trial moves as the slope has it. Raises TypeError for a black box.
    """
    model = problem.discrepancy
    if not isinstance(model, DiscrepancyModel):
        raise TypeError("a black box has no equations along which forces could be told")
    near, equations = problem.moved(point, whole.shared, whole.local, _SLOPE), _Equations(problem, model)
    states, beside = problem.states(point), problem.states(near)
    before = equations.accelerations(point.shared, states)
    after = equations.accelerations(near.shared, beside)
    slopes = [(b - a) / _SLOPE for a, b in zip(before, after)]
    motions = [(b - a) / _SLOPE for a, b in zip(states, beside)]

    def to(part: float) -> Point:
        moved = problem.moved(point, whole.shared, whole.local, part)
        there = [motion + part * slope for motion, slope in zip(states, motions)]
        found = equations.accelerations(moved.shared, there)
        beyond = [c - a - part * slope for a, slope, c in zip(before, slopes, found)]
        return Point(moved.shared, moved.initial, moved.forces - _between_knots(problem, model, beyond))

    return to


class _Equations:
    """The equations of motion with the inputs of all trials, one after the other."""

    def __init__(self, problem: Problem, model: DiscrepancyModel) -> None:
        self._problem, self._model, trials = problem, model, problem.trials
        order = [channel.name for channel in model.states]
        self._rows = [order.index(state) for state in problem.equations]
        self._names = [unknown.name for unknown in problem.unknowns]
        inputs = [np.concatenate([trial.inputs[channel.name] for trial in trials]) for channel in model.inputs]
        self._t = np.concatenate([trial.t for trial in trials])
        self._inputs = np.array(inputs).reshape(len(inputs), len(self._t)).T
        self._own = np.concatenate([np.full(len(trial), model.number_of(trial.name)) for trial in trials])
        self._ends = np.cumsum([len(trial) for trial in trials])[:-1]

    def accelerations(self, shared: Array, states: list[Array]) -> list[Array]:
        """Accelerations (n, E) along each trial's motion (n, S) with these shared unknowns.

        Each trial's own missing forces are not among them.
        """
        motion, known = np.concatenate(states), self._problem.space.nominal()
        rates = evaluate_rhs(
            self._model, shared, self._names, known, motion, self._inputs, self._t, trial=self._own
        )  # fmt: skip
        return np.split(rates[:, self._rows], self._ends)


def _between_knots(problem: Problem, model: DiscrepancyModel, series: list[Array]) -> Array:
    """Accelerations (n, E) of each trial as straight lines between knots (T, E, K); what is not finite counts not."""
    found = np.zeros((len(series), len(problem.equations), problem.settings.knots))
    for number, (trial, values) in enumerate(zip(problem.trials, series)):
        t, finite = np.asarray(trial.t), np.isfinite(values).all(axis=1)
        basis = hats(t[finite] - t[0], model.spacing, problem.settings.knots)
        gram = basis.T @ basis
        # Knots beyond the end of a trial hold nothing.
        gram[np.diag_indices_from(gram)] += _RIDGE * max(float(np.trace(gram)), 1.0)
        found[number] = np.linalg.solve(gram, basis.T @ values[finite]).T
    return found
