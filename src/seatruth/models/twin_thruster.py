"""Boat with a thruster in each of two hulls, steered by their difference: surge, sway and yaw, with roll as an option.

Equations: [L] Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed. (2021), chapters 6 to 8,
reduced to these degrees of freedom [S]. Values: Maritime Robotics Otter, 2 m, with 25 kg of payload, [L] Fossen's MSS
toolbox (otter.m, 2019 to 2024). What MSS prints is tagged so; what it computes from printed values (draught, inertias,
added masses, damping) is computed here in the same way and says so; [S] is chosen here.

Body axes midships on the centreline in the waterline: x forward, y to starboard, z down. Derivatives have the sign of
the force. Thrust goes with n |n|, by another coefficient astern; it does not fall with speed: X_u holds that, as
published. The propellers' lag of 1 s in MSS is a servo of the study: `[actuators] n_port = { record = "order", lag =
"1 s" }`.

* The Munk moment of the added masses is left out, as in MSS: N_uv is a parameter of its own, nominally zero.
* Cross-flow drag acts on strips of the hull, C_d on a lateral area of L times d.
* Roll stands in body axes; heave and pitch stay zero. Weight and buoyancy right the boat by the metacentric height.
"""

from __future__ import annotations

import math
from typing import Any

from seatruth.models.actuators import Thruster
from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter
from seatruth.models.rigid_body import solved
from seatruth.trials.channel import Channel

_MSS = "[L] Fossen, MSS toolbox, Otter with 25 kg payload"
_COMPUTED = _MSS + ", computed from its printed values"
_CHOSEN = "[S] chosen here"
STRIPS = tuple(
    (0.25 * side * (1.0 + root), weight / 36.0)
    for side in (-1.0, 1.0)
    for root, weight in ((-math.sqrt(0.6), 5.0), (0.0, 8.0), (math.sqrt(0.6), 5.0))
)
"""Places over L and weights of strips of the hull: Gauss's rule of three points on each half, exact in sway or yaw."""
PER_TURN = 2.0 * math.pi
"""rad: MSS counts propellers in rad/s, this model in rev/s."""
FULL = 16.54
"""rev/s [L]: propeller speed of the Otter at 24.4 kgf with both thrusters, 103.9 rad/s."""


def _size(name: str, value: float, unit: str, description: str, source: str = _MSS) -> Parameter:
    low, high = sorted((0.5 * value, 2.0 * value))
    return Parameter(name, value, unit, low, high, source=source, description=description)


def _derivative(
    name: str, value: float, unit: str, low: float, high: float, source: str, description: str
) -> Parameter:
    return Parameter(name, value, unit, low, high, source=source, description=description)


OTTER: tuple[Parameter, ...] = (
    Parameter("rho", 1025.0, "kg/m3", 990.0, 1035.0, source=_MSS, description="water density"),
    _size("L", 2.0, "m", "length"),
    _size("B", 1.08, "m", "breadth over both hulls (for effects; not in the equations)"),
    _size("d", 0.195, "m", "draught, from a block coefficient of 0.4 of each hull", _COMPUTED),
    _size("m", 80.0, "kg", "mass, 55 kg of boat and 25 kg of payload"),
    Parameter("x_G", 0.1375, "m", -0.5, 0.5, source=_COMPUTED, description="centre of gravity forward of midships"),
    _size("I_z", 16.30, "kg m2", "yaw moment of inertia about the origin", _COMPUTED),
    _derivative("X_du", -5.5, "kg", -40.0, 0.0, _COMPUTED, "added mass in surge: a tenth of 55 kg"),
    _derivative("Y_dv", -82.5, "kg", -300.0, 0.0, _COMPUTED, "added mass in sway: 1.5 times 55 kg"),
    _derivative("N_dr", -25.14, "kg m2", -120.0, 0.0, _COMPUTED, "added moment of inertia in yaw: 1.7 times that at G"),
    _derivative("X_u", -77.55, "kg/s", -250.0, 0.0, _COMPUTED, "surge damping: 24.4 kgf at 6 knots"),
    _derivative("X_uu", 0.0, "kg/m", -120.0, 0.0, _CHOSEN + ": not in MSS", "quadratic surge damping"),
    _derivative("Y_v", 0.0, "kg/s", -300.0, 0.0, _MSS, "linear sway damping"),
    _derivative("N_uv", 0.0, "kg", -150.0, 80.0, _MSS + ", which neglects it", "yaw moment by surge times sway (Munk)"),
    _derivative("N_r", -41.45, "kg m2/s", -200.0, 0.0, _COMPUTED, "yaw damping: a time constant of 1 s"),
    _derivative("N_rr", -414.5, "kg m2", -2000.0, 0.0, _COMPUTED, "quadratic yaw damping: 10 times N_r"),
    _derivative("C_d", 1.0, "1", 0.0, 4.0, _COMPUTED, "cross-flow drag: Hoerner's curve at B / (2 T) = 0.64 of a hull"),
    _size("y_T", 0.395, "m", "thrusters to port and starboard of the centreline"),
    _derivative("k_ahead", 0.01108 * PER_TURN**2, "N s2", 0.05, 2.0, _MSS, "thrust ahead of one, over n |n|"),
    _derivative("k_astern", 0.006445 * PER_TURN**2, "N s2", 0.02, 2.0, _MSS, "thrust astern of one, over n |n|"),
)

ROLL: tuple[Parameter, ...] = (
    Parameter("g", 9.81, "m/s2", 9.77, 9.84, source=_MSS, description="gravity"),
    Parameter("z_G", -0.2469, "m", -0.8, 0.3, source=_COMPUTED, description="centre of gravity below the origin"),
    _size("I_x", 21.55, "kg m2", "roll moment of inertia about the origin", _COMPUTED),
    Parameter(
        "I_xz", 4.58, "kg m2", -10.0, 10.0, source=_COMPUTED, description="entry of the inertia matrix in roll and yaw"
    ),
    _derivative("K_dp", -3.336, "kg m2", -30.0, 0.0, _COMPUTED, "added moment of inertia in roll: 0.2 times that at G"),
    _derivative("K_p", -62.07, "kg m2/s", -400.0, 0.0, _COMPUTED, "roll damping: 0.2 of the critical one"),
    _size("GM", 1.2325, "m", "metacentric height", _COMPUTED),
    Parameter(
        "z_Y", 0.0, "m", -0.3, 0.5, source=_MSS, description="the hull's side force acts this far below the origin"
    ),
)


def thrust(n: Any, p: Any) -> Any:
    """Thrust of one propeller, N."""
    ahead, astern = max(0.0, n), max(0.0, -n)
    return p.k_ahead * ahead * ahead - p.k_astern * astern * astern


def cross_flow(v: Any, r: Any, p: Any) -> tuple[Any, Any]:
    """Side force (N) and yaw moment (N m) of the drag across the hull, strip by strip."""
    Y, N = 0.0, 0.0
    half = 0.5 * p.rho * p.d * p.C_d * p.L
    for place, weight in STRIPS:
        x = place * p.L
        across = v + x * r
        force = -weight * half * across * abs(across)
        Y, N = Y + force, N + x * force
    return Y, N


def forces(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, Any, Any, Any]:
    """Surge force, side force (N) and yaw moment (N m), all but those of the rigid body; the side force of the hull."""
    u, v, r = s.u - e.u_c, s.v - e.v_c, s.r
    port, starboard = thrust(i.n_port, p), thrust(i.n_starboard, p)
    Y_drag, N_drag = cross_flow(v, r, p)
    Y_hull = p.Y_v * v + Y_drag
    X = port + starboard + (p.X_u + p.X_uu * abs(u)) * u - p.Y_dv * v * r - p.X_du * e.du_c + e.X
    Y = Y_hull + p.X_du * u * r - p.Y_dv * e.dv_c + e.Y
    N = p.y_T * (port - starboard) + (p.N_r + p.N_rr * abs(r)) * r + p.N_uv * u * v + N_drag + e.N
    return X, Y, N, Y_hull


class TwinThruster(Model):
    """Surge, sway and yaw; the inputs are the revolutions of both propellers as they act."""

    name = "twin_thruster"
    title = "Boat with two thrusters, steered by their difference (3 degrees of freedom)"
    kind = "ship"
    source = "[L] Fossen 2021; values of the Otter, MSS toolbox"
    states: tuple[Channel, ...] = (
        Channel("u", "m/s", "forward velocity over ground"),
        Channel("v", "m/s", "starboard velocity over ground"),
        Channel("r", "rad/s", "yaw rate, positive nose to starboard"),
        Channel("x", "m", "position, along psi = 0"),
        Channel("y", "m", "position, to starboard of x"),
        Channel("psi", "rad", "heading, clockwise", angle=True),
    )
    inputs = (
        Channel("n_port", "rev/s", "revolutions of the port propeller, negative astern"),
        Channel("n_starboard", "rev/s", "revolutions of the starboard propeller, negative astern"),
    )
    outputs: tuple[Channel, ...] = (states[3], states[4], states[5], states[0], states[1], states[2])
    parameters: tuple[Parameter, ...] = OTTER
    actuators = (
        Thruster("port", "n_port", at=(-0.9, "-y_T", 0.2), towards=(1.0, 0.0, 0.0), full=FULL, diameter=0.2),
        Thruster("starboard", "n_starboard", at=(-0.9, "y_T", 0.2), towards=(1.0, 0.0, 0.0), full=FULL, diameter=0.2),
    )
    # Place along x and z, and diameter: [S] chosen here. Only effects on thrusters use them.
    longest_step = 0.1
    """s: with both propellers at full thrust in opposite senses the Otter's yaw has a time constant of 0.11 s."""

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return thrust(i.n_port, p), thrust(i.n_starboard, p)

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return thrust(i.n_port, p) + thrust(i.n_starboard, p)

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return -(p.X_u + p.X_uu * abs(u)) * u

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, p.B, p.d, p.m, p.rho)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        X, Y, N, _ = forces(s, i, p, e)
        # Rigid body on the velocity over ground; the added mass, on that through the water, is in the forces.
        X = X + p.m * (s.v * s.r + p.x_G * s.r * s.r)
        Y = Y - p.m * s.u * s.r
        N = N - p.m * p.x_G * s.u * s.r
        a, b, c = p.m - p.Y_dv, p.m * p.x_G, p.I_z - p.N_dr
        determinant = a * c - b * b
        return (
            X / (p.m - p.X_du),
            (c * Y - b * N) / determinant,
            (a * N - b * Y) / determinant,
            s.u * math.cos(s.psi) - s.v * math.sin(s.psi),
            s.u * math.sin(s.psi) + s.v * math.cos(s.psi),
            s.r,
        )


class TwinThrusterRoll(TwinThruster):
    """The same with roll."""

    name = "twin_thruster_roll"
    title = "Boat with two thrusters, steered by their difference (with roll, 4 degrees of freedom)"
    states = (
        *TwinThruster.states,
        Channel("p", "rad/s", "roll rate, positive starboard down"),
        Channel("phi", "rad", "roll, positive starboard down", angle=True),
    )
    outputs = (*TwinThruster.outputs, states[6], states[7])
    parameters = (*OTTER, *ROLL)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        X, Y, N, Y_hull = forces(s, i, p, e)
        K = p.K_p * s.p - p.z_Y * Y_hull - p.m * p.g * p.GM * math.sin(s.phi) + e.K
        X = X + p.m * (s.v * s.r + p.x_G * s.r * s.r - p.z_G * s.p * s.r)
        Y = Y - p.m * s.u * s.r
        K = K + p.m * p.z_G * s.u * s.r
        N = N - p.m * p.x_G * s.u * s.r
        inertia = (
            (p.m - p.Y_dv, -p.m * p.z_G, p.m * p.x_G),
            (-p.m * p.z_G, p.I_x - p.K_dp, p.I_xz),
            (p.m * p.x_G, p.I_xz, p.I_z - p.N_dr),
        )
        dv, dp, dr = solved(inertia, (Y, K, N))
        across = s.v * math.cos(s.phi)
        return (
            *(X / (p.m - p.X_du), dv, dr),
            s.u * math.cos(s.psi) - across * math.sin(s.psi),
            s.u * math.sin(s.psi) + across * math.cos(s.psi),
            *(s.r * math.cos(s.phi), dp, s.p),
        )
