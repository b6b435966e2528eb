"""Wind and waves on what is above or near the surface."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.effects.kinematics import G, into_body
from seatruth.models.parameter import Parameter

AIR = 1.226
"""kg/m3."""
FRONT, SIDE = 1.3, 0.9
"""Areas above water over breadth times draught and over length times draught [S]: loaded cargo ships and tankers."""
ALONG, ACROSS, SHAPE = 0.65, 0.85, 0.40
"""Blendermann's coefficients of a loaded cargo ship: drag ahead on the frontal area, abeam, and cross-force."""


REACH = 3.0
"""m: depth in which the square of a wave's motion falls to 1/e, for waves of 5 s [L: exp(-2 k z)]."""


def wind_force(u: Any, v: Any, lever: Any, d: Any) -> tuple[Any, Any, Any]:
    """X, Y (N) and N (N m) by the air that the vehicle moves through with u, v (m/s), after Blendermann."""
    square = u * u + v * v + 1e-12
    speed = math.sqrt(square)
    front, side = FRONT * d.breadth * d.draft, SIDE * d.length * d.draft
    ratio = 1.0 - ALONG * front / (ACROSS * side)
    divisor = 1.0 - 0.5 * SHAPE * ratio * 4.0 * (u * u / square) * (v * v / square)
    X = -0.5 * AIR * front * ALONG * speed * u / divisor
    Y = -0.5 * AIR * side * ACROSS * speed * v / divisor
    return X, Y, d.length * (lever + 0.18 * math.atan2(u, math.sqrt(v * v + 1e-12))) * Y


class Wind(Effect):
    """A steady wind that blows towards (north, east), less the air's resistance in a calm, which the drag contains.

    The areas above water are estimated from the dimensions, so the wind found is one for these areas.
    """

    name = "wind"
    title = "steady wind"
    cause = "environment.force_fixed_to_earth.wind"
    number = 20
    equation = "F = rho_a/2 V_rw^2 A C(gamma), less the same in a calm"
    source = "[L] Blendermann 1994, loaded cargo ship; [S] areas from the dimensions; catalogue: 2 to 15 m/s"
    kinds = ("ship", "planing")
    acts_on = ("surge", "sway", "roll", "yaw")
    confused_with = ("current", "wave_drift", "rudder_offset", "drag_increase")
    told_apart = "leaves a drift through the water and a rudder angle that change with the heading to the earth"
    needs_states = ("u", "v", "psi", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("north", 5.0, "m/s", -40.0, 40.0, source="[S] catalogue", description="blows along x of the earth"),
        Parameter("east", 5.0, "m/s", -40.0, 40.0, source="[S] catalogue", description="blows along y of the earth"),
        Parameter("lever", 0.05, "1", -0.3, 0.3, source="[S] chosen here", description="side area before midship / L"),
    )
    null: ClassVar[Mapping[str, float]] = {"north": 0.0, "east": 0.0, "lever": 0.0}
    froude: ClassVar[Mapping[str, float]] = {"north": 0.5, "east": 0.5}
    starts = tuple(
        {"north": 3.0 * math.cos(k * math.pi / 4), "east": 3.0 * math.sin(k * math.pi / 4), "lever": 0.0}
        for k in range(8)
    )

    @staticmethod
    def surroundings(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        along, across, _ = into_body(q.north, q.east, s)
        X, Y, N = wind_force(s.u - along, s.v - across, q.lever, d)
        X_0, Y_0, N_0 = wind_force(s.u, s.v, q.lever, d)
        heel = d.draft * (Y - Y_0)  # the side area's centre is about a draught above the origin
        return e._replace(X=e.X + X - X_0, Y=e.Y + Y - Y_0, K=e.K + heel, N=e.N + N - N_0)


class WaveDrift(Effect):
    """Mean second-order force of waves that run towards (north, east); these are the components of H_s^2."""

    name = "wave_drift"
    title = "mean drift force of waves"
    cause = "environment.force_fixed_to_earth.wave_drift"
    number = 29
    equation = "X = rho g B h_x / 16, Y = rho g L h_y / 16, h = R(psi)^T (north, east)"
    source = "[L] Maruo's bound for a reflecting side, rho g a^2 / 2 a metre; [S] catalogue: H_s 0.2 to 4 m"
    acts_on = ("surge", "sway")
    confused_with = ("wind", "current", "drag_increase")
    told_apart = "as a steady wind without moment; from a current by the drift through the water"
    needs_states = ("u", "v", "psi", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("north", 0.02, "m2", -50.0, 50.0, source="[S] catalogue", description="of H_s^2, along x"),
        Parameter("east", 0.02, "m2", -50.0, 50.0, source="[S] catalogue", description="of H_s^2, along y"),
    )
    null: ClassVar[Mapping[str, float]] = {"north": 0.0, "east": 0.0}
    magnitudes: ClassVar[Mapping[str, Mapping[str, float]]] = {"ship": {"north": 4.0, "east": 4.0}}
    froude: ClassVar[Mapping[str, float]] = {"north": 2.0, "east": 2.0}

    @staticmethod
    def surroundings(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        along, across, _ = into_body(q.north, q.east, s)
        pressure = d.rho * G / 16.0
        return e._replace(X=e.X + pressure * d.breadth * along, Y=e.Y + pressure * d.length * across)


class WaveDriftVertical(Effect):
    """The same on a submerged vehicle near the surface: a push along the waves and suction towards the surface."""

    name = "wave_drift_vertical"
    title = "mean drift and suction of waves near the surface"
    cause = "environment.force_fixed_to_earth.wave_drift"
    number = 29
    equation = "rho g B / 16 (along x of the earth, up) exp(-z / reach)"
    source = WaveDrift.source
    kinds = ("auv", "glider")
    acts_on = ("surge", "heave")
    confused_with = ("net_weight", "current_along", "thrust_gain", "drag_increase")
    told_apart = "suction ends a few metres down, weight does not: two depths"
    needs_states = ("u", "w", "q", "theta", "z")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("along", 0.1, "m2", -5.0, 5.0, source="[S] catalogue", description="of H_s^2, along x"),
        Parameter("up", 0.05, "m2", -5.0, 5.0, source="[S] catalogue", description="of H_s^2, towards the surface"),
        Parameter("reach", 1.5, "m", 0.3, 60.0, source="[L] exp(-2 k z)", description="depth in which it falls to 1/e"),
    )
    null: ClassVar[Mapping[str, float]] = {"along": 0.0, "up": 0.0, "reach": REACH}
    magnitudes: ClassVar[Mapping[str, Mapping[str, float]]] = {"glider": {"along": 0.02, "up": 0.01}}

    @staticmethod
    def surroundings(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        along, across, down = into_body(d.breadth * q.along, 0.0, s)
        phi, c, t = getattr(s, "phi", 0.0), math.cos(s.theta), math.sin(s.theta)
        lift = d.breadth * q.up
        pressure = d.rho * G / 16.0 * math.exp(-max(s.z, 0.0) / q.reach)
        return e._replace(
            X=e.X + pressure * (along + lift * t),
            Y=e.Y + pressure * (across - lift * c * math.sin(phi)),
            Z=e.Z + pressure * (down - lift * c * math.cos(phi)),
        )


class WaveForces(Effect):
    """First-order force of one long-crested wave along its direction, at the frequency of encounter.

    The phase belongs to one trial; several trials have no phase in common, there it is narrow-band noise.
    """

    name = "wave_forces"
    title = "first-order wave forces"
    cause = "environment.wave_motion"
    number = 29
    equation = "F/m = cosine cos(w t - k s) + sine sin(w t - k s), k = w^2/g, s along the direction"
    source = "[L] linear deep-water waves; [S] magnitudes chosen here"
    acts_on = ("surge", "sway")
    confused_with = ("rudder_dead_band", "rudder_backlash", "sloshing")
    told_apart = "a narrow band whose frequency moves with course and speed; limit cycles and sloshing keep theirs"
    needs_states = ("u", "v", "psi", "r", "x", "y")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("cosine", 0.02, "m/s^2", -2.0, 2.0, source="[S] chosen here", description="acceleration in phase"),
        Parameter("sine", 0.02, "m/s^2", -2.0, 2.0, source="[S] chosen here", description="acceleration out of phase"),
        Parameter("frequency", 1.1, "rad/s", 0.2, 4.0, source="[S] chosen here", description="w, seen from the earth"),
        Parameter("towards", 1.5, "rad", -7.0, 7.0, source="[S] chosen here", description="clockwise from x"),
    )
    null: ClassVar[Mapping[str, float]] = {"cosine": 0.0, "sine": 0.0, "frequency": 0.8, "towards": 0.0}
    starts = tuple(
        {"cosine": 0.01, "sine": 0.01, "frequency": frequency, "towards": k * math.pi / 2}
        for frequency in (0.5, 0.9, 1.6)
        for k in range(4)
    )
    stochastic = True

    @staticmethod
    def surroundings(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        c, t = math.cos(q.towards), math.sin(q.towards)
        phase = q.frequency * e.t - q.frequency * q.frequency / G * (s.x * c + s.y * t)
        force = d.mass * (q.cosine * math.cos(phase) + q.sine * math.sin(phase))
        along, across, _ = into_body(c, t, s)
        return e._replace(X=e.X + force * along, Y=e.Y + force * across)
