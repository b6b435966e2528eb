"""The single runs of the experiment on Chen, Yan and Wang 2011: what a worker process does.

Run k of a level has start k and noise k whatever the solver, so solvers are compared on the same problems.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import chen2011_system as system
import numpy as np
from chen2011_design import trial as designed
from chen2011_system import FREE, TRUTH, percent
from joblib import Parallel, delayed

from seatruth import Budget, identify
from seatruth.costs import cost_of
from seatruth.costs.options import TrajectoryOptions
from seatruth.optimizers import Chain, Optimizer, make, minimise
from seatruth.trials import Trial

SEED = 2011
REACHED = 0.01
"""Excess over the best-known fit, in chi-square units, at which a run has reached it: less than a tenth of a standard
error in any direction."""
Solver = Sequence[tuple[str, Mapping[str, Any]]]
"""Names and options, one after another."""


def in_parallel(function: Any, jobs: Sequence[Mapping[str, Any]], workers: int) -> list[Any]:
    """`function` of each job, in their order. A job runs on one thread and has its own seeds, whatever the workers."""
    if workers == 1:
        return [function(**job) for job in jobs]
    found: list[Any] = Parallel(workers)(delayed(function)(**job) for job in jobs)
    return found


def solver_of(parts: Solver) -> Optimizer:
    """The solver, or the hybrid of several."""
    made = tuple(make(name, **options) for name, options in parts)
    return made[0] if len(made) == 1 else Chain(made)


def record(level: float, k: int, elevator: Sequence[float] | None = None) -> tuple[Trial, dict[str, float], float]:
    """Record k at this noise of the benchmark, or of a run under this elevator; its noise; the level of its weights.

    Without noise the weights are those of 1 %.
    """
    clean = system.benchmark() if elevator is None else designed(np.asarray(elevator))
    weight = level or 0.01
    sd = system.noise_of(clean, weight)
    if level:
        return system.noisy(clean, sd, np.random.default_rng([SEED, round(1e6 * level), k])), sd, weight
    return clean, sd, weight


def search(
    level: float, label: str, solver: Solver, k: int, evaluations: int, elevator: Sequence[float] | None = None
) -> dict[str, Any]:
    """One run of a solver from random start k on record k, until it reaches the best-known fit or the budget ends."""
    trial, sd, weight = record(level, k, elevator)
    known = cost_of(system.study(trial, weight, noise=sd), threads=1)
    best = min((minimise(known, name, seed=SEED) for name in ("least_squares", "newton")), key=lambda out: out.value)
    start = system.random_start(np.random.default_rng([SEED, 1, k]))
    cost = cost_of(system.study(trial, weight, start, noise=sd), threads=1)
    budget = Budget(evaluations, target=best.value + 0.5 * REACHED)
    out = minimise(cost, solver_of(solver), seed=SEED + k, budget=budget)
    error = percent(dict(zip(cost.names, out.x.tolist())))
    excess = 2.0 * (out.value - best.value)
    return {
        **{"level": level, "solver": label, "run": k, "reached": bool(excess <= REACHED), "excess": excess},
        **{"evaluations": out.evaluations, "ended": out.code, "seconds": out.wall_s, "error": error},
    }


def fit(
    level: float, k: int, elevator: Sequence[float] | None = None, *, start: float = 0.5, free_start: bool = False
) -> dict[str, Any]:
    """Maximum likelihood on record k, without bounds: errors in per cent, and which 95 % intervals hold the truth.

    It starts at `start` times the truth. With `free_start` the first sample is noisy too, and the first state is
    estimated with the parameters.
    """
    trial, sd, weight = record(level, k, elevator)
    changes: dict[str, Any] = {"noise": sd, "bounded": False}
    if free_start:
        rng = np.random.default_rng([SEED, 2, k])
        outputs = {q: np.array(y) for q, y in trial.outputs.items()}
        for q, y in outputs.items():
            y[0] += sd[q] * rng.standard_normal()
        trial = replace(trial, outputs=outputs)
        changes |= {"cost": TrajectoryOptions(initial="free", initial_sd=sd)}
    begin = {name: start * TRUTH[name] for name in FREE}
    table: Any = identify(system.study(trial, weight, begin, **changes), seed=SEED, threads=1).parameters
    inside = {}
    for name in FREE:
        low, high = sorted((float(table.loc[name, "lower"]), float(table.loc[name, "upper"])))
        inside[name] = low <= TRUTH[name] <= high
    return {"error": percent(table["value"].to_dict()), "inside": inside}


def ratio(errors: Sequence[Mapping[str, float]], bound: Mapping[str, float]) -> dict[str, float]:
    """Root mean square error of each parameter over its bound."""
    return {q: math.sqrt(float(np.mean([(row[q] / bound[q]) ** 2 for row in errors]))) for q in bound}
