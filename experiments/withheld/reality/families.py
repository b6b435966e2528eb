"""The families of vehicles, and designs of trials for them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from withheld.reality import auv, catalogue, kvlcc2, mariner
from withheld.reality.manoeuvres import Craft, Trial, auv_trial, ship_trial
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Vehicle

RUDDER_RATE = math.radians(5.0)
"""rad/s at model scale: slow enough for the record's rate, so that samples joined by lines are the rudder's motion."""


@dataclass(frozen=True)
class Family:
    """One kind of vehicle: its physics, its record, its trials."""

    name: str
    model: str
    """The library's model that the study is handed out with."""
    set: str
    vehicle: Vehicle
    coefficients: Mapping[str, float]
    sizes: Mapping[str, float]
    speed: float
    time: float
    """L / U, s."""
    revolutions: float
    """rev/s of the approach; 0 where the model has no such input."""
    outputs: tuple[str, ...]
    """Names of the six state rows."""
    input: str
    """The library's name of the steering input."""
    noise: Mapping[str, float]
    """Standard deviations of the data sheet, by output."""
    dt: float
    craft: Craft
    mechanisms: Sequence[Mechanism] = field(repr=False)

    def mechanism(self, key: str) -> Mechanism:
        """One mechanism by key; KeyError if it does not act on this family."""
        for one in self.mechanisms:
            if one.key == key:
                return one
        raise KeyError(key)

    @property
    def named(self) -> list[Mechanism]:
        """Those that the catalogue of effects holds."""
        return [one for one in self.mechanisms if one.number is not None]

    @property
    def unnamed(self) -> list[Mechanism]:
        """Those that it does not."""
        return [one for one in self.mechanisms if one.number is None]


NEEDS_SCREW = ("speed_steps", "coast_down")
TURNED = {"reciprocal_run": math.pi, "beam_heading_run": math.pi / 2}


def _ship(name: str) -> Family:
    small = name == "ship"
    module = kvlcc2 if small else mariner
    sizes = {**module.SIZES, **module.WINDAGE}
    L, d, rho, speed = sizes["L"], sizes["d"], sizes["rho"], module.SPEED
    time = L / speed
    unit = 0.5 * rho * L * L * d
    if small:
        mass, m_x, m_y = rho * sizes["nabla"], 0.022 * unit, 0.223 * unit
    else:
        cube = 0.5 * rho * L**3
        mass, m_x, m_y = sizes["m"] * cube, 42e-5 * cube, 748e-5 * cube
    sizes |= {
        "lever": 1.0, "mass": mass, "added_across": m_y, "added_difference": m_x - m_y, "speed": speed,
        "drag_area": 0.022 * L * d if small else 0.016 * L * d, "steering": 0.5 * rho * 1.2 * 0.0168 * L * d,
        "thrust_share": 1.0,
    }  # fmt: skip
    scale = 1.0 if small else 8.0
    deg = math.radians
    noise = {
        "x": 0.1 * scale, "y": 0.1 * scale, "psi": deg(0.1), "u": 0.01 * speed / 1.18, "v": 0.01 * speed / 1.18,
        "r": deg(0.05) * 5.94 / time,
    }  # fmt: skip
    return Family(
        name, "mmg" if small else "abkowitz", "KVLCC2" if small else "",
        kvlcc2.KVLCC2() if small else mariner.Mariner(), module.COEFFICIENTS, sizes, speed, time,
        11.85 if small else 0.0, ("u", "v", "r", "x", "y", "psi"), "delta", noise, 0.5 if small else 2.0,
        Craft("psi", "r", 1.0, 1.2, 1.0, deg(15), time),
        [*catalogue.planar(speed, time, mass), *(catalogue.screw() if small else [])],
    )  # fmt: skip


def _vehicle() -> Family:
    sizes = dict(auv.SIZES)
    L, rho = sizes["L"], sizes["rho"]
    time = L / auv.SPEED
    k3 = 0.5 * rho * L**3
    sizes |= {
        "lever": -1.0, "mass": sizes["m"], "added_across": 0.24 * k3, "added_difference": (0.0076 - 0.24) * k3,
        "speed": auv.SPEED, "d": 0.5, "drag_area": 0.00385 * L * L, "steering": 0.5 * rho * L * L * 0.073,
    }  # fmt: skip
    deg = math.radians
    noise = {"u": 0.01, "w": 0.005, "q": deg(0.05), "theta": deg(0.1), "z": 0.05, "x": 0.3}
    return Family(
        "auv", "diving_plane", "", auv.NPSVehicle(), auv.COEFFICIENTS, sizes, auv.SPEED, time, 0.0,
        ("u", "w", "q", "x", "z", "theta"), "delta_s", noise, 0.5,
        Craft("theta", "q", 1.0, 1.0, -1.0, deg(15), time), catalogue.vertical(auv.SPEED, time, sizes["m"]),
    )  # fmt: skip


def families() -> dict[str, Family]:
    """All of them by name."""
    return {"ship": _ship("ship"), "auv": _vehicle(), "mariner": _ship("mariner")}


def design(family: Family, rng: np.random.Generator, poor: bool = False) -> list[Trial]:
    """The trials of a case: 4 to 8 on several headings, half of them steered; `poor`: 4 on one heading.

    One manoeuvre is run twice, so that the noise can be seen. Each trial's name is unique.
    """
    count = 4 if poor else int(rng.integers(5, 9))
    heading = float(rng.uniform(-math.pi, math.pi))
    if family.name == "auv":
        steered = ["pitch_steps", "level_run", "dive", "level_run_slow", "climb"]
        free = ["pitch_zigzag_15_down", "pitch_zigzag_5_up", "plane_staircase", "plane_step_up"]
        if poor:
            steered, free = ["level_run"], ["pitch_zigzag_5_up"]
    else:
        steered = ["reciprocal_run", "course_changes", "speed_steps", "beam_heading_run", "straight_run"]
        free = ["zigzag_20_20_port", "zigzag_10_10", "turn_35_starboard", "turn_20_port", "zigzag_20_10"]
        if poor:
            steered, free = ["straight_run"], ["zigzag_10_10"]
    usable = [name for name in steered if family.revolutions or name not in NEEDS_SCREW]
    names: list[str] = []
    for pool, many in ((free, count - count // 2), (usable, count // 2)):
        order = list(pool) if poor else [pool[0], *rng.permutation(pool[1:]).tolist()]
        names += [order[k % len(order)] for k in range(many)]
    if not poor:
        names[count - count // 2 - 1] = names[0]  # the replicate
    trials = []
    for name in names:
        if family.name == "auv":
            trials.append(auv_trial(name, family.time, 0.75 if name.endswith("_slow") else 1.0))
            continue
        turned = TURNED.get(name, 0.0)
        base = heading if poor or name == names[0] else heading + float(rng.choice((0.0, 0.5, 1.0, 1.5))) * math.pi
        trials.append(ship_trial(name, heading + turned if turned else base, family.time))
    return trials
