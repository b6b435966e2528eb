"""S175, a single-screw container ship at full size: numbers for the equations of `kvlcc2.py`. Synthetic in parts.

[L] K. Son and K. Nomoto, "On the coupled motion of steering and rolling of a high speed container ship", J. Soc. Nav.
Arch. Japan 150 (1981), as the public transcription by Lauvdal and Fossen (MSS) has them: principal particulars, masses,
derivatives of the upright hull, thrust and rudder constants. They count in rho/2 L^2 U^2; these equations in
rho/2 L d U^2.

[R] What had to be brought into these equations' form:

- Derivatives count as those at midship; the centre of the added mass, 5 % of the length ahead, counts as there too.
- No roll: the terms by heel and rolling are left out.
- `kappa` gives the published inflow of the rudder (slip constant 0.631, wake ratio 0.921) at the approach.
- `gamma_R` and `l_R` fit the published straightening 0.088 v - 0.156 r - 0.275 r^3 + 1.96 r^2 v over turns with 20
  and 35 deg and zigzags of 10 and 20 deg by the published equations; `C_2` their wake 1.09 (v + x_P r)^2, with `C_1` of
  KVLCC2.

[S] Port and starboard, alike in the published set, differ by 6 % about these fits in `gamma_R` and `C_2`; areas above
the water; the speed of the approach, about that of service.
"""

from __future__ import annotations

_L, _D = 175.0, 8.5
_PRIME: dict[str, float] = {
    "m_x": 0.000238, "m_y": 0.007049, "J_z": 0.000419,
    "R_0": 0.0004226, "X_vv": -0.00386, "X_vr": -0.00311, "X_rr": 0.00020,
    "Y_v": -0.0116, "Y_r": 0.00242, "Y_vvv": -0.109, "Y_vvr": 0.0214, "Y_vrr": -0.0405, "Y_rrr": 0.00177,
    "N_v": -0.0038545, "N_r": -0.00222, "N_vvv": 0.001492, "N_vvr": -0.0424, "N_vrr": 0.00156, "N_rrr": -0.00229,
}  # fmt: skip
"""[L], over rho/2 L^2 U^2, rho/2 L^3 and their like."""

COEFFICIENTS: dict[str, float] = {
    **{name: value * _L / _D for name, value in _PRIME.items()},
    "t_P": 0.175, "w_P0": 0.184, "k_0": 0.527, "k_1": -0.455,  # [L]
    "C_1": 2.0, "C_2_plus": 1.55, "C_2_minus": 1.37,  # [R] 1.46
    "t_R": 0.29, "a_H": 0.237, "x_H": -0.48, "epsilon": 0.921,  # [L]
    "f_alpha": 2.743,  # [L] 6.13 A / (A + 2.25), aspect ratio A = 1.8219
    "l_R": -1.0, "gamma_R_minus": 0.31, "gamma_R_plus": 0.35,  # [R] 0.33
    "kappa": 0.773,  # [R]
}  # fmt: skip
SIZES: dict[str, float] = {
    "rho": 1025.0, "L": _L, "B": 25.4, "d": _D, "nabla": 21222.0, "D_P": 6.533, "A_R": 33.0376,  # [L]
    "H_R": 7.758,  # [L] from area and aspect ratio
    "x_G": -2.52, "k_zz": 0.24,  # [L] ITTC's particulars, from memory; root of I_z / m = 0.000456 / 0.00792
    "x_P": -0.526, "x_R": -0.5,  # [L]
    "X_vvvv": 0.0, "k_2": 0.0,  # [L] no such terms in the published set: no case puts them off
}  # fmt: skip
WINDAGE = {"A_F": 600.0, "A_L": 2800.0, "s_L": -4.0}
"""m2, m2, m: three tiers of containers on deck, the house aft [S]."""
SPEED = 11.318
"""m/s: 22 knots."""
REVOLUTIONS = 1.8015
"""rev/s that hold this speed."""
