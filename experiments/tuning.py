"""The solvers' own options, chosen by a sweep on cheap problems and checked on others.

    python experiments/tuning.py [--quick]

Each population method and simulated annealing is swept over its options on four problems (tuning_systems.py), none of
which is in the standard comparison. The setting with the smallest score is recommended. The former and the recommended
settings then fit five other problems, with other noise. All trials are simulated (synthetic).

The score is the geometric mean over the problems of the expected running time: evaluations until a search is within
1 chi-square of the best known fit, those of failed searches included. Where no search gets there, it is taken as twice
the budgets of all searches.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import tuning_systems as systems
from common import COLOURS, Options, Results, main, say

from seatruth.comparison import Comparison, Noise, Problem, compare
from seatruth.comparison.sweep import swept
from seatruth.optimizers import make

SEED = 20261123
TUNED_BUDGET, CHECKED_BUDGET = 50_000, 100_000
TUNED_SEEDS, CHECKED_SEEDS = 4, 4
SUCCESS = 1.0
"""Excess over the best known fit, in units of chi-square, below which a search has arrived."""
UNLIMITED: dict[str, dict[str, Any]] = {"genetic": {"generations": 10**6}, "simulated_annealing": {"iterations": 10**5}}
"""Limits of generations and steps, moved beyond the budgets."""
FORMER: dict[str, dict[str, Any]] = {
    "differential_swarm": {"particles": 50, "omega": 1.0, "distinct": True},
    "particle_swarm": {
        "particles": 50, "inertia": 0.7298, "cognitive": 1.4962, "social": 1.4962,
        "draw": "component", "topology": "star", "boundary": "nearest",
    },
    "genetic": {"population": 200, "crossing": "sbx", "crossover": 0.8, "mutation": 0.15},
    "simulated_annealing": {"heat": 1.0, "visit": 2.62, "precision": 2.2e-9},
    "differential_evolution": {
        "population": 50, "strategy": "best1bin", "mutation_low": 0.5, "mutation_high": 1.0, "recombination": 0.7,
    },
    "cma_es": {"sigma": 0.3, "population": None},
}  # fmt: skip
"""The defaults before: Chen 2011, Clerc and Kennedy 2002, Liu, SciPy's, SciPy's, Hansen's. Local searches of annealing
also ended at a slope of 1e-5 of the scaled cost, which is not repeated here."""
SWEEPS: dict[str, tuple[dict[str, list[Any]], ...]] = {
    "differential_swarm": (
        {"particles": [35, 50, 70], "omega": [0.7, 0.8, 0.9, 1.0]},
        {"particles": [50], "omega": [0.6]},
        {"particles": [50], "omega": [0.7, 0.8, 0.9, 1.0], "distinct": [False]},
    ),
    "particle_swarm": (
        {"draw": ["component"], "topology": ["star", "fixed"], "boundary": ["nearest", "reflective"]},
        {"draw": ["particle"], "topology": ["star"], "boundary": ["reflective"], "inertia": [0.65, 0.7298]},
        {
            "draw": ["particle"], "topology": ["fixed"], "boundary": ["reflective"],
            "neighbours": [7, 10, 15], "inertia": [0.65, 0.7298], "particles": [50, 100],
        },
    ),
    "genetic": (
        {"crossing": ["sbx"], "crossover": [0.9], "crossover_index": [2.0, 15.0],
         "mutation": [0.1], "mutation_index": [20.0, 100.0], "population": [100]},
        {"crossing": ["parent_centric"], "reach": [1.0, 1.1, 1.2, 1.3], "population": [70, 100, 150],
         "mutation": [0.02], "crossover": [0.9]},
        {"crossing": ["parent_centric"], "reach": [1.1], "population": [100],
         "mutation": [0.0, 0.02, 0.05], "crossover": [0.8, 1.0]},
    ),
    "simulated_annealing": (
        {"heat": [0.1, 1.0], "visit": [2.4, 2.62], "precision": [1e-12]},
        {"precision": [2.2e-9, 1e-15]},
    ),
    "differential_evolution": (
        {"strategy": ["best1bin", "rand1bin", "randtobest1bin", "currenttobest1bin", "best2bin"],
         "recombination": [0.9, 1.0], "population": [30, 50]},
        {"strategy": ["randtobest1bin"], "recombination": [0.95], "population": [50, 70],
         "mutation_low": [0.4, 0.5], "mutation_high": [1.0]},
    ),
    "cma_es": ({"sigma": [0.1, 0.3, 0.5]}, {"population": [16]}),
}  # fmt: skip
"""What is swept; a value that is not named is the default."""


def settings(solver: str, quick: bool = False) -> dict[str, dict[str, Any]]:
    """By label the options of a solver's sweep, the former defaults first."""
    tried = {"former defaults": FORMER[solver]}
    for sweep in SWEEPS[solver]:
        tried |= dict(swept({name: values[:1] for name, values in sweep.items()} if quick else sweep))
    return tried


def measured(
    solver: str,
    tried: Mapping[str, Mapping[str, Any]],
    problems: list[Problem],
    levels: tuple[float, ...],
    seeds: int,
    budget: int,
    out: Any,
) -> list[dict[str, Any]]:
    """One row a setting and problem: searches that arrived, of how many, and the expected running time."""
    optimizers = {label: make(solver, **{**UNLIMITED.get(solver, {}), **options}) for label, options in tried.items()}
    once = {optimizer: label for label, optimizer in reversed(optimizers.items())}  # two labels may mean the same
    made = Comparison(
        problems=problems,
        solvers={label: optimizer for optimizer, label in reversed(once.items())},
        noise=[Noise("white", level) for level in levels],
        seeds=seeds,
        budgets=[budget],
        stop="targets",
        success=SUCCESS,
        seed=SEED,
        name=f"{solver}, {len(tried)} settings",
    )
    found = compare(made, out, workers=1)
    rows: list[dict[str, Any]] = []
    every: Any = found.expected.itertuples(index=False)
    for row in every:
        ert = float(row.ert) if math.isfinite(row.ert) else 2.0 * row.runs * budget
        numbers = {"searches": int(row.runs), "arrived": round(row.success_rate * row.runs), "evaluations": ert}
        same = [label for label, optimizer in optimizers.items() if once[optimizer] == row.solver]
        rows += [{"setting": label, "problem": row.problem, **numbers} for label in same]
    return rows


def scores(rows: list[dict[str, Any]]) -> Any:
    """By setting: geometric mean of the expected running times, searches that arrived, searches; the best first."""
    table = pd.DataFrame(rows)
    by = table.assign(log=np.log(table["evaluations"])).groupby("setting", sort=False)
    scored = by.agg(score=("log", "mean"), arrived=("arrived", "sum"), searches=("searches", "sum"))
    return scored.assign(score=np.exp(scored["score"])).sort_values("score", kind="stable")


def body(options: Options, results: Results) -> None:
    solvers = ["differential_swarm", "genetic"] if options.quick else list(FORMER)
    results.add_text(__doc__ or "")
    results.expect(2 * len(solvers))
    swept_rows, checks = [], []
    for solver in solvers:
        tried = settings(solver, options.quick)
        rows = _stage(results, "tune", solver, tried, options)
        scored = scores(rows)
        best = str(scored.index[0])
        swept_rows += [{"solver": solver, **row} for row in scored.reset_index().to_dict("records")]
        gain = _round(scored.loc["former defaults", "score"] / scored.loc[best, "score"])
        say(f"  {solver}: {best}, {gain} times as fast as before where it was tuned")
        recommended = dict(tried[best])
        same = all(getattr(make(solver), name) == value for name, value in recommended.items())
        if not options.quick:
            note = best if same else f"{best}; the default differs"
            results.add_figure(f"{solver}: the default is what is recommended", float(same), "1", note)
        pair = {"former defaults": FORMER[solver], "defaults": {}, "recommended": recommended}
        rows = _stage(results, "check", solver, pair, options)
        checks += [{"solver": solver, **row} for row in rows]
        gained = scores(rows)
        for name in ("defaults", "recommended"):
            ratio = gained.loc["former defaults", "score"] / gained.loc[name, "score"]
            counts = ", ".join(f"{row.Index} {row.arrived} of {row.searches}" for row in gained.itertuples())
            results.add_figure(f"{solver}: gain of the {name} on other problems", float(ratio), "times",
                               f"at the best fit: {counts}")  # fmt: skip
    results.add_table("sweeps", pd.DataFrame(swept_rows).set_index(["solver", "setting"]))
    table = pd.DataFrame(checks)
    results.add_table("checks", table.set_index(["solver", "setting", "problem"]))
    results.add_picture("gain", _drawn(table))


def _stage(
    results: Results, what: str, solver: str, tried: Mapping[str, Mapping[str, Any]], options: Options
) -> list[dict[str, Any]]:
    """The sweep of a solver ("tune"), or what its settings do on the other problems ("check")."""
    tuning = what == "tune"
    makers: Mapping[str, Callable[[], Problem]] = systems.TUNED_ON if tuning else systems.CHECKED_ON
    levels = systems.NOISE["tuned on" if tuning else "checked on"]
    seeds, budget = (TUNED_SEEDS, TUNED_BUDGET) if tuning else (CHECKED_SEEDS, CHECKED_BUDGET)
    if options.quick:
        makers, levels, seeds, budget = dict(list(makers.items())[2:3]), levels[-1:], 2, 2000
    definition = {"tried": tried, "problems": list(makers), "levels": levels, "seeds": seeds, "budget": budget}
    out = options.out / "stores" / f"{what}-{solver}"
    problems = [maker() for maker in makers.values()]
    rows: list[dict[str, Any]] = results.stage(
        f"{what} {solver}", definition, partial(measured, solver, tried, problems, levels, seeds, budget, out)
    )
    return rows


def _round(ratio: float) -> str:
    return f"{ratio:.2g}"


def _drawn(table: pd.DataFrame) -> Any:
    """Expected running times of the former settings and of the defaults, by solver and problem."""
    import matplotlib.pyplot as plt

    solvers, problems = list(dict.fromkeys(table["solver"])), list(dict.fromkeys(table["problem"]))
    figure, axes = plt.subplots(figsize=(8.0, 0.55 * len(solvers) * max(len(problems), 2) ** 0.5 + 1.2))
    for k, solver in enumerate(solvers):
        for j, problem in enumerate(problems):
            part = table[(table["solver"] == solver) & (table["problem"] == problem)].set_index("setting")
            y = k + 0.12 * (j - 0.5 * (len(problems) - 1))
            before, now = (part.loc[name] for name in ("former defaults", "defaults"))
            axes.plot([before["evaluations"], now["evaluations"]], [y, y], color=COLOURS[j], lw=1, zorder=1)
            for row, marker in ((before, "o"), (now, "D")):
                whole = row["arrived"] == row["searches"]
                axes.plot(row["evaluations"], y, marker=marker, ms=5, ls="none", color=COLOURS[j],
                          mfc=COLOURS[j] if whole else "white")  # fmt: skip
    for j, problem in enumerate(problems):
        axes.plot([], [], color=COLOURS[j], lw=3, label=problem)
    axes.plot([], [], "ok", ms=5, ls="none", label="before")
    axes.plot([], [], "Dk", ms=5, ls="none", label="now")
    axes.plot([], [], "ok", ms=5, ls="none", mfc="white", label="some searches failed")
    axes.set_xscale("log")
    axes.set_xlabel("expected evaluations to the best fit (synthetic; problems that were not tuned on)")
    axes.set_yticks(range(len(solvers)), [solver.replace("_", " ") for solver in solvers])
    axes.invert_yaxis()
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


if __name__ == "__main__":
    sys.exit(main("tuning", str(__doc__).splitlines()[0], body, seeds={"comparison": SEED}))
