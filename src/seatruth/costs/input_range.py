"""Whether inputs run far beyond full power: a column in another unit, or without its scale or offset."""

from __future__ import annotations

import numpy as np

from seatruth.costs.problem import EstimationProblem
from seatruth.effects.undeclared_actuators import resting_inputs
from seatruth.models.actuators import Thruster, at_full_power
from seatruth.models.black_box import BlackBox
from seatruth.trials.finding import Finding
from seatruth.units import PULSES

_BEYOND = 2.0
"""Times full power, over the rest, from which a drive that runs is read wrongly: engines give a tenth more than their
rated power. Chosen here [S]."""


def input_range(problem: EstimationProblem) -> list[Finding]:
    """A warning for each input of thrusters that usually lies beyond full power, as the model states it.

    Args:
        problem: the study. Samples at rest, and pulses of 0 us of an output that is off, do not count.
    """
    model, found = problem.model, list[Finding]()
    resting = {} if isinstance(model, BlackBox) else resting_inputs(model) or {}
    units = {channel.name: channel.unit for channel in model.inputs}
    for one in model.actuators:
        parts = [trial.inputs[one.input] for trial in problem.trials if one.input in trial.inputs]
        told = {finding.channel for finding in found}
        if not isinstance(one, Thruster) or not parts or one.input in told:
            continue
        unit, rest = units[one.input], resting.get(one.input, 0.0)
        values = np.concatenate(parts)
        values = values[np.isfinite(values)]
        values = values[values != 0.0] if unit in PULSES else values
        over = np.abs(values - rest)
        over = over[over > 0.0]
        if not over.size or float(np.median(over)) <= _BEYOND * at_full_power(one.full, rest):
            continue
        said = "" if unit == "1" else f" {unit}"
        at_rest = f"; it rests at {rest:g}{said}" if rest else ""
        found.append(
            Finding(
                "warning",
                "input-range",
                f"It runs from {float(values.min()):.4g} to {float(values.max()):.4g}{said}, and full power of the "
                f"thruster {one.name!r} is {one.full:g}{said}{at_rest}.",
                f"channel {one.input!r}",
                "Check the unit of its column in [channels], and its scale and offset; or `full` in the model.",
                channel=one.input,
            )
        )
    return found
