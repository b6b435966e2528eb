"""Sensors that sit elsewhere than the model has them, or are turned: lever arms and misalignment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.effects.sensors import LOG
from seatruth.effects.vehicle import dimensions_of
from seatruth.models.base import Model
from seatruth.models.observed import stated_place
from seatruth.models.parameter import Parameter, Prior

_SURER = 0.2
"""Part of its usual error that an arm has whose place is stated, at least. [S]"""
_OF_LENGTH = 0.25
"""Part of the vehicle's length above which no arm is typical. [S] Half a metre, as of an AUV of 2 m or more, is longer
than a frame of 0.46 m, whose antenna 0.03 m off was "next to nothing" (an opened case). A ship's 20 m are a fifth."""
_CONFUSED = 0.3
"""Part of a stated arm by which it is typically wrong. [S] A wrong sign is twice the arm, and so 2.7 deviations of a
prior of two and a half times a typical error."""


class PlacedSensor(Effect):
    """A sensor that sits elsewhere than the study has it. Where it states the place (`at`), that was measured.

    Beside a model that drifts otherwise in a turn an arm of some metres explains much: of a planing boat of 7.5 m,
    whose antenna was where the study had it, 4.8 +- 1.0 m.
    """

    measures: ClassVar[tuple[str, ...]] = ()
    """Names of what the sensor measures."""
    axes: ClassVar[tuple[int, ...]] = (0, 1)
    """Body axes along which the arm lies: forward, starboard, down."""

    def priors(self, model: Model) -> dict[str, Prior]:
        priors, place = super().priors(model), stated_place(model, self.measures)
        size = dimensions_of(model)
        if size is not None and (longest := max(one.sd for one in priors.values())) > _OF_LENGTH * size.length:
            ratio = _OF_LENGTH * size.length / longest
            priors = {name: Prior(one.mean, ratio * one.sd) for name, one in priors.items()}
        if place is None:
            return priors
        arm = _CONFUSED * math.hypot(*(place[axis] for axis in self.axes))
        return {name: Prior(one.mean, min(one.sd, max(_SURER * one.sd, arm))) for name, one in priors.items()}


class LogLeverArm(PlacedSensor):
    """The log sits away from the origin of the model, and measures the speed there."""

    name = "log_lever_arm"
    title = "lever arm of the log"
    cause = "sensor.alignment.speed"
    number = 8
    equation = "u_m = u - starboard r, v_m = v + forward r"
    source = "[L] velocity of a point of a rigid body; [S] magnitude of the catalogue: 0.1 to 2 m, ships 1 to 50 m"
    acts_on = ("sensor:u", "sensor:v")
    confused_with = ("sway_bias", "munk", "cross_flow", "position_lever_arm")
    distinguished_by = "in proportion to the rate of turn, at once, with its sign"
    needs_outputs = ("u", "v", "r")
    measures = ("u", "v", "u_w", "v_w")
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"], "v": LOG["v"]}
    parameters = (
        Parameter("forward", 0.5, "m", -100.0, 100.0, source="[S] chosen here", description="sensor ahead of origin"),
        Parameter("starboard", 0.2, "m", -30.0, 30.0, source="[S] chosen here", description="sensor to starboard"),
    )
    null: Mapping[str, float] = {"forward": 0.0, "starboard": 0.0}
    typical_by_kind: ClassVar[Mapping[str, Mapping[str, float]]] = {"ship": {"forward": 20.0, "starboard": 5.0}}
    froude: ClassVar[Mapping[str, float]] = {"forward": 1.0, "starboard": 1.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(u=y.u - q.starboard * y.r, v=y.v + q.forward * y.r)


class LogLeverArmVertical(PlacedSensor):
    """The log sits away from the origin of the model in the diving plane, and measures the speed there."""

    name = "log_lever_arm_vertical"
    title = "lever arm of the log in the diving plane"
    cause = "sensor.alignment.speed"
    number = 8
    equation = "u_m = u + below q, w_m = w - forward q"
    source = LogLeverArm.source
    acts_on = ("sensor:u", "sensor:w")
    confused_with = ("munk_vertical", "cross_flow_vertical")
    distinguished_by = "in proportion to the pitch rate, at once, with its sign"
    needs_outputs = ("u", "w", "q")
    measures = ("u", "w", "u_w", "w_w")
    axes = (0, 2)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"], "w": LOG["w"]}
    parameters = (
        Parameter("forward", 0.5, "m", -100.0, 100.0, source="[S] chosen here", description="sensor ahead of origin"),
        Parameter("below", 0.2, "m", -30.0, 30.0, source="[S] chosen here", description="sensor below origin"),
    )
    null: Mapping[str, float] = {"forward": 0.0, "below": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(u=y.u + q.below * y.q, w=y.w - q.forward * y.q)


class LogMisalignment(Effect):
    """The axes of the log are turned from those of the vehicle."""

    name = "log_misalignment"
    title = "misalignment of the log"
    cause = "sensor.alignment.speed"
    number = 8
    equation = "(u_m, v_m) = R(angle)^T (u, v)"
    source = "[L] components in turned axes; [S] magnitude of the catalogue: 0.01 to 0.1 rad before calibration"
    acts_on = ("sensor:u", "sensor:v")
    confused_with = ("sway_bias", "heading_bias", "current", "rudder_offset")
    distinguished_by = "on a straight course the log drifts, in proportion to the speed; the track keeps to the heading"
    needs_outputs = ("u", "v")
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"], "v": LOG["v"]}
    parameters = (
        Parameter("angle", 0.035, "rad", -1.6, 1.6, source="[S] chosen here", description="log turned to starboard"),
    )
    null: Mapping[str, float] = {"angle": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        c, d = math.cos(q.angle), math.sin(q.angle)
        return y._replace(u=c * y.u + d * y.v, v=c * y.v - d * y.u)


class LogMisalignmentVertical(LogMisalignment):
    """The axes of the log are pitched from those of the vehicle.

    Beside a model without a pitch angle the pitch of the vehicle itself, bow down under thrust, shows the same.
    """

    name = "log_misalignment_vertical"
    title = "misalignment of the log in the diving plane"
    equation = "u_m = u cos(angle) + w sin(angle), w_m = w cos(angle) - u sin(angle)"
    acts_on = ("sensor:u", "sensor:w")
    confused_with = ("current_along", "plane_offset", "net_weight", "log_lever_arm_vertical")
    distinguished_by = "in proportion to the speed; depth and pitch angle do not show it"
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"], "v": LOG["w"]}
    parameters = (LogMisalignment.parameters[0].replace(description="log pitched bow down"),)

    def missing(self, model: Model) -> str:
        reason = super().missing(model)
        if not reason and "theta" not in {channel.name for channel in (*model.states, *model.outputs)}:
            reason = "the model has no pitch angle 'theta', without which the vehicle's own pitch shows the same"
        return reason


class PositionLeverArm(PlacedSensor):
    """The antenna (or tracked mark) sits away from the origin of the model, or from the place that the study states.

    A receiver's velocity north and east, or its speed and course over ground, is that of its antenna: where a log holds
    it, and the rate of turn, the arm acts on it too.
    """

    name = "position_lever_arm"
    title = "lever arm of the position sensor"
    cause = "sensor.alignment.position"
    number = 8
    equation = "(x_m, y_m) = (x, y) + R(psi) (forward, starboard); (v_n, v_e), or sog and cog, alike, by its rate"
    source = LogLeverArm.source
    acts_on = ("sensor:x", "sensor:y")
    confused_with = ("log_lever_arm", "position_delay")
    distinguished_by = "turns with the heading and is bounded: the start of a turn"
    needs_outputs = ("x", "y", "psi")
    measures = ("x", "y")
    parameters = LogLeverArm.parameters
    null: Mapping[str, float] = {"forward": 0.0, "starboard": 0.0}
    typical_by_kind = LogLeverArm.typical_by_kind
    froude = LogLeverArm.froude

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        c, d = math.cos(y.psi), math.sin(y.psi)
        north, east = q.forward * c - q.starboard * d, q.forward * d + q.starboard * c
        y = y._replace(x=y.x + north, y=y.y + east)
        if not hasattr(y, "r"):
            return y
        if hasattr(y, "v_n") and hasattr(y, "v_e"):
            y = y._replace(v_n=y.v_n - east * y.r, v_e=y.v_e + north * y.r)
        if hasattr(y, "sog") and hasattr(y, "cog"):
            # Along the course and to starboard of it: so the course goes on through whole turns.
            c, d = math.cos(y.cog), math.sin(y.cog)
            along, across = y.sog + (north * d - east * c) * y.r, (north * c + east * d) * y.r
            speed = math.sqrt(along * along + across * across + 1e-12)
            y = y._replace(sog=speed, cog=y.cog + math.atan2(across, along))
        return y


class DepthLeverArm(PlacedSensor):
    """The depth sensor sits ahead of the origin of the model."""

    name = "depth_lever_arm"
    title = "lever arm of the depth sensor"
    cause = "sensor.alignment.depth"
    number = 8
    equation = "z_m = z - forward sin(theta)"
    source = LogLeverArm.source
    acts_on = ("sensor:z",)
    confused_with = ("depth_lag", "depth_bias")
    distinguished_by = "follows the pitch angle at once"
    needs_outputs = ("z", "theta")
    measures = ("z",)
    axes = (0,)
    parameters = LogLeverArm.parameters[:1]
    null: Mapping[str, float] = {"forward": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(z=y.z - q.forward * math.sin(y.theta))
