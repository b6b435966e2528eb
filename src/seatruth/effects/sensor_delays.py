"""Delays of sensors, by a clock, a filter or a link; one effect for each sensor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.filtered import (
    Filtered,
    carried,
    carried_rates,
    carried_velocity,
    delay_rates,
    delayed,
    delayed_slowly,
    filter_rates,
)
from seatruth.effects.sensors import LOG, sinking
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel

_TAU = Parameter("tau", 0.4, "s", 0.0, 5.0, source="[S] chosen here", description="delay")
_SOURCE = "[S] magnitude of the catalogue: 0.05 to 1 s"


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


class PositionDelay(Filtered):
    """The position is recorded late, or early where tau is negative: the clocks of receiver and log differ."""

    name = "position_delay"
    title = "delay of the position"
    cause = "sensor.timing.position"
    number = 10
    equation = "x_m(t) = x(t - tau), y_m alike"
    source = _SOURCE
    acts_on: tuple[str, ...] = ("sensor:x", "sensor:y")
    confused_with: tuple[str, ...] = ("position_lever_arm", "rudder_delay", "receiver_delay")
    distinguished_by = "late along the track, in proportion to the speed; other sensors are in time"
    needs_outputs: tuple[str, ...] = ("x", "y")
    parameters = (_TAU.replace(min=-_TAU.max),)
    null: Mapping[str, float] = {"tau": 0.0}
    states = (
        *(Channel(f"x_{k}", "m", f"x after lag {k}") for k in (1, 2)),
        *(Channel(f"y_{k}", "m", f"y after lag {k}") for k in (1, 2)),
    )

    follows: ClassVar[Mapping[str, str]] = {"x_1": "x", "x_2": "x", "y_1": "y", "y_2": "y"}

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        north, east = (
            delayed_slowly(y.x, s.x_1, s.x_2, q.tau, self.filter_time),
            delayed_slowly(y.y, s.y_1, s.y_2, q.tau, self.filter_time),
        )
        return y._replace(x=north, y=east)

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        return (
            *filter_rates(y.x, s.x_1, s.x_2, 0.0, self.filter_time),
            *filter_rates(y.y, s.y_1, s.y_2, 0.0, self.filter_time),
        )

    def initial_state(self, y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        # The vehicle moves at the start: each filter lags by the speed times its time constant. This must not depend
        # on the delay, since the initial state is computed once.
        T, (x_dot, y_dot) = self.filter_time, _over_ground(y)
        return y.x - T * x_dot, y.x - 2.0 * T * x_dot, y.y - T * y_dot, y.y - 2.0 * T * y_dot


class ReceiverDelay(PositionDelay):
    """All that the position's receiver gives is recorded late: position and velocity north and east, from its speed and
    course; or early where tau is negative."""

    name = "receiver_delay"
    title = "delay of position and velocity over ground"
    equation = "x_m(t) = x(t - tau), y_m, v_n_m, v_e_m alike"
    acts_on = ("sensor:x", "sensor:y", "sensor:v_n", "sensor:v_e")
    confused_with = ("position_lever_arm", "rudder_delay", "thruster_delay", "position_delay")
    distinguished_by = "turns and changes of speed are late together; heading, rates and a log are in time"
    needs_outputs = ("x", "y", "v_n", "v_e")
    starts = ({"tau": 0.4},)
    """From no delay a fit may end at thrusters that are late instead, which follow the velocity ahead as well: of a
    boat whose receiver was late by 0.6 s it came to 0.015 s, 620 nats short."""
    states = (
        *(Channel(f"v_n_{k}", "m/s", f"velocity north after filter {k}") for k in (1, 2, 3, 4)),
        *(Channel(f"v_e_{k}", "m/s", f"velocity east after filter {k}") for k in (1, 2, 3, 4)),
    )
    """Two pairs a direction, each of which is late by half of the delay: a planing boat turns by 20 deg within it."""
    follows: ClassVar[Mapping[str, str]] = {}

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        half, T = 0.5 * q.tau, self.filter_time
        x, v_n = _carried_on(y.x, y.v_n, (s.v_n_1, s.v_n_2), half, T)
        x, v_n = _carried_on(x, v_n, (s.v_n_3, s.v_n_4), half, T)
        east, v_e = _carried_on(y.y, y.v_e, (s.v_e_1, s.v_e_2), half, T)
        east, v_e = _carried_on(east, v_e, (s.v_e_3, s.v_e_4), half, T)
        return y._replace(x=x, y=east, v_n=v_n, v_e=v_e)

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        half, T = 0.5 * q.tau, self.filter_time
        v_n = carried_velocity(y.v_n, s.v_n_1, s.v_n_2, half, T)
        v_e = carried_velocity(y.v_e, s.v_e_1, s.v_e_2, half, T)
        return (
            *carried_rates(y.v_n, s.v_n_1, s.v_n_2, half, T),
            *carried_rates(v_n, s.v_n_3, s.v_n_4, half, T),
            *carried_rates(y.v_e, s.v_e_1, s.v_e_2, half, T),
            *carried_rates(v_e, s.v_e_3, s.v_e_4, half, T),
        )

    def initial_state(self, y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        return (*(y.v_n for _ in range(4)), *(y.v_e for _ in range(4)))


def _carried_on(
    position: Any, velocity: Any, filters: tuple[Any, Any], tau: Any, filter_time: float
) -> tuple[Any, Any]:
    """A position and its velocity tau ago, from the two filters of the velocity."""
    return (
        carried(position, *filters, tau, filter_time),
        carried_velocity(velocity, *filters, tau, filter_time),
    )


class HeadingDelay(Filtered):
    """The heading is recorded late."""

    name = "heading_delay"
    title = "delay of the heading"
    cause = "sensor.timing.angle"
    number = 10
    equation = "psi_m(t) = psi(t - tau)"
    source = _SOURCE
    acts_on = ("sensor:psi",)
    confused_with: tuple[str, ...] = ("rudder_delay", "rudder_lag")
    distinguished_by = "the heading alone is late, other sensors are in time"
    needs_outputs = ("psi",)
    parameters = (_TAU,)
    null: Mapping[str, float] = {"tau": 0.0}
    states = (Channel("first", "rad", "angle after one lag"), Channel("second", "rad", "angle after two"))

    follows: ClassVar[Mapping[str, str]] = {"first": "psi", "second": "psi"}

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(psi=delayed_slowly(y.psi, s.first, s.second, q.tau, self.filter_time))

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        return filter_rates(y.psi, s.first, s.second, 0.0, self.filter_time)

    def initial_state(self, y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        rate = getattr(y, "r", 0.0)
        return y.psi - self.filter_time * rate, y.psi - 2.0 * self.filter_time * rate


class PitchDelay(HeadingDelay):
    """The pitch angle is recorded late."""

    name = "pitch_delay"
    title = "delay of the pitch angle"
    equation = "theta_m(t) = theta(t - tau)"
    confused_with = ("plane_delay", "plane_lag")
    distinguished_by = "the pitch angle alone is late, other sensors are in time"
    acts_on = ("sensor:theta",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"psi": ("theta",), "r": ("q",)}


class DepthDelay(HeadingDelay):
    """The depth is recorded late, as a whole: by a clock or a link."""

    name = "depth_delay"
    title = "delay of the depth"
    cause = "sensor.timing.depth"
    equation = "z_m(t) = z(t - tau)"
    acts_on = ("sensor:z",)
    confused_with = ("depth_lag", "depth_lever_arm", "plane_delay")
    distinguished_by = "quick changes of depth are as late as slow ones, and as large"
    needs_outputs = ("z",)
    states = (Channel("first", "m", "depth after one lag"), Channel("second", "m", "depth after two"))
    follows: ClassVar[Mapping[str, str]] = {"first": "z", "second": "z"}

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(z=delayed_slowly(y.z, s.first, s.second, q.tau, self.filter_time))

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        return filter_rates(y.z, s.first, s.second, 0.0, self.filter_time)

    def initial_state(self, y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        late = self.filter_time * sinking(y)
        return y.z - late, y.z - 2.0 * late


class RateDelay(Filtered):
    """The yaw rate is recorded late; the pitch rate where the model has no yaw rate."""

    name = "rate_delay"
    title = "delay of the rate of turn"
    cause = "sensor.timing.rate"
    number = 10
    equation = "r_m(t) = r(t - tau); q_m where there is no yaw rate"
    source = _SOURCE
    acts_on = ("sensor:r",)
    confused_with = ("rudder_delay", "rudder_lag")
    distinguished_by = "the rate alone is late, other sensors are in time"
    needs_outputs = ("r",)
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"r": ("r", "q")}
    parameters = (_TAU,)
    null: Mapping[str, float] = {"tau": 0.0}
    states = (Channel("first", "rad/s", "rate after one lag"), Channel("second", "rad/s", "rate after two"))
    follows: ClassVar[Mapping[str, str]] = {"first": "r", "second": "r"}

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(r=delayed(y.r, s.first, s.second, q.tau, self.filter_time))

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        return delay_rates(y.r, s.first, s.second, q.tau, self.filter_time)

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        return y.r, y.r


class SpeedDelay(Filtered):
    """The log records late: speed along and across, or along and down where the model has no sway."""

    name = "speed_delay"
    title = "delay of the log"
    cause = "sensor.timing.speed"
    number = 10
    equation = "u_m(t) = u(t - tau), v_m (w_m where there is no sway) alike"
    source = _SOURCE
    acts_on = ("sensor:u", "sensor:v")
    confused_with = ("rudder_delay", "log_lever_arm")
    distinguished_by = "the log alone is late, other sensors are in time"
    needs_outputs = ("u", "v")
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {"u": LOG["u"], "v": (*LOG["v"], *LOG["w"])}
    parameters = (_TAU,)
    null: Mapping[str, float] = {"tau": 0.0}
    states = (
        *(Channel(f"u_{k}", "m/s", f"speed along after lag {k}") for k in (1, 2)),
        *(Channel(f"v_{k}", "m/s", f"speed across after lag {k}") for k in (1, 2)),
    )
    follows: ClassVar[Mapping[str, str]] = {"u_1": "u", "u_2": "u", "v_1": "v", "v_2": "v"}

    def measured_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(
            u=delayed(y.u, s.u_1, s.u_2, q.tau, self.filter_time), v=delayed(y.v, s.v_1, s.v_2, q.tau, self.filter_time)
        )

    def rates_from_outputs(self, y: Any, s: Any, i: Any, q: Any, e: Any) -> tuple[Any, ...]:
        return (
            *delay_rates(y.u, s.u_1, s.u_2, q.tau, self.filter_time),
            *delay_rates(y.v, s.v_1, s.v_2, q.tau, self.filter_time),
        )

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        return y.u, y.u, y.v, y.v
