"""A twin-hull boat of 2 m that steers with two fixed propellers, as its data sheet describes it.

Values [S]: of the order of those published for boats of this kind and size. A study sets each of them.
"""

from math import cos, sin
from typing import Any

from seatruth import Channel, Model, Parameter
from seatruth.models import Dimensions


def one_thrust(n: Any, u: Any, p: Any) -> Any:
    """One propeller's thrust (N) at n rev/s and u m/s through the water."""
    return p.k_n * n * abs(n) - p.k_u * abs(n) * u


class TwinHull(Model):
    name = "twin_hull"
    title = "twin-hull boat with two propellers"
    kind = "ship"
    source = "data sheet [S]"
    states = (
        Channel("u", "m/s", "forward velocity"),
        Channel("v", "m/s", "velocity to starboard"),
        Channel("r", "rad/s", "rate of turn"),
        Channel("x", "m", "north"),
        Channel("y", "m", "east"),
        Channel("psi", "rad", "heading", angle=True),
    )
    inputs = (
        Channel("n_port", "rev/s", "revolutions of the port propeller"),
        Channel("n_starboard", "rev/s", "revolutions of the starboard propeller"),
    )
    outputs = states
    parameters = (
        Parameter("X_du", -6.0, "kg", min=-24.0, max=0.0, source="data sheet"),
        Parameter("Y_dv", -75.0, "kg", min=-300.0, max=0.0, source="data sheet"),
        Parameter("N_dr", -30.0, "kg*m^2", min=-120.0, max=0.0, source="data sheet"),
        Parameter("X_u", -28.0, "N*s/m", min=-112.0, max=0.0, source="data sheet"),
        Parameter("X_uu", -38.0, "N*s^2/m^2", min=-152.0, max=0.0, source="data sheet"),
        Parameter("Y_v", -60.0, "N*s/m", min=-240.0, max=0.0, source="data sheet"),
        Parameter("Y_uv", -55.0, "N*s^2/m^2", min=-220.0, max=0.0, source="data sheet"),
        Parameter("Y_vv", -150.0, "N*s^2/m^2", min=-600.0, max=0.0, source="data sheet"),
        Parameter("Y_ur", 12.0, "N*s^2/m", min=0.0, max=48.0, source="data sheet"),
        Parameter("N_uv", -6.0, "N*s^2/m", min=-24.0, max=0.0, source="data sheet"),
        Parameter("N_r", -22.0, "N*m*s", min=-88.0, max=0.0, source="data sheet"),
        Parameter("N_ur", -20.0, "N*s^2", min=-80.0, max=0.0, source="data sheet"),
        Parameter("N_rr", -25.0, "N*m*s^2", min=-100.0, max=0.0, source="data sheet"),
        Parameter("k_n", 0.55, "N*s^2", min=0.1, max=2.2, source="data sheet"),
        Parameter("k_u", 0.62, "N*s^2/m", min=0.1, max=2.5, source="data sheet"),
        Parameter("rho", 1025.0, "kg/m^3", min=990.0, max=1040.0, source="sea water"),
        Parameter("L", 2.0, "m", min=0.5, max=10.0, source="data sheet"),
        Parameter("B", 1.08, "m", min=0.2, max=5.0, source="data sheet"),
        Parameter("d", 0.17, "m", min=0.05, max=1.0, source="data sheet"),
        Parameter("mass", 80.0, "kg", min=10.0, max=1000.0, source="weighed"),
        Parameter("I_z", 24.0, "kg*m^2", min=1.0, max=1000.0, source="data sheet"),
        Parameter("side", 0.395, "m", min=0.05, max=2.0, source="propeller to the middle line"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u, v, r = s.u - e.u_c, s.v - e.v_c, s.r
        port, starboard = one_thrust(i.n_port, u, p), one_thrust(i.n_starboard, u, p)
        X = p.X_u * u + p.X_uu * u * abs(u) + port + starboard + e.X
        Y = p.Y_v * v + p.Y_uv * u * v + p.Y_vv * v * abs(v) + p.Y_ur * u * r + e.Y
        N = p.N_uv * u * v + p.N_r * r + p.N_ur * u * r + p.N_rr * r * abs(r) + p.side * (port - starboard) + e.N
        # The boat's mass moves with the ground, the added mass with the water.
        X = X + p.mass * s.v * r - p.Y_dv * v * r - p.X_du * e.du_c
        Y = Y - p.mass * s.u * r + p.X_du * u * r - p.Y_dv * e.dv_c
        c, d = cos(s.psi), sin(s.psi)
        return (
            X / (p.mass - p.X_du),
            Y / (p.mass - p.Y_dv),
            N / (p.I_z - p.N_dr),
            s.u * c - s.v * d,
            s.u * d + s.v * c,
            r,
        )

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, p.B, p.d, p.mass, p.rho)

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return one_thrust(i.n_port, u, p) + one_thrust(i.n_starboard, u, p)

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return -p.X_u * u - p.X_uu * u * abs(u)
