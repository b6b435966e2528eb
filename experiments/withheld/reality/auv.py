"""Diving plane of an NPS-class vehicle at constant thrust. [L] Healey and Lienard 1993; [S] the quadratic terms.

Written from the published equations (Gertler and Hagen's family). State rows u, w, q, x (made good), z (depth), theta.
"""

from __future__ import annotations

import numpy as np

from withheld.reality.motion import Array, Values, View

COEFFICIENTS: dict[str, float] = {
    "X_du": -7.6e-3, "Z_dw": -240e-3, "Z_dq": -6.8e-3, "M_dw": -6.8e-3, "M_dq": -17e-3,
    "X_uu": -3.85e-3, "X_wq": -200e-3, "X_qq": -15e-3,
    "Z_0": -1e-3, "Z_w": -300e-3, "Z_aw": -30e-3, "Z_waw": -600e-3, "Z_q": -140e-3, "Z_qaq": -50e-3, "Z_ds": -73e-3,
    "M_w": 100e-3, "M_aw": -10e-3, "M_waw": 50e-3, "M_q": -68e-3, "M_qaq": -20e-3, "M_ds": -41e-3,
}  # fmt: skip
SIZES: dict[str, float] = {
    "rho": 1025.0, "L": 5.3, "m": 5443.4, "I_y": 13587.0, "z_B": -0.061, "B": 53400.0, "X_T": 120.0, "X_ww": 0.0,
}  # fmt: skip
SPEED = 1.471
"""Steady speed at 120 N, m/s."""


class NPSVehicle:
    """The vehicle; `delta` is the stern plane, positive nose down."""

    earth_current = False

    def rates(self, view: View, p: Values, X: Array, Y: Array, N: Array) -> tuple[Array, ...]:
        u, w, q, ds = view.u_r, view.v_r, view.r, view.delta
        L = p["L"]
        k2 = 0.5 * p["rho"] * L**2
        k3, k4, k5 = k2 * L, k2 * L**2, k2 * L**3
        aw, aq = np.abs(w), np.abs(q)
        X = X + k2 * p["X_uu"] * u * np.abs(u) + k2 * p["X_ww"] * w * w + k3 * p["X_wq"] * w * q
        X = X + k4 * p["X_qq"] * q * q + p["X_T"] - p["m"] * view.v * q - k3 * p["X_du"] * view.du_c
        Z = p["Z_0"] * u * u + p["Z_w"] * u * w + p["Z_aw"] * u * aw + p["Z_waw"] * w * aw + p["Z_ds"] * u * u * ds
        Z = Y + k2 * Z + k3 * p["Z_q"] * u * q + k4 * p["Z_qaq"] * q * aq + p["m"] * view.u * q
        Z = Z - k3 * p["Z_dw"] * view.dv_c
        M = p["M_w"] * u * w + p["M_aw"] * u * aw + p["M_waw"] * w * aw + p["M_ds"] * u * u * ds
        M = N + k3 * M + k4 * p["M_q"] * u * q + k5 * p["M_qaq"] * q * aq + p["z_B"] * p["B"] * np.sin(view.psi)
        M = M - k4 * p["M_dw"] * view.dv_c
        a, b = p["m"] - k3 * p["Z_dw"], -k4 * p["Z_dq"]
        c, d = -k4 * p["M_dw"], p["I_y"] - k5 * p["M_dq"]
        det = a * d - b * c
        cos, sin = np.cos(view.psi), np.sin(view.psi)
        return (
            X / (p["m"] - k3 * p["X_du"]),
            (d * Z - b * M) / det,
            (a * M - c * Z) / det,
            view.u * cos + view.v * sin,
            view.v * cos - view.u * sin,
            q,
        )
