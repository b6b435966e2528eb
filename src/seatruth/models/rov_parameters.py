"""Parameters of the BlueROV2 of Blue Robotics: with eight thrusters ("heavy") as published, and with six.

Hull of the heavy one: [L] von Benzon et al., "An Open-Source Benchmark Simulator: Control of a BlueROV2 Underwater
Robot", J. Mar. Sci. Eng. 10 (2022) 1898, whose damping was measured by Wu 2018 (thesis, Flinders University).
Thrusters: T200, [L] Blue Robotics' technical details (5.25 and 4.1 kgf at 16 V) and performance data of September 2019
(3.71 kgf ahead at 12 V, no thrust at 1472 to 1528 us of 1100 to 1900 us at 16 V), both read as others reproduce them.
Tether: [L] docs.bluerobotics.com/fathom-r2, 7.6 mm, neutrally buoyant. The lighter vehicle with six thrusters has no
hydrodynamic data of its own; it takes those of the heavy one [S].
"""

from __future__ import annotations

from seatruth.models.parameter import Parameter

_BENZON = "[L] von Benzon et al. 2022, BlueROV2 heavy"
_T200 = "[L] Blue Robotics, technical details and performance data (September 2019) of the T200"
_TETHER = "[L] Blue Robotics, Fathom ROV Tether (R2)"
_CHOSEN = "[S] chosen here"
_KGF = 9.80665
"""N."""


def _value(name: str, value: float, unit: str, low: float, high: float, source: str, description: str) -> Parameter:
    return Parameter(name, value, unit, low, high, source=source, description=description)


def _size(name: str, value: float, unit: str, description: str, source: str = _BENZON) -> Parameter:
    return Parameter(name, value, unit, 0.5 * value, 2.0 * value, source=source, description=description)


def _force(name: str, value: float, unit: str, description: str) -> Parameter:
    """A derivative with the sign of the force; one that is not published as more than zero may still be something."""
    low = 5.0 * value if value else {"kg/s": -100.0}.get(unit, -2.0)
    return Parameter(name, value, unit, low, 0.0, source=_BENZON, description=description)


HEAVY: tuple[Parameter, ...] = (
    _value("rho", 1000.0, "kg/m3", 990.0, 1035.0, _BENZON, "water density"),
    _value("g", 9.82, "m/s2", 9.77, 9.84, _BENZON, "gravity"),
    _size("L", 0.46, "m", "length (for effects and the tether; not in the hull's equations)"),
    _size("B", 0.58, "m", "breadth (for effects)"),
    _size("H", 0.38, "m", "height (for effects)"),
    _size("m", 13.5, "kg", "mass in air"),
    _size("nabla", 0.0134, "m3", "displaced volume"),
    _size("I_x", 0.26, "kg m2", "roll moment of inertia at the centre of gravity"),
    _size("I_y", 0.23, "kg m2", "pitch moment of inertia at the centre of gravity"),
    _size("I_z", 0.37, "kg m2", "yaw moment of inertia at the centre of gravity"),
    _value("x_G", 0.0, "m", -0.1, 0.1, _BENZON, "centre of gravity forward of the origin"),
    _value("y_G", 0.0, "m", -0.1, 0.1, _BENZON, "centre of gravity to starboard of the origin"),
    _value("z_G", 0.0, "m", -0.1, 0.1, _BENZON, "centre of gravity below the origin"),
    _value("x_B", 0.0, "m", -0.1, 0.1, _BENZON, "centre of buoyancy forward of the origin"),
    _value("y_B", 0.0, "m", -0.1, 0.1, _BENZON, "centre of buoyancy to starboard of the origin"),
    _value("z_B", -0.01, "m", -0.1, 0.1, _BENZON, "centre of buoyancy below the origin (above: negative)"),
    _force("X_du", -6.36, "kg", "added mass in surge"),
    _force("Y_dv", -7.12, "kg", "added mass in sway"),
    _force("Z_dw", -18.68, "kg", "added mass in heave"),
    _force("K_dp", -0.189, "kg m2", "added moment of inertia in roll"),
    _force("M_dq", -0.135, "kg m2", "added moment of inertia in pitch"),
    _force("N_dr", -0.222, "kg m2", "added moment of inertia in yaw"),
    _force("X_u", -13.7, "kg/s", "linear surge damping"),
    _force("Y_v", 0.0, "kg/s", "linear sway damping"),
    _force("Z_w", -33.0, "kg/s", "linear heave damping"),
    _force("K_p", 0.0, "kg m2/s", "linear roll damping"),
    _force("M_q", -0.8, "kg m2/s", "linear pitch damping"),
    _force("N_r", 0.0, "kg m2/s", "linear yaw damping"),
    _force("X_uu", -141.0, "kg/m", "quadratic surge damping"),
    _force("Y_vv", -217.0, "kg/m", "quadratic sway damping"),
    _force("Z_ww", -190.0, "kg/m", "quadratic heave damping"),
    _force("K_pp", -1.19, "kg m2", "quadratic roll damping"),
    _force("M_qq", -0.47, "kg m2", "quadratic pitch damping"),
    _force("N_rr", -1.5, "kg m2", "quadratic yaw damping"),
    _size("T_ahead", 5.25 * _KGF, "N", "thrust of one thruster at full command, at 16 V", _T200),
    _size("T_astern", 4.10 * _KGF, "N", "the same at full command astern", _T200),
    _value("V_0", 16.0, "V", 7.0, 20.0, _T200, "voltage at which those hold"),
    _value(
        "k_V", 1.2, "1", 0.0, 2.0, _T200 + ", slope from 12 to 16 V", "relative change of thrust by that of voltage"
    ),
    _value("dead_band", 0.07, "1", 0.0, 0.3, _T200 + ": no thrust at 1472 to 1528 us", "command without thrust"),
    _value(
        *("k_lin", 0.0, "1", 0.0, 1.4, _CHOSEN + ": quadratic; 1.35 fits the polynomial of von Benzon et al. 2022"),
        "share of the thrust that goes linearly with the command",
    ),
    _value("l_t", 10.0, "m", 0.0, 300.0, _CHOSEN, "length of tether that follows the vehicle"),
    _size("d_t", 0.0076, "m", "diameter of the tether", _TETHER),
    _size("C_t", 1.2, "1", "drag coefficient of the tether across", _BENZON + ", normal drag of its tether"),
    _value("w_t", 0.0, "N", -20.0, 20.0, _TETHER + ": neutrally buoyant", "weight of the tether"),
    _value("x_t", -0.23, "m", -1.0, 1.0, _CHOSEN + ": the stern", "place of the tether, forward of the origin"),
    _value("z_t", 0.0, "m", -1.0, 1.0, _CHOSEN, "the same, below the origin"),
)

_BLUE = "[L] Blue Robotics, technical data of the BlueROV2"
_GAZEBO = "[L] bluerov2_gz (C. McQueen), scaled from 10 kg to 11.5 kg"
_OF_SIX: dict[str, tuple[float, str]] = {
    "L": (0.457, _BLUE),
    "B": (0.338, _BLUE),
    "H": (0.254, _BLUE),
    "m": (11.5, _BLUE + ", with ballast"),
    "nabla": (0.0115, "[S] trimmed to float neutrally in fresh water"),
    "I_x": (0.114, _GAZEBO),
    "I_y": (0.205, _GAZEBO),
    "I_z": (0.309, _GAZEBO),
}


def _six() -> tuple[Parameter, ...]:
    """The vehicle with six thrusters: its own sizes, the hydrodynamics of the heavy one."""
    changed = []
    for parameter in HEAVY:
        if parameter.name in _OF_SIX:
            value, source = _OF_SIX[parameter.name]
            parameter = parameter.replace(value=value, min=0.5 * value, max=2.0 * value, source=source)
        elif parameter.source == _BENZON:
            parameter = parameter.replace(source="[S] value of the heavy vehicle, von Benzon et al. 2022")
        changed.append(parameter)
    return tuple(changed)


SIX: tuple[Parameter, ...] = _six()
