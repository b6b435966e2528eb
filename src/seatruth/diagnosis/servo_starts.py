"""Where the actuators behind servos stand when a trial, or a section of it, begins: what is believed of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Model, whole_name
from seatruth.models.servo_black_box import acting
from seatruth.trials.trial import Trial

_LEAST_LAG = 0.01
"""Least prior deviation of an actuator from its first order, as a part of the range of orders: that of one which hardly
lags. [S]"""


def begun_under_way(
    model: Model, whole: Sequence[Trial], trials: Sequence[Trial], values: Mapping[str, float], first: Array
) -> Array:
    """Initial states (T, S), `first` for whole trials; those of sections have their actuators where they then are.

    An actuator follows the orders of the whole trial, behind the servo that these values of the parameters make.
    """
    found, order = np.array(first), [channel.name for channel in model.states]
    named = {trial.name: trial for trial in whole}
    parts = [(k, part, whole_name(part.name)) for k, part in enumerate(trials) if part.name not in named]
    runs = {name: acting(model, named[name], values) for name in {name for *_, name in parts}}
    for k, part, name in parts:
        for state, moved in runs[name].items():
            found[k, order.index(state)] = np.interp(part.t[0], named[name].t, moved)
    return found


def near_orders(
    model: Model, trials: Sequence[Trial], states: Sequence[Array], names: Sequence[str], sd: Array
) -> Array:
    """Prior deviations (I,) of initial states, those of actuators no wider than they usually are from their orders.

    `sd` (I,) are the deviations of the initial states of these names where nothing else is known, `states` (n, S) the
    motions by the model as it is declared, by trial.
    """
    found, order = np.array(sd), [channel.name for channel in model.states]
    angles = {channel.name for channel in model.inputs if channel.angle}
    for servo in model.servos:
        if servo.state not in names:
            continue
        column, place = order.index(servo.state), list(names).index(servo.state)
        behind = np.concatenate([np.asarray(t.inputs[servo.input]) - x[:, column] for t, x in zip(trials, states)])
        if servo.input in angles:
            behind = (behind + math.pi) % (2.0 * math.pi) - math.pi
        behind = behind[np.isfinite(behind)]
        usual = float(np.sqrt(np.mean(behind**2))) if behind.size else math.inf
        found[place] *= min(1.0, max(_LEAST_LAG, usual / found[place]))
    return found
