"""A small study whose truth is known: zigzags of a boat that two thrusters steer, with noise, and an estimate of it."""

from __future__ import annotations

import functools
import math

import numpy as np

from seatruth import Budget, Estimate, Study, TrajectoryOptions, Trial, Trials, identify
from seatruth.manoeuvres import Manoeuvre, Zigzag, add_noise, run_manoeuvre
from seatruth.models import Prior, load_model

deg = math.radians
BOAT = load_model("twin_thruster")
SPEED, N = 1.2, 10.3
NOISE = {"x": 0.05, "y": 0.05, "psi": deg(0.3), "u": 0.02, "v": 0.02, "r": deg(0.3)}
FREE = {"X_u": 15.0, "N_r": 15.0, "N_rr": 150.0, "C_d": 0.4}
"""Free parameters and the standard deviations of their priors."""
TRUTH = {"X_u": -80.0, "N_r": -46.0, "N_rr": -370.0, "C_d": 1.1}


def sail(plan: Manoeuvre, values: dict[str, float] | None = None, dt: float = 0.1) -> Trial:
    ahead = {"n_port": N, "n_starboard": N}
    return run_manoeuvre(BOAT, plan, values, dt=dt, first_state={"u": SPEED}, inputs=ahead, limit=200.0)


def study() -> Study:
    rng = np.random.default_rng(0)
    plans = (Zigzag(0.1, deg(10), by="thrust"), Zigzag(0.2, deg(20), "port", by="thrust"))
    trials = [add_noise(sail(plan, TRUTH), NOISE, rng) for plan in plans]
    parameters = [
        p.replace(vary=True, prior=Prior(p.value, FREE[p.name])) if p.name in FREE else p for p in BOAT.parameters
    ]
    return Study(
        "known boat",
        BOAT,
        Trials(trials),
        parameters=tuple(parameters),
        noise=NOISE,
        cost=TrajectoryOptions(initial="free"),
        budget=Budget(evaluations=300),
    )


@functools.cache
def fitted() -> tuple[Study, Estimate]:
    made = study()
    return made, identify(made, threads=1)
