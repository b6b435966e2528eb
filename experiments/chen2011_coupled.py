"""Differential Swarm on the coupled 6-DOF vehicle, which Chen, Yan and Wang 2011 call an easy next step.

The plant is the 324 mm body of `torpedo_324` [S], 5 % lighter than the water that it displaces. Hull and fins are alike
up and across, so one coefficient serves both planes: ten parameters for them and three of roll are free. The trial is
synthetic: heading and pitch held in steps in closed loop, all three fins switching on top, within 15 deg and 40 deg/s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from chen2011_runs import REACHED, SEED, Solver, solver_of
from chen2011_system import HIGH, LOW, STEP, noise_of, noisy

from seatruth import Budget, Study
from seatruth.costs import cost_of
from seatruth.manoeuvres import Manoeuvre, run_manoeuvre
from seatruth.models.torpedo import Torpedo324
from seatruth.models.torpedo_parameters import TIES
from seatruth.optimizers import minimise
from seatruth.trials import Trial, Trials
from seatruth.uncertainty import prior_identifiability

PLANT = Torpedo324()
VALUES = PLANT.nominal() | {"dG": -0.05 * PLANT.nominal()["m"] * PLANT.nominal()["g"]}
FREE = (
    *("lambda_22", "lambda_26", "lambda_66", "C_x0", "C_y_alpha", "C_y_wz", "C_y_de", "m_z_alpha", "m_z_wz", "m_z_de"),
    *("lambda_44", "m_x_wx", "m_x_dd"),
)
SECONDS, ANGLE, RATE = 60.0, math.radians(15.0), math.radians(40.0)
FIRST = {"u": 5.0, "z": 60.0}
REVOLUTIONS = 1000.0 / 60.0


@dataclass(frozen=True)
class AllAxes(Manoeuvre):
    """Heading and pitch in steps, with rudder, stern plane and differential fins switching on top."""

    @property
    def label(self) -> str:
        return "heading and pitch steps with switching fins"

    def helm(self) -> Any:
        def switching(t: float, one: float, two: float, size: float) -> float:
            return math.copysign(
                math.radians(size), math.sin(2.0 * math.pi * t / one) + 0.7 * math.sin(2.0 * math.pi * t / two)
            )

        def helm(t: float, y: Mapping[str, float]) -> Mapping[str, float]:
            heading = math.radians(20.0 if t % 26.0 < 13.0 else -20.0)
            pitch = math.radians(15.0 if t % 20.0 < 10.0 else -15.0)
            orders = {
                "delta": 1.5 * (heading - y["psi"]) - 1.0 * y["r"] + switching(t, 3.7, 1.9, 5.0),
                "delta_s": -(2.0 * (pitch - y["theta"]) - 1.5 * y["q"]) + switching(t, 3.1, 1.7, 6.0),
                "delta_d": switching(t, 2.3, 1.3, 4.0) - 1.0 * y["phi"],
            }
            return {name: max(-ANGLE, min(ANGLE, order)) for name, order in orders.items()} | {"n": REVOLUTIONS}

        return helm


def benchmark() -> Trial:
    """The run, without noise. The differential fins follow within a sample, the others at their rate."""
    return run_manoeuvre(
        PLANT,
        AllAxes(),
        VALUES,
        dt=STEP,
        first_state=FIRST,
        inputs={"n": REVOLUTIONS},
        rudder_rate=RATE,
        limit=SECONDS,
    )


def study(trial: Trial, sd: Mapping[str, float], start: Mapping[str, float] | None = None) -> Study:
    """Of the free parameters within 0.2 to 3 times the truth, the others known or tied."""
    given = []
    for q in PLANT.parameters:
        value = VALUES[q.name]
        if q.name in FREE:
            low, high = sorted((LOW * value, HIGH * value))
            q = q.replace(value=(start or {}).get(q.name, value), min=low, max=high, vary=True)
        elif q.name in TIES:
            q = q.replace(expr=TIES[q.name])
        else:
            q = q.replace(value=value)
        given.append(q)
    return Study("chen2011, 6-DOF", PLANT, Trials([trial]), parameters=tuple(given), noise=sd)


def sizes(trial: Trial, level: float) -> dict[str, float]:
    """Noise of each of the twelve outputs: this part of its peak."""
    return noise_of(trial, level, tuple(trial.outputs))


def bounds(level: float) -> dict[str, float]:
    """Cramer-Rao bounds in per cent."""
    trial = benchmark()
    frame = prior_identifiability(study(trial, sizes(trial, level)), threads=1)
    return {str(q): 100.0 * float(row["crlb"] / abs(row["value"])) for q, row in frame.iterrows()}


def search(label: str, solver: Solver, k: int, level: float, evaluations: int) -> dict[str, Any]:
    """One run of a solver from random start k on record k, until it reaches the best-known fit or the budget ends."""
    clean = benchmark()
    sd = sizes(clean, level)
    record = replace(noisy(clean, sd, np.random.default_rng([SEED, 3, k])), name=f"record {k}")
    best = minimise(cost_of(study(record, sd), threads=1), "least_squares", seed=SEED)
    rng = np.random.default_rng([SEED, 4, k])
    start = {name: VALUES[name] * float(rng.uniform(LOW, HIGH)) for name in FREE}
    cost = cost_of(study(record, sd, start), threads=1)
    budget = Budget(evaluations, target=best.value + 0.5 * REACHED)
    out = minimise(cost, solver_of(solver), seed=SEED + k, budget=budget)
    excess = 2.0 * (out.value - best.value)
    error = {name: 100.0 * (float(x) / VALUES[name] - 1.0) for name, x in zip(cost.names, out.x)}
    return {
        **{"solver": label, "run": k, "reached": bool(excess <= REACHED), "excess": excess, "ended": out.code},
        **{"evaluations": out.evaluations, "seconds": out.wall_s, "error": error},
    }
