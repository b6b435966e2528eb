"""KVLCC2, 7 m model: MMG standard method. [L] Yasukawa and Yoshimura 2015; written from the published equations.

`COEFFICIENTS` are those that a case puts off; `SIZES` are measured on the vehicle and right.
"""

from __future__ import annotations

import math

import numpy as np

from withheld.reality.motion import Array, Values, View

COEFFICIENTS: dict[str, float] = {
    "m_x": 0.022, "m_y": 0.223, "J_z": 0.011,
    "R_0": 0.022, "X_vv": -0.040, "X_vr": 0.002, "X_rr": 0.011, "X_vvvv": 0.771,
    "Y_v": -0.315, "Y_r": 0.083, "Y_vvv": -1.607, "Y_vvr": 0.379, "Y_vrr": -0.391, "Y_rrr": 0.008,
    "N_v": -0.137, "N_r": -0.049, "N_vvv": -0.030, "N_vvr": -0.294, "N_vrr": 0.055, "N_rrr": -0.013,
    "t_P": 0.220, "w_P0": 0.40, "k_0": 0.2931, "k_1": -0.2753, "k_2": -0.1385,
    "C_1": 2.0, "C_2_plus": 1.6, "C_2_minus": 1.1,
    "t_R": 0.387, "a_H": 0.312, "x_H": -0.464, "l_R": -0.710, "gamma_R_minus": 0.395, "gamma_R_plus": 0.640,
    "epsilon": 1.09, "kappa": 0.50, "f_alpha": 2.747,
}  # fmt: skip
SIZES: dict[str, float] = {
    "rho": 1025.0, "L": 7.0, "B": 1.27, "d": 0.46, "nabla": 3.27, "x_G": 0.25, "D_P": 0.216, "H_R": 0.345,
    "A_R": 0.0539, "k_zz": 0.25, "x_P": -0.48, "x_R": -0.5,
}  # fmt: skip
WINDAGE = {"A_F": 0.56, "A_L": 1.45, "s_L": 0.2}
"""m2, m2, m: areas above the water of a loaded tanker at this scale and the lateral one's centre [S]."""
SPEED = 1.179
"""Approach speed, m/s."""


class KVLCC2:
    """The ship; state rows u, v (at midship), r, x, y, psi."""

    earth_current = True

    def rates(self, view: View, p: Values, X: Array, Y: Array, N: Array) -> tuple[Array, ...]:
        u, v, r, delta = view.u_r, view.v_r, view.r, view.delta
        L, d, rho = p["L"], p["d"], p["rho"]
        U2 = u * u + v * v + 1e-12
        U = np.sqrt(U2)
        beta = np.arctan2(-v, u)
        a, b = v / U, r * L / U
        q = 0.5 * rho * L * d * U2
        # Powers are products: a general power costs ten times as much.
        aa, ab, bb = a * a, a * b, b * b
        aaa, aab, abb, bbb = aa * a, aa * b, a * bb, bb * b
        X_H = -p["R_0"] + p["X_vv"] * aa + p["X_vr"] * ab + p["X_rr"] * bb + p["X_vvvv"] * (aa * aa)
        Y_H = p["Y_v"] * a + p["Y_r"] * b + p["Y_vvv"] * aaa + p["Y_vvr"] * aab + p["Y_vrr"] * abb + p["Y_rrr"] * bbb
        N_H = p["N_v"] * a + p["N_r"] * b + p["N_vvv"] * aaa + p["N_vvr"] * aab + p["N_vrr"] * abb + p["N_rrr"] * bbb
        thrust, u_P = inflow(u, beta - p["x_P"] * b, view.n, p)
        eta = p["D_P"] / p["H_R"]
        jet = np.sqrt(np.maximum(u_P**2 + 8.0 * thrust / (math.pi * rho * p["D_P"] ** 2), 0.0))
        u_R = p["epsilon"] * np.sqrt(eta * (u_P + p["kappa"] * (jet - u_P)) ** 2 + (1 - eta) * u_P**2)
        beta_R = beta - p["l_R"] * b
        v_R = U * np.where(beta_R > 0, p["gamma_R_plus"], p["gamma_R_minus"]) * beta_R
        normal = 0.5 * rho * p["A_R"] * (u_R**2 + v_R**2) * p["f_alpha"] * np.sin(delta - np.arctan2(v_R, u_R))
        lift = normal * np.cos(delta)
        X = X + q * X_H + (1 - p["t_P"]) * thrust * p.get("thrust_share", 1.0) - (1 - p["t_R"]) * normal * np.sin(delta)
        Y = Y + q * Y_H - (1 + p["a_H"]) * lift
        N = N + q * L * N_H - (p["x_R"] + p["a_H"] * p["x_H"]) * L * lift

        m = rho * p["nabla"]
        unit = 0.5 * rho * L * L * d
        m_x, m_y, J_z = unit * p["m_x"], unit * p["m_y"], unit * L * L * p["J_z"]
        first = m * p["x_G"]
        I_z = m * (p["k_zz"] * L) ** 2 + first * p["x_G"] + J_z
        # The water's share of inertia moves with the water, the ship's with the ground.
        X = X + m * view.v * r + m_y * v * r + first * r * r + m_x * view.du_c
        Y = Y - m * view.u * r - m_x * u * r + m_y * view.dv_c
        N = N - first * view.u * r
        det = (m + m_y) * I_z - first * first
        c, s = np.cos(view.psi), np.sin(view.psi)
        return (
            X / (m + m_x),
            (I_z * Y - first * N) / det,
            ((m + m_y) * N - first * Y) / det,
            view.u * c - view.v * s,
            view.u * s + view.v * c,
            r,
        )


def inflow(u: Array, beta_P: Array, n: Array, p: Values) -> tuple[Array, Array]:
    """Thrust (N) and axial inflow (m/s) of the propeller."""
    plus: Array = p["C_2_plus"]
    minus: Array = p["C_2_minus"]
    grow = np.where(beta_P > 0, plus, minus) - 1.0
    u_P = u * (1 - p["w_P0"]) * (1 + (1 - np.exp(-p["C_1"] * np.abs(beta_P))) * grow)
    nD = n * p["D_P"]
    return p["rho"] * p["D_P"] ** 2 * (p["k_0"] * nD**2 + p["k_1"] * nD * u_P + p["k_2"] * u_P**2), u_P
