"""Parameters of the MMG ship: what each is, where its value comes from, and how far it can plausibly be from it.

Tags in `source`: [L] public literature, named; [S] chosen or estimated here. Two sets: KVLCC2 (7 m model) and
ESSO_OSAKA (3 m model).
"""

from __future__ import annotations

from seatruth.models.parameter import Parameter

_YY = "[L] Yasukawa and Yoshimura 2015, KVLCC2 L-7"
_KNOWN = 0.2
"""Geometry and mass are measured: their bounds are this fraction either side."""


def _size(name: str, value: float, unit: str, description: str) -> Parameter:
    low, high = sorted((value * (1 - _KNOWN), value * (1 + _KNOWN)))
    return Parameter(name, value, unit, low, high, source=_YY, description=description)


def _coefficient(name: str, value: float, low: float, high: float, description: str) -> Parameter:
    return Parameter(name, value, "1", low, high, source=_YY, description=description)


KVLCC2: tuple[Parameter, ...] = (
    Parameter("rho", 1025.0, "kg/m3", 990.0, 1035.0, source="[L] sea water; cancels from the motion"),
    _size("L", 7.0, "m", "length between perpendiculars"),
    _size("B", 1.27, "m", "breadth (for effects; not in the equations)"),
    _size("d", 0.46, "m", "draught"),
    _size("nabla", 3.27, "m3", "displaced volume"),
    _size("x_G", 0.25, "m", "centre of gravity forward of midship"),
    _size("D_P", 0.216, "m", "propeller diameter"),
    _size("H_R", 0.345, "m", "rudder span"),
    _size("A_R", 0.0539, "m2", "rudder area, movable part"),
    _size("k_zz", 0.25, "1", "radius of gyration about the vertical through G, over L"),
    _coefficient("m_x", 0.022, 0.0, 0.06, "added mass in surge over rho/2 L^2 d"),
    _coefficient("m_y", 0.223, 0.1, 0.4, "added mass in sway over rho/2 L^2 d"),
    _coefficient("J_z", 0.011, 0.004, 0.03, "added moment of inertia in yaw over rho/2 L^4 d"),
    _coefficient("R_0", 0.022, 0.008, 0.05, "resistance in straight motion"),
    _coefficient("X_vv", -0.040, -0.4, 0.3, "surge force by sway squared"),
    _coefficient("X_vr", 0.002, -0.25, 0.3, "surge force by sway times yaw (the added-mass part is apart)"),
    _coefficient("X_rr", 0.011, -0.15, 0.15, "surge force by yaw squared"),
    _coefficient("X_vvvv", 0.771, -1.0, 3.0, "surge force by sway to the fourth"),
    _coefficient("Y_v", -0.315, -0.7, -0.1, "sway damping"),
    _coefficient("Y_r", 0.083, -0.1, 0.3, "sway force by yaw (the added-mass part is apart)"),
    _coefficient("Y_vvv", -1.607, -6.0, 1.0, "cubic sway damping"),
    _coefficient("Y_vvr", 0.379, -2.5, 3.0, "sway force by sway squared times yaw"),
    _coefficient("Y_vrr", -0.391, -3.0, 1.5, "sway force by sway times yaw squared"),
    _coefficient("Y_rrr", 0.008, -0.4, 0.4, "sway force by yaw cubed"),
    _coefficient("N_v", -0.137, -0.3, -0.03, "yaw moment by sway (Munk moment)"),
    _coefficient("N_r", -0.049, -0.12, -0.01, "yaw damping"),
    _coefficient("N_vvv", -0.030, -1.0, 1.0, "yaw moment by sway cubed"),
    _coefficient("N_vvr", -0.294, -1.5, 0.5, "yaw moment by sway squared times yaw"),
    _coefficient("N_vrr", 0.055, -0.6, 0.6, "yaw moment by sway times yaw squared"),
    _coefficient("N_rrr", -0.013, -0.15, 0.05, "cubic yaw damping"),
    _coefficient("t_P", 0.220, 0.05, 0.4, "thrust deduction"),
    _coefficient("w_P0", 0.40, 0.15, 0.6, "wake fraction at the propeller in straight motion"),
    _coefficient("k_0", 0.2931, 0.15, 0.5, "thrust coefficient K_T at J = 0"),
    _coefficient("k_1", -0.2753, -0.5, -0.1, "K_T by J"),
    _coefficient("k_2", -0.1385, -0.3, 0.0, "K_T by J squared"),
    _coefficient("x_P", -0.48, -0.55, -0.4, "propeller position over L"),
    _coefficient("C_1", 2.0, 0.5, 8.0, "how fast the wake changes with the inflow angle"),
    _coefficient("C_2_plus", 1.6, 0.8, 2.5, "change of wake for inflow angle beta_P > 0"),
    _coefficient("C_2_minus", 1.1, 0.8, 2.5, "change of wake for inflow angle beta_P < 0"),
    _coefficient("t_R", 0.387, 0.0, 0.6, "steering resistance deduction"),
    _coefficient("a_H", 0.312, 0.0, 0.8, "rudder force increase by the hull"),
    _coefficient("x_H", -0.464, -0.7, -0.2, "where that increase acts, over L"),
    _coefficient("x_R", -0.5, -0.55, -0.45, "rudder position over L"),
    _coefficient("l_R", -0.710, -1.2, -0.4, "effective rudder lever of the inflow angle, over L"),
    _coefficient("gamma_R_minus", 0.395, 0.1, 0.9, "flow straightening for inflow angle beta_R < 0"),
    _coefficient("gamma_R_plus", 0.640, 0.1, 1.1, "flow straightening for inflow angle beta_R > 0"),
    _coefficient("epsilon", 1.09, 0.7, 1.6, "wake ratio, rudder to propeller"),
    _coefficient("kappa", 0.50, 0.2, 0.9, "slipstream acceleration constant"),
    _coefficient("f_alpha", 2.747, 1.8, 3.8, "slope of the rudder's lift"),
)

_POND = "measured: published principal particulars of the 3 m model"
_KIJIMA = "[S] estimate: Kijima et al. 1990 type regression on L, B, d, C_b"
_CLARKE = "[S] estimate: Clarke et al. 1983 regression, scaled by its ratio to the KVLCC2 value"
_TANKER = "[S] estimate: KVLCC2's value, a full tanker of similar proportions"

_ESSO: dict[str, tuple[float, str]] = {
    "rho": (1000.0, "[L] fresh water"),
    "L": (3.0, _POND),
    "B": (0.489, _POND),
    "d": (0.201, _POND),
    "nabla": (0.2446, "[L] 244.6 kg in fresh water"),
    "x_G": (0.094, _POND),
    "D_P": (0.084, _POND),
    "H_R": (0.1278, "[L] from rudder area and aspect ratio 1.54"),
    "A_R": (0.0106, _POND),
    "m_x": (0.0205, _TANKER + " as a fraction of the mass"),
    "m_y": (0.227, _CLARKE),
    "J_z": (0.0116, _CLARKE),
    "R_0": (0.021, "[S] estimate: ITTC 1957 friction at 0.4 m/s, form factor 1.25, wetted surface after Denny"),
    "Y_v": (-0.400, _KIJIMA + ": -(pi d / L + 1.4 C_b B / L)"),
    "Y_r": (0.088, _KIJIMA + ": m' + m_x' - 1.5 C_b B / L"),
    "N_v": (-0.134, _KIJIMA + ": -2 d / L"),
    "N_r": (-0.054, _KIJIMA + ": -0.54 k + k^2, k = 2 d / L"),
    "f_alpha": (2.491, "[S] estimate: 6.13 A / (A + 2.25) at aspect ratio A = 1.54 (Fujii)"),
}


def _esso() -> tuple[Parameter, ...]:
    changed = []
    for parameter in KVLCC2:
        value, source = _ESSO.get(parameter.name, (parameter.value, _TANKER))
        source = source if source.startswith("[") else f"[L] {source}"
        low, high = parameter.min, parameter.max
        if parameter.source == _YY and parameter.unit != "1":
            low, high = value * (1 - _KNOWN), value * (1 + _KNOWN)
        changed.append(parameter.replace(value=value, min=low, max=high, source=source))
    return tuple(changed)


ESSO_OSAKA: tuple[Parameter, ...] = _esso()

SHIPS: dict[str, tuple[Parameter, ...]] = {"KVLCC2": KVLCC2, "ESSO_OSAKA": ESSO_OSAKA}
