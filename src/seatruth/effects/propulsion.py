"""Side force, torque and errors of the thrust of the propeller."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.vehicle import motion_channels, role_of
from seatruth.models.base import Environment, Model, record
from seatruth.models.parameter import Parameter

STERN = 0.48
"""Propeller aft of midship over the length [L, KVLCC2]."""


class OfPropeller(Effect):
    """Base of effects that go with the thrust as it is driven, whatever the inputs that drive it are called.

    With a thrust that depends on no input they are a constant force, which says nothing of a propeller.
    """

    def missing(self, model: Model) -> str:
        reason = super().missing(model)
        if not reason and not _drivers(model):
            reason = "the model's thrust depends on no input"
        return reason


class AtStern(OfPropeller):
    """Base of those that act where a single propeller is: at the stern, on the centreline.

    Several thrusters have places of their own; `thruster_direction` is the side force of those that a model names.
    """

    def missing(self, model: Model) -> str:
        reason = super().missing(model)
        if not reason and len(_drivers(model)) > 1:
            reason = "several inputs drive the model, which so has no single propeller at the stern"
        return reason


class PropellerWalk(AtStern):
    """Side force of the propeller at the stern, with the square of the revolutions."""

    name = "propeller_walk"
    title = "propeller side force"
    cause = "actuator.propulsion.side_force"
    number = 16
    equation = "Y = k T_0, N = -0.48 L Y, T_0 the thrust at rest with these revolutions"
    source = "[L] wheel effect; [S] magnitude of the catalogue: 1 to 5 % of the thrust"
    acts_on = ("sway", "yaw")
    confused_with = ("rudder_offset", "thrust_misalignment", "lateral_asymmetry", "wind", "bank")
    distinguished_by = "goes with n |n| and vanishes in a coast-down: revolutions to zero at speed"
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions", "thrust")
    parameters = (Parameter("k", 0.03, "1", -0.3, 0.3, source="[S] catalogue", description="share, to starboard"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        Y = q.k * d.thrust_0
        return e._replace(Y=e.Y + Y, N=e.N - STERN * d.length * Y)


class ThrustMisalignment(AtStern):
    """The thrust points to the side by a small angle."""

    name = "thrust_misalignment"
    title = "thrust misalignment"
    cause = "actuator.propulsion.side_force"
    number = 16
    equation = "Y = T angle, N = -0.48 L Y"
    source = "[S] magnitude of the catalogue: 0.2 to 1 deg"
    acts_on = ("sway", "yaw")
    confused_with = ("propeller_walk", "rudder_offset", "wind")
    distinguished_by = "goes with the thrust, which falls with speed; the side force of `propeller_walk` does not"
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions", "thrust")
    parameters = (Parameter("angle", 0.012, "rad", -0.2, 0.2, source="[S] 0.7 deg", description="thrust to starboard"),)
    null: Mapping[str, float] = {"angle": 0.0}

    def missing(self, model: Model) -> str:
        reason = of_named_thruster(model, "thruster_direction") or super().missing(model)
        if not reason and not _falls_with_speed(model):
            reason = "the model's thrust does not depend on the speed: it is one with `propeller_walk`"
        return reason

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        Y = q.angle * d.thrust
        return e._replace(Y=e.Y + Y, N=e.N - STERN * d.length * Y)


def of_named_thruster(model: Model, instead: str) -> str:
    """Why an error of the thrust does not act where a thruster is named whose effects say the same; empty elsewhere."""
    named = model.thrust is None and model.thrusts is not None and role_of(model, "thrust") is not None
    return f"the model names its thruster, of which {instead!r} says the same" if named else ""


def _falls_with_speed(model: Model) -> bool:
    """Whether a model's thrust at the same revolutions depends on the speed."""
    inputs = [1.0 for _ in model.inputs]
    return _thrust(model, 0.0, inputs) != _thrust(model, 1.0, inputs)


def _drivers(model: Model) -> list[str]:
    """Inputs that drive a model: its propeller's revolutions n, else those on which its thrust depends."""
    names = [channel.name for channel in model.inputs]
    revolutions = [name for name in names if model.standard_of(name)[0] == "n"]
    if revolutions:
        return revolutions
    found = set()
    for size in (1.0, 10.0, 100.0):  # shares, a battery's volts, rev/s
        inputs = [size for _ in names]
        usual = _thrust(model, 0.0, inputs)
        # One at a time: opposed thrusters under equal orders push nowhere.
        found |= {k for k in range(len(names)) if _thrust(model, 0.0, [*inputs[:k], 0.0, *inputs[k + 1 :]]) != usual}
    return [names[k] for k in sorted(found)]


def _thrust(model: Model, u: float, inputs: Sequence[float]) -> float:
    """A model's thrust (N) ahead at the speed `u` (m/s) under its inputs, in their order; NaN where it has none there.

    It is declared, or follows from the equations.
    """
    thrust = role_of(model, "thrust")
    motions = motion_channels(model)
    s = record("States", motions)(*(u if c.name == "u" else 0.0 for c in motions))
    i = record("Inputs", model.inputs)(*inputs)
    p = record("Parameters", model.parameters)(**model.nominal())
    try:
        return float(thrust(s, i, p, Environment()))
    except (ArithmeticError, ValueError):
        return math.nan


class PropellerTorque(OfPropeller):
    """The propeller's torque rolls the vehicle."""

    name = "propeller_torque"
    title = "propeller torque in roll"
    cause = "actuator.propulsion.torque"
    number = 17
    equation = "K = k B T_0, T_0 the thrust at rest with these revolutions"
    source = "[S] catalogue: lists by 0.5 to 5 deg"
    acts_on = ("roll",)
    equivalent = ("k_Q",)
    confused_with = ("lateral_offset",)
    distinguished_by = "changes with the revolutions, a weight's list does not"
    needs_states = ("phi", "p")
    needs_vehicle = ("dimensions", "thrust")
    parameters = (Parameter("k", 0.03, "1", -1.0, 1.0, source="[S] chosen here", description="to starboard down"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return e._replace(K=e.K + q.k * d.breadth * d.thrust_0)


class ThrustGain(Effect):
    """The propeller gives another share of its thrust: battery, ventilation, fouling."""

    name = "thrust_gain"
    title = "thrust gain"
    cause = "actuator.propulsion.thrust"
    number = 18
    equation = "T = (1 + k) T_0"
    source = "[S] magnitude of the catalogue: -0.2 to 0.05"
    acts_on = ("surge",)
    equivalent = ("X_T", "T", "t_P", "k_2")
    confused_with = ("drag_increase", "speed_scale", "current")
    distinguished_by = "same coast-down: revolutions to zero at speed"
    needs_states = ("u",)
    needs_vehicle = ("thrust",)
    parameters = (Parameter("k", -0.1, "1", -0.9, 3.0, source="[S] catalogue", description="relative change"),)
    null: Mapping[str, float] = {"k": 0.0}

    def missing(self, model: Model) -> str:
        return of_named_thruster(model, "thruster_gain") or super().missing(model)

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return e._replace(X=e.X + q.k * d.thrust)
