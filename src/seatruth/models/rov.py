"""Underwater vehicle with any number of fixed thrusters and a tether, in six degrees of freedom.

Equations: [L] Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed. (2021), chapters 2 to 8, as
von Benzon et al. 2022 use them for the BlueROV2; here about an origin from which the centres of gravity and buoyancy
may be off. Values: `seatruth.models.rov_parameters`. Body axes x forward, y to starboard, z down; derivatives have the
sign of the force; the added mass acts on the velocity through the water and carries the Munk moments.

* A thruster's command c in [-1, 1] gives, beyond a dead band, a thrust quadratic in it,
  e = (|c| - dead_band) / (1 - dead_band), F = T (k_lin e + (1 - k_lin) e^2) (1 + k_V (V / V_0 - 1)),
  with T ahead or astern and the battery's voltage V, an input. Form [S], values from the maker's data.
* Each thruster pushes where and as its place and direction say, the columns of the allocation matrix.
* The tether [S] is straight and turns about its far end, so that its drag pulls at the vehicle with a quarter of the
  force on a rod that moves as a whole: F = -rho/2 C_t d_t l_t / 4 |V| V at its place on the vehicle.

A vehicle of one's own is a subclass with its thrusters (and `parameters`, where they differ):

    class MyVehicle(ROV):
        name = "my_vehicle"
        title = "five thrusters"
        actuators = (Thruster("main", "c_1", at=(-0.3, 0.0, 0.0), towards=(1.0, 0.0, 0.0), full=1.0), ...)

Its inputs are those of its thrusters and `voltage`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from seatruth.errors import BadInput
from seatruth.models.actuators import Thruster, Triple, entry
from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter
from seatruth.models.rigid_body import Vector, cross, kinematics, plus, solved
from seatruth.models.rov_parameters import HEAVY, SIX
from seatruth.trials.channel import Channel

_TINY_2 = 1e-12
"""(m/s)^2, added under the root of the tether's speed: keeps derivatives finite at rest."""
_VOLTAGE = Channel("voltage", "V", "voltage of the battery under load")
T200 = 0.076
"""m: diameter of the propeller, [L] Blue Robotics."""


def thrust(command: Any, voltage: Any, p: Any) -> Any:
    """Thrust of one thruster, N, positive along its direction."""
    ahead, astern = (max(0.0, c - p.dead_band) / (1.0 - p.dead_band) for c in (command, -command))
    size = p.T_ahead * _share(ahead, p) - p.T_astern * _share(astern, p)
    return size * max(0.0, 1.0 + p.k_V * (voltage / p.V_0 - 1.0))


def _share(e: Any, p: Any) -> Any:
    return (p.k_lin + (1.0 - p.k_lin) * e) * e


def tether(s: Any, p: Any, e: Any) -> tuple[Vector, Vector]:
    """Force, N, and moment, N m, of the tether: its drag, and its weight in water."""
    at = (p.x_t, 0.0, p.z_t)
    u, v, w = plus((s.u - e.u_c, s.v - e.v_c, s.w - e.w_c), cross((s.p, s.q, s.r), at))
    pull = -0.125 * p.rho * p.C_t * p.d_t * p.l_t * math.sqrt(u * u + v * v + w * w + _TINY_2)
    x, y, z = downwards(s)
    force = (pull * u + p.w_t * x, pull * v + p.w_t * y, pull * w + p.w_t * z)
    return force, cross(at, force)


def downwards(s: Any) -> Vector:
    """The unit vector to the centre of the earth, in body axes."""
    cos_t = math.cos(s.theta)
    return -math.sin(s.theta), cos_t * math.sin(s.phi), cos_t * math.cos(s.phi)


def damping(s: Any, p: Any, e: Any) -> tuple[Vector, Vector]:
    """Force, N, and moment, N m, of the water on the hull."""
    u, v, w = s.u - e.u_c, s.v - e.v_c, s.w - e.w_c
    return (
        ((p.X_u + p.X_uu * abs(u)) * u, (p.Y_v + p.Y_vv * abs(v)) * v, (p.Z_w + p.Z_ww * abs(w)) * w),
        ((p.K_p + p.K_pp * abs(s.p)) * s.p, (p.M_q + p.M_qq * abs(s.q)) * s.q, (p.N_r + p.N_rr * abs(s.r)) * s.r),
    )


def motion(s: Any, force: Vector, moment: Vector, p: Any, e: Any) -> list[Any]:
    """d/dt of u, v, w over ground and of p, q, r, under the force (N) and the moment (N m) of all thrusters."""
    v, rate = (s.u, s.v, s.w), (s.p, s.q, s.r)
    through = (s.u - e.u_c, s.v - e.v_c, s.w - e.w_c)
    x, y, z = p.x_G, p.y_G, p.z_G
    G, B = (p.m * x, p.m * y, p.m * z), (p.x_B, p.y_B, p.z_B)
    I_x, I_y, I_z = p.I_x + p.m * (y * y + z * z), p.I_y + p.m * (x * x + z * z), p.I_z + p.m * (x * x + y * y)
    I_xy, I_xz, I_yz = -p.m * x * y, -p.m * x * z, -p.m * y * z

    # Momenta about the origin: of the vehicle over ground, of the water that moves along through the water.
    turning = cross(rate, G)
    P_body = (p.m * v[0] + turning[0], p.m * v[1] + turning[1], p.m * v[2] + turning[2])
    L_body = plus(
        cross(G, v),
        (
            I_x * s.p + I_xy * s.q + I_xz * s.r,
            I_xy * s.p + I_y * s.q + I_yz * s.r,
            I_xz * s.p + I_yz * s.q + I_z * s.r,
        ),
    )
    P_water = (-p.X_du * through[0], -p.Y_dv * through[1], -p.Z_dw * through[2])
    L_water = (-p.K_dp * s.p, -p.M_dq * s.q, -p.N_dr * s.r)

    down = downwards(s)
    weight, buoyancy = p.m * p.g, p.rho * p.g * p.nabla
    heavy = weight - buoyancy
    hull, tow = damping(s, p, e), tether(s, p, e)
    F = plus(
        *(force, hull[0], tow[0], (e.X, e.Y, e.Z)),
        cross(plus(P_body, P_water), rate),
        (heavy * down[0], heavy * down[1], heavy * down[2]),
        (-p.X_du * e.du_c, -p.Y_dv * e.dv_c, -p.Z_dw * e.dw_c),
    )
    lever = (G[0] * p.g - buoyancy * B[0], G[1] * p.g - buoyancy * B[1], G[2] * p.g - buoyancy * B[2])
    M = plus(
        *(moment, hull[1], tow[1], (e.K, e.M, e.N)),
        *(cross(plus(L_body, L_water), rate), cross(P_body, v), cross(P_water, through)),
        cross(lever, down),
    )
    a, b, c = G
    inertia = (
        (p.m - p.X_du, 0.0, 0.0, 0.0, c, -b),
        (0.0, p.m - p.Y_dv, 0.0, -c, 0.0, a),
        (0.0, 0.0, p.m - p.Z_dw, b, -a, 0.0),
        (0.0, -c, b, I_x - p.K_dp, I_xy, I_xz),
        (c, 0.0, -a, I_xy, I_y - p.M_dq, I_yz),
        (-b, a, 0.0, I_xz, I_yz, I_z - p.N_dr),
    )
    return solved(inertia, (*F, *M))


Layout = tuple[tuple[Triple, Triple], ...]
"""Place and direction of each thruster."""


def allocated(thrusts: tuple[Any, ...], layout: Layout, p: Any) -> tuple[Vector, Vector]:
    """Force, N, and moment, N m, of all thrusters from the thrust of each."""
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for size, (at, towards) in zip(thrusts, layout):
        x, y, z = (entry(value, p) for value in at)
        a, b, c = (entry(value, p) for value in towards)
        one = (size * a, size * b, size * c)
        force, moment = plus(force, one), plus(moment, cross((x, y, z), one))
    return force, moment


class ROV(Model):
    """Base of vehicles with fixed thrusters; see the module. A subclass names its `actuators`, all Thrusters."""

    kind = "auv"
    """Effects ask for no more than a body under water."""
    source = "[L] Fossen 2021, von Benzon et al. 2022"
    states: tuple[Channel, ...] = (
        Channel("u", "m/s", "forward velocity over ground"),
        Channel("v", "m/s", "velocity over ground to starboard"),
        Channel("w", "m/s", "velocity over ground down, body axes"),
        Channel("p", "rad/s", "roll rate, positive starboard down"),
        Channel("q", "rad/s", "pitch rate, positive nose up"),
        Channel("r", "rad/s", "yaw rate, positive nose to starboard"),
        Channel("x", "m", "position along psi = 0"),
        Channel("y", "m", "position to starboard of x"),
        Channel("z", "m", "depth"),
        Channel("phi", "rad", "roll, positive starboard down", angle=True),
        Channel("theta", "rad", "pitch, positive nose up", angle=True),
        Channel("psi", "rad", "heading, clockwise", angle=True),
    )
    outputs: tuple[Channel, ...] = states
    parameters: tuple[Parameter, ...] = HEAVY
    longest_step = 0.1
    """s: at 1.5 m/s the drag across has a time constant of 0.04 s."""

    def __init_subclass__(cls) -> None:
        """Makes the inputs and the equations of a subclass that names its thrusters."""
        super().__init_subclass__()
        if "actuators" not in cls.__dict__:
            return
        thrusters = [actuator for actuator in cls.actuators if isinstance(actuator, Thruster)]
        if not thrusters or len(thrusters) < len(cls.actuators):
            where = f"model {cls.name or cls.__name__!r}"
            do = "Give a Thruster for each thruster, and nothing else."
            raise BadInput("its actuators must be Thrusters, one at least", where=where, do=do)
        orders = dict.fromkeys(one.input for one in thrusters)
        cls.inputs = (*(Channel(order, "1", "command, -1 to 1") for order in orders), _VOLTAGE)
        layout = tuple((one.at, one.towards) for one in thrusters)
        thrusts = _thrusts([one.input for one in thrusters])
        for name, function in (
            ("thrusts", thrusts),
            ("thrust", _ahead(thrusts, layout)),
            ("rhs", _equations(thrusts, layout)),
        ):
            if name not in cls.__dict__:
                setattr(cls, name, staticmethod(function))

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return (-p.X_u - p.X_uu * abs(u) + 0.125 * p.rho * p.C_t * p.d_t * p.l_t * abs(u)) * u

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, p.B, p.H, p.m, p.rho)


def _thrusts(orders: list[str]) -> Callable[..., tuple[Any, ...]]:
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return tuple(thrust(getattr(i, order), i.voltage, p) for order in orders)

    return thrusts


def _ahead(thrusts: Callable[..., tuple[Any, ...]], layout: Layout) -> Callable[..., Any]:
    def ahead(s: Any, i: Any, p: Any, e: Any) -> Any:
        return allocated(thrusts(s, i, p, e), layout, p)[0][0]

    return ahead


def _equations(thrusts: Callable[..., tuple[Any, ...]], layout: Layout) -> Callable[..., tuple[Any, ...]]:
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        force, moment = allocated(thrusts(s, i, p, e), layout, p)
        return (*motion(s, force, moment, p, e), *kinematics(s))

    return rhs


_HALF = math.sqrt(0.5)
_CORNERS = (("front_starboard", 1, 1), ("front_port", 1, -1), ("rear_starboard", -1, 1), ("rear_port", -1, -1))
"""Names, and signs of x and y."""


def _vectored(x: float, y: float, z: float) -> tuple[Thruster, ...]:
    """Four thrusters at the corners, 45 deg off: a positive thrust pushes along x away from its end, and inwards."""
    return tuple(
        Thruster(name, f"c_{k}", (a * x, b * y, z), (a * _HALF, -b * _HALF, 0.0), full=1.0, diameter=T200)
        for k, (name, a, b) in enumerate(_CORNERS, 1)
    )


class BlueROV2Heavy(ROV):
    """BlueROV2 with eight thrusters: four at the corners 45 deg off, four vertical ones whose thrust is upwards."""

    name = "bluerov2_heavy"
    title = "Underwater vehicle with eight thrusters (6 degrees of freedom), BlueROV2 heavy"
    actuators = (  # [L] von Benzon et al. 2022
        *_vectored(0.156, 0.111, 0.085),
        *(
            Thruster(f"up_{name}", f"c_{k}", (0.12 * a, 0.218 * b, 0.0), (0.0, 0.0, -1.0), full=1.0, diameter=T200)
            for k, (name, a, b) in enumerate(_CORNERS, 5)
        ),
    )


class BlueROV2(ROV):
    """BlueROV2 with six thrusters: four at the corners 45 deg off, two vertical ones; it cannot pitch at will."""

    name = "bluerov2"
    title = "Underwater vehicle with six thrusters (6 degrees of freedom), BlueROV2"
    parameters = SIX
    actuators = (  # [L] bluerov2_gz (C. McQueen)
        *_vectored(0.14, 0.092, 0.0),
        Thruster("up_starboard", "c_5", (0.0, 0.109, -0.077), (0.0, 0.0, -1.0), full=1.0, diameter=T200),
        Thruster("up_port", "c_6", (0.0, -0.109, -0.077), (0.0, 0.0, -1.0), full=1.0, diameter=T200),
    )
