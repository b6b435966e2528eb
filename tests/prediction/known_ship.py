"""A small study whose truth is known: a ship's zigzags with noise, and an estimate of it."""

from __future__ import annotations

import functools
import math

import numpy as np

from seatruth import Budget, Estimate, Study, TrajectoryOptions, Trial, Trials, identify
from seatruth.costs.options import CostOptions
from seatruth.manoeuvres import Manoeuvre, Zigzag, add_noise, run_manoeuvre
from seatruth.models import Prior, load_model

deg = math.radians
SHIP = load_model("mmg")
NOISE = {"x": 0.05, "y": 0.05, "psi": deg(0.2), "u": 0.01, "v": 0.01, "r": deg(0.1)}
FREE = {"Y_v": 0.06, "N_v": 0.02, "N_r": 0.008, "N_rrr": 0.01, "Y_vvv": 0.6}
"""Free parameters and the standard deviations of their priors."""


def sail(plan: Manoeuvre, values: dict[str, float] | None = None, dt: float = 0.5) -> Trial:
    return run_manoeuvre(
        SHIP, plan, values, dt=dt, first_state={"u": 1.18}, inputs={"n": 11.85}, rudder_rate=deg(15.8), limit=400.0
    )


def study(
    truth: dict[str, float] | None = None,
    seed: int = 0,
    plans: tuple[Manoeuvre, ...] = (Zigzag(deg(10), deg(10)), Zigzag(deg(20), deg(20), "port")),
    cost: CostOptions | None = None,
    noise: dict[str, float] | None = None,
    priors: bool = True,
) -> Study:
    rng = np.random.default_rng(seed)
    sd = NOISE if noise is None else noise
    trials = [add_noise(sail(plan, truth), sd, rng) for plan in plans]
    parameters = [
        p.replace(vary=True, prior=Prior(p.value, FREE[p.name]) if priors else None) if p.name in FREE else p
        for p in SHIP.parameters
    ]
    return Study(
        "known ship",
        SHIP,
        Trials(trials),
        parameters=tuple(parameters),
        noise=sd if cost is None else {},
        cost=cost or TrajectoryOptions(initial="free"),
        budget=Budget(evaluations=300),
    )


@functools.cache
def fitted() -> tuple[Study, Estimate]:
    made = study()
    return made, identify(made, threads=1)
