"""The inputs that steer a model which does not call them delta or delta_s, read as a rudder or a plane would be.

A nozzle, a jet, two pods, a wheel: each counts as the angle of a rudder that is positive for a turn to starboard, or of
a plane that is positive for a bow that goes down, whatever the model's own sense. A pod aft that pushes to starboard
turns the vehicle to port.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from seatruth.effects.commands import FULL, NOT_COMPUTED
from seatruth.effects.undeclared_actuators import (
    bare,
    drive_inputs,
    named_steering,
    resting_inputs,
    steering_inputs,
    unnamed_steering,
)
from seatruth.models.actuators import Rudder, Thruster
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.rates import rates_at
from seatruth.trials.trial import Trial

Kind = Literal["rudder", "plane"]
_RATES: Mapping[Kind, tuple[str, float]] = MappingProxyType({"rudder": ("r", 1.0), "plane": ("q", -1.0)})
"""The rate that a rudder or a plane changes, and its sign where the angle is positive."""
_SPEED, _REVOLUTIONS = 0.3, 10.0
"""m/s and rev/s at which the sense of an angle is tried: slow under much thrust, so that a propeller pushes. [S]"""
_TRIED = 0.1
"""rad: the angle that is tried. [S]"""


@dataclass(frozen=True)
class Gear:
    """How an input counts as an angle: `rest` amidships, and `radian` more for 1 rad, negative where it turns back."""

    rest: float
    radian: float

    def angle(self, values: Any) -> Any:
        """The angle (n,), rad, of values (n,) of the input."""
        return (values - self.rest) / self.radian

    def order(self, angle: float) -> float:
        """The input that gives an angle, rad."""
        return self.rest + self.radian * angle


def steering_gear(model: Model, kind: Kind) -> dict[str, Gear]:
    """The inputs that steer a model as its rudders do, or its planes; those in a unit that is no angle are left out.

    Example:
        >>> from seatruth import Channel, Model
        >>> class Pod(Model):
        ...     name = "pod"
        ...     states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"))
        ...     inputs = (Channel("azimuth", "rad"), Channel("n", "rev/s"))
        ...
        ...     @staticmethod
        ...     def rhs(s, i, p):
        ...         return i.n - s.u, -i.n * i.azimuth - s.r
        >>> steering_gear(Pod(), "rudder")
        {'azimuth': Gear(rest=0.0, radian=-1.0)}
    """
    units = {channel.name: channel.unit for channel in model.inputs}
    commands = unnamed_steering(model) if kind == "rudder" else {}
    named = {one.input: one for one in model.actuators if isinstance(one, Rudder)}
    found = {}
    for name in steering_inputs(model, kind):
        if name in commands:
            rest, radian = commands[name]
        elif units.get(name) == "rad":
            rest, radian = 0.0, 1.0
        elif name in named:
            rest, radian = named_steering(model, named[name])
        else:
            continue
        found[name] = Gear(rest, _sense(model, name, kind, rest, _TRIED * radian) * radian)
    return found


def mean_angle(gear: Mapping[str, Gear], known: Mapping[str, Any]) -> Any:
    """The mean angle (n,), rad, of those that are known; None where none is."""
    angles = [one.angle(known[name]) for name, one in gear.items() if name in known]
    return np.mean(angles, axis=0) if angles else None


def with_planes(model: Model | None, log: Trial) -> Trial:
    """The log with the input delta_s, the mean of the planes of a model, where it has none and the model's others."""
    known = {**log.outputs, **log.inputs}
    angle = None if model is None or "delta_s" in known else mean_angle(steering_gear(model, "plane"), known)
    return log if angle is None else replace(log, inputs={**log.inputs, "delta_s": angle})


def _sense(model: Model, name: str, kind: Kind, rest: float, step: float) -> float:
    """1 where more of an input does what more of a rudder or a plane does, else -1; 1 where it cannot be told."""
    if isinstance(model, BlackBox):
        return float(model.standard_of(name)[1])
    model = bare(model)
    rate, sign = _RATES[kind]
    states = [model.standard_of(state.name) for state in model.states]
    places = [k for k, (standard, _) in enumerate(states) if standard == rate]
    if not places:
        return 1.0
    thrusters = {one.input: one.full for one in model.actuators if isinstance(one, Thruster)}
    resting = resting_inputs(model) or {}
    inputs = {channel.name: resting.get(channel.name, 0.0) for channel in model.inputs}
    for channel in model.inputs:
        if channel.name in thrusters:
            inputs[channel.name] = thrusters[channel.name]
        elif channel.name in drive_inputs(model):
            here = inputs[channel.name]
            inputs[channel.name] = _REVOLUTIONS if channel.unit == "rev/s" else here + FULL.get(here, 1.0)
    ahead = {channel.name: _SPEED * one for channel, (standard, one) in zip(model.states, states) if standard == "u"}
    try:
        before, after = (rates_at(model, ahead, {**inputs, name: value})[places[0]] for value in (rest, rest + step))
    except NOT_COMPUTED:
        return 1.0
    turned = sign * states[places[0]][1] * (after - before)
    return -1.0 if math.isfinite(turned) and turned < 0.0 else 1.0
