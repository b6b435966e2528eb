"""Torpedo-like underwater vehicle in six degrees of freedom (Zhao, Xie and Qiao 2018).

The paper names the small-angle model of a body of revolution of Yan 2005, 12 differential and 3 algebraic equations,
45 parameters; its equations are lost and reconstructed here [R], with 41. They hold for running ahead at small
incidence (beyond some 15 deg of sideslip the linear coefficients promise too much); running astern they stay finite.

Two conventions meet in this file and in no other place. The equations stand in the torpedo convention of the paper:
x forward, y up, z to starboard; w_y positive nose to port. States, inputs and outputs are in seatruth's axes, so that
logs, checks, lever arms and effects need to know nothing of it:

    v_x = u     w_x = p     x_0 = x     phi   = phi
    v_y = -w    w_y = -r    y_0 = -z    theta = theta
    v_z = v     w_z = q     z_0 = y     psi_torpedo = -psi

The origin is the centre of buoyancy. Coefficients hold the ideal-fluid moments (Munk) already: Coriolis terms carry the
mass alone.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, NamedTuple

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.rigid_body import solved
from seatruth.models.torpedo_parameters import SOURCES, parameters
from seatruth.trials.channel import Channel

U = Channel("u", "m/s", "forward velocity over ground")
V = Channel("v", "m/s", "velocity over ground to starboard")
W = Channel("w", "m/s", "velocity over ground down, body axes")
P = Channel("p", "rad/s", "roll rate, positive starboard down")
Q = Channel("q", "rad/s", "pitch rate, positive nose up")
R = Channel("r", "rad/s", "yaw rate, positive nose to starboard")
X = Channel("x", "m", "position along psi = 0")
Y = Channel("y", "m", "position to starboard of x")
Z = Channel("z", "m", "depth")
PHI = Channel("phi", "rad", "roll, positive starboard down", angle=True)
THETA = Channel("theta", "rad", "pitch, positive nose up", angle=True)
PSI = Channel("psi", "rad", "heading, clockwise", angle=True)
RUDDER = Channel("delta", "rad", "rudder angle, positive turns to starboard")
PLANE = Channel("delta_s", "rad", "stern plane angle, positive pitches the nose down")
DIFFERENTIAL = Channel("delta_d", "rad", "differential fin angle, positive rolls to starboard")
REVOLUTIONS = Channel("n", "rev/s", "propeller revolutions")

_SMALL = 1e-12
"""m2/s2: keeps the derivative of the speed finite at rest."""


class Flow(NamedTuple):
    """What the water's forces come from: incidences, and what turns coefficients into forces."""

    alpha: Any
    beta: Any
    pressure: Any
    """q_v."""
    damping: Any
    """q_v times the dimensionless rate over the rate."""


def flow(v_x: Any, v_y: Any, v_z: Any, p: Any) -> Flow:
    """From velocities through the water."""
    square = v_x * v_x + v_y * v_y + v_z * v_z
    half = 0.125 * math.pi * p.rho * p.D * p.D  # half the density times the cross-section
    return Flow(
        alpha=math.atan2(-v_y, abs(v_x) + _SMALL),
        beta=math.atan2(v_z, math.sqrt(v_x * v_x + v_y * v_y + _SMALL)),
        pressure=half * square,
        damping=half * math.sqrt(square + _SMALL) * p.L,
    )


def drag(water: Flow, v_x: Any, p: Any) -> Any:
    """q_v C_x0, against the motion."""
    return p.C_x0 * (water.pressure if v_x >= 0.0 else -water.pressure)


def lift(water: Flow, w_z: Any, delta_e: Any, p: Any) -> Any:
    """Force along y."""
    return water.pressure * (p.C_y_alpha * water.alpha + p.C_y_de * delta_e) + water.damping * p.C_y_wz * w_z


def side(water: Flow, w_y: Any, delta_r: Any, p: Any) -> Any:
    """Force along z."""
    return water.pressure * (p.C_z_beta * water.beta + p.C_z_dr * delta_r) + water.damping * p.C_z_wy * w_y


def rolling(water: Flow, w_x: Any, w_y: Any, delta_r: Any, delta_d: Any, p: Any) -> Any:
    """Moment about x."""
    still = p.m_x_beta * water.beta + p.m_x_dr * delta_r + p.m_x_dd * delta_d
    return p.L * (water.pressure * still + water.damping * (p.m_x_wx * w_x + p.m_x_wy * w_y))


def yawing(water: Flow, w_y: Any, delta_r: Any, p: Any) -> Any:
    """Moment about y."""
    still = p.m_y_beta * water.beta + p.m_y_dr * delta_r
    return p.L * (water.pressure * still + water.damping * p.m_y_wy * w_y)


def pitching(water: Flow, w_z: Any, delta_e: Any, p: Any) -> Any:
    """Moment about z."""
    still = p.m_z_alpha * water.alpha + p.m_z_de * delta_e
    return p.L * (water.pressure * still + water.damping * p.m_z_wz * w_z)


def thrust(n: Any, p: Any) -> Any:
    """Thrust of the propeller; its linear and quadratic terms are the paper's, their form is reconstructed."""
    return p.k_1 * n + p.k_2 * n * abs(n)


def motion(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
    """d/dt of the twelve states."""
    # Into the torpedo convention; the current and outside forces too.
    v_x, v_y, v_z, w_x, w_y, w_z = s.u, -s.w, s.v, s.p, -s.r, s.q
    c_x, c_y, c_z = e.du_c, -e.dw_c, e.dv_c
    sin_f, cos_f, sin_t, cos_t = math.sin(s.phi), math.cos(s.phi), math.sin(s.theta), math.cos(s.theta)
    m, x_G, y_G, z_G, G = p.m, p.x_G, p.y_G, p.z_G, p.m * p.g
    through = v_x - e.u_c
    water = flow(through, v_y + e.w_c, v_z - e.v_c, p)

    # Forces, less the rigid body's velocity terms (over ground), plus what the moving water gives through added mass.
    F_x = thrust(i.n, p) - drag(water, through, p) - p.dG * sin_t + e.X + p.lambda_11 * c_x
    F_x -= m * (v_z * w_y - v_y * w_z + y_G * w_x * w_y + z_G * w_x * w_z - x_G * (w_y * w_y + w_z * w_z))
    F_y = lift(water, w_z, i.delta_s, p) - p.dG * cos_t * cos_f - e.Z + p.lambda_22 * c_y
    F_y -= m * (v_x * w_z - v_z * w_x + x_G * w_x * w_y + z_G * w_y * w_z - y_G * (w_x * w_x + w_z * w_z))
    F_z = side(water, w_y, i.delta, p) + p.dG * cos_t * sin_f + e.Y + p.lambda_33 * c_z
    F_z -= m * (v_y * w_x - v_x * w_y + x_G * w_x * w_z + y_G * w_y * w_z - z_G * (w_x * w_x + w_y * w_y))
    M_x = rolling(water, w_x, w_y, i.delta, i.delta_d, p) + p.k_Q * i.n * abs(i.n) + e.K
    M_x += G * cos_t * (y_G * sin_f + z_G * cos_f) - (p.J_z - p.J_y) * w_y * w_z
    M_x -= m * (y_G * (v_y * w_x - v_x * w_y) + z_G * (v_z * w_x - v_x * w_z))
    M_y = yawing(water, w_y, i.delta, p) - G * (x_G * cos_t * sin_f + z_G * sin_t) - e.N + p.lambda_35 * c_z
    M_y -= m * (z_G * (v_z * w_y - v_y * w_z) + x_G * (v_x * w_y - v_y * w_x)) + (p.J_x - p.J_z) * w_x * w_z
    M_z = pitching(water, w_z, i.delta_s, p) + G * (y_G * sin_t - x_G * cos_t * cos_f) + e.M + p.lambda_26 * c_y
    M_z -= m * (x_G * (v_x * w_z - v_z * w_x) + y_G * (v_y * w_z - v_z * w_y)) + (p.J_y - p.J_x) * w_x * w_y

    a, b = m * x_G + p.lambda_26, p.lambda_35 - m * x_G
    inertia = (
        (m + p.lambda_11, 0.0, 0.0, 0.0, m * z_G, -m * y_G),
        (0.0, m + p.lambda_22, 0.0, -m * z_G, 0.0, a),
        (0.0, 0.0, m + p.lambda_33, m * y_G, b, 0.0),
        (0.0, -m * z_G, m * y_G, p.J_x + p.lambda_44, 0.0, 0.0),
        (m * z_G, 0.0, b, 0.0, p.J_y + p.lambda_55, 0.0),
        (-m * y_G, a, 0.0, 0.0, 0.0, p.J_z + p.lambda_66),
    )
    dv_x, dv_y, dv_z, dw_x, dw_y, dw_z = solved(inertia, (F_x, F_y, F_z, M_x, M_y, M_z))

    # Kinematics with the torpedo's heading, and back to seatruth's axes.
    sin_p, cos_p = -math.sin(s.psi), math.cos(s.psi)
    turn = w_y * cos_f - w_z * sin_f
    dx = v_x * cos_t * cos_p + v_y * (sin_p * sin_f - sin_t * cos_p * cos_f)
    dx += v_z * (sin_p * cos_f + sin_t * cos_p * sin_f)
    dy = v_x * sin_t + v_y * cos_t * cos_f - v_z * cos_t * sin_f
    dz = -v_x * cos_t * sin_p + v_y * (cos_p * sin_f + sin_t * sin_p * cos_f)
    dz += v_z * (cos_p * cos_f - sin_t * sin_p * sin_f)
    return (
        *(dv_x, dv_z, -dv_y, dw_x, dw_z, -dw_y),
        *(dx, dz, -dy),
        *(w_x - turn * sin_t / cos_t, w_y * sin_f + w_z * cos_f, -turn / cos_t),
    )


class OneOfTheSets(Model):
    """A model whose values are those of one of the sets."""

    sets: ClassVar[tuple[str, ...]] = tuple(SOURCES)

    def __init__(self, vehicle: str = "T1") -> None:
        if vehicle not in SOURCES:
            raise BadInput(f"model {self.name!r} has no parameter set {vehicle!r}", do=nearest(vehicle, SOURCES))
        self.vehicle = vehicle
        self.parameters = parameters(vehicle, tuple(q.name for q in type(self).parameters))
        super().__init__()


class Torpedo(OneOfTheSets):
    """The coupled model; `vehicle` names one of the `sets` of values."""

    name = "torpedo"
    title = "Torpedo-like underwater vehicle (6 degrees of freedom), REMUS-100 class"
    kind = "auv"
    source = "[R] Yan 2005 as named by Zhao, Xie and Qiao 2018"
    states = (U, V, W, P, Q, R, X, Y, Z, PHI, THETA, PSI)
    inputs = (RUDDER, PLANE, DIFFERENTIAL, REVOLUTIONS)
    outputs = states
    parameters = parameters("T1")

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return motion(s, i, p, e)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, p.D, p.D, p.m, p.rho)

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return thrust(i.n, p)

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return 0.125 * math.pi * p.rho * p.D * p.D * p.C_x0 * u * abs(u)


class Torpedo324(Torpedo):
    """The same with the values of the heavier body."""

    name = "torpedo_324"
    title = "Torpedo-like underwater vehicle (6 degrees of freedom), 324 mm body"
    parameters = parameters("T2")

    def __init__(self, vehicle: str = "T2") -> None:
        super().__init__(vehicle)
