"""A motion near that of a study's trials, at which a model's equations are asked what acts on them."""

from __future__ import annotations

import numpy as np

from seatruth.costs.problem import EstimationProblem
from seatruth.models.base import Model

_SPEED = 2.0
"""m/s: the speed that is tried where no record has one. Chosen here [S]."""
_TURN = 0.02
"""rad/s: the rate of turn that is tried where no record has one. Chosen here [S]."""
_DRIFT = 0.1
"""Part of the speed that goes to starboard. Chosen here [S]."""


def usual_motion(
    problem: EstimationProblem, model: Model
) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Parameters, states and inputs, each by name: the speed and the turn that the trials reach, and usual inputs.

    Args:
        problem: the study, with trials and the values of its parameters.
        model: its model, with or without what is around it.
    """
    speed, turn = _usual(problem, ("u", "u_w", "sog"), _SPEED), _usual(problem, ("r",), _TURN)
    inputs = {channel.name: 0.0 for channel in model.inputs}
    for trial in problem.trials[:1]:
        inputs |= {name: float(np.median(trial.inputs[name])) for name in inputs if name in trial.inputs}
    known = {parameter.name: parameter.value for parameter in problem.parameters}
    values = {name: known.get(name, value) for name, value in model.nominal().items()}
    moving = {"u": speed, "v": _DRIFT * speed, "r": turn}
    state = {channel.name: moving.get(channel.name, 0.0) for channel in model.states}
    return values, state, inputs


def _usual(problem: EstimationProblem, names: tuple[str, ...], otherwise: float) -> float:
    """The size that the first of these channels which a trial has usually reaches; `otherwise` where none has."""
    for name in names:
        values = [np.abs(trial.outputs[name]) for trial in problem.trials if name in trial.outputs]
        whole = np.concatenate(values) if values else np.empty(0)
        whole = whole[np.isfinite(whole)]
        if whole.size and float(np.quantile(whole, 0.9)) > 0.0:
            return float(np.quantile(whole, 0.9))
    return otherwise
