"""Delays of sensors, by a clock, a filter or a link; one effect for each sensor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.filtered import Filtered, delay_time, delayed_along, delayed_twice, slope_rates
from seatruth.effects.sensors import LOG, sinking
from seatruth.models.first_slope import FirstSlope
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel

_TAU = Parameter("tau", 0.4, "s", 0.0, 20.0, source="[S] chosen here", description="delay")
_SOURCE = "[S] magnitude of the catalogue: 0.05 to 1 s"


def _kept(output: str, unit: str, what: str, slopes: int) -> tuple[Channel, ...]:
    """The states of `slope_rates` of an output: "r_0", the output itself, "r_1" and so on, its slope."""
    after = [Channel(f"{output}_{k}", f"{unit}/s", f"its slope after filter {k}") for k in range(1, slopes + 1)]
    return (Channel(f"{output}_0", unit, f"{what} after the fastest filter"), *after)


class SensorDelay(Filtered):
    """Base of delays of sensors: what the outputs `late` show comes `tau` s late, from the first sample of a trial on.

    A trial begins under way: how fast an output then changes, the slope with which its record begins tells, or other
    outputs (`first_rates`).
    """

    late: tuple[str, ...]
    """Standard names of the outputs, each with the states of `_kept`, in this order."""
    source = _SOURCE
    parameters: tuple[Parameter, ...] = (_TAU,)
    null: Mapping[str, float] = {"tau": 0.0}
    parts = 1
    """Parts of the delay, each with a pair of filters of the slope of each output."""

    by_record: ClassVar[bool] = True
    """Whether their own record tells how fast the outputs change at the start; else `first_rates` does."""

    def first_rates(self, y: Any) -> Mapping[str, Any]:
        """Rates of the outputs at the start of a trial, by standard name, as other outputs tell them."""
        return {}

    @property
    def slopes(self) -> Mapping[str, FirstSlope]:
        found: dict[str, FirstSlope] = {}
        for name in self.late if self.by_record else ():
            found |= self.along(name, *(f"{name}_{k}" for k in range(2 * self.parts + 1)))
        return found

    def kept(self, s: Any, name: str) -> tuple[Any, ...]:
        """The states of `slope_rates` of an output."""
        return tuple(getattr(s, f"{name}_{k}") for k in range(2 * self.parts + 1))

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        shown = {
            name: delayed_along(getattr(y, name), self.kept(s, name), q.tau, self.filter_time) for name in self.late
        }
        return y._replace(**shown)

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        rates: list[Any] = []
        T = delay_time(q.tau / self.parts, self.filter_time)
        for name in self.late:
            rates += slope_rates(getattr(y, name), self.kept(s, name), T, self.filter_time)
        return tuple(rates)

    def initial_state(self, y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        rates, first = self.first_rates(y), []
        for name in self.late:
            rate = rates.get(name, 0.0)
            first += [getattr(y, name) - self.filter_time * rate, *(rate for _ in range(2 * self.parts))]
        return tuple(first)


def _over_ground(y: Any) -> tuple[float, float]:
    """Velocity north and east at the start of a trial: over ground if outputs show it, else that of the model's states.

    Zero where neither outputs nor states have one.
    """
    if hasattr(y, "v_n") and hasattr(y, "v_e"):
        return y.v_n, y.v_e
    psi = getattr(y, "psi", 0.0)
    if hasattr(y, "sog"):
        course = getattr(y, "cog", psi)
        return y.sog * math.cos(course), y.sog * math.sin(course)
    u, v = (getattr(y, name, getattr(y, f"{name}_w", 0.0)) for name in ("u", "v"))
    return u * math.cos(psi) - v * math.sin(psi), u * math.sin(psi) + v * math.cos(psi)


class PositionDelay(SensorDelay):
    """The position is recorded late, or early where tau is negative: the clocks of receiver and log differ."""

    name = "position_delay"
    title = "delay of the position"
    cause = "sensor.timing.position"
    number = 10
    equation = "x_m(t) = x(t - tau), y_m alike"
    acts_on: tuple[str, ...] = ("sensor:x", "sensor:y")
    confused_with: tuple[str, ...] = ("position_lever_arm", "rudder_delay", "receiver_delay")
    distinguished_by = "late along the track, in proportion to the speed; other sensors are in time"
    needs_outputs: tuple[str, ...] = ("x", "y")
    parameters = (_TAU.replace(min=-_TAU.max),)
    late = ("x", "y")
    states = (*_kept("x", "m", "x", 2), *_kept("y", "m", "y", 2))
    follows: ClassVar[Mapping[str, str]] = {"x_0": "x", "y_0": "y"}

    by_record = False

    def first_rates(self, y: Any) -> Mapping[str, Any]:
        return dict(zip(("x", "y"), _over_ground(y)))


class ReceiverDelay(SensorDelay):
    """All that the position's receiver gives is recorded late: position and velocity north and east, from its speed and
    course; or early where tau is negative."""

    name = "receiver_delay"
    title = "delay of position and velocity over ground"
    cause = "sensor.timing.position"
    number = 10
    equation = "x_m(t) = x(t - tau), y_m, v_n_m, v_e_m alike"
    acts_on = ("sensor:x", "sensor:y", "sensor:v_n", "sensor:v_e")
    confused_with = ("position_lever_arm", "rudder_delay", "thruster_delay", "position_delay")
    distinguished_by = "turns and changes of speed are late together; heading, rates and a log are in time"
    needs_outputs = ("x", "y", "v_n", "v_e")
    parameters = (_TAU.replace(min=-_TAU.max),)
    starts = ({"tau": 0.4},)
    """From no delay a fit may end at thrusters that are late instead, which follow the velocity ahead as well: of a
    boat whose receiver was late by 0.6 s it came to 0.015 s, 620 nats short."""
    late = ("v_n", "v_e")
    parts = 2
    """A planing boat turns by 20 deg within the delay."""
    states = (*_kept("v_n", "m/s", "velocity north", 4), *_kept("v_e", "m/s", "velocity east", 4))

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        x, v_n = delayed_twice(y.x, y.v_n, self.kept(s, "v_n"), q.tau, self.filter_time)
        east, v_e = delayed_twice(y.y, y.v_e, self.kept(s, "v_e"), q.tau, self.filter_time)
        return y._replace(x=x, y=east, v_n=v_n, v_e=v_e)


class HeadingDelay(SensorDelay):
    """The heading is recorded late."""

    name = "heading_delay"
    title = "delay of the heading"
    cause = "sensor.timing.angle"
    number = 10
    equation = "psi_m(t) = psi(t - tau)"
    acts_on = ("sensor:psi",)
    confused_with: tuple[str, ...] = ("rudder_delay", "rudder_lag")
    distinguished_by = "the heading alone is late, other sensors are in time"
    needs_outputs = ("psi",)
    late = ("psi",)
    states = _kept("psi", "rad", "angle", 2)
    follows: ClassVar[Mapping[str, str]] = {"psi_0": "psi"}

    by_record = False

    def first_rates(self, y: Any) -> Mapping[str, Any]:
        return {"psi": getattr(y, "r", 0.0)}


class PitchDelay(HeadingDelay):
    """The pitch angle is recorded late."""

    name = "pitch_delay"
    title = "delay of the pitch angle"
    equation = "theta_m(t) = theta(t - tau)"
    confused_with = ("plane_delay", "plane_lag")
    distinguished_by = "the pitch angle alone is late, other sensors are in time"
    acts_on = ("sensor:theta",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"psi": ("theta",), "r": ("q",)}


class DepthDelay(SensorDelay):
    """The depth is recorded late, as a whole: by a clock or a link."""

    name = "depth_delay"
    title = "delay of the depth"
    cause = "sensor.timing.depth"
    number = 10
    equation = "z_m(t) = z(t - tau)"
    acts_on = ("sensor:z",)
    confused_with = ("depth_lag", "depth_lever_arm", "plane_delay")
    distinguished_by = "quick changes of depth are as late as slow ones, and as large"
    needs_outputs = ("z",)
    late = ("z",)
    states = _kept("z", "m", "depth", 2)
    follows: ClassVar[Mapping[str, str]] = {"z_0": "z"}

    by_record = False

    def first_rates(self, y: Any) -> Mapping[str, Any]:
        return {"z": sinking(y)}


class RateDelay(SensorDelay):
    """The yaw rate is recorded late; the pitch rate where the model has no yaw rate."""

    name = "rate_delay"
    title = "delay of the rate of turn"
    cause = "sensor.timing.rate"
    number = 10
    equation = "r_m(t) = r(t - tau); q_m where there is no yaw rate"
    acts_on = ("sensor:r",)
    confused_with = ("rudder_delay", "rudder_lag")
    distinguished_by = "the rate alone is late, other sensors are in time"
    needs_outputs = ("r",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"r": ("r", "q")}
    late = ("r",)
    states = _kept("r", "rad/s", "rate", 2)
    follows: ClassVar[Mapping[str, str]] = {"r_0": "r"}


class SpeedDelay(SensorDelay):
    """The log records late: speed along and across, or along and down where the model has no sway."""

    name = "speed_delay"
    title = "delay of the log"
    cause = "sensor.timing.speed"
    number = 10
    equation = "u_m(t) = u(t - tau), v_m (w_m where there is no sway) alike"
    acts_on = ("sensor:u", "sensor:v")
    confused_with = ("rudder_delay", "log_lever_arm")
    distinguished_by = "the log alone is late, other sensors are in time"
    needs_outputs = ("u", "v")
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"], "v": (*LOG["v"], *LOG["w"])}
    late = ("u", "v")
    states = (*_kept("u", "m/s", "speed along", 2), *_kept("v", "m/s", "speed across", 2))
    follows: ClassVar[Mapping[str, str]] = {"u_0": "u", "v_0": "v"}
