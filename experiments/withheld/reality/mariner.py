"""Mariner: Abkowitz series. [L] Chislett and Strom-Tejsen 1965; written from the published equations.

Prime system with U and L, rho/2 absorbed; the coefficients count the rudder positive to port, `delta` to starboard.
"""

from __future__ import annotations

import numpy as np

from withheld.reality.motion import Array, Values, View

COEFFICIENTS: dict[str, float] = {
    name: value * 1e-5
    for name, value in {
        "X_du": -42, "Y_dv": -748, "Y_dr": -9.354, "N_dv": 4.646, "N_dr": -43.8,
        "X_u": -184, "X_uu": -110, "X_uuu": -215, "X_vv": -899, "X_rr": 18, "X_rv": 798, "X_dd": -95,
        "X_udd": -190, "X_vd": 93, "X_uvd": 93,
        "Y_v": -1160, "Y_r": -499, "Y_vvv": -8078, "Y_vvr": 15356, "Y_vu": -1160, "Y_ru": -499, "Y_d": 278,
        "Y_ddd": -90, "Y_ud": 556, "Y_uud": 278, "Y_vdd": -4, "Y_vvd": 1190, "Y_0": -4, "Y_0u": -8, "Y_0uu": -4,
        "N_v": -264, "N_r": -166, "N_vvv": 1636, "N_vvr": -5483, "N_vu": -264, "N_ru": -166, "N_d": -139,
        "N_ddd": 45, "N_ud": -278, "N_uud": -139, "N_vdd": 13, "N_vvd": -489, "N_0": 3, "N_0u": 6, "N_0uu": 3,
    }.items()
}  # fmt: skip
SIZES: dict[str, float] = {
    "rho": 1025.0, "L": 160.93, "U_0": 7.7175, "x_G": -0.023, "m": 798e-5, "I_z": 39.2e-5, "B": 23.17, "d": 7.46,
}  # fmt: skip
WINDAGE = {"A_F": 350.0, "A_L": 1700.0, "s_L": 3.0}
"""m2, m2, m: a cargo liner's areas above the water [S]."""
SPEED = 7.7175
"""Service speed, m/s."""


class Mariner:
    """The ship; state rows u, v, r, x, y, psi."""

    earth_current = True

    def rates(self, view: View, p: Values, X: Array, Y: Array, N: Array) -> tuple[Array, ...]:
        L = p["L"]
        U2 = view.u_r**2 + view.v_r**2 + 1e-12
        U = np.sqrt(U2)
        u, v, r, d = (view.u_r - p["U_0"]) / U, view.v_r / U, view.r * L / U, -view.delta
        # Powers are products: a general power costs ten times as much.
        uu, vv, dd, vu, vd, ud = u * u, v * v, d * d, v * u, v * d, u * d
        vvv, vvr, ru, ddd, uud, vdd, vvd = vv * v, vv * r, r * u, dd * d, uu * d, vd * d, vv * d
        fX = p["X_u"] * u + p["X_uu"] * uu + p["X_uuu"] * (uu * u) + p["X_vv"] * vv + p["X_rr"] * (r * r)
        fX = fX + p["X_rv"] * (r * v) + p["X_dd"] * dd + p["X_udd"] * (u * dd) + p["X_vd"] * vd
        fX = fX + p["X_uvd"] * (u * vd)
        fY, fN = (
            p[f"{c}_v"] * v + p[f"{c}_r"] * r + p[f"{c}_vvv"] * vvv + p[f"{c}_vvr"] * vvr + p[f"{c}_vu"] * vu
            + p[f"{c}_ru"] * ru + p[f"{c}_d"] * d + p[f"{c}_ddd"] * ddd + p[f"{c}_ud"] * ud
            + p[f"{c}_uud"] * uud + p[f"{c}_vdd"] * vdd + p[f"{c}_vvd"] * vvd
            + p[f"{c}_0"] + p[f"{c}_0u"] * u + p[f"{c}_0uu"] * uu
            for c in "YN"
        )  # fmt: skip
        unit = 0.5 * p["rho"] * L**3
        ax = fX * U2 / L + X / unit - p["X_du"] * view.du_c + p["m"] * view.v_c * view.r
        ay = fY * U2 / L + Y / unit - p["Y_dv"] * view.dv_c - p["m"] * view.u_c * view.r
        an = fN * U2 / L + N / (unit * L) - p["N_dv"] * view.dv_c - p["m"] * p["x_G"] * view.u_c * view.r
        m22, m23 = p["m"] - p["Y_dv"], p["m"] * p["x_G"] - p["Y_dr"]
        m32, m33 = p["m"] * p["x_G"] - p["N_dv"], p["I_z"] - p["N_dr"]
        det = m22 * m33 - m23 * m32
        c, s = np.cos(view.psi), np.sin(view.psi)
        return (
            ax / (p["m"] - p["X_du"]),
            (m33 * ay - m23 * an) / det,
            (m22 * an - m32 * ay) / (det * L),
            view.u * c - view.v * s,
            view.u * s + view.v * c,
            view.r,
        )
