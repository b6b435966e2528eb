"""Wind and waves on vehicles at or near the surface."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from seatruth.effects.base import Effect
from seatruth.effects.kinematics import G, to_body_axes
from seatruth.effects.vehicle import dimensions_of
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter, Prior

_SHAPE = "[S] chosen here: how much vehicles differ"
_KNOWN_AREA, _ESTIMATED_AREA = 0.15, 0.4
"""Deviation of ln(area) of an area that the model declares, and of one estimated from its dimensions. Chosen here [S]:
what the loading changes, and how much ships differ."""
_X_RATIO = 0.5
"""Deviation of ln(surge coefficient over the published one), chosen here [S]."""
AIR = 1.226
"""kg/m3."""
FRONT, SIDE = 1.3, 0.9
"""Areas above water over breadth times draught and over length times draught [S]: loaded cargo ships and tankers."""
ALONG, ACROSS, CROSS = 0.65, 0.85, 0.40
"""Blendermann's coefficients of a loaded cargo ship: drag ahead on the frontal area, abeam, and cross-force."""
_REACH, _REACHES = 7.0, 5.0
"""m: depth in which the square of a wave's motion falls to 1/e, g T^2 / (8 pi^2) [L: exp(-2 k z)], and its deviation:
2 m for waves of 4 s, 12 m for those of 10 s."""

RIPPLE = 1e-4
"""m2: H_s^2 of a centimetre, below which a drift force has no moment by its angle, so that it is smooth there. [S]"""


class WindShape(NamedTuple):
    """How the air's force on a vehicle differs from that on the published loaded cargo ship; by default not at all.

    `lever`: centre of the side area before midship over the length; `ln_area`: natural logarithm of the areas over
    those estimated from the dimensions; `yaw_slope`: by how much the lever grows with the wind's angle, 1/rad;
    `ln_x_ratio`: natural logarithm of the surge coefficient over the published one.
    """

    lever: Any = 0.0
    ln_area: Any = 0.0
    yaw_slope: Any = 0.18
    ln_x_ratio: Any = 0.0


def wind_force(u: Any, v: Any, shape: Any, d: Any) -> tuple[Any, Any, Any]:
    """X, Y (N) and N (N m) by the air, through which the vehicle moves with u, v (m/s), after Blendermann.

    `shape` has the fields of `WindShape`, `d` those of `Vehicle`.
    """
    square = u * u + v * v + 1e-12
    speed = math.sqrt(square)
    area = math.exp(shape.ln_area)
    front = area * (FRONT * d.breadth * d.draft if d.frontal_area is None else d.frontal_area)
    side = area * (SIDE * d.length * d.draft if d.lateral_area is None else d.lateral_area)
    ratio = 1.0 - ALONG * front / (ACROSS * side)
    divisor = 1.0 - 0.5 * CROSS * ratio * 4.0 * (u * u / square) * (v * v / square)
    X = -0.5 * AIR * front * ALONG * math.exp(shape.ln_x_ratio) * speed * u / divisor
    Y = -0.5 * AIR * side * ACROSS * speed * v / divisor
    return X, Y, d.length * (shape.lever + shape.yaw_slope * math.atan2(u, math.sqrt(v * v + 1e-12))) * Y


class Wind(Effect):
    """A steady wind that blows towards (north, east), less the air's resistance in a calm, which the drag contains.

    The areas above water are those that the model or the study states, or are estimated from its dimensions. How far
    the vehicle's areas and coefficients are from these and from the published ones is free under priors.
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
    distinguished_by = "leaves a drift through the water and a rudder angle that change with the heading to the earth"
    needs_states = ("u", "v", "psi", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("north", 5.0, "m/s", -40.0, 40.0, source="[S] catalogue", description="blows along x of the earth"),
        Parameter("east", 5.0, "m/s", -40.0, 40.0, source="[S] catalogue", description="blows along y of the earth"),
        Parameter(
            "lever",
            0.0,
            "1",
            -0.4,
            0.4,
            prior=Prior(0.0, 0.1),
            source=_SHAPE,
            description="side area before midship / L",
        ),
        Parameter(
            "ln_area",
            0.0,
            "1",
            -2.0,
            2.0,
            prior=Prior(0.0, _ESTIMATED_AREA),
            source=_SHAPE,
            description="areas / declared or estimated ones, ln",
        ),
        Parameter(
            "yaw_slope",
            0.18,
            "1/rad",
            -0.4,
            0.8,
            prior=Prior(0.18, 0.12),
            source="[L] Blendermann 1994: 0.18; [S] deviation: model ships on a pond had 0.04 to 0.10",
            description="of the lever over the angle of the wind",
        ),
        Parameter(
            "ln_x_ratio",
            0.0,
            "1",
            -2.5,
            2.5,
            prior=Prior(0.0, _X_RATIO),
            source=_SHAPE,
            description="surge / published, ln",
        ),
    )
    null: Mapping[str, float] = {"north": 0.0, "east": 0.0}
    direction = ("north", "east")
    froude: ClassVar[Mapping[str, float]] = {"north": 0.5, "east": 0.5}
    scaled_by: ClassVar[Mapping[str, float]] = {"ln_area": -0.5}
    starts = tuple(
        {"north": 3.0 * math.cos(k * math.pi / 4), "east": 3.0 * math.sin(k * math.pi / 4)} for k in range(8)
    )

    def priors(self, model: Model) -> dict[str, Prior]:
        """See `Effect.priors`; narrower where the model declares areas above water.

        The sway force is as uncertain as the lateral area, the surge force as the frontal area and its coefficient
        together. Since `ln_area` scales both areas, `ln_x_ratio` takes what the two differ by.
        """
        found, size = super().priors(model), dimensions_of(model)
        if size is None:
            return found
        front, side = (_ESTIMATED_AREA if a is None else _KNOWN_AREA for a in (size.frontal_area, size.lateral_area))
        surge = math.sqrt(front * front + _X_RATIO * _X_RATIO - side * side)
        found["ln_area"] = Prior(found["ln_area"].mean, side)
        found["ln_x_ratio"] = Prior(found["ln_x_ratio"].mean, surge)
        return found

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        along, across, _ = to_body_axes(q.north, q.east, s)
        X, Y, N = wind_force(s.u - along, s.v - across, q, d)
        X_0, Y_0, N_0 = wind_force(s.u, s.v, q, d)
        heel = d.draft * (Y - Y_0)  # the side area's centre is about a draught above the origin
        return e._replace(X=e.X + X - X_0, Y=e.Y + Y - Y_0, K=e.K + heel, N=e.N + N - N_0)


class WaveDrift(Effect):
    """Mean second-order force of waves that run towards (north, east); these are the components of H_s^2.

    A steady force fixed to the earth. Where it acts along the hull, and the force along over that across, depend on
    the waves' length and are free under priors. Short waves, reflected where they meet the waterline, push on a hull
    with round ends before its middle in a head sea and behind it in a following one, as wind does.
    """

    name = "wave_drift"
    title = "mean drift force of waves"
    cause = "environment.force_fixed_to_earth.wave_drift"
    number = 29
    equation = (
        "X = ratio rho g B h_x / 16, Y = rho g L h_y / 16, N = (lever + slope gamma) L Y, h = R(psi)^T (north, east)"
    )
    source = "[L] Maruo's bound for a reflecting side, rho g a^2 / 2 a metre; [S] catalogue: H_s 0.2 to 4 m"
    acts_on = ("surge", "sway", "yaw")
    confused_with = ("wind", "current", "drag_increase")
    distinguished_by = "wind pushes the harder the faster the vehicle meets it; from a current: drift through the water"
    needs_states = ("u", "v", "psi", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("north", 0.02, "m2", -50.0, 50.0, source="[S] catalogue", description="of H_s^2, along x"),
        Parameter("east", 0.02, "m2", -50.0, 50.0, source="[S] catalogue", description="of H_s^2, along y"),
        Parameter(
            "lever", 0.0, "1", -0.5, 0.5, prior=Prior(0.0, 0.1), source=_SHAPE, description="force before midship / L"
        ),
        Parameter(
            "ln_x_ratio",
            0.0,
            "1",
            -2.5,
            2.5,
            prior=Prior(0.0, 0.5),
            source=_SHAPE,
            description="surge / that bound, ln",
        ),
        Parameter(
            "yaw_slope",
            0.12,
            "1/rad",
            -0.3,
            0.6,
            prior=Prior(0.12, 0.08),
            source="[L] Maruo's reflection; [V] summed along superelliptic waterlines: 0.06 to 0.2; [S] deviation",
            description="of the lever over the angle at which the waves come, less a right angle",
        ),
    )
    null: Mapping[str, float] = {"north": 0.0, "east": 0.0}
    direction = ("north", "east")
    typical_by_kind: ClassVar[Mapping[str, Mapping[str, float]]] = {"ship": {"north": 4.0, "east": 4.0}}
    froude: ClassVar[Mapping[str, float]] = {"north": 2.0, "east": 2.0}
    power = 2

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        along, across, _ = to_body_axes(q.north, q.east, s)
        pressure = d.rho * G / 16.0
        Y = pressure * d.length * across
        X = math.exp(q.ln_x_ratio) * pressure * d.breadth * along
        lever = q.lever - q.yaw_slope * math.atan2(along, math.sqrt(across * across + RIPPLE * RIPPLE))
        return e._replace(X=e.X + X, Y=e.Y + Y, N=e.N + lever * d.length * Y)


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
    distinguished_by = "suction ends a few metres down, weight does not: two depths"
    needs_states = ("u", "w", "q", "theta", "z")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("along", 0.1, "m2", -5.0, 5.0, source="[S] catalogue", description="of H_s^2, along x"),
        Parameter("up", 0.05, "m2", -5.0, 5.0, source="[S] catalogue", description="of H_s^2, towards the surface"),
        Parameter(
            "reach",
            _REACH,
            "m",
            0.3,
            60.0,
            prior=Prior(_REACH, _REACHES),
            source="[L] exp(-2 k z); [S] waves of 4 to 10 s",
            description="depth in which it falls to 1/e",
        ),
    )
    null: Mapping[str, float] = {"along": 0.0, "up": 0.0}
    typical_by_kind: ClassVar[Mapping[str, Mapping[str, float]]] = {"glider": {"along": 0.02, "up": 0.01}}
    power = 2

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        along, across, down = to_body_axes(d.breadth * q.along, 0.0, s)
        phi, c, t = getattr(s, "phi", 0.0), math.cos(s.theta), math.sin(s.theta)
        lift = d.breadth * q.up
        pressure = d.rho * G / 16.0 * math.exp(-max(s.z, 0.0) / q.reach)
        return e._replace(
            X=e.X + pressure * (along + lift * t),
            Y=e.Y + pressure * (across - lift * c * math.sin(phi)),
            Z=e.Z + pressure * (down - lift * c * math.cos(phi)),
        )
