"""Every installed solver on the two formulas of Liu, Yue and Yu, with and without the scale that cancels."""

from __future__ import annotations

from typing import Any

import liu_planing_system as system
import numpy as np
from joblib import Parallel, delayed
from liu_planing_folds import CLOSE, NAMES

from seatruth import Study
from seatruth.costs import cost_of
from seatruth.errors import BadInput
from seatruth.optimizers import Budget, available, make, minimise

FIXED = {"M1": "d3", "M2": "a5"}
"""Fixed at its printed value [P], each model has no scale left that cancels."""
LOCAL = ("least_squares", "newton", "nelder_mead", "ls_svm")
"""Solvers in which nothing is random."""


def study(name: str, fixed: bool) -> Study:
    """The study of a formula as its file has it, or with one parameter fixed at its printed value."""
    found = system.study(name)
    return found if not fixed else found.replace(parameters=parameters(name))


def parameters(name: str) -> tuple[Any, ...]:
    """The parameters of a formula, one of them fixed at its printed value."""
    return tuple(
        p.replace(vary=False, value=system.PRINTED[name][p.name]) if p.name == FIXED[name] else p
        for p in system.study(name).parameters
    )


def run(name: str, fixed: bool, solver: str, seed: int, generations: int, evaluations: int) -> dict[str, Any]:
    """One run: where it ended, F (mean squared error, lengths^2), the part of points within 10 per cent."""
    used = study(name, fixed)
    cost = cost_of(used, threads=1)
    printed = solver == "genetic"
    options: dict[str, Any] = {"crossing": "sbx", "population": 200, "crossover": 0.8, "mutation": 0.15}
    options = options | {"generations": generations} if printed else {}
    budget = Budget(200 * (generations + 1) if printed else evaluations)
    row = {"cost": f"{name}, {FIXED[name]} fixed" if fixed else name, "solver": solver, "seed": seed}
    try:
        out = minimise(cost, make(solver, **options), seed=seed, budget=budget)
    except BadInput as problem:
        return row | {"ended": "cannot be used", "why": problem.what}
    error = cost.errors(out.x)[:, 0]
    values = np.concatenate([trial.outputs["diameter"] for trial in used.trials])
    row |= {"ended": out.code, "evaluations": out.evaluations, "seconds": out.wall_s, "why": ""}
    return row | {"F": float(np.mean(error**2)), "within 10 %": float(np.mean(np.abs(error) <= CLOSE * values))}


def everything(*, seed: int, seeds: int, generations: int, evaluations: int, workers: int) -> list[dict[str, Any]]:
    """The genetic algorithm as printed, and every other solver that the cost serves, with half as many seeds."""
    usable = cost_of(system.study("M2"), threads=1).gives
    names = [name for name, info in available().items() if not info.error and info.needs <= usable]
    jobs = [
        (name, fixed, solver, seed + k, generations, evaluations)
        for name in NAMES
        for fixed in (False, True)
        for solver in names
        for k in range(1 if solver in LOCAL else seeds if solver == "genetic" else max(1, seeds // 2))
    ]
    return list(Parallel(n_jobs=workers)(delayed(run)(*job) for job in jobs))
