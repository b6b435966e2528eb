"""Whether forces from outside act on every axis of a model: a term that is left out of one equation is no error.

Wind, a tether, lost thrust and whatever else pushes the vehicle come to its equations as `e.X` to `e.N`. Of a model
that forgets one of them every such effect is computed without that part, and a diagnosis rules it out for nothing.
"""

from __future__ import annotations

from seatruth.costs.problem import EstimationProblem
from seatruth.costs.usual_motion import usual_motion
from seatruth.effects.undeclared_actuators import bare
from seatruth.errors import SeatruthError
from seatruth.manoeuvres.stepper import EnvironmentAt, Stepper
from seatruth.models.base import Environment
from seatruth.models.black_box import BlackBox
from seatruth.text import listed
from seatruth.trials.finding import Finding

_AXES = {"u": "X", "v": "Y", "w": "Z", "p": "K", "q": "M", "r": "N"}
"""The force or moment from outside along the axis of each velocity."""


def outside_forces(problem: EstimationProblem) -> list[Finding]:
    """A warning where a force from outside does not accelerate a model along its own axis.

    Args:
        problem: the study; its model is asked near the usual motion and inputs of its trials.
    """
    model = bare(problem.model)
    names = [channel.name for channel in model.states]
    axes = {state: force for state, force in _AXES.items() if state in names}
    if isinstance(model, BlackBox) or not model.takes_environment or not axes:
        return []
    values, state, inputs = usual_motion(problem, model)
    at = tuple(state.values())
    # What a positive force adds is positive along its own axis, whatever the added masses couple.
    size = max(abs(values.get(name, 0.0)) for name in ("m", "mass")) or 1.0
    try:
        free = Stepper(model, values).rate(0.0, at, inputs)
        still = []
        for axis, force in axes.items():
            pushed = Stepper(model, values, _steady(Environment(**{force: size}))).rate(0.0, at, inputs)
            if pushed[names.index(axis)] <= free[names.index(axis)]:
                still.append((axis, force))
    except SeatruthError:  # equations that fail here are told of where they are simulated
        return []
    if not still:
        return []
    rates = listed([f"e.{force} does not raise the rate of {axis}" for axis, force in still])
    return [
        Finding(
            "warning",
            "outside-forces",
            f"A force from outside does not push it along its own axis: {rates}. Effects that push it there are "
            "computed without that part.",
            f"model {model.name!r}",
            f"Add {listed([f'e.{force}' for _, force in still])} to the forces and moments in its rhs "
            "(docs/models.md); or leave e out of rhs, if no outside force can act on it.",
        )
    ]


def _steady(environment: Environment) -> EnvironmentAt:
    return lambda t, state: environment
