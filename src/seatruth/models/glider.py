"""Buoyancy-driven underwater glider with a sliding mass, a buoyancy tank and a tail rudder, in six degrees of freedom.

Equations: multibody model as Sun, Wang and Sang 2019 describe it; the printed equations are lost, the form here is a
reconstruction [R] from the momentum theorems with the hydrodynamic forces of the underwater-glider literature. Values:
`seatruth.models.glider_parameters`. Body axes at the centre of buoyancy: x forward, y to starboard in the wing plane,
z to the belly; earth z down, psi clockwise; alpha = atan(w/u), beta = asin(v/V) of the velocity through the water.

* Three bodies: hull (m_h at x_h, 0, z_h), sliding mass (m_p at the input x_p, 0, z_p) and net buoyancy (the input m_b
  at x_b on the axis; negative lightens). Shifts of x_p and m_b are slow: their own momentum is left out [R].
* The added mass acts on the velocity through the water and carries the Munk moment, which the coefficients exclude.
* Forces go with V^2, rate damping too (K_p p V^2, the published convention).
* A positive rudder angle turns to starboard, as everywhere here; the published rudder counts the other way.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.glider_parameters import GLIDERS, PETREL_II
from seatruth.models.parameter import Parameter
from seatruth.models.rigid_body import Vector, cross, kinematics, plus
from seatruth.trials.channel import Channel

TINY_2 = 1e-12
"""(m/s)^2, added to squared speeds in denominators: keeps derivatives finite at rest, changes nothing else."""

LENGTH, DIAMETER, WATER = 2.0, 0.22, 1025.0
"""m, m, kg/m3 [L]: a glider of this class in sea water; only effects' forces need them."""


def solve(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, y: Vector) -> Vector:
    """x of [[a, b, c], [b, d, e], [c, e, f]] x = y, by the adjoint."""
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    D, E, F = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * A + b * B + c * C
    return (
        (A * y[0] + B * y[1] + C * y[2]) / determinant,
        (B * y[0] + D * y[1] + E * y[2]) / determinant,
        (C * y[0] + E * y[1] + F * y[2]) / determinant,
    )


def water_forces(v: Vector, rate: Vector, delta: Any, p: Any) -> tuple[Vector, Vector]:
    """Hydrodynamic force, N, and moment, N m, in body axes from the velocity through the water (m/s) and rates."""
    u, side, w = v
    plane2 = u * u + w * w + TINY_2
    V2 = plane2 + side * side
    plane, V = math.sqrt(plane2), math.sqrt(V2)
    # atan(w / u), which passes smoothly through u = 0 when the glider turns over
    alpha = math.atan(w * u / (u * u + TINY_2))
    beta = math.atan2(side, plane)
    ca, sa, cb, sb = u / plane, w / plane, plane / V, side / V

    def to_body(x: Any, y: Any, z: Any) -> Vector:
        return (ca * cb * x - ca * sb * y - sa * z, sb * x + cb * y, sa * cb * x - sa * sb * y + ca * z)

    force = to_body(-(p.K_D0 + p.K_D * alpha * alpha), p.K_beta * beta, -(p.K_L0 + p.K_alpha * alpha))
    moment = to_body(
        p.K_MR * beta + p.K_p * rate[0],
        p.K_M0 + p.K_M * alpha + p.K_q * rate[1],
        p.K_MY * beta + p.K_r * rate[2],
    )
    rudder = -p.Y_delta * delta
    return (
        (V2 * force[0], V2 * (force[1] + rudder), V2 * force[2]),
        (V2 * moment[0], V2 * moment[1], V2 * (moment[2] + p.x_delta * rudder)),
    )


def motion(s: Any, i: Any, p: Any, e: Any) -> tuple[Vector, Vector]:
    """d/dt of (u, v, w) over ground and of (p, q, r)."""
    v, rate = (s.u, s.v, s.w), (s.p, s.q, s.r)
    through = (s.u - e.u_c, s.v - e.v_c, s.w - e.w_c)
    m = p.m_h + p.m_p + i.m_b
    sx = p.m_h * p.x_h + p.m_p * i.x_p + i.m_b * p.x_b
    sz = p.m_h * p.z_h + p.m_p * p.z_p
    hull, slide = p.x_h * p.x_h + p.z_h * p.z_h, i.x_p * i.x_p + p.z_p * p.z_p
    tank = i.m_b * p.x_b * p.x_b
    I_x = p.I_x + p.I_px + p.m_h * p.z_h * p.z_h + p.m_p * p.z_p * p.z_p
    I_y = p.I_y + p.I_py + p.m_h * hull + p.m_p * slide + tank
    I_z = p.I_z + p.I_pz + p.m_h * p.x_h * p.x_h + p.m_p * i.x_p * i.x_p + tank
    I_xz = -(p.m_h * p.x_h * p.z_h + p.m_p * i.x_p * p.z_p)

    # Momenta about the origin: of the bodies over ground, of the water that moves along through the water.
    sigma = (sx, 0.0, sz)
    turning = cross(rate, sigma)
    P_body = (m * v[0] + turning[0], m * v[1] + turning[1], m * v[2] + turning[2])
    L_body = plus(
        cross(sigma, v),
        (I_x * rate[0] + I_xz * rate[2], I_y * rate[1], I_xz * rate[0] + I_z * rate[2]),
    )
    P_water = (
        p.A_11 * through[0],
        p.A_22 * through[1] + p.A_26 * rate[2],
        p.A_33 * through[2] + p.A_35 * rate[1],
    )
    L_water = (
        p.A_44 * rate[0],
        p.A_35 * through[2] + p.A_55 * rate[1],
        p.A_26 * through[1] + p.A_66 * rate[2],
    )
    F, M = water_forces(through, rate, i.delta, p)
    down = (
        -math.sin(s.theta),
        math.cos(s.theta) * math.sin(s.phi),
        math.cos(s.theta) * math.cos(s.phi),
    )
    heavy = (m - p.m_disp) * p.g
    F = plus(
        F,
        cross(plus(P_body, P_water), rate),
        (heavy * down[0], heavy * down[1], heavy * down[2]),
        (p.A_11 * e.du_c, p.A_22 * e.dv_c, p.A_33 * e.dw_c),
        (e.X, e.Y, e.Z),
    )
    M = plus(
        M,
        cross(plus(L_body, L_water), rate),
        cross(P_body, v),
        cross(P_water, through),
        cross((sx * p.g, 0.0, sz * p.g), down),
        (0.0, p.A_35 * e.dw_c, p.A_26 * e.dv_c),
        (e.K, e.M, e.N),
    )
    # The plane of symmetry parts the inertia matrix in two.
    u_dot, w_dot, q_dot = solve(m + p.A_11, 0.0, sz, m + p.A_33, p.A_35 - sx, I_y + p.A_55, (F[0], F[2], M[1]))
    v_dot, p_dot, r_dot = solve(m + p.A_22, -sz, sx + p.A_26, I_x + p.A_44, I_xz, I_z + p.A_66, (F[1], M[0], M[2]))
    return (u_dot, v_dot, w_dot), (p_dot, q_dot, r_dot)


_POSITION = (
    Channel("x", "m", "position, north"),
    Channel("y", "m", "position, east"),
    Channel("z", "m", "depth"),
    Channel("phi", "rad", "roll, positive starboard down", angle=True),
    Channel("theta", "rad", "pitch, positive nose up", angle=True),
    Channel("psi", "rad", "heading, clockwise", angle=True),
)
_VELOCITY = (
    Channel("u", "m/s", "velocity over ground, forward"),
    Channel("v", "m/s", "velocity over ground, to starboard"),
    Channel("w", "m/s", "velocity over ground, to the belly"),
    Channel("p", "rad/s", "roll rate"),
    Channel("q", "rad/s", "pitch rate, positive nose up"),
    Channel("r", "rad/s", "yaw rate, positive nose to starboard"),
)


class Glider(Model):
    """Underwater glider; inputs are net buoyancy, place of the sliding mass and rudder angle, as measured.

    `glider` names one of the parameter sets in `sets`.
    """

    name = "glider"
    title = "Underwater glider with sliding mass, buoyancy tank and rudder (6 degrees of freedom)"
    kind = "glider"
    source = "[R] multibody model after Sun, Wang and Sang 2019; values [L] Zhang et al. 2013 and [S]"
    states = (*_POSITION, *_VELOCITY)
    inputs = (
        Channel("m_b", "kg", "net buoyancy as a mass in the tank, negative lightens"),
        Channel("x_p", "m", "sliding mass, forward of the centre of buoyancy"),
        Channel("delta", "rad", "rudder angle, positive turns to starboard"),
    )
    outputs = states
    parameters: tuple[Parameter, ...] = PETREL_II
    sets: ClassVar[tuple[str, ...]] = tuple(GLIDERS)

    def __init__(self, glider: str = "PETREL_II") -> None:
        if glider not in GLIDERS:
            raise BadInput(f"model {self.name!r} has no parameter set {glider!r}", do=nearest(glider, GLIDERS))
        self.glider = glider
        self.parameters = GLIDERS[glider]
        super().__init__()

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        velocity, rate = motion(s, i, p, e)
        return (*kinematics(s), *velocity, *rate)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(LENGTH, DIAMETER, DIAMETER, p.m_h + p.m_p, WATER)

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return p.K_D0 * u * abs(u)
