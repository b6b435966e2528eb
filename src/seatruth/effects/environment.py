"""Currents, shallow water and banks. Wind and waves: `weather`."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.effects.kinematics import sink_rate, to_body_axes
from seatruth.effects.vehicle import motion_channels
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter, Prior

_FOSSEN = "[L] Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control"


def with_current(e: Any, s: Any, north: Any, east: Any, north_dot: Any = 0.0, east_dot: Any = 0.0) -> Any:
    """The environment with a current over ground (north, east; m/s) added, and its rate of change (m/s2)."""
    u_c, v_c, w_c = to_body_axes(north, east, s)
    du, dv, dw = to_body_axes(north_dot, east_dot, s)
    p, q, r = getattr(s, "p", 0.0), getattr(s, "q", 0.0), getattr(s, "r", 0.0)
    return e._replace(
        u_c=e.u_c + u_c,
        v_c=e.v_c + v_c,
        w_c=e.w_c + w_c,
        du_c=e.du_c + du + r * v_c - q * w_c,
        dv_c=e.dv_c + dv + p * w_c - r * u_c,
        dw_c=e.dw_c + dw + q * u_c - p * v_c,
    )


_SUBMERGED = ("auv", "glider")
"""Kinds of vehicles that neither wind nor waves push far."""


def as_drift(effect: Effect, model: Model, title: str) -> Effect:
    """A current as a model can tell it: the environment's drift over the ground, where wind would look the same.

    On a model without a sway state, or on which no outside force can act, wind and waves at the surface cannot be
    tried: the leeway that they cause is a drift over the ground as a current causes it.
    """
    sways = any(model.standard_of(channel.name)[0] == "v" for channel in motion_channels(model))
    pushed = bool(model.innermost.ports.force) if isinstance(model, BlackBox) else model.takes_environment
    if model.kind in _SUBMERGED or (sways and pushed):
        return effect
    drift = copy(effect)
    drift.title, drift.cause, drift.stands_for_untried = title, "environment", True
    return drift


def _has_heading(model: Model, instead: str) -> str:
    """Why an effect along the track is the wrong one for a model; empty where it is the right one."""
    turns = any(channel.name == "psi" for channel in motion_channels(model))
    return f"the model has a heading: use `{instead}`" if turns else ""


class Current(Effect):
    """A constant current: the water moves over ground, as components so that its null is a regular point."""

    name = "current"
    title = "constant current"
    cause = "environment.moving_water.uniform_current"
    number = 1
    equation = "nu_c = R(psi)^T (north, east); forces by nu - nu_c, position by nu"
    source = _FOSSEN + "; [S] magnitudes of the catalogue: 0.05 to 0.5 m/s, ships 0.1 to 1.5 m/s"
    acts_on = ("kinematics",)
    confused_with = ("speed_bias", "sway_bias", "heading_bias", "wind", "wave_drift", "compass_deviation")
    distinguished_by = "fixed to the earth: turn by 180 deg or more; unlike wind it leaves no drift through the water"
    needs_states = ("u", "psi", "r")
    parameters = (
        Parameter("north", 0.2, "m/s", -3.0, 3.0, source="[S] chosen here", description="along x of the earth"),
        Parameter("east", 0.2, "m/s", -3.0, 3.0, source="[S] chosen here", description="along y of the earth"),
    )
    null: Mapping[str, float] = {"north": 0.0, "east": 0.0}
    direction = ("north", "east")
    typical_by_kind: ClassVar[Mapping[str, Mapping[str, float]]] = {"ship": {"north": 0.5, "east": 0.5}}
    froude: ClassVar[Mapping[str, float]] = {"north": 0.5, "east": 0.5}

    def variants(self, model: Model) -> tuple[Effect, ...]:
        return (as_drift(self, model, "steady drift over the ground (current or leeway)"),)

    @staticmethod
    def current(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        return with_current(e, s, q.north, q.east)


class CurrentAlong(Effect):
    """A constant current along the track of a vehicle whose model has no heading."""

    name = "current_along"
    title = "constant current along the track"
    cause = "environment.moving_water.uniform_current"
    number = 1
    equation = "as a constant current, along x of the earth"
    source = Current.source
    acts_on = ("kinematics",)
    confused_with = ("speed_bias", "speed_scale")
    distinguished_by = "the position knows it: with position, or on the reciprocal course"
    needs_states = ("u", "w", "theta", "q")
    parameters = (Parameter("along", 0.2, "m/s", -3.0, 3.0, source="[S] chosen here", description="along x"),)
    null: Mapping[str, float] = {"along": 0.0}

    def missing(self, model: Model) -> str:
        return _has_heading(model, "current") or super().missing(model)

    @staticmethod
    def current(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        return with_current(e, s, q.along, 0.0)


class CurrentShear(Effect):
    """A current that grows with depth from nothing at the surface; with `current`, any profile to first order."""

    name = "current_shear"
    title = "current sheared with depth"
    cause = "environment.moving_water.sheared_current"
    number = 2
    equation = "V_c = (north, east) z"
    source = _FOSSEN + "; [S] magnitude of the catalogue: 1e-3 1/s; its random part is coloured noise"
    acts_on = ("kinematics",)
    confused_with = ("current", "net_weight")
    distinguished_by = "changes with depth: two depths"
    needs_states = ("u", "psi", "z")
    parameters = (
        Parameter("north", 2e-3, "1/s", -0.1, 0.1, source="[S] catalogue", description="along x of the earth, a metre"),
        Parameter("east", 2e-3, "1/s", -0.1, 0.1, source="[S] catalogue", description="along y of the earth, a metre"),
    )
    null: Mapping[str, float] = {"north": 0.0, "east": 0.0}
    direction = ("north", "east")

    @staticmethod
    def current(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        down = sink_rate(s)
        return with_current(e, s, q.north * s.z, q.east * s.z, q.north * down, q.east * down)


class CurrentShearAlong(Effect):
    """A current along the track that grows with depth, for a vehicle whose model has no heading."""

    name = "current_shear_along"
    title = "current along the track, sheared with depth"
    cause = "environment.moving_water.sheared_current"
    number = 2
    equation = "V_c = along z, along x of the earth"
    source = CurrentShear.source
    acts_on = ("kinematics",)
    confused_with = ("current_along", "varying_current_along", "speed_scale", "net_weight")
    distinguished_by = "changes with depth: a dive with position, or a log on dives and climbs"
    needs_states = ("u", "w", "theta", "q", "z")
    parameters = (Parameter("along", 2e-3, "1/s", -0.1, 0.1, source="[S] catalogue", description="along x, a metre"),)
    null: Mapping[str, float] = {"along": 0.0}

    def missing(self, model: Model) -> str:
        return _has_heading(model, "current_shear") or super().missing(model)

    @staticmethod
    def current(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        return with_current(e, s, q.along * s.z, 0.0, q.along * sink_rate(s))


class VaryingCurrent(Effect):
    """A current that changes steadily with the time of the trial; with `current`, a slow change to first order."""

    name = "varying_current"
    title = "current that changes with time"
    cause = "environment.moving_water.varying_current"
    number = 2
    equation = "V_c = (north, east) t, t of the trial"
    source = _FOSSEN + "; [S] 0.1 m/s in 300 to 3000 s; the random rest of a Gauss-Markov current is coloured noise"
    acts_on = ("kinematics",)
    confused_with = ("current", "wind")
    distinguished_by = "changes with time: repeat the first run at the end"
    needs_states = ("u", "psi", "r")
    parameters = (
        Parameter("north", 3e-4, "m/s^2", -0.02, 0.02, source="[S] catalogue", description="rate along x of the earth"),
        Parameter("east", 3e-4, "m/s^2", -0.02, 0.02, source="[S] catalogue", description="rate along y of the earth"),
    )
    null: Mapping[str, float] = {"north": 0.0, "east": 0.0}
    direction = ("north", "east")
    stochastic = True

    def variants(self, model: Model) -> tuple[Effect, ...]:
        return (as_drift(self, model, "drift over the ground that changes with time (current or leeway)"),)

    @staticmethod
    def current(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        return with_current(e, s, q.north * e.t, q.east * e.t, q.north, q.east)


class VaryingCurrentAlong(Effect):
    """A current along the track that changes steadily with time, for a vehicle whose model has no heading."""

    name = "varying_current_along"
    title = "current along the track that changes with time"
    cause = "environment.moving_water.varying_current"
    number = 2
    equation = "V_c = along t, along x of the earth, t of the trial"
    source = VaryingCurrent.source
    acts_on = ("kinematics",)
    confused_with = ("current_along", "current_shear_along", "speed_bias")
    distinguished_by = "changes with time, not with depth: repeat the first run at the end, with position"
    needs_states = ("u", "w", "theta", "q")
    parameters = (Parameter("along", 3e-4, "m/s^2", -0.02, 0.02, source="[S] catalogue", description="rate along x"),)
    null: Mapping[str, float] = {"along": 0.0}
    stochastic = True

    def missing(self, model: Model) -> str:
        return _has_heading(model, "varying_current") or super().missing(model)

    @staticmethod
    def current(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        return with_current(e, s, q.along * e.t, 0.0, q.along)


_HULL_DAMPING = ("Y_v", "N_v", "C_d")
"""Sway and yaw by drift: linear terms, and the drag of a cross flow where a model has it apart."""


class ShallowWater(Effect):
    """Shallow water makes the hull's sway and yaw damping larger, its cross-flow drag too."""

    name = "shallow_water"
    title = "shallow water"
    cause = "environment.confined_water.shallow_water"
    number = 30
    equation = "Y_v, N_v, C_d times 1 + gain, gain = c (d/h)^k"
    source = "[L] form of corrections for shallow water; [S] catalogue: h/d 1.2 to 3"
    kinds = ("ship", "planing")
    acts_on = ("sway", "yaw")
    equivalent = _HULL_DAMPING
    confused_with = ("drag_increase", "rudder_gain", "cross_flow", "munk")
    distinguished_by = "never from Y_v and N_v on one depth: trials on two depths"
    needs_parameters = _HULL_DAMPING
    parameters = (Parameter("gain", 0.3, "1", 0.0, 3.0, source="[S] chosen here", description="relative increase"),)
    null: Mapping[str, float] = {"gain": 0.0}

    @staticmethod
    def true_parameters(p: Any, q: Any) -> Any:
        return p._replace(**{k: getattr(p, k) * (1.0 + q.gain) for k in _HULL_DAMPING if k in p._fields})


class Bank(Effect):
    """A bank along the track, to starboard where `suction` is positive: it sucks the ship and turns the bow away."""

    name = "bank"
    title = "bank suction"
    cause = "environment.confined_water.bank"
    number = 30
    equation = "Y = suction rho/2 L d u |u|, N = lever L Y"
    source = "[L] Norrbin's form, suction with u^2 / distance; [S] lever and magnitude chosen here"
    kinds = ("ship",)
    acts_on = ("sway", "yaw")
    confused_with = ("rudder_offset", "propeller_walk", "lateral_asymmetry", "wind", "current")
    distinguished_by = "belongs to a place: the same track on the reciprocal course changes its side"
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("suction", 0.003, "1", -0.1, 0.1, source="[S] chosen here", description="to starboard"),
        Parameter(
            "lever",
            -0.3,
            "1",
            -0.6,
            0.6,
            prior=Prior(-0.3, 0.15),
            source="[S] chosen here: the suction acts abaft midship",
            description="suction before midship / L",
        ),
    )
    null: Mapping[str, float] = {"suction": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        u = s.u - e.u_c
        Y = q.suction * 0.5 * d.rho * d.length * d.draft * u * abs(u)
        return e._replace(Y=e.Y + Y, N=e.N + q.lever * d.length * Y)
