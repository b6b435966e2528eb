"""Errors between the recorded angle of a rudder or a stern plane and the angle that acts.

Each effect on the rudder has a twin on the stern plane. They act on every steering input that the model names, whatever
it is called. Lags and rate limits make its servo slower; the others act on what the servo gives.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.effects.filtered import DeadTime, Filtered
from seatruth.effects.kinematics import clipped
from seatruth.effects.rate_limits import RateLimit
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel

RUDDER_COEFFICIENTS = ("Y_d", "N_d", "Y_delta", "N_delta", "f_alpha", "A_R", "C_z_dr", "m_y_dr")
PLANE_COEFFICIENTS = ("Z_ds", "M_ds", "C_y_de", "m_z_de")


class OnRudder(Effect):
    """Base of effects on the rudder angle, `delta` in the equations."""

    acts_on = ("actuator:delta",)
    actuator = "rudder"
    needs_inputs = ("delta",)


class OnPlane(Effect):
    """Mixed into an effect on the rudder to act on the stern plane, then named `delta` in the equations."""

    actuator = "plane"


class RudderOffset(OnRudder):
    """The rudder angle differs from the recorded one by a constant."""

    name = "rudder_offset"
    title = "rudder zero offset"
    cause = "actuator.steering.offset"
    number = 12
    equation = "delta = delta_m + angle"
    source = "[S] magnitude of the catalogue: 0.2 to 2 deg"
    confused_with: tuple[str, ...] = ("propeller_walk", "wind", "gyro_bias", "bank", "lateral_asymmetry")
    distinguished_by = "its force goes with u^2: vary the speed and the revolutions apart"
    parameters = (Parameter("angle", 0.02, "rad", -0.8, 0.8, source="[S] 1.1 deg", description="added to delta"),)
    null: Mapping[str, float] = {"angle": 0.0}

    @staticmethod
    def true_inputs(i: Any, s: Any, q: Any, e: Any) -> Any:
        return i._replace(delta=i.delta + q.angle)


class RudderGain(OnRudder):
    """The angle that acts is a multiple of the recorded one; the same as an error of the rudder's coefficients."""

    name = "rudder_gain"
    title = "rudder effectiveness"
    cause = "actuator.steering.gain"
    number = 13
    equation = "delta = k delta_m"
    source = "[S] magnitude of the catalogue: 0.8 to 1.2"
    equivalent: tuple[str, ...] = RUDDER_COEFFICIENTS
    confused_with: tuple[str, ...] = ("rudder_dead_band", "shallow_water", "cross_flow")
    distinguished_by = "never from the rudder's coefficients; a gain is the same at every amplitude and speed"
    parameters = (Parameter("k", 0.85, "1", 0.0, 4.0, source="[S] 15 % off", description="factor on delta"),)
    null: Mapping[str, float] = {"k": 1.0}

    @staticmethod
    def true_inputs(i: Any, s: Any, q: Any, e: Any) -> Any:
        return i._replace(delta=q.k * i.delta)


class RudderLag(OnRudder):
    """The rudder follows its order with a first-order lag, in addition to that of a servo which the study states."""

    name = "rudder_lag"
    title = "lag of the rudder"
    cause = "actuator.steering.dynamics.lag"
    number = 14
    equation = "tau ddelta/dt = delta_m - delta"
    source = "[L] first-order steering gear; [S] magnitudes of the catalogue: 0.05 to 0.5 s, ships 1 to 3 s"
    confused_with: tuple[str, ...] = ("rudder_delay", "added_mass", "rudder_rate_limit", "sloshing")
    distinguished_by = "phase rises with frequency; a measured rudder angle settles it"
    parameters = (Parameter("tau", 0.3, "s", 0.0, 60.0, source="[S] catalogue", description="time constant"),)
    null: Mapping[str, float] = {"tau": 0.0}
    typical_by_kind: ClassVar[Mapping[str, Mapping[str, float]]] = {"ship": {"tau": 2.0}, "planing": {"tau": 0.3}}
    froude: ClassVar[Mapping[str, float]] = {"tau": 0.5}

    @staticmethod
    def servo(lag: Any, slowness: Any, q: Any, full: float) -> tuple[Any, Any]:
        return lag + q.tau, slowness


_PAIRS = tuple((f"f{2 * k + 1}", f"f{2 * k + 2}") for k in range(4))
"""Pairs of filters of a dead time, each for its part of it. [S] Of what 2 s change on a torpedo that is steered in
steps, one pair leaves 24 % and four leave 9 % (tests/effects/test_effects_filtered.py)."""


class RudderDelay(DeadTime, OnRudder):
    """The rudder follows its order after a dead time."""

    name = "rudder_delay"
    title = "dead time of the rudder"
    cause = "actuator.steering.dynamics.delay"
    number = 15
    equation = "delta(t) = delta_m(t - tau)"
    source = "[S] magnitude of the catalogue: 0.05 to 0.5 s"
    confused_with: tuple[str, ...] = ("rudder_lag", "heading_delay", "rate_delay", "added_mass")
    distinguished_by = "common to all outputs; the same at every amplitude"
    parameters = (Parameter("tau", 0.3, "s", 0.0, 20.0, source="[S] catalogue", description="dead time"),)
    null: Mapping[str, float] = {"tau": 0.0}
    states = tuple(Channel(name, "rad", f"rudder through filter {name[1:]}") for pair in _PAIRS for name in pair)
    in_turn = _PAIRS


class RudderRateLimit(RateLimit, OnRudder):
    """The rudder turns no faster than 1 / slowness, or slower still where the study states a rate limit.

    The slowness adds to that of the servo: of 25 deg/s, 2.29 s/rad, beside which 12 deg/s act, it is 2.48 s/rad.
    """

    name = "rudder_rate_limit"
    title = "rate limit of the rudder"
    cause = "actuator.steering.dynamics.rate_limit"
    number = 14
    equation = "|ddelta/dt| <= 1 / (slowness + 1 / rate), rate the stated rate_limit"
    source = "[L] steering gear; [S] magnitudes of the catalogue: 5 to 40 deg/s, ships 2 to 5 deg/s"
    confused_with: tuple[str, ...] = ("rudder_lag", "rudder_delay")
    distinguished_by = "depends on amplitude: large orders come later, small ones in time"
    parameters = (
        Parameter(
            "slowness",
            5.0,
            "s/rad",
            0.0,
            200.0,
            source="[S] 11 deg/s",
            description="1 / fastest rate, beyond a stated rate limit's",
        ),
    )
    null: Mapping[str, float] = {"slowness": 0.0}
    typical_by_kind: ClassVar[Mapping[str, Mapping[str, float]]] = {"ship": {"slowness": 20.0}}
    froude: ClassVar[Mapping[str, float]] = {"slowness": 0.5}
    starts = tuple({"slowness": slowness} for slowness in (2.0, 5.0, 12.0, 30.0, 70.0))

    @staticmethod
    def servo(lag: Any, slowness: Any, q: Any, full: float) -> tuple[Any, Any]:
        return lag, slowness + q.slowness / full


class RudderDeadBand(OnRudder):
    """Small angles do nothing, larger ones act less the band."""

    name = "rudder_dead_band"
    title = "dead band of the rudder"
    cause = "actuator.steering.dynamics.dead_band"
    number = 15
    equation = "delta = delta_m - clip(delta_m, -band, band)"
    source = "[S] magnitude of the catalogue: 0.2 to 2 deg"
    confused_with: tuple[str, ...] = ("rudder_backlash", "rudder_gain")
    distinguished_by = "small amplitudes lose most: a staircase of small angles"
    parameters = (
        Parameter("band", 0.015, "rad", 0.0, 0.6, source="[S] 0.9 deg", description="half of the dead range"),
    )
    null: Mapping[str, float] = {"band": 0.0}
    starts = ({"band": 0.005}, {"band": 0.02})

    @staticmethod
    def true_inputs(i: Any, s: Any, q: Any, e: Any) -> Any:
        return i._replace(delta=i.delta - clipped(i.delta, q.band))


class RudderBacklash(Filtered, OnRudder):
    """Play in the gear: the rudder moves only when its order has taken up the slack."""

    name = "rudder_backlash"
    title = "backlash of the rudder"
    cause = "actuator.steering.dynamics.backlash"
    number = 15
    equation = "delta follows delta_m at a distance of at most slack"
    source = "[S] magnitude of the catalogue: 0.2 to 2 deg"
    confused_with: tuple[str, ...] = ("rudder_dead_band", "rudder_delay", "rudder_lag")
    distinguished_by = "late by an angle, not by a time: slow and fast reversals"
    parameters = (Parameter("slack", 0.015, "rad", 0.0, 0.6, source="[S] 0.9 deg", description="half of the play"),)
    null: Mapping[str, float] = {"slack": 0.0}
    starts = ({"slack": 0.005}, {"slack": 0.02})
    states = (Channel("loose", "rad", "rudder with play"), Channel("tight", "rad", "rudder without it"))

    @staticmethod
    def true_inputs(i: Any, s: Any, q: Any, e: Any) -> Any:
        return i._replace(delta=i.delta + s.loose - s.tight)

    def rates(self, s: Any, i: Any, p: Any, q: Any, e: Any) -> tuple[Any, ...]:
        apart = i.delta - s.loose
        return (apart - clipped(apart, q.slack)) / self.filter_time, (i.delta - s.tight) / self.filter_time

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        return i.delta, i.delta


class PlaneOffset(OnPlane, RudderOffset):
    """The plane angle differs from the recorded one by a constant."""

    name = "plane_offset"
    title = "stern plane zero offset"
    confused_with: tuple[str, ...] = ("net_weight", "trim", "asymmetry")
    distinguished_by = "the same at every speed, unlike a weight; of an asymmetry only where that has another arm"


class PlaneGain(OnPlane, RudderGain):
    """The plane angle that acts is a multiple of the recorded one."""

    name = "plane_gain"
    title = "stern plane effectiveness"
    equivalent: tuple[str, ...] = PLANE_COEFFICIENTS
    confused_with: tuple[str, ...] = ("plane_dead_band", "cross_flow_vertical")
    distinguished_by = "never from the plane's coefficients; a gain is the same at every amplitude and speed"


class PlaneLag(OnPlane, RudderLag):
    """The stern plane follows its order with a first-order lag."""

    name = "plane_lag"
    title = "lag of the stern plane"
    confused_with: tuple[str, ...] = ("plane_delay", "added_mass", "plane_rate_limit")
    distinguished_by = "phase rises with frequency; a measured plane angle settles it"


class PlaneDelay(OnPlane, RudderDelay):
    """The stern plane follows its order after a dead time."""

    name = "plane_delay"
    title = "dead time of the stern plane"
    confused_with: tuple[str, ...] = ("plane_lag", "pitch_delay", "added_mass")


class PlaneRateLimit(OnPlane, RudderRateLimit):
    """The stern plane turns no faster than 1 / slowness, which adds to that of a stated rate limit."""

    name = "plane_rate_limit"
    title = "rate limit of the stern plane"
    confused_with: tuple[str, ...] = ("plane_lag", "plane_delay")


class PlaneDeadBand(OnPlane, RudderDeadBand):
    """Small angles of the stern plane do nothing."""

    name = "plane_dead_band"
    title = "dead band of the stern plane"
    confused_with: tuple[str, ...] = ("plane_backlash", "plane_gain")


class PlaneBacklash(OnPlane, RudderBacklash):
    """Play in the gear of the stern plane."""

    name = "plane_backlash"
    title = "backlash of the stern plane"
    confused_with: tuple[str, ...] = ("plane_dead_band", "plane_delay", "plane_lag")
