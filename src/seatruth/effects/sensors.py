"""Offsets, scale errors and lags of sensors. Places and directions: `sensor_places`; delays: `sensor_delays`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.effects.filtered import Filtered, lag_time, lagged, slope_rates
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel
from seatruth.trials.check.headings import heading_offset
from seatruth.trials.trial import Trial

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
    parameters = (Parameter("k", 0.03, "1", -0.9, 3.0, source="[S] chosen here", description="relative error"),)
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
    parameters = (Parameter("b", 0.05, "m/s", -5.0, 5.0, source="[S] chosen here", description="added to u"),)
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
    confused_with: tuple[str, ...] = ("log_misalignment", "current", "heading_bias", "log_lever_arm")
    distinguished_by = "constant whatever the heading, the speed and the rate of turn"
    needs_outputs = ("v",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"v": LOG["v"]}
    parameters = (Parameter("b", 0.05, "m/s", -5.0, 5.0, source="[S] chosen here", description="added to v"),)
    null: Mapping[str, float] = {"b": 0.0}
    froude: ClassVar[Mapping[str, float]] = {"b": 0.5}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(v=y.v + q.b)


class HeaveBias(SwayBias):
    """The log has a constant offset in heave."""

    name = "heave_bias"
    title = "heave sensor bias"
    equation = "w_m = w + b"
    acts_on = ("sensor:w",)
    confused_with = ("log_misalignment_vertical", "net_weight", "log_lever_arm_vertical")
    distinguished_by = "constant whatever the speed and the pitch rate; the depth does not show it"
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"v": LOG["w"]}
    parameters = (SwayBias.parameters[0].replace(description="added to w"),)


class HeadingBias(Effect):
    """The compass has a constant offset."""

    name = "heading_bias"
    title = "heading bias"
    cause = "sensor.bias_or_scale.angle"
    number = 5
    equation = "psi_m = psi + b"
    source = "[S] magnitude of the catalogue: 0.5 to 3 deg"
    acts_on = ("sensor:psi",)
    confused_with: tuple[str, ...] = ("current", "compass_deviation", "sway_bias", "log_misalignment")
    distinguished_by = "the error of the track turns with the heading: reciprocal and beam headings"
    needs_outputs = ("psi",)
    parameters = (Parameter("b", 0.03, "rad", -3.2, 3.2, source="[S] chosen here", description="added to psi"),)
    null: Mapping[str, float] = {"b": 0.0}
    start: ClassVar[str] = "psi"

    def gross_values(self, trials: Sequence[Trial]) -> list[dict[str, float]]:
        """See `Effect.gross_values`: the angle from the heading to the track, since turned tracks are not linear."""
        angle = heading_offset(trials) if self.start == "psi" else None
        return [] if angle is None else [{"b": -angle}]

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(psi=y.psi + q.b)


class PitchBias(HeadingBias):
    """The inclinometer has a constant offset: it is not mounted level."""

    name = "pitch_bias"
    title = "pitch bias"
    equation = "theta_m = theta + b"
    source = "[S] chosen here, as that of the compass: a mounting that is level to a degree or two"
    acts_on = ("sensor:theta",)
    confused_with = ("trim", "plane_offset", "net_weight", "log_misalignment_vertical")
    distinguished_by = "depth changes as the true pitch says; at two speeds, with orders that hold other pitch angles"
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"psi": ("theta",)}
    parameters = (HeadingBias.parameters[0].replace(description="added to theta"),)
    start: ClassVar[str] = "theta"


class RollBias(HeadingBias):
    """The inclinometer has a constant offset across: it is not mounted level."""

    name = "roll_bias"
    title = "roll bias"
    equation = "phi_m = phi + b"
    source = PitchBias.source
    acts_on = ("sensor:phi",)
    confused_with = ("lateral_offset", "propeller_torque")
    distinguished_by = "a real heel turns the vehicle, or pushes it aside; does not change with speed and thrust"
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"psi": ("phi",)}
    parameters = (HeadingBias.parameters[0].replace(description="added to phi"),)
    start: ClassVar[str] = "phi"


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
        Parameter("A", 0.03, "rad", -0.8, 0.8, source="[S] chosen here", description="by sin(psi)"),
        Parameter("B", 0.03, "rad", -0.8, 0.8, source="[S] chosen here", description="by cos(psi)"),
    )
    null: Mapping[str, float] = {"A": 0.0, "B": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(psi=y.psi + q.A * math.sin(y.psi) + q.B * math.cos(y.psi))


class GyroBias(Effect):
    """The yaw rate gyro has a constant offset."""

    name = "gyro_bias"
    title = "yaw rate bias"
    cause = "sensor.bias_or_scale.rate"
    number = 7
    equation = "r_m = r + b"
    source = "[S] magnitude of the catalogue: 0.001 to 0.1 deg/s"
    acts_on = ("sensor:r",)
    confused_with = ("rudder_offset", "propeller_walk")
    distinguished_by = "a real turn shows in the heading too"
    needs_outputs = ("r",)
    parameters = (Parameter("b", 0.001, "rad/s", -0.5, 0.5, source="[S] 0.06 deg/s", description="added to r"),)
    null: Mapping[str, float] = {"b": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(r=y.r + q.b)


class PitchGyroBias(GyroBias):
    """The pitch rate gyro has a constant offset."""

    name = "pitch_gyro_bias"
    title = "pitch rate bias"
    equation = "q_m = q + b"
    confused_with = ("plane_offset", "trim")
    distinguished_by = "a real turn shows in the pitch angle too"
    acts_on = ("sensor:q",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"r": ("q",)}
    parameters = (GyroBias.parameters[0].replace(description="added to q"),)


class GyroScale(Effect):
    """The yaw rate gyro has a scale error."""

    name = "gyro_scale"
    title = "yaw rate scale"
    cause = "sensor.bias_or_scale.rate"
    number = 7
    equation = "r_m = (1 + k) r"
    source = "[S] chosen here: gyros of small craft are specified to within 0.5 to 5 %"
    acts_on = ("sensor:r",)
    confused_with: tuple[str, ...] = ("rudder_gain", "added_mass", "rate_delay")
    distinguished_by = (
        "the heading does not show it: in turns to both sides it changes by less than the integral of the rate"
    )
    needs_outputs = ("r", "psi")
    parameters = (Parameter("k", 0.03, "1", -0.9, 3.0, source="[S] chosen here", description="relative error"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(r=y.r + q.k * y.r)


class PitchGyroScale(GyroScale):
    """The pitch rate gyro has a scale error."""

    name = "pitch_gyro_scale"
    title = "pitch rate scale"
    equation = "q_m = (1 + k) q"
    confused_with = ("plane_gain", "pitch_delay")
    distinguished_by = "the pitch angle does not show it: its changes are less than the integral of the rate"
    acts_on = ("sensor:q",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"r": ("q",), "psi": ("theta",)}


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
    parameters = (Parameter("b", 0.2, "m", -50.0, 50.0, source="[S] chosen here", description="added to z"),)
    null: Mapping[str, float] = {"b": 0.0}
    start: ClassVar[str] = "z"

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
    parameters = (Parameter("k", 0.015, "1", -0.9, 3.0, source="[S] chosen here", description="relative error"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def measured_outputs(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(z=y.z + q.k * y.z)


def sinking(y: Any) -> Any:
    """Rate of the depth at the start of a trial, m/s, by its first speeds and pitch; zero where none is recorded."""
    u, w, theta = (getattr(y, name, 0.0) for name in ("u", "w", "theta"))
    return w * math.cos(theta) - u * math.sin(theta)


class DepthLag(Filtered):
    """The depth sensor follows the depth with a first-order lag.

    A trial that begins under way has a sensor that is late already: by the rate of the depth that its first samples of
    speed and pitch tell.
    """

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
    parameters = (Parameter("tau", 0.5, "s", 0.0, 20.0, source="[S] catalogue", description="time constant"),)
    null: Mapping[str, float] = {"tau": 0.0}
    states = (
        Channel("fast", "m", "depth after the fastest filter"),
        Channel("first", "m/s", "its slope after filter 1"),
        Channel("second", "m/s", "its slope after filter 2"),
    )
    follows: ClassVar[Mapping[str, str]] = {"fast": "z"}

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(z=lagged(y.z, (s.fast, s.first, s.second), q.tau, self.filter_time))

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        return slope_rates(y.z, (s.fast, s.first, s.second), lag_time(q.tau, self.filter_time), self.filter_time)

    def initial_state(self, y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        rate = sinking(y)
        return y.z - self.filter_time * rate, rate, rate
