"""Offsets, scale errors, places and directions of sensors. Delays: `sensor_delays`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.effects.filtered import Filtered, filter_rates, lagged
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel

LOG: Mapping[str, tuple[str, ...]] = {"u": ("u_w", "u"), "v": ("v_w", "v"), "w": ("w_w", "w")}
"""What a log shows: the speed through the water where a trial has it, else the one that the model has."""


class SpeedScale(Effect):
    """The speed log has a scale error."""

    name = "speed_scale"
    title = "speed sensor scale"
    cause = "sensor.bias_or_scale.speed"
    number = 3
    equation = "u_m = (1 + k) u"
    source = "[S] magnitude of the catalogue: 1 to 5 %"
    acts_on = ("sensor:u",)
    confused_with = ("speed_bias", "thrust_gain", "drag_increase", "current")
    distinguished_by = (
        "the position knows the speed over ground; a log of speed through water needs a reciprocal run too"
    )
    needs_outputs = ("u",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"]}
    parameters = (Parameter("k", 0.03, "1", -0.3, 0.3, source="[S] chosen here", description="relative error"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(u=y.u + q.k * y.u)


class SpeedBias(Effect):
    """The speed log has a constant offset."""

    name = "speed_bias"
    title = "speed sensor bias"
    cause = "sensor.bias_or_scale.speed"
    number = 4
    equation = "u_m = u + b"
    source = "[S] magnitude of the catalogue: 0.01 to 0.1 m/s"
    acts_on = ("sensor:u",)
    confused_with = ("current", "speed_scale")
    distinguished_by = "turns with the vehicle, a current does not: reciprocal course; vary the speed against a scale"
    needs_outputs = ("u",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"]}
    parameters = (Parameter("b", 0.05, "m/s", -1.0, 1.0, source="[S] chosen here", description="added to u"),)
    null: Mapping[str, float] = {"b": 0.0}
    froude: ClassVar[Mapping[str, float]] = {"b": 0.5}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(u=y.u + q.b)


class SwayBias(Effect):
    """The log has a constant offset in sway."""

    name = "sway_bias"
    title = "sway sensor bias"
    cause = "sensor.bias_or_scale.speed"
    number = 4
    equation = "v_m = v + b"
    source = "[S] magnitude of the catalogue: 0.01 to 0.1 m/s"
    acts_on = ("sensor:v",)
    confused_with = ("log_misalignment", "current", "heading_bias", "log_lever_arm")
    distinguished_by = "constant whatever the heading, the speed and the rate of turn"
    needs_outputs = ("v",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"v": LOG["v"]}
    parameters = (Parameter("b", 0.05, "m/s", -1.0, 1.0, source="[S] chosen here", description="added to v"),)
    null: Mapping[str, float] = {"b": 0.0}
    froude: ClassVar[Mapping[str, float]] = {"b": 0.5}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(v=y.v + q.b)


class HeadingBias(Effect):
    """The compass has a constant offset."""

    name = "heading_bias"
    title = "heading bias"
    cause = "sensor.bias_or_scale.angle"
    number = 5
    equation = "psi_m = psi + b"
    source = "[S] magnitude of the catalogue: 0.5 to 3 deg"
    acts_on = ("sensor:psi",)
    confused_with = ("current", "compass_deviation", "sway_bias", "log_misalignment")
    distinguished_by = "the error of the track turns with the heading: reciprocal and beam headings"
    needs_outputs = ("psi",)
    parameters = (Parameter("b", 0.03, "rad", -0.3, 0.3, source="[S] chosen here", description="added to psi"),)
    null: Mapping[str, float] = {"b": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(psi=y.psi + q.b)


class CompassDeviation(Effect):
    """The compass has an offset that varies once in a full turn."""

    name = "compass_deviation"
    title = "compass deviation"
    cause = "sensor.bias_or_scale.angle"
    number = 6
    equation = "psi_m = psi + A sin(psi) + B cos(psi)"
    source = "[L] semicircular deviation of magnetic compasses; [S] magnitude of the catalogue: 0.5 to 3 deg"
    acts_on = ("sensor:psi",)
    confused_with = ("heading_bias", "current")
    distinguished_by = "once in a turn: a full circle; against a current, at two speeds"
    needs_outputs = ("psi",)
    parameters = (
        Parameter("A", 0.03, "rad", -0.3, 0.3, source="[S] chosen here", description="by sin(psi)"),
        Parameter("B", 0.03, "rad", -0.3, 0.3, source="[S] chosen here", description="by cos(psi)"),
    )
    null: Mapping[str, float] = {"A": 0.0, "B": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(psi=y.psi + q.A * math.sin(y.psi) + q.B * math.cos(y.psi))


class GyroBias(Effect):
    """The yaw rate gyro has a constant offset."""

    name = "gyro_bias"
    title = "yaw gyro bias"
    cause = "sensor.bias_or_scale.rate"
    number = 7
    equation = "r_m = r + b"
    source = "[S] magnitude of the catalogue: 0.001 to 0.1 deg/s"
    acts_on = ("sensor:r",)
    confused_with = ("rudder_offset", "propeller_walk")
    distinguished_by = "a real turn shows in the heading too"
    needs_outputs = ("r",)
    parameters = (Parameter("b", 0.001, "rad/s", -0.05, 0.05, source="[S] 0.06 deg/s", description="added to r"),)
    null: Mapping[str, float] = {"b": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(r=y.r + q.b)


class PitchGyroBias(GyroBias):
    """The pitch rate gyro has a constant offset."""

    name = "pitch_gyro_bias"
    title = "pitch gyro bias"
    equation = "q_m = q + b"
    confused_with = ("plane_offset", "trim")
    distinguished_by = "a real turn shows in the pitch angle too"
    acts_on = ("sensor:q",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"r": ("q",)}


class LogLeverArm(Effect):
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


class LogLeverArmVertical(Effect):
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
        Parameter("angle", 0.035, "rad", -0.8, 0.8, source="[S] chosen here", description="log turned to starboard"),
    )
    null: Mapping[str, float] = {"angle": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        c, d = math.cos(q.angle), math.sin(q.angle)
        return y._replace(u=c * y.u + d * y.v, v=c * y.v - d * y.u)


class LogMisalignmentVertical(LogMisalignment):
    """The axes of the log are pitched from those of the vehicle."""

    name = "log_misalignment_vertical"
    title = "misalignment of the log in the diving plane"
    equation = "u_m = u cos(angle) + w sin(angle), w_m = w cos(angle) - u sin(angle)"
    acts_on = ("sensor:u", "sensor:w")
    confused_with = ("current_along", "plane_offset", "net_weight", "log_lever_arm_vertical")
    distinguished_by = "in proportion to the speed; depth and pitch angle do not show it"
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"], "v": LOG["w"]}
    parameters = (LogMisalignment.parameters[0].replace(description="log pitched bow down"),)


class PositionLeverArm(Effect):
    """The antenna (or tracked mark) sits away from the origin of the model."""

    name = "position_lever_arm"
    title = "lever arm of the position sensor"
    cause = "sensor.alignment.position"
    number = 8
    equation = "(x_m, y_m) = (x, y) + R(psi) (forward, starboard)"
    source = LogLeverArm.source
    acts_on = ("sensor:x", "sensor:y")
    confused_with = ("log_lever_arm", "position_delay")
    distinguished_by = "turns with the heading and is bounded: the start of a turn"
    needs_outputs = ("x", "y", "psi")
    parameters = LogLeverArm.parameters
    null: Mapping[str, float] = {"forward": 0.0, "starboard": 0.0}
    typical_by_kind = LogLeverArm.typical_by_kind
    froude = LogLeverArm.froude

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        c, d = math.cos(y.psi), math.sin(y.psi)
        return y._replace(x=y.x + q.forward * c - q.starboard * d, y=y.y + q.forward * d + q.starboard * c)


class DepthLeverArm(Effect):
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
    parameters = LogLeverArm.parameters[:1]
    null: Mapping[str, float] = {"forward": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(z=y.z - q.forward * math.sin(y.theta))


class DepthBias(Effect):
    """The depth sensor has a constant offset."""

    name = "depth_bias"
    title = "depth sensor bias"
    cause = "sensor.bias_or_scale.depth"
    number = 9
    equation = "z_m = z + b"
    source = "[S] magnitude of the catalogue: 0.05 to 0.5 m"
    acts_on = ("sensor:z",)
    confused_with = ("depth_scale",)
    distinguished_by = "seen at the surface; with the depth at the start unknown it is part of that"
    needs_outputs = ("z",)
    parameters = (Parameter("b", 0.2, "m", -5.0, 5.0, source="[S] chosen here", description="added to z"),)
    null: Mapping[str, float] = {"b": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(z=y.z + q.b)


class DepthScale(Effect):
    """The depth sensor has a scale error, as where fresh water is assumed in salt water."""

    name = "depth_scale"
    title = "depth sensor scale"
    cause = "sensor.bias_or_scale.depth"
    number = 9
    equation = "z_m = (1 + k) z"
    source = "[S] magnitude of the catalogue: 1 %; salt water for fresh is 2.5 %"
    acts_on = ("sensor:z",)
    confused_with = ("depth_bias", "net_weight")
    distinguished_by = "two depths; pitch and planes do not show it"
    needs_outputs = ("z",)
    parameters = (Parameter("k", 0.015, "1", -0.2, 0.2, source="[S] chosen here", description="relative error"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(z=y.z + q.k * y.z)


class DepthLag(Filtered):
    """The depth sensor follows the depth with a first-order lag."""

    name = "depth_lag"
    title = "lag of the depth sensor"
    cause = "sensor.timing.depth"
    number = 9
    equation = "tau dz_m/dt = z - z_m"
    source = "[S] magnitude of the catalogue: 0.1 to 1 s"
    acts_on = ("sensor:z",)
    confused_with = ("depth_lever_arm", "plane_delay")
    distinguished_by = "depth alone is late, pitch is not"
    needs_outputs = ("z",)
    parameters = (Parameter("tau", 0.5, "s", 0.0, 10.0, source="[S] catalogue", description="time constant"),)
    null: Mapping[str, float] = {"tau": 0.0}
    states = (Channel("first", "m", "depth after one lag"), Channel("second", "m", "depth after two"))
    follows: ClassVar[Mapping[str, str]] = {"first": "z", "second": "z"}

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(z=lagged(y.z, s.first, s.second, q.tau, self.filter_time))

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        return filter_rates(y.z, s.first, s.second, q.tau, self.filter_time)

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        return y.z, y.z
