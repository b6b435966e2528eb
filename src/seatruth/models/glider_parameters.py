"""Parameters of the buoyancy-driven glider: what each is, where its value comes from, how far it can be from it.

Tags in `source`: [L] public literature, named; [S] chosen or estimated here. PETREL_II is the set adopted for the
vehicle of Sun, Wang and Sang 2019, steered by a tail rudder; its own numbers are lost, so it takes those of the
Sea-Wing glider and changes what a rudder-steered vehicle must have otherwise. SEA_WING are the published numbers of
that roll-steered vehicle, without a rudder and with the tank at the origin: 30 deg of rudder would roll it over.
"""

from __future__ import annotations

from seatruth.models.parameter import Parameter

_ZHANG = "[L] Zhang et al. 2013, Sea-Wing glider"
_CHOSEN = "[S] chosen here"
_KNOWN = 0.2
"""Masses and lengths are measured: their bounds are this fraction either side."""


def _known(name: str, value: float, unit: str, description: str, source: str = _ZHANG) -> Parameter:
    reach = _KNOWN * abs(value) if value else 0.02
    return Parameter(name, value, unit, value - reach, value + reach, source=source, description=description)


def _free(
    name: str, value: float, unit: str, low: float, high: float, description: str, source: str = _ZHANG
) -> Parameter:
    return Parameter(name, value, unit, low, high, source=source, description=description)


PETREL_II: tuple[Parameter, ...] = (
    _known("m_h", 54.28, "kg", "mass of the hull"),
    _known("x_h", -0.0814, "m", "centre of the hull's mass, forward"),
    _free("z_h", 0.0060, "m", 0.0, 0.02, "centre of the hull's mass, below", f"{_CHOSEN}; published 0.0032"),
    _known("m_p", 11.0, "kg", "sliding mass"),
    _known("z_p", 0.014, "m", "sliding mass, below"),
    _free("x_b", 0.55, "m", -1.0, 1.0, "buoyancy tank, forward", _CHOSEN),
    _known("m_disp", 65.28, "kg", "mass of the displaced water"),
    _known("I_x", 0.60, "kg m2", "roll inertia of the hull about its centre"),
    _known("I_y", 15.27, "kg m2", "pitch inertia of the hull about its centre"),
    _known("I_z", 15.32, "kg m2", "yaw inertia of the hull about its centre"),
    _known("I_px", 0.02, "kg m2", "roll inertia of the sliding mass about its centre"),
    _known(
        "I_py",
        0.16,
        "kg m2",
        "pitch inertia of the sliding mass about its centre",
        f"{_CHOSEN}; a public copy has 10.16, taken as a misprint",
    ),
    _known("I_pz", 0.17, "kg m2", "yaw inertia of the sliding mass about its centre"),
    _free("A_11", 1.48, "kg", 0.1, 10.0, "added mass in surge"),
    _free("A_22", 49.58, "kg", 10.0, 150.0, "added mass in sway"),
    _free("A_33", 65.92, "kg", 10.0, 200.0, "added mass in heave"),
    _free("A_44", 0.53, "kg m2", 0.02, 3.0, "added inertia in roll"),
    _free("A_55", 7.88, "kg m2", 1.0, 25.0, "added inertia in pitch"),
    _free("A_66", 10.18, "kg m2", 1.0, 30.0, "added inertia in yaw"),
    _free("A_26", 2.57, "kg m", -10.0, 10.0, "added mass, sway with yaw"),
    _free("A_35", 0.0, "kg m", -10.0, 10.0, "added mass, heave with pitch", f"{_CHOSEN}; published 3.61"),
    _free("K_D0", 7.19, "kg/m", 0.5, 30.0, "drag at zero incidence"),
    _free("K_D", 386.29, "kg/m/rad2", 10.0, 1500.0, "drag by incidence squared"),
    _free("K_L0", -0.36, "kg/m", -5.0, 5.0, "lift at zero incidence"),
    _free("K_alpha", 440.99, "kg/m/rad", 50.0, 1500.0, "lift slope"),
    _free("K_beta", -115.65, "kg/m/rad", -500.0, -10.0, "side force by sideslip"),
    _free("K_MR", -20.0, "kg/rad", -200.0, 20.0, "roll moment by sideslip", f"{_CHOSEN}; published -58.27"),
    _free("K_p", -19.83, "kg s/rad", -100.0, -1.0, "roll damping; multiplies V^2 as published"),
    _free("K_M0", 0.28, "kg", -3.0, 3.0, "pitch moment at zero incidence"),
    _free("K_M", -65.84, "kg/rad", -250.0, 30.0, "pitch moment by incidence, without the Munk moment"),
    _free("K_q", -205.64, "kg s/rad", -800.0, -10.0, "pitch damping; multiplies V^2 as published"),
    _free("K_MY", 34.10, "kg/rad", -50.0, 200.0, "yaw moment by sideslip, without the Munk moment"),
    _free(
        "K_r",
        -150.0,
        "kg s/rad",
        -800.0,
        -10.0,
        "yaw damping; multiplies V^2 as published",
        f"{_CHOSEN}; published -389.30",
    ),
    _free("Y_delta", 13.1, "kg/m/rad", 0.0, 60.0, "side force by rudder, to port (rudder area 0.012 m2)", _CHOSEN),
    _free("x_delta", -0.9, "m", -1.5, -0.3, "rudder, forward", _CHOSEN),
    Parameter("g", 9.81, "m/s2", 9.7, 9.9, source="[L] gravity", description="gravity"),
)

_PUBLISHED = {"z_h": 0.0032, "x_b": 0.0, "A_35": 3.61, "K_MR": -58.27, "K_r": -389.30, "Y_delta": 0.0}

SEA_WING: tuple[Parameter, ...] = tuple(
    q.replace(value=_PUBLISHED[q.name], source=_ZHANG) if q.name in _PUBLISHED else q for q in PETREL_II
)

GLIDERS: dict[str, tuple[Parameter, ...]] = {"PETREL_II": PETREL_II, "SEA_WING": SEA_WING}
