"""A small open-frame vehicle under water with four horizontal thrusters, as its data sheet describes it; depth is held.

Values [S]: of the order of those published for vehicles of this kind and size. A study sets each of them.
"""

from math import cos, sin
from typing import Any

from seatruth import Channel, Model, Parameter
from seatruth.models import Dimensions

AHEAD = 0.5**0.5
"""Cosine of the angle by which each thruster is turned off the axis."""


def one_thrust(n: Any, u: Any, p: Any) -> Any:
    """One thruster's thrust (N) at n rev/s and u m/s through the water."""
    return p.k_n * n * abs(n) - p.k_u * abs(n) * u


class OpenFrame(Model):
    name = "open_frame"
    title = "open-frame vehicle with four horizontal thrusters"
    kind = "auv"
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
        Channel("n_bow_port", "rev/s", "revolutions of the thruster at the bow, port side"),
        Channel("n_bow_starboard", "rev/s", "revolutions of the thruster at the bow, starboard side"),
        Channel("n_stern_port", "rev/s", "revolutions of the thruster at the stern, port side"),
        Channel("n_stern_starboard", "rev/s", "revolutions of the thruster at the stern, starboard side"),
    )
    outputs = states
    parameters = (
        Parameter("X_du", -5.5, "kg", min=-22.0, max=0.0, source="data sheet"),
        Parameter("Y_dv", -12.7, "kg", min=-50.8, max=0.0, source="data sheet"),
        Parameter("N_dr", -0.12, "kg*m^2", min=-0.48, max=0.0, source="data sheet"),
        Parameter("X_u", -4.0, "N*s/m", min=-16.0, max=0.0, source="data sheet"),
        Parameter("X_uu", -18.0, "N*s^2/m^2", min=-72.0, max=0.0, source="data sheet"),
        Parameter("Y_v", -6.2, "N*s/m", min=-24.8, max=0.0, source="data sheet"),
        Parameter("Y_uv", -4.0, "N*s^2/m^2", min=-16.0, max=0.0, source="data sheet"),
        Parameter("Y_vv", -21.7, "N*s^2/m^2", min=-86.8, max=0.0, source="data sheet"),
        Parameter("Y_ur", 0.4, "N*s^2/m", min=0.0, max=1.6, source="data sheet"),
        Parameter("N_uv", -0.2, "N*s^2/m", min=-0.8, max=0.0, source="data sheet"),
        Parameter("N_r", -0.35, "N*m*s", min=-1.4, max=0.0, source="data sheet"),
        Parameter("N_ur", -0.5, "N*s^2", min=-2.0, max=0.0, source="data sheet"),
        Parameter("N_rr", -0.5, "N*m*s^2", min=-2.0, max=0.0, source="data sheet"),
        Parameter("k_n", 0.018, "N*s^2", min=0.0, max=0.072, source="data sheet"),
        Parameter("k_u", 0.02, "N*s^2/m", min=0.0, max=0.08, source="data sheet"),
        Parameter("rho", 1025.0, "kg/m^3", min=990.0, max=1040.0, source="sea water"),
        Parameter("L", 0.457, "m", min=0.1, max=3.0, source="data sheet"),
        Parameter("B", 0.338, "m", min=0.1, max=3.0, source="data sheet"),
        Parameter("d", 0.254, "m", min=0.05, max=3.0, source="data sheet"),
        Parameter("mass", 13.5, "kg", min=1.0, max=100.0, source="weighed"),
        Parameter("I_z", 0.26, "kg*m^2", min=0.01, max=10.0, source="data sheet"),
        Parameter("side", 0.166, "m", min=0.02, max=1.0, source="lever of a thruster about the middle"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u, v, r = s.u - e.u_c, s.v - e.v_c, s.r
        port = one_thrust(i.n_bow_port, u, p) + one_thrust(i.n_stern_port, u, p)
        starboard = one_thrust(i.n_bow_starboard, u, p) + one_thrust(i.n_stern_starboard, u, p)
        X = p.X_u * u + p.X_uu * u * abs(u) + AHEAD * (port + starboard) + e.X
        Y = p.Y_v * v + p.Y_uv * u * v + p.Y_vv * v * abs(v) + p.Y_ur * u * r + e.Y
        N = p.N_uv * u * v + p.N_r * r + p.N_ur * u * r + p.N_rr * r * abs(r) + p.side * (port - starboard) + e.N
        # The vehicle's mass moves with the ground, the added mass with the water.
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
        port = one_thrust(i.n_bow_port, u, p) + one_thrust(i.n_stern_port, u, p)
        return AHEAD * (port + one_thrust(i.n_bow_starboard, u, p) + one_thrust(i.n_stern_starboard, u, p))

    @staticmethod
    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        u = s.u - e.u_c
        return -p.X_u * u - p.X_uu * u * abs(u)
