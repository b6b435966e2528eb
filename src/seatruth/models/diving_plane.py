"""Diving plane of an underwater vehicle: surge, heave and pitch under its stern planes.

Equations: models of the Gertler-Hagen family as used by Xu, Zou et al. 2012 for identification; the printed equations
are lost, the form here is a reconstruction [R]. Values: NPS AUV II, [L] Healey and Lienard 1993; those marked [S] are
chosen here (the cross-flow integrals are replaced by quadratic terms). Origin at the centre of gravity, weight equals
buoyancy, the centre of buoyancy above (z_B < 0). Body axes x forward, z down; q > 0 nose up; a positive stern plane
pitches the nose down (running astern, up: its force goes with u |u|, which is the published u^2 ahead).
"""

from __future__ import annotations

import math
from typing import Any

from seatruth.models.actuators import Rudder, Thruster
from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel

_NPS = "[L] Healey and Lienard 1993, NPS AUV II"
_XU = "[P] Xu, Zou et al. 2012"
_CHOSEN = "[S] chosen here"
_SLENDER = 0.15
"""Breadth and height over length; the vehicle's hull is 0.7 m by 0.4 m at 5.3 m [L]. Only effects' forces need it."""

_STERN, _FULL = -2.6, 600.0
"""m and N: place of the propeller, half a length abaft [L], and the bound of the thrust, five times that of the paper
[S]. Only effects on the thruster need them."""


def _coefficient(name: str, value: float, low: float, high: float, source: str, description: str) -> Parameter:
    return Parameter(name, value, "1", low, high, source=source, description=description)


class DivingPlane(Model):
    """Surge, heave and pitch of an underwater vehicle at constant thrust."""

    name = "diving_plane"
    title = "Underwater vehicle in the diving plane (surge, heave, pitch)"
    kind = "auv"
    source = "[R] Gertler-Hagen family after Xu, Zou et al. 2012"
    states = (
        Channel("u", "m/s", "forward velocity over ground"),
        Channel("w", "m/s", "downward velocity over ground, body axes"),
        Channel("q", "rad/s", "pitch rate, positive nose up"),
        Channel("theta", "rad", "pitch angle, positive nose up", angle=True),
        Channel("x", "m", "distance made good"),
        Channel("z", "m", "depth"),
    )
    inputs: tuple[Channel, ...] = (Channel("delta_s", "rad", "stern plane angle, positive pitches the nose down"),)
    outputs = (states[0], states[1], states[2], states[3], states[5], states[4])
    parameters: tuple[Parameter, ...] = (
        Parameter("rho", 1025.0, "kg/m3", 990.0, 1035.0, source=_NPS, description="water density"),
        Parameter("L", 5.3, "m", 4.2, 6.4, source=_NPS, description="length"),
        Parameter("m", 5443.4, "kg", 4300.0, 6600.0, source=_NPS, description="mass"),
        Parameter("I_y", 13587.0, "kg m2", 9000.0, 20000.0, source=_NPS, description="pitch moment of inertia"),
        Parameter("z_B", -0.061, "m", -0.2, 0.0, source=_NPS, description="centre of buoyancy below that of gravity"),
        Parameter("B", 53400.0, "N", 42000.0, 64000.0, source=_NPS, description="buoyancy, equal to the weight"),
        Parameter("X_T", 120.0, "N", 0.0, 600.0, source=_XU, description="thrust"),
        _coefficient("X_du", -7.6e-3, -0.05, 0.0, _NPS, "added mass in surge, sign as a force"),
        _coefficient("Z_dw", -240e-3, -0.6, -0.05, _NPS, "added mass in heave, sign as a force"),
        _coefficient("Z_dq", -6.8e-3, -0.05, 0.05, _NPS, "heave force by pitch acceleration"),
        _coefficient("M_dw", -6.8e-3, -0.05, 0.05, _NPS, "pitch moment by heave acceleration"),
        _coefficient("M_dq", -17e-3, -0.05, -0.002, _NPS, "added moment of inertia in pitch, sign as a moment"),
        _coefficient("X_uu", -3.85e-3, -0.02, -0.0005, _NPS, "drag (the public propulsion constant)"),
        _coefficient("X_wq", -200e-3, -0.6, 0.2, _NPS, "surge force by heave times pitch rate"),
        _coefficient("X_qq", -15e-3, -0.1, 0.1, _NPS, "surge force by pitch rate squared"),
        _coefficient("X_ww", 0.0, -1.0, 1.0, _CHOSEN, "surge force by heave squared (not in the published set)"),
        _coefficient("Z_0", -1e-3, -0.01, 0.01, _CHOSEN, "heave force at zero incidence"),
        _coefficient("Z_w", -300e-3, -0.9, -0.03, _NPS, "heave damping"),
        _coefficient("Z_aw", -30e-3, -0.3, 0.3, _CHOSEN, "heave force by u |w|"),
        _coefficient("Z_waw", -600e-3, -6.0, 3.0, _CHOSEN, "quadratic heave damping"),
        _coefficient("Z_q", -140e-3, -0.5, 0.1, _NPS, "heave force by pitch rate"),
        _coefficient("Z_qaq", -50e-3, -1.0, 1.0, _CHOSEN, "heave force by q |q|"),
        _coefficient("Z_ds", -73e-3, -0.2, -0.01, _NPS, "heave force by the stern plane"),
        _coefficient("M_w", 100e-3, -0.05, 0.3, _NPS, "pitch moment by heave (Munk moment)"),
        _coefficient("M_aw", -10e-3, -0.1, 0.1, _CHOSEN, "pitch moment by u |w|"),
        _coefficient("M_waw", 50e-3, -2.0, 2.0, _CHOSEN, "pitch moment by w |w|"),
        _coefficient("M_q", -68e-3, -0.2, -0.01, _NPS, "pitch damping"),
        _coefficient("M_qaq", -20e-3, -0.5, 0.5, _CHOSEN, "quadratic pitch damping"),
        _coefficient("M_ds", -41e-3, -0.1, -0.005, _NPS, "pitch moment by the stern plane"),
    )

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, _SLENDER * p.L, _SLENDER * p.L, p.m, p.rho)

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return p.X_T

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return -0.5 * p.rho * p.L * p.L * p.X_uu * u * abs(u)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u, w, q = s.u - e.u_c, s.w - e.w_c, s.q
        r2 = 0.5 * p.rho * p.L * p.L
        r3, r4, r5 = r2 * p.L, r2 * p.L * p.L, r2 * p.L * p.L * p.L
        plane = u * abs(u) * i.delta_s
        X = r2 * (p.X_uu * u * abs(u) + p.X_ww * w * w) + r3 * p.X_wq * w * q + r4 * p.X_qq * q * q + p.X_T
        Z = (
            r2 * (p.Z_0 * u * u + p.Z_w * u * w + p.Z_aw * u * abs(w) + p.Z_waw * w * abs(w) + p.Z_ds * plane)
            + r3 * p.Z_q * u * q
            + r4 * p.Z_qaq * q * abs(q)
        )
        M = (
            r3 * (p.M_w * u * w + p.M_aw * u * abs(w) + p.M_waw * w * abs(w) + p.M_ds * plane)
            + r4 * p.M_q * u * q
            + r5 * p.M_qaq * q * abs(q)
            + p.z_B * p.B * math.sin(s.theta)
        )
        # Rigid body on the velocity over ground, added mass on the velocity through the water.
        X = X - p.m * s.w * q - r3 * p.X_du * e.du_c + e.X
        Z = Z + p.m * s.u * q - r3 * p.Z_dw * e.dw_c + e.Z
        M = M - r4 * p.M_dw * e.dw_c + e.M
        a, b = p.m - r3 * p.Z_dw, -r4 * p.Z_dq
        c, d = -r4 * p.M_dw, p.I_y - r5 * p.M_dq
        determinant = a * d - b * c
        return (
            X / (p.m - r3 * p.X_du),
            (d * Z - b * M) / determinant,
            (a * M - c * Z) / determinant,
            q,
            s.u * math.cos(s.theta) + s.w * math.sin(s.theta),
            s.w * math.cos(s.theta) - s.u * math.sin(s.theta),
        )


class DivingPlaneDriven(DivingPlane):
    """The same with the thrust as an input; the parameter X_T is a constant thrust beside it, zero unless stated."""

    name = "diving_plane_driven"
    title = "Underwater vehicle in the diving plane, its thrust an input"
    inputs = (*DivingPlane.inputs, Channel("T", "N", "thrust of the propeller, forwards"))
    parameters = tuple(
        q.replace(value=0.0, min=-_FULL, source=_CHOSEN) if q.name == "X_T" else q for q in DivingPlane.parameters
    )
    actuators = (
        Rudder("stern_plane", input="delta_s", turns="pitch"),
        Thruster("propeller", input="T", at=(_STERN, 0.0, 0.0), towards=(1.0, 0.0, 0.0), full=_FULL),
    )

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return p.X_T + i.T

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return (i.T,)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return DivingPlane.rhs(s, i, p, e._replace(X=e.X + i.T))
