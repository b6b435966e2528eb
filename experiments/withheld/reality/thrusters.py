"""Craft that steer with fixed thrusters instead of a rudder: a twin-hull boat and a small vehicle under water.

Three degrees of freedom with linear and quadratic damping, the centre of gravity at the origin, thrust that falls with
the speed of the water. State rows u, v, r, x, y, psi. A pilot gives mean revolutions `n` and, as on a rudder, an angle
`delta`: the thrusters on the port side run faster by that angle times `SHARE` of the usual revolutions.

Sizes and derivatives [S]: of the order of those published for a 2 m twin-hull boat (Otter, Fossen's MSS) and for a
small open-frame vehicle (BlueROV2, Wu 2018), rounded, and with enough damping to keep their course by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from withheld.reality.motion import Array, Force, Values, View

SHARE = 0.5
"""Of the usual revolutions that a radian of the pilot's angle adds to port and takes from starboard."""
TWIN: dict[str, float] = {
    "X_du": -6.0, "Y_dv": -75.0, "N_dr": -30.0,
    "X_u": -28.0, "X_uu": -38.0, "Y_v": -60.0, "Y_uv": -55.0, "Y_vv": -150.0, "Y_ur": 12.0,
    "N_uv": -6.0, "N_r": -22.0, "N_ur": -20.0, "N_rr": -25.0, "k_n": 0.55, "k_u": 0.62,
}  # fmt: skip
TWIN_SIZES: dict[str, float] = {
    "rho": 1025.0, "L": 2.0, "B": 1.08, "d": 0.17, "mass": 80.0, "I_z": 24.0, "side": 0.395,
}  # fmt: skip
TWIN_WINDAGE = {"A_F": 0.35, "A_L": 0.6, "s_L": 0.05}
TWIN_SPEED = 1.3
FRAME: dict[str, float] = {
    "X_du": -5.5, "Y_dv": -12.7, "N_dr": -0.12,
    "X_u": -4.0, "X_uu": -18.0, "Y_v": -6.2, "Y_uv": -4.0, "Y_vv": -21.7, "Y_ur": 0.4,
    "N_uv": -0.2, "N_r": -0.35, "N_ur": -0.5, "N_rr": -0.5, "k_n": 0.018, "k_u": 0.02,
}  # fmt: skip
FRAME_SIZES: dict[str, float] = {
    "rho": 1025.0, "L": 0.457, "B": 0.338, "d": 0.254, "mass": 13.5, "I_z": 0.26, "side": 0.166,
}  # fmt: skip
FRAME_WINDAGE = {"A_F": 0.0, "A_L": 0.0, "s_L": 0.0}
FRAME_SPEED = 0.7


@dataclass(frozen=True)
class ThrusterCraft:
    """`pairs` thrusters on each side, turned `cosine` off the axis; `side` m is each one's lever about the origin."""

    pairs: int
    cosine: float
    usual: float
    """rev/s at the speed of the approach."""
    earth_current = True

    def rates(self, view: View, p: Values, X: Array, Y: Array, N: Array) -> tuple[Array, ...]:
        """d/dt of the six rows."""
        u, v, r = view.u_r, view.v_r, view.r
        port = self._thrust(view.n + SHARE * self.usual * view.delta, u, p)
        starboard = self._thrust(view.n - SHARE * self.usual * view.delta, u, p)
        m, m_x, m_y = p["mass"], -p["X_du"], -p["Y_dv"]
        X = X + p["X_u"] * u + p["X_uu"] * u * np.abs(u) + self.pairs * self.cosine * (port + starboard)
        Y = Y + p["Y_v"] * v + p["Y_uv"] * u * v + p["Y_vv"] * v * np.abs(v) + p["Y_ur"] * u * r
        N = N + p["N_uv"] * u * v + p["N_r"] * r + p["N_ur"] * u * r + p["N_rr"] * r * np.abs(r)
        N = N + self.pairs * p["side"] * (port - starboard)
        # The body's mass moves with the ground, the water's share of inertia with the water.
        X = X + m * view.v * r + m_y * v * r + m_x * view.du_c
        Y = Y - m * view.u * r - m_x * u * r + m_y * view.dv_c
        c, s = np.cos(view.psi), np.sin(view.psi)
        return (
            X / (m + m_x),
            Y / (m + m_y),
            N / (p["I_z"] - p["N_dr"]),
            view.u * c - view.v * s,
            view.u * s + view.v * c,
            r,
        )

    @staticmethod
    def _thrust(n: Array, u: Array, p: Values) -> Array:
        return np.asarray(p["thrust_share"] * (p["k_n"] * n * np.abs(n) - p["k_u"] * np.abs(n) * u))


def weak_thrusters(view: View, q: Values, p: Values) -> Force:
    """The thrusters on the starboard side lose a share `k` of their thrust; those on the port side do not."""
    n = np.maximum(view.n, 0.0)
    lost = q["k"] * p["thrusters"] * (p["k_n"] * n * n - p["k_u"] * n * view.u_r)
    return Force(X=-p["cosine"] * lost, N=p["side"] * lost)
