"""Longitudinal plane of a torpedo-like vehicle: its speed along and across, pitch, and its place in the vertical plane.

Equations: the model that Chen, Yan and Wang 2011 identify; the printed equations are lost, the form here is a
reconstruction [R] from the surviving text [P]: origin at the centre of gravity, centre of buoyancy on the axis at x_B,
constant added masses, viscous forces linear in incidence, pitch rate and fin. Values: [S] a 324 mm body of the class
that Zhao, Xie and Qiao 2018 describe; the pendulum term of y_G is an addition (0 in the paper's geometry).

The equations stand in the torpedo convention of the paper, x forward and **y up**. States, inputs and outputs are in
seatruth's axes, z down, as those of the coupled model in `torpedo.py` are:

    v_x = u     w_z = q           x_0 = x     delta_e = delta_s
    v_y = -w    theta = theta     y_0 = -z

Incidence is alpha = -arctan(v_y / v_x). A positive elevator angle pitches the nose down.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel

_BODY = "[S] a 324 mm body, chosen here"
_TINY_SPEED_2 = 1e-12
"""m2/s2: keeps incidence and its derivatives finite at rest."""


def _coefficient(name: str, value: float, description: str) -> Parameter:
    """Within 0.2 to 3 times its value, which is where the published search starts from here [S]."""
    low, high = sorted((0.2 * value, 3.0 * value))
    return Parameter(name, value, "1", low, high, source=_BODY, description=description)


def _added(name: str, value: float, unit: str, description: str) -> Parameter:
    low, high = sorted((0.2 * value, 3.0 * value))
    return Parameter(name, value, unit, low, high, source=_BODY, description=description)


def _constant(name: str, value: float, unit: str, low: float, high: float, description: str) -> Parameter:
    return Parameter(name, value, unit, low, high, source=_BODY, description=description)


_WEIGHT = 232.57 * 9.81
"""N."""
_THRUST = 0.5 * 1025.0 * (math.pi * 0.324**2 / 4.0) * 0.16 * 4.0**2
"""N: balances a drag coefficient of 0.16 at 4 m/s."""

_R2: tuple[Parameter, ...] = (
    _constant("rho", 1025.0, "kg/m3", 990.0, 1035.0, "water density"),
    _constant("g", 9.81, "m/s2", 9.77, 9.84, "gravity"),
    _constant("L", 3.2, "m", 2.5, 4.0, "length"),
    _constant("D", 0.324, "m", 0.25, 0.4, "diameter; its cross-section is the reference area"),
    _constant("m", 232.57, "kg", 180.0, 280.0, "mass"),
    _constant("J_z", 170.1, "kg m2", 100.0, 250.0, "pitch moment of inertia"),
    _constant("dG", -0.05 * _WEIGHT, "N", -600.0, 600.0, "net weight: weight less buoyancy, negative if it floats"),
    _constant("x_B", 0.0, "m", -0.2, 0.2, "centre of buoyancy ahead of that of gravity"),
    _constant("y_G", -0.012, "m", -0.1, 0.1, "height of the centre of gravity that gives the pendulum moment"),
    _constant("T", _THRUST, "N", 0.0, 600.0, "thrust"),
    _added("lambda_11", 6.98, "kg", "added mass along"),
    _added("lambda_22", 218.6, "kg", "added mass across"),
    _added("lambda_26", -44.65, "kg m", "added mass that couples across and pitch"),
    _added("lambda_66", 144.6, "kg m2", "added moment of inertia in pitch"),
    _coefficient("C_x0", 0.14, "drag at zero incidence"),
    _coefficient("C_x_alpha", 0.35, "drag by |incidence|"),
    _constant("C_y0", 0.0, "1", -0.1, 0.1, "lift at zero incidence (reading R1)"),
    _coefficient("C_y_alpha", 2.30, "lift by incidence"),
    _coefficient("C_y_wz", 1.20, "lift by pitch rate"),
    _coefficient("C_y_de", 0.45, "lift by the elevator (reading R2)"),
    _constant("m_z0", 0.0, "1", -0.02, 0.02, "pitch moment at zero incidence (reading R1)"),
    _coefficient("m_z_alpha", 0.60, "pitch moment by incidence (destabilising)"),
    _coefficient("m_z_wz", -0.62, "pitch damping"),
    _coefficient("m_z_de", -0.21, "pitch moment by the elevator (reading R2)"),
)
_R1: tuple[Parameter, ...] = (
    _constant("T", 0.0, "N", 0.0, 600.0, "thrust"),
    _constant("C_y0", 0.005, "1", -0.1, 0.1, "lift at zero incidence"),
    _constant("C_y_de", 0.0, "1", -1.0, 1.0, "lift by the elevator (reading R2)"),
    _constant("m_z0", -0.001, "1", -0.02, 0.02, "pitch moment at zero incidence"),
    _constant("m_z_de", 0.0, "1", -1.0, 1.0, "pitch moment by the elevator (reading R2)"),
)
READINGS: Mapping[str, tuple[str, ...]] = {
    "R2": (
        *("lambda_22", "lambda_26", "lambda_66", "C_x0", "C_x_alpha"),
        *("C_y_alpha", "C_y_wz", "C_y_de", "m_z_alpha", "m_z_wz", "m_z_de"),
    ),
    "R1": (
        *("lambda_22", "lambda_26", "lambda_66", "C_x0", "C_x_alpha"),
        *("C_y0", "C_y_alpha", "C_y_wz", "m_z0", "m_z_alpha", "m_z_wz"),
    ),
}
"""The 11 parameters that each reading of the paper's vector identifies (the 12th, lambda_11, is kept)."""


class LongitudinalPlane(Model):
    """Motion of a torpedo-like vehicle in the vertical plane at constant thrust, running ahead.

    `reading` picks how the paper's lost vector of 12 parameters is read: "R2" with an elevator (the benchmark), "R1"
    without fin and thrust but with a lift and a moment at zero incidence. The coefficients contain the couplings of
    an ideal fluid (Munk's moment and the like); `LongitudinalPlaneExplicit` is for coefficients that do not.
    """

    name = "longitudinal_plane"
    title = "Torpedo-like vehicle in the longitudinal plane (added masses free)"
    kind = "auv"
    source = "[R] after Chen, Yan and Wang 2011"
    states = (
        Channel("u", "m/s", "forward velocity over ground"),
        Channel("w", "m/s", "downward velocity over ground, body axes"),
        Channel("q", "rad/s", "pitch rate, positive nose up"),
        Channel("theta", "rad", "pitch angle, positive nose up", angle=True),
        Channel("x", "m", "distance made good"),
        Channel("z", "m", "depth"),
    )
    inputs = (Channel("delta_s", "rad", "elevator angle, positive pitches the nose down"),)
    outputs = states
    parameters: tuple[Parameter, ...] = _R2
    sets: ClassVar[tuple[str, ...]] = tuple(READINGS)

    def __init__(self, reading: str = "R2") -> None:
        if reading not in READINGS:
            raise BadInput(f"model {self.name!r} has no parameter set {reading!r}", do=nearest(reading, READINGS))
        own = {parameter.name: parameter for parameter in (_R1 if reading == "R1" else ())}
        self.reading = reading
        self.parameters = tuple(own.get(parameter.name, parameter) for parameter in _R2)
        super().__init__()

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return motion(s, i.delta_s, p, e, 0.0)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, p.D, p.D, p.m, p.rho)

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return p.T

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return 0.125 * math.pi * p.rho * p.D * p.D * p.C_x0 * u * abs(u)


class LongitudinalPlaneExplicit(LongitudinalPlane):
    """The same with the couplings of the added masses written out, for coefficients that do not contain them."""

    name = "longitudinal_plane_explicit"
    title = "Torpedo-like vehicle in the longitudinal plane, ideal-fluid couplings apart from the coefficients"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return motion(s, i.delta_s, p, e, 1.0)


def motion(s: Any, delta: Any, p: Any, e: Any, couplings: float) -> tuple[Any, ...]:
    """d/dt of the states under the elevator angle delta; `couplings` is 1 where they stand apart, else 0."""
    # Into the torpedo convention, over ground and through the water.
    v_x, v_y, w_z, G = s.u, -s.w, s.q, p.m * p.g
    r_x, r_y = v_x - e.u_c, v_y + e.w_c
    square = r_x * r_x + r_y * r_y
    ahead = math.sqrt(r_x * r_x + _TINY_SPEED_2)
    alpha = math.atan2(-r_y, ahead)
    half = 0.125 * math.pi * p.rho * p.D * p.D  # half the density times the cross-section
    pressure, damping = half * square, half * math.sqrt(square + _TINY_SPEED_2) * p.L
    drag = pressure * (p.C_x0 + p.C_x_alpha * abs(alpha)) * (r_x / ahead)
    F_x = p.T - drag - p.dG * math.sin(s.theta)
    F_y = pressure * (p.C_y0 + p.C_y_alpha * alpha + p.C_y_de * delta) + damping * p.C_y_wz * w_z
    F_y = F_y - p.dG * math.cos(s.theta)
    M_z = p.L * (pressure * (p.m_z0 + p.m_z_alpha * alpha + p.m_z_de * delta) + damping * p.m_z_wz * w_z)
    M_z = M_z + (G - p.dG) * p.x_B * math.cos(s.theta) + G * p.y_G * math.sin(s.theta)
    if couplings:
        F_x = F_x + p.lambda_22 * r_y * w_z + p.lambda_26 * w_z * w_z
        F_y = F_y - p.lambda_11 * r_x * w_z
        M_z = M_z - p.lambda_26 * r_x * w_z

    # Rigid body on the velocity over ground, added mass on the velocity through the water.
    F_x = F_x + p.m * v_y * w_z + p.lambda_11 * e.du_c + e.X
    F_y = F_y - p.m * v_x * w_z - p.lambda_22 * e.dw_c - e.Z
    M_z = M_z - p.lambda_26 * e.dw_c + e.M
    a, b, d = p.m + p.lambda_22, p.lambda_26, p.J_z + p.lambda_66
    determinant = a * d - b * b
    sin_t, cos_t = math.sin(s.theta), math.cos(s.theta)
    return (
        F_x / (p.m + p.lambda_11),
        -(d * F_y - b * M_z) / determinant,
        (a * M_z - b * F_y) / determinant,
        w_z,
        v_x * cos_t - v_y * sin_t,
        -(v_x * sin_t + v_y * cos_t),
    )
