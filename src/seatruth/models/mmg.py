"""MMG standard model of a single-screw, single-rudder ship in three degrees of freedom (Yasukawa and Yoshimura 2015).

Equations and the KVLCC2 values: [L] H. Yasukawa, Y. Yoshimura, "Introduction of MMG standard method for ship
maneuvering predictions", J. Mar. Sci. Technol. 20 (2015). Body axes at midship: x forward, y starboard, z down; the
sway velocity v is the one at midship. A positive rudder angle turns the ship to starboard: the rudder's normal force
F_N > 0 pushes the stern to port (Y_R < 0) and, acting aft (x_R < 0), the bow to starboard (N_R > 0).

Beyond the published form, and equal to it for ordinary manoeuvres:

* The advance ratio J = u_P / (n D_P) is never formed: n^2 K_T and u_P^2 (1 + 8 K_T / (pi J^2)) are polynomials in n
  and u_P, so that the model starts from rest and coasts with the propeller stopped.
* Running astern, thrust is antisymmetric, T(-n, -u_P) = -T(n, u_P), with ahead's coefficients; the slipstream and
  the rudder's inflow keep their sign, so that the rudder reverses its effect with the flow.
* Resistance, the sway force by yaw (Y_r) and the Munk moment (N_v) change sign with the surge velocity; they do so
  over the band |u| < 0.2 U, outside of which the published form holds exactly.
* The non-dimensional yaw rate r L / U that enters the series is held at +-2 (a turning radius of half a length);
  beyond, the hull forces grow with the square of the yaw rate, as cross-flow drag does, also at U = 0.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter
from seatruth.models.ship_parameters import KVLCC2, SHIPS
from seatruth.trials.channel import Channel

TINY_SPEED_2 = 1e-12
"""(m/s)^2, added under square roots: keeps derivatives finite at rest, changes nothing else."""
LARGEST_YAW = 2.0
"""Largest non-dimensional yaw rate that enters the hull's series."""
SIDEWAYS = 5.0
"""One over the u / U at which terms that reverse with the surge velocity reach their published value."""


def signed_root(x: Any) -> Any:
    """sign(x) sqrt(|x|), smooth at zero; exact to 1e-12 for |x| > 1e-3."""
    return x / math.sqrt(math.sqrt(x * x + 1e-16))


def hull(u: Any, v: Any, r: Any, p: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Hull force X, Y (N) and moment N (N m) about midship, drift angle beta (rad), non-dimensional yaw rate."""
    U2 = u * u + v * v + TINY_SPEED_2
    U = math.sqrt(U2)
    scale = max(U, abs(r) * p.L / LARGEST_YAW)
    v1 = v / scale
    r1 = r * p.L / scale
    ahead = max(-1.0, min(1.0, SIDEWAYS * u / U))
    vv, vr, rr = v1 * v1, v1 * r1, r1 * r1
    area = 0.5 * p.rho * p.L * p.d
    q = area * scale * scale
    X = q * (p.X_vv * vv + p.X_vr * vr + p.X_rr * rr + p.X_vvvv * vv * vv) - area * U2 * p.R_0 * ahead
    Y = q * (v1 * (p.Y_v + p.Y_vvv * vv + p.Y_vvr * vr + p.Y_vrr * rr) + r1 * (p.Y_r * ahead + p.Y_rrr * rr))
    N = q * p.L * (v1 * (p.N_v * ahead + p.N_vvv * vv + p.N_vvr * vr + p.N_vrr * rr) + r1 * (p.N_r + p.N_rrr * rr))
    beta = math.atan2(-v, math.sqrt(u * u + TINY_SPEED_2))
    return X, Y, N, beta, r1


def propeller(u: Any, n: Any, beta: Any, r1: Any, p: Any) -> tuple[Any, Any]:
    """Thrust over rho D_P^2 (m2/s2) and axial inflow u_P (m/s)."""
    beta_P = beta - p.x_P * r1
    C_2 = p.C_2_plus if beta_P > 0.0 else p.C_2_minus
    wake = 1.0 + (1.0 - math.exp(-p.C_1 * abs(beta_P))) * (C_2 - 1.0)
    u_P = u * (1.0 - p.w_P0) * wake
    nD = n * p.D_P
    thrust = p.k_0 * nD * abs(nD) + p.k_1 * abs(nD) * u_P + p.k_2 * u_P * abs(u_P)
    return thrust, u_P


def rudder(u: Any, v: Any, delta: Any, thrust: Any, u_P: Any, beta: Any, r1: Any, p: Any) -> Any:
    """Normal force of the rudder, N; positive pushes the stern to port."""
    scale = math.sqrt(u * u + v * v + TINY_SPEED_2)
    slipstream = signed_root(u_P * abs(u_P) + 8.0 / math.pi * thrust)
    inside = u_P + p.kappa * (slipstream - u_P)
    eta = p.D_P / p.H_R
    u_R = p.epsilon * signed_root(eta * inside * abs(inside) + (1.0 - eta) * u_P * abs(u_P))
    beta_R = beta - p.l_R * r1
    v_R = scale * (p.gamma_R_plus if beta_R > 0.0 else p.gamma_R_minus) * beta_R
    U_R = math.sqrt(u_R * u_R + v_R * v_R + TINY_SPEED_2)
    # U_R^2 sin(delta - atan2(v_R, u_R)), without the angle
    return 0.5 * p.rho * p.A_R * p.f_alpha * U_R * (u_R * math.sin(delta) - v_R * math.cos(delta))


def motion(s: Any, delta: Any, n: Any, p: Any, e: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    """d/dt of u, v, r, x, y, psi under the rudder angle delta and the propeller's revolutions n."""
    u, v = s.u - e.u_c, s.v - e.v_c
    X_H, Y_H, N_H, beta, r1 = hull(u, v, s.r, p)
    thrust, u_P = propeller(u, n, beta, r1, p)
    F_N = rudder(u, v, delta, thrust, u_P, beta, r1, p)
    F_across = F_N * math.cos(delta)
    X = X_H + (1.0 - p.t_P) * p.rho * p.D_P * p.D_P * thrust - (1.0 - p.t_R) * F_N * math.sin(delta)
    Y = Y_H - (1.0 + p.a_H) * F_across
    N = N_H - (p.x_R + p.a_H * p.x_H) * p.L * F_across

    # Rigid body on the velocity over ground, added mass on the velocity through the water.
    m = p.rho * p.nabla
    added = 0.5 * p.rho * p.L * p.L * p.d
    m_x, m_y, J_z = added * p.m_x, added * p.m_y, added * p.L * p.L * p.J_z
    mx_G = m * p.x_G
    I_z = m * (p.k_zz * p.L) * (p.k_zz * p.L) + p.x_G * mx_G + J_z
    X = X + m * s.v * s.r + m_y * v * s.r + mx_G * s.r * s.r + m_x * e.du_c + e.X
    Y = Y - m * s.u * s.r - m_x * u * s.r + m_y * e.dv_c + e.Y
    N = N - mx_G * s.u * s.r + e.N
    determinant = (m + m_y) * I_z - mx_G * mx_G
    return (
        X / (m + m_x),
        (I_z * Y - mx_G * N) / determinant,
        ((m + m_y) * N - mx_G * Y) / determinant,
        s.u * math.cos(s.psi) - s.v * math.sin(s.psi),
        s.u * math.sin(s.psi) + s.v * math.cos(s.psi),
        s.r,
    )


SURGE = Channel("u", "m/s", "forward velocity over ground at midship")
SWAY = Channel("v", "m/s", "starboard velocity over ground at midship")
YAW_RATE = Channel("r", "rad/s", "yaw rate, positive nose to starboard")
NORTH = Channel("x", "m", "midship position, along psi = 0")
EAST = Channel("y", "m", "midship position, to starboard of x")
HEADING = Channel("psi", "rad", "heading, clockwise", angle=True)
RUDDER = Channel("delta", "rad", "rudder angle, positive turns to starboard")
REVOLUTIONS = Channel("n", "rev/s", "propeller revolutions, negative astern")


class MMGShip(Model):
    """Ship under the MMG standard method; its inputs are the angle of the rudder and the revolutions as they act.

    `ship` names one of the parameter sets in `sets`.
    """

    name = "mmg"
    title = "Ship, MMG standard method (3 degrees of freedom)"
    kind = "ship"
    source = "[L] Yasukawa and Yoshimura 2015"
    states: tuple[Channel, ...] = (SURGE, SWAY, YAW_RATE, NORTH, EAST, HEADING)
    inputs: tuple[Channel, ...] = (RUDDER, REVOLUTIONS)
    outputs: tuple[Channel, ...] = (NORTH, EAST, HEADING, SURGE, SWAY, YAW_RATE)
    parameters: tuple[Parameter, ...] = KVLCC2
    sets: ClassVar[tuple[str, ...]] = tuple(SHIPS)

    def __init__(self, ship: str = "KVLCC2") -> None:
        if ship not in SHIPS:
            raise BadInput(f"model {self.name!r} has no parameter set {ship!r}", do=nearest(ship, SHIPS))
        own = {parameter.name: parameter for parameter in SHIPS[ship]}
        self.ship = ship
        self.parameters = tuple(own.get(parameter.name, parameter) for parameter in type(self).parameters)
        super().__init__()

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return motion(s, i.delta, i.n, p, e)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, p.B, p.d, p.rho * p.nabla, p.rho)

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        u, v = s.u - e.u_c, s.v - e.v_c
        _, _, _, beta, r1 = hull(u, v, s.r, p)
        return (1.0 - p.t_P) * p.rho * p.D_P * p.D_P * propeller(u, i.n, beta, r1, p)[0]

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return 0.5 * p.rho * p.L * p.d * p.R_0 * u * abs(u)
