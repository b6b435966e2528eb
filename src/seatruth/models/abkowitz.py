"""Abkowitz model of a ship: a series in the deviations from straight motion at the service speed U_0.

Equations and the Mariner values: [L] M. S. Chislett, J. Strom-Tejsen, "Planar motion mechanism tests and full-scale
steering and manoeuvring predictions for a Mariner class vessel" (1965), as transcribed in Fossen's Marine Systems
Simulator. Prime system with speed U and length L (rho/2 absorbed): u' = (u - U_0) / U, v' = v / U, r' = r L / U,
U^2 = u^2 + v^2. Masses over rho/2 L^3, moments of inertia over rho/2 L^5. The propeller runs at its service speed and
is part of the X series, and the centrifugal terms (m u r) are part of the coefficients Y_r, N_r.

The coefficients count the rudder positive to *port*; the input `delta` is positive for a turn to starboard, as
everywhere in seatruth, and changes sign in the first line of the equations.

The series holds about U_0. Its divisor U is held at U_0 / 4 or more, so that it stays finite at rest, where it is not
meant to be used.
"""

from __future__ import annotations

import math
from typing import Any

from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.mmg import EAST, HEADING, NORTH, RUDDER, SURGE, SWAY, YAW_RATE
from seatruth.models.parameter import Parameter

_SOURCE = "[L] Chislett and Strom-Tejsen 1965, Mariner"
_BREADTH, _DRAFT = 23.17 / 160.93, 8.23 / 160.93
"""Over the length [L, Mariner]; only effects' forces need them."""
_RESISTANCE = 0.5
"""Resistance over -X_u: were the thrust constant, drag less thrust would rise by twice the drag over U_0 [R]. The
propeller is part of the series, so the model has no thrust of its own to declare."""
_SLOWEST = 0.25
"""Smallest U / U_0 that divides the series."""


def _coefficient(name: str, value: float, spread: float, description: str) -> Parameter:
    """A prime coefficient given in 1e-5, with bounds `spread` (1e-5) either side."""
    low, high = (value - spread) * 1e-5, (value + spread) * 1e-5
    return Parameter(name, value * 1e-5, "1", low, high, source=_SOURCE, description=description)


_SERIES = (
    _coefficient("X_u", -184, 150, "drag less thrust, by surge"),
    _coefficient("X_uu", -110, 300, "by surge squared"),
    _coefficient("X_uuu", -215, 600, "by surge cubed"),
    _coefficient("X_vv", -899, 1500, "by sway squared"),
    _coefficient("X_rr", 18, 150, "by yaw squared"),
    _coefficient("X_rv", 798, 800, "by yaw times sway"),
    _coefficient("X_dd", -95, 94, "by rudder squared"),
    _coefficient("X_udd", -190, 300, "by surge times rudder squared"),
    _coefficient("X_vd", 93, 150, "by sway times rudder"),
    _coefficient("X_uvd", 93, 300, "by surge times sway times rudder"),
    _coefficient("Y_v", -1160, 1000, "sway force by sway"),
    _coefficient("Y_r", -499, 600, "by yaw, m u r included"),
    _coefficient("Y_vvv", -8078, 12000, "by sway cubed"),
    _coefficient("Y_vvr", 15356, 24000, "by sway squared times yaw"),
    _coefficient("Y_vu", -1160, 1500, "by sway times surge"),
    _coefficient("Y_ru", -499, 900, "by yaw times surge"),
    _coefficient("Y_d", 278, 250, "by rudder"),
    _coefficient("Y_ddd", -90, 300, "by rudder cubed"),
    _coefficient("Y_ud", 556, 800, "by surge times rudder"),
    _coefficient("Y_uud", 278, 800, "by surge squared times rudder"),
    _coefficient("Y_vdd", -4, 300, "by sway times rudder squared"),
    _coefficient("Y_vvd", 1190, 3000, "by sway squared times rudder"),
    _coefficient("Y_0", -4, 30, "at zero rudder, from the single screw"),
    _coefficient("Y_0u", -8, 60, "its change by surge"),
    _coefficient("Y_0uu", -4, 60, "its change by surge squared"),
    _coefficient("N_v", -264, 300, "yaw moment by sway"),
    _coefficient("N_r", -166, 160, "by yaw, m x_G u r included"),
    _coefficient("N_vvv", 1636, 3000, "by sway cubed"),
    _coefficient("N_vvr", -5483, 9000, "by sway squared times yaw"),
    _coefficient("N_vu", -264, 500, "by sway times surge"),
    _coefficient("N_ru", -166, 300, "by yaw times surge"),
    _coefficient("N_d", -139, 120, "by rudder"),
    _coefficient("N_ddd", 45, 150, "by rudder cubed"),
    _coefficient("N_ud", -278, 400, "by surge times rudder"),
    _coefficient("N_uud", -139, 400, "by surge squared times rudder"),
    _coefficient("N_vdd", 13, 150, "by sway times rudder squared"),
    _coefficient("N_vvd", -489, 1500, "by sway squared times rudder"),
    _coefficient("N_0", 3, 20, "at zero rudder, from the single screw"),
    _coefficient("N_0u", 6, 40, "its change by surge"),
    _coefficient("N_0uu", 3, 40, "its change by surge squared"),
)


class AbkowitzShip(Model):
    """Ship under a third-order Abkowitz series about its service speed."""

    name = "abkowitz"
    title = "Ship, Abkowitz series about the service speed (3 degrees of freedom)"
    kind = "ship"
    source = _SOURCE
    states = (SURGE, SWAY, YAW_RATE, NORTH, EAST, HEADING)
    inputs = (RUDDER,)
    outputs = (NORTH, EAST, HEADING, SURGE, SWAY, YAW_RATE)
    parameters = (
        Parameter("rho", 1025.0, "kg/m3", 990.0, 1035.0, source="[L] sea water; only effects' forces need it"),
        Parameter("L", 160.93, "m", 129.0, 193.0, source=_SOURCE, description="length between perpendiculars"),
        Parameter("U_0", 7.7175, "m/s", 4.0, 12.0, source=_SOURCE, description="service speed"),
        Parameter("x_G", -0.023, "1", -0.06, 0.06, source=_SOURCE, description="centre of gravity over L"),
        _coefficient("m", 798, 200, "mass"),
        _coefficient("I_z", 39.2, 15, "moment of inertia in yaw"),
        _coefficient("X_du", -42, 40, "added mass in surge, sign as a force"),
        _coefficient("Y_dv", -748, 400, "added mass in sway, sign as a force"),
        _coefficient("Y_dr", -9.354, 60, "sway force by yaw acceleration"),
        _coefficient("N_dv", 4.646, 60, "yaw moment by sway acceleration"),
        _coefficient("N_dr", -43.8, 30, "added moment of inertia in yaw, sign as a moment"),
        *_SERIES,
    )

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        half = 0.5 * p.rho
        return Dimensions(p.L, _BREADTH * p.L, _DRAFT * p.L, half * p.L * p.L * p.L * p.m, p.rho)

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return 0.5 * p.rho * p.L * p.L * _RESISTANCE * -p.X_u * u * abs(u)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        d = -i.delta  # the coefficients count the rudder positive to port
        u_r, v_r = s.u - e.u_c, s.v - e.v_c
        U = max(math.sqrt(u_r * u_r + v_r * v_r + 1e-12), _SLOWEST * p.U_0)
        u, v, r = (u_r - p.U_0) / U, v_r / U, s.r * p.L / U
        uu, vv, rr, dd = u * u, v * v, r * r, d * d
        X = (
            u * (p.X_u + p.X_uu * u + p.X_uuu * uu)
            + p.X_vv * vv
            + p.X_rr * rr
            + p.X_rv * r * v
            + (p.X_dd + p.X_udd * u) * dd
            + (p.X_vd + p.X_uvd * u) * v * d
        )
        Y = (
            v * (p.Y_v + p.Y_vvv * vv + p.Y_vvr * v * r + p.Y_vu * u + p.Y_vdd * dd + p.Y_vvd * v * d)
            + r * (p.Y_r + p.Y_ru * u)
            + d * (p.Y_d + p.Y_ddd * dd + p.Y_ud * u + p.Y_uud * uu)
            + (p.Y_0 + p.Y_0u * u + p.Y_0uu * uu)
        )
        N = (
            v * (p.N_v + p.N_vvv * vv + p.N_vvr * v * r + p.N_vu * u + p.N_vdd * dd + p.N_vvd * v * d)
            + r * (p.N_r + p.N_ru * u)
            + d * (p.N_d + p.N_ddd * dd + p.N_ud * u + p.N_uud * uu)
            + (p.N_0 + p.N_0u * u + p.N_0uu * uu)
        )
        # Accelerations times mass: the series, the current (rigid body on the velocity over ground, added mass on
        # the velocity through the water), and what acts from outside.
        q = U * U / p.L
        mass = 0.5 * p.rho * p.L * p.L * p.L
        X = X * q - p.X_du * e.du_c + p.m * e.v_c * s.r + e.X / mass
        Y = Y * q - p.Y_dv * e.dv_c - p.m * e.u_c * s.r + e.Y / mass
        N = N * q - p.N_dv * e.dv_c - p.m * p.x_G * e.u_c * s.r + e.N / (mass * p.L)
        m22, m23 = p.m - p.Y_dv, p.m * p.x_G - p.Y_dr
        m32, m33 = p.m * p.x_G - p.N_dv, p.I_z - p.N_dr
        determinant = m22 * m33 - m23 * m32
        return (
            X / (p.m - p.X_du),
            (m33 * Y - m23 * N) / determinant,
            (m22 * N - m32 * Y) / (determinant * p.L),
            s.u * math.cos(s.psi) - s.v * math.sin(s.psi),
            s.u * math.sin(s.psi) + s.v * math.cos(s.psi),
            s.r,
        )
