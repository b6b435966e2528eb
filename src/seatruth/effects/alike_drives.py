"""Drives that are alike, as the model declares them or as its equations show."""

from __future__ import annotations

import math
from collections.abc import Mapping

from seatruth.effects.commands import NOT_COMPUTED
from seatruth.effects.undeclared_actuators import bare, drive_inputs, resting_inputs, steering_inputs
from seatruth.models.actuators import Thruster, push
from seatruth.models.base import Model, record
from seatruth.models.rates import rates_at

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Equations in the order of the components of a thruster's `push`."""
_MOTIONS = dict(zip("uvwpqr", AXES))
"""The equation of each motion, by its standard name."""
Kind = Mapping[str, Mapping[str, float]]
"""Drives that are alike: what the thrust of each does in each equation, by its input and by words for the equation."""
_TRIED = (0.1, -0.1)
"""Changes of a drive's input that are tried, over the input at rest, or by themselves where that is zero. [S]"""
_DIGITS = 6
"""To which accelerations of drives that are alike agree."""


def kinds_of_drives(model: Model) -> list[Kind]:
    """Drives that are alike and have inputs of their own, two or more of each kind.

    Named thrusters are alike that have the same full power and direction; directions are alike where only signs differ,
    as those of thrusters that are set aslant around a vehicle do. Where a model names none, those are alike whose
    inputs accelerate it as much at rest, in each equation: none where more than one angle steers it, with which the
    direction of their thrust may change.

    Example:
        >>> from seatruth import load_model
        >>> [list(kind) for kind in kinds_of_drives(load_model("twin_thruster"))]
        [['n_port', 'n_starboard']]
    """
    model = bare(model)
    kinds = _named(model) if any(isinstance(one, Thruster) for one in model.actuators) else _unnamed(model)
    return [kind for kind in kinds if len(kind) > 1]


def _named(model: Model) -> list[Kind]:
    p = record("Parameters", model.parameters)(**model.nominal())
    kinds: dict[tuple[float, ...], dict[str, dict[str, float]]] = {}
    for one in model.actuators:
        if isinstance(one, Thruster):
            pushed = push(one, p)
            direction = (round(abs(share), 3) for share in pushed[:3])
            own = kinds.setdefault((one.full, *direction), {}).setdefault(one.input, dict.fromkeys(AXES, 0.0))
            for axis, share in zip(AXES, pushed):
                own[axis] += share
    return list(kinds.values())


def _unnamed(model: Model) -> list[Kind]:
    drives, resting = drive_inputs(model), resting_inputs(model)
    if len(drives) < 2 or resting is None or len(steering_inputs(model, "rudder")) > 1:
        return []
    found = {name: [_accelerations(model, name, resting, change) for change in _TRIED] for name in drives}
    most = max((abs(x) for both in found.values() for one in both for x in one.values()), default=0.0)
    if not 0.0 < most < math.inf:
        return []
    kinds: dict[tuple[float, ...], dict[str, dict[str, float]]] = {}
    for name, (ahead, astern) in found.items():
        # Those of alike drives differ in sign alone, both ways.
        turned = {axis: math.copysign(1.0, ahead[axis]) / most for axis in ahead}
        sizes = (round(one[axis] * turned[axis], _DIGITS) for one in (ahead, astern) for axis in ahead)
        kinds.setdefault(tuple(sizes), {})[name] = dict.fromkeys(AXES, 0.0) | ahead
    return list(kinds.values())


def _accelerations(model: Model, name: str, resting: Mapping[str, float], change: float) -> dict[str, float]:
    """What a drive adds to the rates of the motions of a model at rest, by equation; NaN where it is not computed."""
    motions = [model.standard_of(state.name)[0] for state in model.states]
    rows = {_MOTIONS[motion]: k for k, motion in enumerate(motions) if motion in _MOTIONS}
    changed = {**resting, name: resting[name] + change * (abs(resting[name]) or 1.0)}
    try:
        before, after = (rates_at(model, inputs=one) for one in (resting, changed))
        return {axis: float(after[k] - before[k]) for axis, k in rows.items()}
    except NOT_COMPUTED:
        return dict.fromkeys(rows, math.nan)
