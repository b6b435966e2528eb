"""The families of vehicles, and designs of trials for them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from withheld.reality import auv, catalogue, container, esso, kvlcc2, mariner, thrusters, torpedo
from withheld.reality.forms import planar_forms, vertical_forms
from withheld.reality.manoeuvres import Craft, Trial, auv_trial, ship_trial, torpedo_trial
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Array, Vehicle

RUDDER_RATE = math.radians(5.0)
"""rad/s at model scale: slow enough for the record's rate, so that samples joined by lines are the rudder's motion."""
VELOCITIES = ("u", "v")
"""Outputs that a log of the speed through the water records, of a vehicle that a current carries sideways."""


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
    depth: float = 0.0
    """m at the start of a trial, of a vehicle under water."""
    trimmed: bool = False
    """Whether it needs an angle and a rudder to go level; then pilots count both from there."""
    measured: Mapping[str, float] = field(default_factory=dict)
    """What was measured on this vehicle and is not the library's default: the library's name, its value there."""
    whole: bool = False
    """Whether its study hands out every parameter, coefficients with bounds, as the library has no set for it."""
    forms: Sequence[Mechanism] = field(default=(), repr=False)
    """Other forms that its hull, damping or wake may have: no effect of a library."""
    thrusters: Mapping[str, float] = field(default_factory=dict)
    """Of a craft without a rudder: what is recorded in place of angle and revolutions; names of thrusters, and by how
    many rev/s each runs faster a radian of the pilot's angle."""
    water_log: bool = False
    """Whether its velocities are recorded through the water, as a speed log has them, and not over ground."""
    sheet: str = ""
    """File beside this package that holds the model as a user would write it from a data sheet; "" where the library
    has the model."""

    @property
    def named_in_log(self) -> dict[str, str]:
        """The names of the outputs in a log and a study, by those of the state rows."""
        return {name: f"{name}_w" if self.water_log and name in VELOCITIES else name for name in self.outputs}

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the recorded inputs."""
        return tuple(self.thrusters) or (self.input, *(["n"] if self.revolutions else []))

    def recorded(self, delta: Array, n: Array) -> dict[str, Array]:
        """The recorded inputs by name, of the pilot's angle (rad) and revolutions (rev/s)."""
        if self.thrusters:
            return {name: n + share * delta for name, share in self.thrusters.items()}
        return {self.input: delta, "n": n}

    def orders(self, inputs: Mapping[str, Array]) -> tuple[Array, Array]:
        """The pilot's angle and revolutions of recorded inputs: the other way round."""
        if self.thrusters:
            share = np.array(list(self.thrusters.values()))
            each = np.stack([inputs[name] for name in self.thrusters])
            n = np.asarray(each.mean(axis=0))
            return np.asarray(share @ (each - n) / (share @ share)), n
        delta = inputs[self.input]
        return delta, inputs.get("n", np.zeros_like(delta))

    def mechanism(self, key: str) -> Mechanism:
        """One mechanism or other form by key; KeyError if it does not act on this family."""
        for one in (*self.mechanisms, *self.forms):
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
VERTICAL = {
    "auv": (
        ["pitch_steps", "level_run", "dive", "level_run_slow", "climb"],
        ["pitch_zigzag_15_down", "pitch_zigzag_5_up", "plane_staircase", "plane_step_up"],
    ),
    "torpedo": (
        ["pitch_steps", "level_run", "depth_steps", "level_run_slow", "dive"],
        ["pitch_zigzag_15_down", "pitch_zigzag_5_up", "plane_doublets", "plane_pulses_up"],
    ),
}
"""Manoeuvres under water: steered ones, free ones. The first of each is in every case but a poor one."""
TURNED = {"reciprocal_run": math.pi, "beam_heading_run": math.pi / 2}


def _ship(name: str) -> Family:
    module = {"ship": kvlcc2, "tanker": esso, "container": container, "mariner": mariner}[name]
    screw = module is not mariner
    sizes = {**module.SIZES, **module.WINDAGE}
    L, d, rho, speed = sizes["L"], sizes["d"], sizes["rho"], module.SPEED
    time = L / speed
    unit = 0.5 * rho * L * L * d
    if screw:
        own = module.COEFFICIENTS
        mass, m_x, m_y, drag = rho * sizes["nabla"], own["m_x"] * unit, own["m_y"] * unit, own["R_0"]
    else:
        cube = 0.5 * rho * L**3
        mass, m_x, m_y, drag = sizes["m"] * cube, 42e-5 * cube, 748e-5 * cube, 0.016
    rudder = 0.0222 if name == "container" else 0.0168  # its area over L d
    sizes |= {
        "lever": 1.0, "mass": mass, "added_across": m_y, "added_difference": m_x - m_y, "speed": speed,
        "drag_area": drag * L * d, "steering": 0.5 * rho * 1.2 * rudder * L * d, "thrust_share": 1.0,
    }  # fmt: skip
    place = {"ship": 0.1, "tanker": 0.05, "container": 0.8, "mariner": 0.8}[name]
    deg = math.radians
    noise = {
        "x": place, "y": place, "psi": deg(0.1), "u": 0.01 * speed / 1.18, "v": 0.01 * speed / 1.18,
        "r": deg(0.05) * 5.94 / time,
    }  # fmt: skip
    # Waves of one to two ship lengths: the tanker is slower for its length than the others, the container ship faster.
    sea = {"tanker": 0.235, "container": 0.75}.get(name, 0.45) * time
    whole = name == "container"
    return Family(
        name, "mmg" if screw else "abkowitz", {"ship": "KVLCC2", "tanker": "ESSO_OSAKA"}.get(name, ""),
        kvlcc2.KVLCC2() if screw else mariner.Mariner(), module.COEFFICIENTS, sizes, speed, time,
        {"ship": 11.85, "tanker": esso.REVOLUTIONS, "container": container.REVOLUTIONS}.get(name, 0.0),
        ("u", "v", "r", "x", "y", "psi"), "delta", noise,
        {"ship": 0.5, "tanker": 0.6, "container": 1.5, "mariner": 2.0}[name],
        Craft("psi", "r", 1.0, 1.2, 1.0, deg(15), time),
        [*catalogue.planar(speed, time, mass, sea), *(catalogue.screw() if screw else [])],
        measured=module.SIZES if whole else {}, whole=whole, forms=planar_forms(screw),
    )  # fmt: skip


def _thrusted(name: str) -> Family:
    """The twin-hull boat ("twin") or the frame under water ("frame")."""
    twin = name == "twin"
    own, sizes, windage, speed = (
        (thrusters.TWIN, thrusters.TWIN_SIZES, thrusters.TWIN_WINDAGE, thrusters.TWIN_SPEED)
        if twin
        else (thrusters.FRAME, thrusters.FRAME_SIZES, thrusters.FRAME_WINDAGE, thrusters.FRAME_SPEED)
    )
    pairs, cosine = (1, 1.0) if twin else (2, math.sqrt(0.5))
    rho, time = sizes["rho"], sizes["L"] / speed
    drag = -own["X_u"] * speed - own["X_uu"] * speed**2
    # Revolutions at which thrust and drag balance: the positive root of a quadratic.
    slip, each = own["k_u"] * speed, drag / (2 * pairs * cosine)
    usual = (slip + math.sqrt(slip**2 + 4 * own["k_n"] * each)) / (2 * own["k_n"])
    every = {
        **sizes, **windage, "lever": 1.0, "added_across": -own["Y_dv"], "added_difference": own["Y_dv"] - own["X_du"],
        "speed": speed, "drag_area": drag / (0.5 * rho * speed**2), "thrust_share": 1.0,
        "thrusters": float(pairs), "cosine": cosine,
    }  # fmt: skip
    deg, faster = math.radians, thrusters.SHARE * usual
    noise = (
        {"x": 0.05, "y": 0.05, "psi": deg(0.2), "u": 0.01, "v": 0.01, "r": deg(0.2)}
        if twin
        else {"x": 0.02, "y": 0.02, "psi": deg(0.3), "u": 0.005, "v": 0.005, "r": deg(0.3)}
    )
    ends = (("port", faster), ("starboard", -faster))
    names = (
        {f"n_{side}": more for side, more in ends}
        if twin
        else {f"n_{end}_{side}": more for end in ("bow", "stern") for side, more in ends}
    )
    return Family(
        name, f"{name}.py:{'TwinHull' if twin else 'OpenFrame'}", "",
        thrusters.ThrusterCraft(pairs, cosine, usual), own, every, speed, time, usual,
        ("u", "v", "r", "x", "y", "psi"), "delta", noise, 0.2 if twin else 0.1,
        Craft("psi", "r", 1.0, 1.2, 1.0, deg(15), time),
        catalogue.thrusted(speed, time, sizes["mass"], 0.85 * time, afloat=twin),
        measured={key: sizes[key] for key in ("rho", "L", "B", "d", "mass", "I_z", "side")}, whole=True,
        forms=planar_forms(False), thrusters=names, sheet=f"{name}.py",
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
        Craft("theta", "q", 1.0, 1.0, -1.0, deg(15), time),
        catalogue.vertical(auv.SPEED, time, sizes["m"], catalogue.LARGE), 20.0, forms=vertical_forms(),
    )  # fmt: skip


def _torpedo() -> Family:
    sizes = dict(torpedo.SIZES)
    L, D, rho, speed = sizes["L"], sizes["D"], sizes["rho"], torpedo.SPEED
    time, area = L / speed, 0.25 * math.pi * D * D
    own = torpedo.COEFFICIENTS
    sizes |= {
        "lever": -1.0, "mass": sizes["m"], "added_across": own["lambda_22"],
        "added_difference": own["lambda_11"] - own["lambda_22"], "speed": speed, "d": D,
        "drag_area": area * own["C_x0"], "steering": 0.5 * rho * area * own["C_y_de"],
    }  # fmt: skip
    deg = math.radians
    noise = {"u": 0.015, "w": 0.01, "q": deg(0.1), "theta": deg(0.1), "z": 0.05, "x": 0.3}
    return Family(
        "torpedo", "longitudinal_plane", "", torpedo.Torpedo(), own, sizes, speed, time, 0.0,
        ("u", "w", "q", "x", "z", "theta"), "delta_s", noise, 0.1,
        Craft("theta", "q", 1.5, 1.5, -1.0, deg(12), time),
        catalogue.vertical(speed, time, sizes["m"], catalogue.SMALL), 30.0, True,
        {"dG": sizes["net"], "y_G": sizes["y_G"]}, forms=vertical_forms(),
    )  # fmt: skip


def family_of(name: str, *, water_log: bool) -> Family:
    """One family by name, its velocities recorded through the water or over ground."""
    return replace(families()[name], water_log=water_log)


def families() -> dict[str, Family]:
    """All of them by name."""
    ships = {name: _ship(name) for name in ("ship", "mariner", "tanker", "container")}
    return {"auv": _vehicle(), "torpedo": _torpedo(), **ships, **{name: _thrusted(name) for name in ("twin", "frame")}}


def design(family: Family, rng: np.random.Generator, poor: bool = False) -> list[Trial]:
    """The trials of a case: 4 to 8 on several headings, half of them steered; `poor`: 4 on one heading.

    One manoeuvre is run twice, so that the noise can be seen. Each trial's name is unique.
    """
    count = 4 if poor else int(rng.integers(5, 9))
    heading = float(rng.uniform(-math.pi, math.pi))
    if family.name in VERTICAL:
        steered, free = VERTICAL[family.name]
        if poor:
            steered, free = ["level_run"], ["pitch_zigzag_5_up"]
    else:
        steered = ["reciprocal_run", "course_changes", "speed_steps", "beam_heading_run", "straight_run"]
        # The tanker would spin about itself: twice its speed over its length is as far as its series goes.
        turn = "turn_25_starboard" if family.name == "tanker" else "turn_35_starboard"
        free = ["zigzag_20_20_port", "zigzag_10_10", turn, "turn_20_port", "zigzag_20_10"]
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
        if family.name in VERTICAL:
            one = torpedo_trial if family.trimmed else auv_trial
            trials.append(one(name, family.time, 0.75 if name.endswith("_slow") else 1.0))
            continue
        turned = TURNED.get(name, 0.0)
        base = heading if poor or name == names[0] else heading + float(rng.choice((0.0, 0.5, 1.0, 1.5))) * math.pi
        trials.append(ship_trial(name, heading + turned if turned else base, family.time))
    return trials
