"""Thrusters that a model turns otherwise than it says of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from seatruth.arrays import Array
from seatruth.effects.commands import NOT_COMPUTED
from seatruth.effects.undeclared_actuators import resting_inputs
from seatruth.errors import BadInput
from seatruth.models.actuators import Rudder, Thruster, push, radian_in, turned
from seatruth.models.base import Environment, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.rates import rates_at

_ANGLE = 0.5
"""rad by which a pod is turned to see where it pushes. [S]"""
_SAME = 1e-6
"""Part of an acceleration to which two are the same: rounding."""


def check_turned_thrusters(model: Model) -> None:
    """Raises BadInput where a rudder turns a thruster that is declared otherwise: fixed, or turned the other way.

    Effects on it would act along `towards`, whatever the angle, or mirrored: a pod that gives 15 % less than its model
    then shows no loss at all. Asked is the model at rest, with the thruster at full power and the rudder at an angle:
    what it does is compared with the declared force, along `towards` and turned from it. A rudder in a propeller's
    wash is neither.

    Example:
        >>> from seatruth import load_model
        >>> check_turned_thrusters(load_model("twin_thruster"))
    """
    if isinstance(model, BlackBox) or model.thrusts is None:
        return
    thrusters = [one for one in model.actuators if isinstance(one, Thruster)]
    rudders = [one for one in model.actuators if isinstance(one, Rudder) and one.kind == "rudder"]
    for place, thruster in enumerate(thrusters):
        for rudder in rudders:
            told = thruster.turned_by
            if told is not None and told.removeprefix("-") != rudder.input:
                continue
            sign = _turn(model, place, thruster, rudder.input)
            words = f"{'-' if sign < 0 else ''}{rudder.input}"
            if sign and told != words:
                way = "to push in one direction" if told is None else f'turned_by="{told}"'
                raise BadInput(
                    f"its input {rudder.input!r} turns the thruster {thruster.name!r} "
                    f"{'clockwise' if sign > 0 else 'anticlockwise'}, seen from above, which is declared {way}",
                    where=f"model {model.name!r}",
                    do=f'Declare it as Thruster(..., turned_by="{words}"), so that effects turn with it.',
                )


def _turn(model: Model, place: int, thruster: Thruster, angle: str) -> int:
    """Whether an input turns a thruster: 1 clockwise seen from above, -1 the other way, 0 not."""
    unit = next(channel.unit for channel in model.inputs if channel.name == angle)
    if radian_in(unit) != 1.0 or model.thrusts is None:
        return 0
    resting = resting_inputs(model) or {}
    s = record("States", model.states)(*(0.0 for _ in model.states))
    i = record("Inputs", model.inputs)(*(resting.get(channel.name, 0.0) for channel in model.inputs))
    p = record("Parameters", model.parameters)(**model.nominal())
    stopped = i._replace(**{angle: _ANGLE})
    running = stopped._replace(**{thruster.input: thruster.full})

    try:
        force = float(tuple(model.thrusts(s, running, p, Environment()))[place])
        still = rates_at(model, inputs=stopped._asdict())
        found = rates_at(model, inputs=running._asdict()) - still

        def declared(by: float) -> Array:
            a, b, *_ = push(thruster, p)
            a, b = turned(a, b, by)
            way = push(replace(thruster, towards=(a, b, push(thruster, p)[2])), p)
            X, Y, Z, K, M, N = (force * part for part in way)
            return rates_at(model, inputs=stopped._asdict(), e=Environment(X=X, Y=Y, Z=Z, K=K, M=M, N=N)) - still

        likeness = {sign: float(np.abs(found - declared(sign * _ANGLE)).max()) for sign in (0, 1, -1)}
    except NOT_COMPUTED:
        return 0
    size = float(np.abs(found).max())
    same = [sign for sign, off in likeness.items() if math.isfinite(off) and off <= _SAME * size]
    return same[0] if size > 0.0 and len(same) == 1 else 0
