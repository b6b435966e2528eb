"""Esso Osaka, 3 m model: numbers for the equations of `kvlcc2.py`.

Sizes [L]: the published principal particulars of the model. Coefficients [S]: regressions on them (Kijima 1990, Clarke
1983, ITTC 1957 friction, Fujii's lift) and, where these say nothing, KVLCC2's, a tanker of like proportions.
"""

from __future__ import annotations

from withheld.reality import kvlcc2

COEFFICIENTS: dict[str, float] = {
    **kvlcc2.COEFFICIENTS,
    "m_x": 0.0205, "m_y": 0.227, "J_z": 0.0116, "R_0": 0.021,
    "Y_v": -0.400, "Y_r": 0.088, "N_v": -0.134, "N_r": -0.054, "f_alpha": 2.491,
}  # fmt: skip
SIZES: dict[str, float] = {
    "rho": 1000.0, "L": 3.0, "B": 0.489, "d": 0.201, "nabla": 0.2446, "x_G": 0.094, "D_P": 0.084, "H_R": 0.1278,
    "A_R": 0.0106, "k_zz": 0.25, "x_P": -0.48, "x_R": -0.5,
}  # fmt: skip
WINDAGE = {"A_F": 0.103, "A_L": 0.266, "s_L": 0.09}
"""m2, m2, m: the loaded KVLCC2's at this scale [S]."""
SPEED = 0.4
"""m/s; the full ship's 7.7 knots, at which its trials were run."""
REVOLUTIONS = 11.07
"""rev/s that hold this speed."""
