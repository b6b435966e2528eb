"""Synthetic logs in which everything is right: every vehicle that is built in, its manoeuvres, currents, noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from seatruth.manoeuvres import (
    CoastDown,
    GlideSpiral,
    Manoeuvre,
    PitchZigzag,
    Sawtooth,
    SpeedSteps,
    Spiral,
    Straight,
    Trim,
    TurningCircle,
    Zigzag,
    add_noise,
    run_manoeuvre,
    steady_current,
)
from seatruth.models import load_model
from seatruth.models.base import Model
from seatruth.trials import Trial

DIVE, CLIMB = Trim(0.5, 0.402), Trim(-0.5, 0.398)
NOISE = {
    **dict.fromkeys(("x", "y", "z"), 0.02),
    **dict.fromkeys(("phi", "theta", "psi"), math.radians(0.1)),
    **dict.fromkeys(("u", "v", "w"), 0.005),
    **dict.fromkeys(("p", "q", "r"), math.radians(0.03)),
}
"""SI; good instruments on a model or a small vehicle."""


@dataclass(frozen=True)
class Vehicle:
    """How one model is sailed: step s, first state, inputs, rate of the rudders, time limit, vertical or horizontal."""

    use: str
    dt: float
    first: Mapping[str, float]
    inputs: Mapping[str, float]
    rate: float
    limit: float
    plane: str


VEHICLES = (
    Vehicle("mmg", 0.2, {"u": 1.18}, {"n": 11.85}, math.radians(15.8), 160.0, "ship"),
    Vehicle("abkowitz", 1.0, {"u": 7.7175}, {}, math.radians(5.0), 800.0, "ship"),
    Vehicle("torpedo", 0.1, {"u": 1.542}, {"n": 15.0}, math.radians(30.0), 40.0, "both"),
    Vehicle("torpedo_324", 0.05, {"u": 5.36}, {"n": 25.0}, math.radians(30.0), 25.0, "both"),
    Vehicle("diving_plane", 0.5, {"u": 1.47, "z": 100.0}, {}, math.radians(2.5), 120.0, "vertical"),
    Vehicle("longitudinal_plane", 0.05, {"u": 4.0, "z": 60.0}, {}, math.radians(20.0), 20.0, "vertical"),
    Vehicle("longitudinal_plane_explicit", 0.05, {"u": 4.0, "z": 60.0}, {}, math.radians(20.0), 20.0, "vertical"),
    Vehicle(
        "glider",
        0.25,
        {"u": 0.57, "w": 0.017, "theta": math.radians(-29.0), "z": 8.0},
        {"m_b": DIVE.m_b, "x_p": DIVE.x_p},
        math.radians(5.0),
        400.0,
        "glider",
    ),
)


def plans(vehicle: Vehicle, rng: np.random.Generator) -> Manoeuvre:
    deg, n, short = math.radians, vehicle.inputs.get("n", 0.0), vehicle.limit
    side = "starboard" if rng.random() < 0.5 else "port"
    sign = 1.0 if side == "starboard" else -1.0
    rudder = deg(float(rng.choice([5, 10, 15, 20, 35] if vehicle.plane == "ship" else [3, 5, 8])))
    approach = 0.06 * short
    horizontal: list[Manoeuvre] = [
        TurningCircle(sign * rudder, deg(700), approach),
        Zigzag(rudder, deg(float(rng.choice([5, 10, 20]))), side, 6, approach),
        Spiral(tuple(sign * rudder * k for k in (1.0, 0.5, 0.0, -0.5, -1.0)), short / 5),
        Straight(0.5 * short),
        Straight(0.5 * short, sign * deg(2.0)),
    ]
    if "n" in vehicle.inputs:
        horizontal += [SpeedSteps((n, 0.6 * n, 1.1 * n), short / 3), CoastDown(0.7 * short, 0.2 * short)]
    plane = deg(float(rng.choice([2, 3, 5])))
    vertical: list[Manoeuvre] = [
        PitchZigzag(plane, deg(float(rng.choice([3, 5]))), "down" if side == "port" else "up"),
    ]
    glides: list[Manoeuvre] = [
        Sawtooth(DIVE, CLIMB, deep=30.0, halves=4),
        Sawtooth(DIVE, CLIMB, deep=30.0, halves=4, headings=(0.0, 1.5)),
        GlideSpiral(DIVE, (sign * deg(10.0), -sign * deg(15.0)), hold=400.0),
    ]
    menu = {"ship": horizontal, "both": [*horizontal, *vertical], "vertical": vertical, "glider": glides}
    return menu[vehicle.plane][int(rng.integers(len(menu[vehicle.plane])))]


def right_log(seed: int) -> tuple[Trial, Model]:
    """One log and its model: vehicle by turns, the rest drawn."""
    rng = np.random.default_rng([20268, seed])
    vehicle = VEHICLES[seed % len(VEHICLES)]
    model = load_model(vehicle.use)
    plan = plans(vehicle, rng)
    first = dict(vehicle.first)
    course = float(rng.uniform(-3, 3))
    current = float(rng.choice([0.0, 0.1, 0.3])) * first["u"] if vehicle.plane in ("ship", "both", "glider") else 0.0
    towards = float(rng.uniform(-3, 3))
    environment = steady_current(current, towards) if current else None
    if "psi" in {channel.name for channel in model.states}:
        first["psi"] = course
        first["u"] += current * math.cos(towards - course)
        first["v"] = first.get("v", 0.0) + current * math.sin(towards - course)
    trial = run_manoeuvre(
        model,
        plan,
        dt=vehicle.dt,
        first_state=first,
        inputs=vehicle.inputs,
        rudder_rate=vehicle.rate,
        limit=vehicle.limit,
        environment=environment,
        name=f"{seed} {vehicle.use} {plan.label}",
    )
    noise = float(rng.choice([0.0, 1.0, 2.0]))
    if noise:
        scale = {
            k: noise * v * (20 if vehicle.use in ("abkowitz",) and k in "xyz" else 1)
            for k, v in NOISE.items()
            if k in trial.outputs
        }
        trial = add_noise(trial, scale, rng)
    return replace(trial, name=f"{trial.name} current {current:.2g} noise {noise:g}"), model
