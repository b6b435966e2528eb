"""Errors of thrusters, for every model that names its thrusters: of all alike, or of each alone (`Effect.variants`).

Forces are added where a thruster sits. They are parts of the thrust that the model computes from the inputs as they
act.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.filtered import DeadTime
from seatruth.effects.kinematics import clipped, relative_velocity
from seatruth.effects.rate_limits import RateLimit
from seatruth.effects.targets import targets
from seatruth.effects.undeclared_actuators import drive_inputs, neutral
from seatruth.effects.vehicle import role_of
from seatruth.models.actuators import Thruster, turned
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel

_TINY = 1e-9
"""m2/s2, added to a square of speeds that divides."""


def pushed(e: Any, one: Any, X: Any, Y: Any, Z: Any) -> Any:
    """The environment with a force (N) added at the place of a thruster."""
    return e._replace(
        X=e.X + X,
        Y=e.Y + Y,
        Z=e.Z + Z,
        K=e.K + one.y * Z - one.z * Y,
        M=e.M + one.z * X - one.x * Z,
        N=e.N + one.x * Y - one.y * X,
    )


def changed(e: Any, one: Any, force: Any) -> Any:
    """The environment with a change (N) of a thruster's force along its direction."""
    return pushed(e, one, force * one.a, force * one.b, force * one.c)


class OnThrusters(Effect):
    """Base of effects on thrusters; `drive` in the equations is the input of one of them over that at full power."""

    actuator = "thruster"
    input_name = "drive"
    acts_on = ("actuator:drive",)
    needs_inputs = ("drive",)


class ThrusterGain(OnThrusters):
    """A thruster gives another share of its thrust: a fouled one loses some, a dead one all, a reversed one twice."""

    name = "thruster_gain"
    title = "thrust of the thrusters"
    cause = "actuator.propulsion.thrust"
    number = 18
    equation = "F = (1 + k) F_0 of each thruster; -1 where it is dead, -2 where it is reversed"
    source = "[S] magnitude of the catalogue: -0.2 to 0.05, and to -1 of one that is fouled"
    equivalent = ("thrust_gain",)
    confused_with = ("drag_increase", "speed_scale", "current", "voltage_sag", "battery_discharge")
    distinguished_by = "one thruster: its side of the turn; all: the same coast-down with thrust at zero"
    each_of_many = True
    needs_vehicle = ("thrusts",)
    parameters = (Parameter("k", -0.3, "1", -2.2, 1.0, source="[S] catalogue", description="relative change"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return changed(e, d.thruster, q.k * d.thruster.force)


class DriveGain(OnThrusters):
    """A drive of a model that names no thruster adds another share to the motion than the equations say."""

    name = "drive_gain"
    title = "thrust of the drives"
    cause = "actuator.propulsion.thrust"
    number = 18
    equation = "ds/dt = f(i) + k (f(i) - f(i_0)) for each drive, i_0 the input at which it rests"
    source = "[S] magnitude of the catalogue: -0.2 to 0.05, and to -1 of one that is fouled"
    equivalent = ("thruster_gain", "thrust_gain")
    confused_with = ("drag_increase", "speed_scale", "current")
    distinguished_by = "one drive: its side of the turn; all: the same coast-down with the drives at rest"
    any_drive = True
    each_of_many = True
    parameters = (Parameter("k", -0.3, "1", -2.2, 1.0, source="[S] catalogue", description="relative change"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def thrust_change(q: Any) -> Any:
        return q.k

    def variants(self, model: Model) -> tuple[Effect, ...]:
        """See `Effect.variants`; none of named thrusters, whose gain is another effect."""
        return (self,) if self._named(model) else super().variants(model)

    def _named(self, model: Model) -> bool:
        return any(one.kind == self.actuator for one in model.actuators)

    def missing(self, model: Model) -> str:
        if self._named(model):
            return "the model names its thrusters"
        if not self.which and role_of(model, "thrust") is not None:
            return "the model tells its thrust"
        if drive_inputs(model) and not isinstance(model, BlackBox) and neutral(model) is None:
            return "its equations do not tell at which input its drives rest"
        return super().missing(model)


class ThrusterDeadBand(OnThrusters):
    """Small orders do nothing, larger ones act less the band."""

    name = "thruster_dead_band"
    title = "dead band of the thrusters"
    cause = "actuator.propulsion.dynamics.dead_band"
    number = 15
    equation = "i = i_m - clip(i_m, -band, band), both over the input at full power"
    source = "[L] electronic speed controllers do not start below some 2 to 10 % of full; [S] magnitude chosen here"
    confused_with = ("thruster_gain", "rudder_dead_band")
    distinguished_by = "small orders lose most: a staircase of small thrusts both ways"
    parameters = (Parameter("band", 0.05, "1", 0.0, 0.5, source="[S] 5 %", description="half of it / full input"),)
    null: Mapping[str, float] = {"band": 0.0}
    starts = ({"band": 0.03}, {"band": 0.1})

    @staticmethod
    def true_inputs(i: Any, s: Any, q: Any, e: Any) -> Any:
        return i._replace(drive=i.drive - clipped(i.drive, q.band))


class ThrusterLag(OnThrusters):
    """A thruster follows its order with a first-order lag, in addition to that of a servo which the study states."""

    name = "thruster_lag"
    title = "lag of the thrusters"
    cause = "actuator.propulsion.dynamics.lag"
    number = 14
    equation = "tau di/dt = i_m - i"
    source = "[L] motor and propeller as a first-order system (Fossen 2011, chapter 9); [S] 0.1 to 1 s"
    confused_with = ("thruster_rate_limit", "thruster_delay", "added_mass")
    distinguished_by = "phase rises with frequency; measured revolutions settle it"
    any_drive = True
    parameters = (Parameter("tau", 0.3, "s", 0.0, 60.0, source="[S] chosen here", description="time constant"),)
    null: Mapping[str, float] = {"tau": 0.0}

    @staticmethod
    def servo(lag: Any, slowness: Any, q: Any, full: float) -> tuple[Any, Any]:
        return lag + q.tau, slowness


_PAIRS = (("f1", "f2"), ("f3", "f4"))
"""Pairs of filters of a dead time, each for its part of it. [S] Half as many as of a rudder, since a vehicle has up to
eight thrusters."""


class ThrusterDelay(DeadTime, OnThrusters):
    """Thrusters follow their orders after a dead time, that of the link and the speed controllers."""

    name = "thruster_delay"
    title = "dead time of the thrusters"
    cause = "actuator.propulsion.dynamics.delay"
    number = 15
    equation = "i(t) = i_m(t - tau)"
    source = "[S] magnitude chosen here: 0.05 to 0.5 s of radio links, buses and speed controllers"
    confused_with = ("thruster_lag", "heading_delay", "rate_delay", "position_delay")
    distinguished_by = "common to all outputs; the same at every amplitude"
    any_drive = True
    common_only = True
    parameters = (Parameter("tau", 0.3, "s", 0.0, 20.0, source="[S] chosen here", description="dead time"),)
    null: Mapping[str, float] = {"tau": 0.0}
    states = tuple(Channel(name, "1", f"order through filter {name[1:]}") for pair in _PAIRS for name in pair)
    in_turn = _PAIRS


class ThrusterRateLimit(RateLimit, OnThrusters):
    """A thruster takes `slowness` seconds at least from rest to full power, in addition to a servo's own."""

    name = "thruster_rate_limit"
    title = "rate limit of the thrusters"
    cause = "actuator.propulsion.dynamics.rate_limit"
    number = 14
    equation = "|di/dt| <= full / (slowness + full / rate), rate the stated rate_limit"
    source = "[L] ramps of speed controllers; [S] magnitude chosen here: 0.5 to 5 s"
    confused_with = ("thruster_lag",)
    distinguished_by = "depends on amplitude: large orders come later, small ones in time"
    parameters = (
        Parameter(
            "slowness",
            1.0,
            "s",
            0.0,
            60.0,
            source="[S] chosen here",
            description="rest to full, beyond a stated rate limit's",
        ),
    )
    null: Mapping[str, float] = {"slowness": 0.0}
    starts = tuple({"slowness": slowness} for slowness in (0.5, 2.0, 8.0))

    @staticmethod
    def servo(lag: Any, slowness: Any, q: Any, full: float) -> tuple[Any, Any]:
        return lag, slowness + q.slowness / full


class ThrusterObliqueLoss(OnThrusters):
    """A thruster loses thrust where the water crosses its jet; all of it, at k = 1, where the crossing is far quicker.

    The jet has the speed that momentum theory gives far behind an actuator disc at rest, 2 |F| / (rho A) squared.
    """

    name = "thruster_oblique_loss"
    title = "loss of thrust in oblique flow"
    cause = "actuator.propulsion.inflow"
    number = 18
    equation = "F = F_0 (1 - k V_x^2 / (V_x^2 + 2 |F_0| / (rho A))), V_x across the jet"
    source = (
        "[L] momentum theory of an actuator disc for the jet's speed; [S] form of the loss and magnitude chosen here"
    )
    confused_with = ("thruster_gain", "thruster_hull_interaction", "cross_flow")
    distinguished_by = "nothing on a straight course: drifting turns, and thrust across the motion"
    needs_vehicle = ("dimensions", "thrusts")
    parameters = (Parameter("k", 0.3, "1", 0.0, 1.0, source="[S] chosen here", description="largest part lost"),)
    null: Mapping[str, float] = {"k": 0.0}

    def missing(self, model: Model) -> str:
        reason = super().missing(model)
        if not reason and any(_thruster(model, target.name).diameter is None for target in targets(self, model)):
            reason = "a thruster of the model declares no diameter"
        return reason

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        one, v = d.thruster, relative_velocity(s, e)
        u_t = v.u + v.q * one.z - v.r * one.y
        v_t = v.v + v.r * one.x - v.p * one.z
        w_t = v.w + v.p * one.y - v.q * one.x
        along = u_t * one.a + v_t * one.b + w_t * one.c
        across = max(0.0, u_t * u_t + v_t * v_t + w_t * w_t - along * along)
        jet = 2.0 * abs(one.force) / (d.rho * one.area)
        return changed(e, one, -q.k * one.force * across / (across + jet + _TINY))


class ThrusterHullInteraction(OnThrusters):
    """A thruster that pushes astern blows its jet along the hull, which takes a part of the force back."""

    name = "thruster_hull_interaction"
    title = "loss of reversed thrust on the hull"
    cause = "actuator.propulsion.hull"
    number = 18
    equation = "F = (1 - k) F_0 where F_0 < 0"
    source = "[L] thrust deduction and Coanda effect (Fossen 2011, chapter 9); [S] magnitude chosen here"
    confused_with = ("thruster_gain", "thruster_dead_band", "thruster_oblique_loss")
    distinguished_by = "only astern: the same thrust ahead and astern from rest"
    needs_vehicle = ("thrusts",)
    parameters = (Parameter("k", 0.2, "1", 0.0, 1.0, source="[S] chosen here", description="part that the hull takes"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return changed(e, d.thruster, -q.k * min(0.0, d.thruster.force))


class ThrusterDirection(OnThrusters):
    """A thruster points elsewhere than the allocation says, turned about the vertical."""

    name = "thruster_direction"
    title = "direction of the thrusters"
    cause = "actuator.propulsion.arrangement"
    number = 16
    equation = "F = F_0 turned by azimuth, clockwise from above"
    source = "[S] chosen here: mountings are a few degrees off"
    confused_with = ("thruster_gain", "thrust_misalignment", "rudder_offset")
    distinguished_by = "a force across the thrust, in proportion to it: steps of one thruster after another"
    needs_states = ("v", "r")
    needs_vehicle = ("thrusts",)
    parameters = (Parameter("azimuth", 0.05, "rad", -0.8, 0.8, source="[S] 3 deg", description="clockwise from above"),)
    null: Mapping[str, float] = {"azimuth": 0.0}

    def candidates(self, model: Model) -> tuple[Effect, ...]:
        """See `Effect.candidates`; none of a pod or a jet whose angle is a rudder's: that one's offset is the same."""
        steered = {f"{sign}{one.input}" for one in model.actuators if one.kind == "rudder" for sign in ("", "-")}
        pods = {one.name for one in model.actuators if isinstance(one, Thruster) and one.turned_by in steered}
        return tuple(
            form for form in super().candidates(model) if not {one.name for one in targets(form, model)} <= pods
        )

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        one = d.thruster
        a, b = turned(one.a, one.b, q.azimuth)
        return pushed(e, one, one.force * (a - one.a), one.force * (b - one.b), 0.0)


class ThrusterTilt(OnThrusters):
    """A thruster points elsewhere than the allocation says, turned about the transverse axis."""

    name = "thruster_tilt"
    title = "tilt of the thrusters"
    cause = "actuator.propulsion.arrangement"
    number = 16
    equation = "F = F_0 turned by tilt, its fore end up"
    source = ThrusterDirection.source
    confused_with = ("thruster_gain", "trim", "plane_offset")
    distinguished_by = "a moment in proportion to the thrust: steps of one thruster after another"
    needs_states = ("w", "q", "theta")
    needs_vehicle = ("thrusts",)
    parameters = (Parameter("tilt", 0.05, "rad", -0.8, 0.8, source="[S] 3 deg", description="fore end up"),)
    null: Mapping[str, float] = {"tilt": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        one = d.thruster
        cos_t, sin_t = math.cos(q.tilt), math.sin(q.tilt)
        a, c = one.a * cos_t + one.c * sin_t, one.c * cos_t - one.a * sin_t
        return pushed(e, one, one.force * (a - one.a), 0.0, one.force * (c - one.c))


class ThrustersExchanged(OnThrusters):
    """Two thrusters have each other's order: wired or allocated the wrong way round, wholly at share 1."""

    name = "thrusters_exchanged"
    title = "orders of two thrusters exchanged"
    cause = "actuator.propulsion.arrangement"
    number = 16
    equation = "F_1 = F_10 + share (F_20 - F_10), F_2 alike"
    source = "[S] an error of wiring or of the allocation matrix"
    confused_with = ("thruster_gain",)
    distinguished_by = "where one pushes, the other answers: steps of one thruster after another"
    pairs = True
    wholly = True
    each_of_many = True
    needs_vehicle = ("thrusts",)
    parameters = (Parameter("share", 1.0, "1", -0.5, 1.5, source="[S] wholly", description="1: exchanged"),)
    null: Mapping[str, float] = {"share": 0.0}
    likely = ({"share": 1.0},)
    """Orders are exchanged wholly. On the way there from none, the paths of a vehicle that turns as it moves may come
    no nearer to the record, and a fit ended at 0.64."""

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        change = q.share * (d.other.force - d.thruster.force)
        return changed(changed(e, d.thruster, change), d.other, -change)


class VoltageSag(OnThrusters):
    """The voltage falls with the load of all thrusters, and the thrust of each with it."""

    name = "voltage_sag"
    title = "thrust that falls with the load"
    cause = "actuator.propulsion.supply.load"
    number = 18
    equation = "F = F_0 (1 - k load), load the mean size of all inputs over full power"
    source = "[L] internal resistance of a battery; [S] linear form and magnitude chosen here: 5 to 30 % at full load"
    confused_with = ("thruster_gain", "battery_discharge", "drag_increase")
    distinguished_by = "one thruster loses where another works: single steps beside steps of all; a recorded voltage"
    needs_vehicle = ("thrusts",)
    parameters = (Parameter("k", 0.15, "1", 0.0, 1.0, source="[S] chosen here", description="loss at full load"),)
    null: Mapping[str, float] = {"k": 0.0}
    common_only = True

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return changed(e, d.thruster, -q.k * d.load * d.thruster.force)


class BatteryDischarge(OnThrusters):
    """The thrust of all thrusters falls with the time of the trial, as the battery empties."""

    name = "battery_discharge"
    title = "thrust that falls with time"
    cause = "actuator.propulsion.supply.charge"
    number = 18
    equation = "F = F_0 (1 - rate t), t of the trial"
    source = "[L] a battery's voltage falls as it empties; [S] linear form, magnitude chosen here: 10 % in 1000 s"
    confused_with = ("thruster_gain", "voltage_sag", "drag_increase", "varying_current")
    distinguished_by = "the same run at the beginning and at the end; a recorded voltage"
    needs_vehicle = ("thrusts",)
    parameters = (Parameter("rate", 1e-4, "1/s", 0.0, 0.01, source="[S] chosen here", description="part lost"),)
    null: Mapping[str, float] = {"rate": 0.0}
    common_only = True

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return changed(e, d.thruster, -q.rate * e.t * d.thruster.force)


def _thruster(model: Model, name: str) -> Thruster:
    return next(one for one in model.actuators if isinstance(one, Thruster) and one.name == name)
