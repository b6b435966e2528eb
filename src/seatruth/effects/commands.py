"""Inputs without a unit, from -1 to 1, in per cent or in pulses: where they rest, and which of them steer a model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from seatruth.models.base import Model
from seatruth.models.rates import rates_at

FULL: Mapping[float, float] = MappingProxyType(
    {0.0: 1.0, 1500.0: 500.0, 50.0: 50.0, 127.5: 127.5, 90.0: 90.0, 0.5: 0.5}
)
"""Commands at which actuators rest, with what full command adds: shares of both signs, pulses (us), per cent, bytes,
degrees of servos, shares from 0 to 1. [L] 1.5 ms is the middle of hobby servos and electronic speed controllers, whose
pulses last 1 to 2 ms."""
FULL_RUDDER = math.radians(35.0)
"""rad, as which full command of a steering command counts. [L] The largest rudder angle of ships, by the rules of
classification; jets and outboard engines turn by 25 to 35 deg."""
NOT_COMPUTED = (ArithmeticError, ValueError, TypeError)
"""What equations raise outside their range: a negative command to a broken power is a complex number."""
_TRIED = 0.1
"""Part of full command that is tried. [S]"""
_STRAIGHT = 1e-9
"""Part of a change below which a rate counts as none: rounding."""
_SYMMETRIC = 1e-6
"""Part of the larger change of surge to either side below which both are the same."""


class SteeringCommand(NamedTuple):
    """An input without a unit that steers: where it rests, and how much of it counts as 1 rad."""

    neutral: float
    radian: float


def steering_commands(model: Model, free: Sequence[str]) -> dict[str, SteeringCommand]:
    """Those of some inputs without a unit that turn a model under way to either side alike, and do nothing at rest.

    So a rudder does, a nozzle and an outboard engine; a thruster to one side drives ahead as well, or turns at rest.

    Args:
        model: of equations with surge and yaw; of another one, none steer.
        free: the inputs that may.

    Example:
        >>> from seatruth import Channel, Model
        >>> class Jet(Model):
        ...     name = "jet"
        ...     states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"))
        ...     inputs = (Channel("steer", "1"), Channel("throttle", "1"))
        ...
        ...     @staticmethod
        ...     def rhs(s, i, p):
        ...         return i.throttle - s.u, i.throttle * i.steer - s.r
        >>> {name: one.neutral for name, one in steering_commands(Jet(), ["steer", "throttle"]).items()}
        {'steer': 0.0}
    """
    motions = [model.standard_of(state.name)[0] for state in model.states]
    if not {"u", "r"} <= {*motions}:
        return {}
    found = {}
    for name in free:
        rest = next((rest for rest in FULL if _steers(model, name, free, rest, motions)), None)
        if rest is not None:
            found[name] = SteeringCommand(rest, FULL[rest] / FULL_RUDDER)
    return found


def _steers(model: Model, name: str, free: Sequence[str], rest: float, motions: Sequence[str]) -> bool:
    """Whether a command that rests there turns the model under way to either side alike, and does nothing at rest."""
    step = _TRIED * FULL[rest]
    resting = dict.fromkeys(free, rest)
    ahead = {other: rest + FULL[rest] for other in free if other != name} | {name: rest}
    try:
        still = [_rates(model, {**resting, name: rest + change}, 0.0, motions) for change in (0.0, step, -step)]
        moving = [_rates(model, {**ahead, name: rest + change}, 1.0, motions) for change in (0.0, step, -step)]
    except NOT_COMPUTED:
        return False
    turn, left, right = (rates["r"] for rates in moving)
    most = max(abs(left - turn), abs(right - turn))
    if not 0.0 < most < math.inf or abs(turn) > _STRAIGHT * most:
        return False
    still_turns = max(abs(rates["r"] - still[0]["r"]) for rates in still)
    slowed, other = (rates["u"] - moving[0]["u"] for rates in moving[1:])
    alike = abs(slowed - other) <= _SYMMETRIC * max(abs(slowed), abs(other), most)
    return alike and still_turns <= _STRAIGHT * most and abs(left + right) <= _SYMMETRIC * most


def _rates(model: Model, inputs: Mapping[str, float], speed: float, motions: Sequence[str]) -> dict[str, float]:
    """Rates of the motions at a speed ahead, by their standard names; other drives turn or push with it."""
    ahead = {state.name: speed for state, motion in zip(model.states, motions) if motion == "u"}
    other = {channel.name: speed for channel in model.inputs if channel.unit in ("rev/s", "N")}
    return dict(zip(motions, rates_at(model, ahead, {**other, **inputs}).tolist()))
