"""Drives that are alike, and the inputs at which they rest, as the model declares them or as its equations show."""

from __future__ import annotations

import math
from collections.abc import Mapping

from seatruth.diagnosis.discrepancy.equations import EQUATIONS, vehicle
from seatruth.effects.undeclared_actuators import drive_commands, drive_inputs, neutral, steering_inputs
from seatruth.models.actuators import Thruster, push
from seatruth.models.base import Environment, Model, record
from seatruth.models.black_box import BlackBox

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Equations in the order of the components of a thruster's `push`."""
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
    base = vehicle(model)
    kinds = _named(base) if any(isinstance(one, Thruster) for one in base.actuators) else _unnamed(base)
    return [kind for kind in kinds if len(kind) > 1]


def rests(model: Model) -> dict[str, float]:
    """The inputs at which drives rest, by name, where that is not zero."""
    base = vehicle(model)
    value = neutral(base)
    return dict.fromkeys(drive_commands(base), value) if value else {}


def _named(base: Model) -> list[Kind]:
    p = record("Parameters", base.parameters)(**base.nominal())
    kinds: dict[tuple[float, ...], dict[str, dict[str, float]]] = {}
    for one in base.actuators:
        if isinstance(one, Thruster):
            pushed = push(one, p)
            direction = (round(abs(share), 3) for share in pushed[:3])
            own = kinds.setdefault((one.full, *direction), {}).setdefault(one.input, dict.fromkeys(AXES, 0.0))
            for axis, share in zip(AXES, pushed):
                own[axis] += share
    return list(kinds.values())


def _unnamed(base: Model) -> list[Kind]:
    drives, rest = drive_inputs(base), neutral(base)
    if len(drives) < 2 or rest is None or isinstance(base, BlackBox) or len(steering_inputs(base, "rudder")) > 1:
        return []
    found = {name: [_accelerations(base, name, rest, change) for change in _TRIED] for name in drives}
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


def _accelerations(base: Model, name: str, rest: float, change: float) -> dict[str, float]:
    """What a drive adds to the rates of the motions of a model at rest, by equation; NaN where it is not computed."""
    rows = {EQUATIONS[state.name]: k for k, state in enumerate(base.states) if state.name in EQUATIONS}
    s = record("States", base.states)(*(0.0 for _ in base.states))
    commands = dict.fromkeys((c.name for c in base.inputs), 0.0) | dict.fromkeys(drive_commands(base), rest)
    p, i = record("Parameters", base.parameters)(**base.nominal()), record("Inputs", base.inputs)(**commands)
    changed = i._replace(**{name: commands[name] + change * (abs(commands[name]) or 1.0)})
    try:
        before, after = (base.rhs(s, one, p, Environment()) for one in (i, changed))
    except (ArithmeticError, ValueError):
        return dict.fromkeys(rows, math.nan)
    return {axis: float(after[k] - before[k]) for axis, k in rows.items()}
