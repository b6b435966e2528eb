"""What does an optimizer cost beside the simulation? Microseconds a candidate, the cost function's own time taken off.

    python experiments/optimizer_overhead.py [--quick]

A sphere in 10 dimensions, populations of 50, 100 and 200, through the whole of seatruth (solver, search coordinates,
counting, history), with and without a checkpoint on disk. Beside them the peers' own loops, with the same population
in one call of the function: pyswarms' GlobalBestPSO, pymoo's GA (as it comes, and without its search for duplicates),
SciPy's differential evolution, pycma. The shortest of the repeats counts (the machine may be shared); the median stands
beside it in the table. One thread.
"""

from __future__ import annotations

import functools
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS, Options, Results, main
from peers import problem_of_pymoo, swarm_of_pyswarms

from seatruth.arrays import Array
from seatruth.costs.base import Cost
from seatruth.models.parameter import Parameter
from seatruth.optimizers import Budget, make, minimise

SEED, D, GOAL = 20260102, 10, 5.0
JUDGED = ("differential_swarm", "particle_swarm", "genetic")
OURS: dict[str, Callable[[int], dict[str, Any]]] = {
    "differential_swarm": lambda n: {"particles": n, "spread": 0.0},
    "particle_swarm": lambda n: {"particles": n, "spread": 0.0},
    "genetic": lambda n: {"population": n, "generations": 10**6},
    "differential_evolution": lambda n: {"population": n, "tolerance": 0.0},
    "cma_es": lambda n: {"population": n, "tolerance": 0.0, "restarts": 20},
}


class Sphere(Cost):
    """sum x^2 over [-5, 5]^D; adds up the time spent in it."""

    gives = frozenset({"values"})

    def __init__(self) -> None:
        self.parameters = tuple(Parameter(f"x{k}", 3.0, min=-5.0, max=5.0, vary=True) for k in range(D))
        self.description = {"function": "sphere", "dimension": D}
        self.seconds, self.candidates = 0.0, 0

    def values(self, X: Array) -> Array:
        begun = time.perf_counter()
        result: Array = (X * X).sum(axis=1)
        self.seconds += time.perf_counter() - begun
        self.candidates += len(X)
        return result


def body(options: Options, results: Results) -> None:
    """Times every optimizer and peer at every size."""
    sizes = (50,) if options.quick else (50, 100, 200)
    evaluations, repeats = (4_000, 3) if options.quick else (40_000, 7)
    cases: list[tuple[str, str, Callable[[Sphere, int, int], None]]] = []
    cases += [(name, "seatruth", _ours(name, False)) for name in OURS]
    cases += [(f"{name}, checkpoint", "seatruth", _ours(name, True)) for name in JUDGED]
    cases += [
        ("pyswarms GlobalBestPSO", "peer", _pyswarms),
        ("pymoo GA", "peer", _pymoo(True)),
        ("pymoo GA, no duplicate search", "peer", _pymoo(False)),
        ("SciPy differential evolution", "peer", _scipy),
        ("pycma", "peer", _pycma),
    ]
    results.expect(len(cases))
    rows = []
    for name, kind, run in cases:
        definition = {"sizes": sizes, "evaluations": evaluations, "repeats": repeats, "seed": SEED}
        timing = functools.partial(_times, run, sizes, evaluations, repeats)
        rows += results.stage(name, definition, timing)
        for row in rows[-len(sizes) :]:
            row |= {"optimizer": name, "kind": kind}
    table = pd.DataFrame(rows)[["optimizer", "kind", "population", "us_a_candidate", "median_us", "evaluations"]]
    results.add_table("overhead", table)
    for row in rows:
        judged = row["optimizer"] in JUDGED
        results.add_figure(
            f"{row['optimizer']}, population {row['population']}",
            row["us_a_candidate"],
            "us/candidate",
            goal=f"at most {GOAL:g}" if judged else "",
            met=bool(row["us_a_candidate"] <= GOAL) if judged else None,
        )
    results.add_text(__doc__ or "")
    results.add_picture("overhead", _picture(table))


def _times(
    run: Callable[[Sphere, int, int], None], sizes: tuple[int, ...], evaluations: int, repeats: int
) -> list[dict[str, Any]]:
    return [_time(run, population, evaluations, repeats) for population in sizes]


def _time(run: Callable[[Sphere, int, int], None], population: int, evaluations: int, repeats: int) -> dict[str, Any]:
    """Microseconds a candidate outside the cost function: shortest and median of the repeats, after a warm-up."""
    run(Sphere(), population, 4 * population)
    found, done = [], 0
    for _ in range(repeats):
        cost = Sphere()
        begun = time.perf_counter()
        run(cost, population, evaluations)
        spent = time.perf_counter() - begun - cost.seconds
        done = cost.candidates
        found.append(1e6 * spent / done)
    return {
        "population": population,
        "us_a_candidate": min(found),
        "median_us": float(np.median(found)),
        "evaluations": done,
    }


def _ours(name: str, checkpoint: bool) -> Callable[[Sphere, int, int], None]:
    def run(cost: Sphere, population: int, evaluations: int) -> None:
        optimizer = make(name, **OURS[name](population))
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "run.checkpoint" if checkpoint else None
            minimise(cost, optimizer, budget=Budget(evaluations), seed=SEED, checkpoint=file)

    return run


def _pyswarms(cost: Sphere, population: int, evaluations: int) -> None:
    swarm = swarm_of_pyswarms(population, np.full(D, -5.0), np.full(D, 5.0))
    swarm.optimize(cost.values, evaluations // population, verbose=False)


def _pymoo(duplicates: bool) -> Callable[[Sphere, int, int], None]:
    def run(cost: Sphere, population: int, evaluations: int) -> None:
        from pymoo.algorithms.soo.nonconvex.ga import GA
        from pymoo.optimize import minimize

        posed = problem_of_pymoo(cost.values, np.full(D, -5.0), np.full(D, 5.0))
        solver = GA(pop_size=population, eliminate_duplicates=duplicates)
        minimize(posed, solver, ("n_gen", evaluations // population), seed=1, verbose=False)

    return run


def _scipy(cost: Sphere, population: int, evaluations: int) -> None:
    from scipy.optimize import Bounds, differential_evolution

    rng = np.random.default_rng(SEED)
    function: Any = lambda columns: cost.values(columns.T)  # noqa: E731
    differential_evolution(
        function,
        Bounds(np.full(D, -5.0), np.full(D, 5.0)),
        init=rng.uniform(-5, 5, (population, D)),
        maxiter=evaluations // population - 1,
        tol=0.0,
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=rng,
    )


def _pycma(cost: Sphere, population: int, evaluations: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import cma

        left = evaluations
        while left >= population:  # it ends when it has converged; then it starts again
            quiet = {"popsize": population, "verbose": -9, "seed": 1, "bounds": [-5.0, 5.0]}
            strategy = cma.CMAEvolutionStrategy(np.full(D, 3.0), 3.0, quiet)
            while not strategy.stop() and left >= population:
                asked = strategy.ask()
                strategy.tell(asked, cost.values(np.asarray(asked)))
                left -= population


def _picture(table: pd.DataFrame) -> Any:
    import matplotlib.pyplot as plt

    largest = table[table.population == table.population.max()].sort_values("us_a_candidate")
    figure, axes = plt.subplots(figsize=(7, 0.35 * len(largest) + 1))
    colours = [COLOURS[0] if kind == "seatruth" else COLOURS[1] for kind in largest.kind]
    axes.barh(largest.optimizer, largest.us_a_candidate, color=colours)
    axes.axvline(GOAL, color=COLOURS[3], linestyle="--", linewidth=1)
    axes.set_xscale("log")
    axes.set_xlabel(f"microseconds a candidate beside the cost, population {int(largest.population.iloc[0])}")
    axes.set_title("Overhead of optimizers (blue: seatruth, orange: peers' own loops; dashed: goal)", fontsize=9)
    axes.invert_yaxis()
    return figure


if __name__ == "__main__":
    # The operators work on small arrays: more threads only make the figures noisier.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.exit(main("optimizer_overhead", (__doc__ or "").splitlines()[0], body, seeds={"runs": SEED}))
