"""Parameters of the torpedo-like vehicle of Zhao, Xie and Qiao 2018: two sets of values.

T1: REMUS-100 class, [L] Prestero 2001, made dimensionless by the density, the cross-section of the hull and its length;
the damping of pitch and yaw is linearised upward [S] to stand for its quadratic terms. T2: a heavier body of 324 mm
diameter, [S] chosen here. The paper's own values are lost. Coefficients keep the torpedo convention of the paper (y up,
z to starboard); `torpedo.py` says how it maps to seatruth's axes. Revolutions count in rev/s here, in rpm there.
"""

from __future__ import annotations

from seatruth.models.parameter import Parameter

SOURCES = {"T1": "[L] Prestero 2001, REMUS-100 class", "T2": "[S] chosen here, 324 mm body"}
"""The sets, and where their values come from."""
_PER_MINUTE = 60.0

_ROWS: tuple[tuple[str, str, float, float, str], ...] = (
    ("rho", "kg/m3", 1025.0, 1025.0, "water density"),
    ("g", "m/s2", 9.81, 9.81, "gravity"),
    ("L", "m", 1.33, 3.2, "length"),
    ("D", "m", 0.191, 0.324, "diameter"),
    ("m", "kg", 30.5, 232.57, "mass"),
    ("J_x", "kg m2", 0.177, 3.052, "roll moment of inertia"),
    ("J_y", "kg m2", 3.45, 170.1, "yaw moment of inertia"),
    ("J_z", "kg m2", 3.45, 170.1, "pitch moment of inertia"),
    ("x_G", "m", 0.0, 0.0, "centre of gravity forward of that of buoyancy"),
    ("y_G", "m", -0.0196, -0.012, "centre of gravity above that of buoyancy (stable: negative)"),
    ("z_G", "m", 0.0, 0.0, "centre of gravity to starboard of that of buoyancy"),
    ("dG", "N", 0.0, 0.0, "weight less buoyancy"),
    ("lambda_11", "kg", 0.93, 6.98, "added mass in surge"),
    ("lambda_22", "kg", 35.5, 218.6, "added mass in heave"),
    ("lambda_33", "kg", 35.5, 218.6, "added mass in sway"),
    ("lambda_26", "kg m", -1.93, -14.88, "added mass, heave and pitch"),
    ("lambda_35", "kg m", 1.93, 14.88, "added mass, sway and yaw"),
    ("lambda_44", "kg m2", 0.0704, 0.488, "added moment of inertia in roll"),
    ("lambda_55", "kg m2", 4.88, 144.6, "added moment of inertia in yaw"),
    ("lambda_66", "kg m2", 4.88, 144.6, "added moment of inertia in pitch"),
    ("k_1", "N s", 2.0e-4 * _PER_MINUTE, 0.045 * _PER_MINUTE, "thrust by revolutions"),
    ("k_2", "N s2", 1.52e-6 * _PER_MINUTE**2, 1.25e-4 * _PER_MINUTE**2, "thrust by revolutions squared"),
    ("k_Q", "N m s2", 2.2e-8 * _PER_MINUTE**2, 6e-7 * _PER_MINUTE**2, "propeller torque by revolutions squared"),
    ("C_x0", "1", 0.110, 0.14, "drag at zero incidence"),
    ("C_y_alpha", "1", 1.95, 2.30, "lift by incidence"),
    ("C_y_wz", "1", 0.80, 1.20, "lift by pitch rate"),
    ("C_y_de", "1", 0.657, 0.45, "lift by the stern plane"),
    ("C_z_beta", "1", -1.95, -2.30, "side force by sideslip"),
    ("C_z_wy", "1", -0.80, -1.20, "side force by yaw rate"),
    ("C_z_dr", "1", -0.657, -0.45, "side force by the rudder"),
    ("m_x_beta", "1", 0.0, 0.002, "roll moment by sideslip"),
    ("m_x_wx", "1", -0.02, -0.006, "roll damping"),
    ("m_x_wy", "1", 0.0, -0.0008, "roll moment by yaw rate"),
    ("m_x_dr", "1", 0.0, -0.0015, "roll moment by the rudder"),
    ("m_x_dd", "1", 0.02, 0.012, "roll moment by the differential fins"),
    ("m_y_beta", "1", 1.00, 0.60, "yaw moment by sideslip (destabilising)"),
    ("m_y_wy", "1", -0.75, -0.62, "yaw damping"),
    ("m_y_dr", "1", -0.315, -0.21, "yaw moment by the rudder"),
    ("m_z_alpha", "1", 1.00, 0.60, "pitch moment by incidence (destabilising)"),
    ("m_z_wz", "1", -0.75, -0.62, "pitch damping"),
    ("m_z_de", "1", -0.315, -0.21, "pitch moment by the stern plane"),
)
_RANGE_OF_ZERO = {"x_G": 0.05, "z_G": 0.02, "dG": 20.0, "m_x_beta": 0.02, "m_x_wy": 0.02, "m_x_dr": 0.02}
"""Half the range of what may have either sign."""

TIES = {
    "lambda_33": "lambda_22",
    "lambda_35": "-lambda_26",
    "lambda_55": "lambda_66",
    "C_z_beta": "-C_y_alpha",
    "C_z_wy": "-C_y_wz",
    "C_z_dr": "-C_y_de",
    "m_y_beta": "m_z_alpha",
    "m_y_wy": "m_z_wz",
    "m_y_dr": "m_z_de",
}
"""What a body of revolution with equal fins up and across has in common; for `Parameter.expr`."""


def parameters(kind: str, names: tuple[str, ...] | None = None) -> tuple[Parameter, ...]:
    """The parameters of set "T1" or "T2": all, or the named ones in their order."""
    result = {}
    for row in _ROWS:
        name, unit, description = row[0], row[1], row[4]
        value = row[2] if kind == "T1" else row[3]
        if name in _RANGE_OF_ZERO:
            low, high = -_RANGE_OF_ZERO[name], _RANGE_OF_ZERO[name]
        elif name in ("rho", "g"):
            low, high = (990.0, 1035.0) if name == "rho" else (9.77, 9.84)
        else:
            low, high = sorted((0.2 * value, 3.0 * value))
        result[name] = Parameter(name, value, unit, low, high, source=SOURCES[kind], description=description)
    return tuple(result.values()) if names is None else tuple(result[name] for name in names)
