"""Speed of the comparison runner: its overhead, its workers, and the same comparison written naively.

* Overhead: runs of one second each (they sleep, so that a busy machine does not matter); what the comparison takes
  beyond the runs' own time (search and scoring), workers started before the clock.
* Workers: the same with 4 workers; and runs that compute, whose gain needs 4 free cores.
* Naive: part of the standard comparison (four published systems [synthetic], 1 % noise, one realisation, 3 solvers)
  against what is written by hand: pyswarms, pymoo's GA and SciPy's least_squares on a cost that calls
  scipy.integrate.solve_ivp for each candidate, one process. Naive runs are made in part and scaled by evaluations;
  times are processor times, so that the load of the machine does not count. A step of solve_ivp is at most a sample, as
  the inputs change from sample to sample.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import standard_comparison_systems as systems
from common import COLOURS, Options, Results, main
from numpy.typing import NDArray
from peers import problem_of_pymoo, swarm_of_pyswarms
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from seatruth import Study
from seatruth.comparison import Comparison, Noise, Problem, compare
from seatruth.comparison.realisation import NoisyProblem, RealisationSettings
from seatruth.costs import cost_of
from seatruth.manoeuvres import Stepper
from seatruth.optimizers import from_callable

Array = NDArray[np.float64]
SEED, LEVEL, BUDGET = 20260401, 0.01, 2000
GOAL_OVERHEAD, GOAL_WORKERS, GOAL_NAIVE = 2.0, 3.5, 500.0
SWARM = 50
NAIVE_RTOL, NAIVE_ATOL = 1e-7, 1e-10
SYSTEMS = ("xu2012", "chen2011", "zhao2018", "sun2019")


def nap(seconds: float) -> Callable[[Any, np.random.Generator], str]:
    def sleep(problem: Any, rng: np.random.Generator) -> str:
        problem.values(problem.sample(rng, 20))
        time.sleep(seconds)
        return "slept"

    return sleep


def toil(candidates: int) -> Callable[[Any, np.random.Generator], str]:
    def work(problem: Any, rng: np.random.Generator) -> str:
        for _ in range(candidates // SWARM):
            problem.values(problem.sample(rng, SWARM))
        return "done"

    return work


def body(options: Options, results: Results) -> None:
    quick = options.quick
    results.expect(3)
    results.add_text(__doc__ or "")
    overhead: dict[str, Any] = {"seconds": 0.2 if quick else 1.0, "runs": 5 if quick else 40, "workers": 4}
    _report_overhead(results, results.stage("overhead", overhead, lambda: _overhead(**overhead)), overhead)
    gain: dict[str, Any] = {"candidates": 10_000 if quick else 50_000, "runs": 8 if quick else 80, "workers": 4}
    _report_gain(results, results.stage("workers", gain, lambda: _gain(**gain)))
    naive: dict[str, Any] = {"names": SYSTEMS[:1] if quick else SYSTEMS, "budget": 200 if quick else BUDGET}
    naive |= {"generations": 1, "fit": not quick}
    _report_naive(results, results.stage("naive", naive, lambda: _naive(**naive)))


def _timed(solver: Any, runs: int, workers: int, problem: Problem) -> dict[str, float]:
    """Of a comparison: wall time, its runs' own time, and the processor time of the runner's process."""
    made = Comparison([problem], {"it": from_callable(solver)}, [Noise("white", LEVEL)], runs, (10**9,), seed=SEED)
    warm = Comparison([problem], {"it": from_callable(nap(0.3))}, [Noise("white", LEVEL)], 3 * workers, (10**9,))
    with tempfile.TemporaryDirectory() as folder:
        compare(warm, Path(folder) / "warm", workers=workers)  # workers start and load; joblib keeps them
        # References and kernels first, so that what is timed is nothing but runs.
        compare(Comparison([problem], {"it": from_callable(nap(0.0))}, made.noise, runs, (10**9,), seed=SEED), folder)
        begun, processor = time.perf_counter(), time.process_time()
        done = compare(made, folder, workers=workers)
        wall, processor = time.perf_counter() - begun, time.process_time() - processor
    return {"wall": wall, "processor": processor, "own": float((done.runs["search_s"] + done.runs["scoring_s"]).sum())}


def _overhead(*, seconds: float, runs: int, workers: int) -> dict[str, Any]:
    problem = systems.planing()
    found = {"one": _timed(nap(seconds), runs, 1, problem), "load": os.getloadavg()[0]}
    return found | {"all": _timed(nap(seconds), runs * workers, workers, problem)}


def _report_overhead(results: Results, found: Mapping[str, Any], setting: Mapping[str, Any]) -> None:
    workers, long = int(setting["workers"]), setting["seconds"] >= 1.0
    busy = found["load"] > workers
    for name, used in (("one", 1), ("all", workers)):
        runs = f"{setting['runs'] * used} runs of {setting['seconds']:g} s" + ("" if long else "; too short to judge")
        # The runs sleep, so that nearly all the processor time is the runner's (and the scoring's) own.
        share = 100.0 * found[name]["processor"] / found[name]["own"]
        goal: dict[str, Any] = {"goal": f"at most {GOAL_OVERHEAD:g} at 1 s a run"}
        results.add_figure(
            f"overhead, {used} worker{'s' if used > 1 else ''}, processor time of the runner",
            share,
            "% of the runs' own time",
            runs,
            **goal,
            met=bool(share <= GOAL_OVERHEAD) if long else None,
        )
        beyond = 100.0 * (found[name]["wall"] * used / found[name]["own"] - 1.0)
        results.add_figure(
            f"overhead, {used} worker{'s' if used > 1 else ''}, wall time",
            beyond,
            "% of the runs' own time",
            f"load of the machine {found['load']:.1f}" + (": the runner had to wait, so not judged" if busy else ""),
            **goal,
            met=bool(beyond <= GOAL_OVERHEAD) if long and not busy else None,
        )
    gain = workers * found["one"]["wall"] / found["all"]["wall"]
    results.add_figure(
        f"{workers} workers over one, runs that sleep",
        gain,
        "times",
        "what handing out the runs leaves",
        goal=f"at least {GOAL_WORKERS:g}",
        met=bool(gain >= GOAL_WORKERS),
    )


def _gain(*, candidates: int, runs: int, workers: int) -> dict[str, Any]:
    problem = systems.diving_plane()
    one = _timed(toil(candidates), runs, 1, problem)
    many = _timed(toil(candidates), runs, workers, problem)
    return {"one": one["wall"], "many": many["wall"], "workers": workers, "load": os.getloadavg()[0]}


def _report_gain(results: Results, found: Mapping[str, float]) -> None:
    gain, busy = found["one"] / found["many"], found["load"] > found["workers"] + 1.5
    name = f"{found['workers']:g} workers over one, runs that compute"
    results.add_figure(
        name,
        gain,
        "times",
        f"load of the machine {found['load']:.1f}" + (": others were computing too, so not judged" if busy else ""),
        goal=f"at least {GOAL_WORKERS:g} on 4 free cores",
        met=None if busy else bool(gain >= GOAL_WORKERS),
    )


class Naive:
    """The cost as it is written by hand: one solve_ivp a candidate, in Python. Counts and times its evaluations."""

    def __init__(self, study: Study) -> None:
        self.study, self.free = study, [q.name for q in study.free]
        self.evaluations, self.seconds = 0, 0.0

    def residuals(self, x: Array) -> Array:
        """Errors over noise of all outputs of all trials."""
        begun = time.process_time()
        stepper = Stepper(self.study.model, dict(zip(self.free, np.asarray(x, dtype=float).tolist())))
        parts = [self._errors(stepper, trial) for trial in self.study.trials]
        self.evaluations += 1
        self.seconds += time.process_time() - begun
        return np.concatenate(parts)

    def values(self, X: Array) -> Array:
        """Cost of each row."""
        return np.array([0.5 * float(np.sum(self.residuals(x) ** 2)) for x in X])

    def _errors(self, stepper: Stepper, trial: Any) -> Array:
        model = self.study.model
        names = [channel.name for channel in model.states]

        def inputs(t: float) -> dict[str, float]:
            return {name: float(np.interp(t, trial.t, u)) for name, u in trial.inputs.items()}

        def rate(t: float, state: Array) -> Array:
            return np.array(stepper.rate(t, tuple(state.tolist()), inputs(t)))

        y = {name: float(trial.outputs[name][0]) for name in (c.name for c in model.outputs)}
        first = model.first_state(y, inputs(trial.t[0]), {})
        step = float(np.diff(trial.t).max())
        found = solve_ivp(
            rate, (trial.t[0], trial.t[-1]), first, t_eval=trial.t, rtol=NAIVE_RTOL, atol=NAIVE_ATOL, max_step=step
        )
        if found.y.shape[1] < len(trial.t):
            return np.full(len(trial.t) * len(names), 1e3)
        # Every output of these models is a state; the first sample is the start.
        sd: Any = self.study.noise
        return np.concatenate(
            [(trial.outputs[c.name] - found.y[names.index(c.name)]) / float(sd[c.name]) for c in model.outputs]
        )


def _naive(*, names: tuple[str, ...], budget: int, generations: int, fit: bool) -> list[dict[str, Any]]:
    rows = []
    for name in names:
        problem = systems.SYNTHETIC[name]()
        problem = Problem(problem.name, problem.study.replace(holdout=[]), problem.truth)
        study = NoisyProblem(problem, RealisationSettings(SEED, LEVEL)).realise("trajectory", Noise("white", LEVEL), 0)
        cost, naive = cost_of(study, threads=1), Naive(study)
        low, high = cost.bounds
        assert problem.truth is not None
        truth = np.array([problem.truth[q] for q in cost.names])
        some = truth + 0.02 * np.random.default_rng(SEED).standard_normal((3, truth.size)) * np.abs(truth)
        ours, theirs = cost.values(some), naive.values(some)
        row: dict[str, Any] = {
            "system": problem.name,
            "largest difference of costs": float(np.abs(theirs / ours - 1).max()),
        }
        row |= _theirs(naive, low, high, study, generations)
        row |= _ours(problem, budget)
        if fit and name == names[0]:
            # The usual step of finite differences (1e-8) is below the error of solve_ivp: the fit then ends anywhere.
            x = least_squares(
                naive.residuals,
                truth,
                x_scale=np.abs(truth),
                bounds=(low, high),
                diff_step=np.full(truth.size, 1e-3),
                max_nfev=12,
            ).x
            from seatruth.optimizers import minimise

            best = minimise(cost, "least_squares").x
            sd = np.abs(best) * 1e-12 + np.sqrt(np.diag(np.linalg.inv(cost.jacobian(best).T @ cost.jacobian(best))))
            row["estimates apart, standard errors"] = float(np.abs((x - best) / sd).max())
        row["naive seconds an evaluation"] = naive.seconds / naive.evaluations
        rows.append(row)
    return rows


def _theirs(naive: Naive, low: Array, high: Array, study: Study, generations: int) -> dict[str, float]:
    """Some generations of a swarm and of a genetic algorithm from libraries: processor seconds an evaluation."""
    begun, before = time.process_time(), naive.evaluations
    swarm_of_pyswarms(SWARM // 5, low, high).optimize(naive.values, generations, verbose=False)

    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.optimize import minimize

    posed = problem_of_pymoo(naive.values, low, high)
    minimize(posed, GA(pop_size=SWARM // 5), ("n_gen", generations), seed=1, verbose=False)
    count = naive.evaluations - before
    return {"naive evaluations": count, "naive seconds": time.process_time() - begun}


def _ours(problem: Problem, budget: int) -> dict[str, float]:
    """The same solvers in seatruth, whole: processor seconds of the comparison with all it does, and evaluations."""
    solvers = ["particle_swarm", "genetic", "least_squares"]
    made = Comparison([problem], solvers, [Noise("white", LEVEL)], 1, (budget,), seed=SEED)
    with tempfile.TemporaryDirectory() as folder:
        compare(Comparison([problem], solvers, made.noise, 1, (50,), seed=SEED), Path(folder) / "warm")
        begun = time.process_time()
        done = compare(made, folder, workers=1)
        spent = time.process_time() - begun
    return {"seatruth evaluations": float(done.runs["evaluations"].sum()), "seatruth seconds": spent}


def _report_naive(results: Results, rows: list[dict[str, Any]]) -> None:
    table = pd.DataFrame(rows)
    scaled = table["naive seconds"] / table["naive evaluations"] * table["seatruth evaluations"]
    table["naive seconds for as many evaluations"] = scaled
    table["times faster, one core"] = scaled / table["seatruth seconds"]
    results.add_table("naive", table.set_index("system"))
    whole = float(scaled.sum() / table["seatruth seconds"].sum())
    results.add_figure(
        "naive comparison over seatruth's, one core each",
        whole,
        "times",
        f"{len(table)} systems, scaled by evaluations; references, scoring and the store are in seatruth's time",
        goal=f"{GOAL_NAIVE:g}, whole comparison",
        met=bool(whole >= GOAL_NAIVE) if len(table) == len(SYSTEMS) else None,
    )
    apart = float(table["largest difference of costs"].max())
    results.add_figure("costs apart, naive and seatruth", apart, "relative", "the same candidates near the truth")
    if "estimates apart, standard errors" in table:
        worst = float(table["estimates apart, standard errors"].max())
        results.add_figure(
            "estimates apart, naive and seatruth",
            worst,
            "standard errors",
            "local fits of the same records, largest of all parameters",
            goal="below 0.1: equal results",
            met=worst < 0.1,
        )
    results.add_picture("naive", _picture(table))


def _picture(table: pd.DataFrame) -> Any:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 0.55 * len(table) + 1.2))
    y = np.arange(len(table))
    naive = 1e3 * table["naive seconds"] / table["naive evaluations"]
    ours = 1e3 * table["seatruth seconds"] / table["seatruth evaluations"]
    axes.barh(y - 0.2, naive, 0.38, color=COLOURS[1], label="naive: pyswarms, pymoo, solve_ivp")
    axes.barh(y + 0.2, ours, 0.38, color=COLOURS[0], label="seatruth, all it does counted")
    for k in range(len(table)):
        axes.annotate(f"{naive.iloc[k] / ours.iloc[k]:.0f} times", (naive.iloc[k], k - 0.2), (4, 0),
                      textcoords="offset points", va="center", fontsize=8)  # fmt: skip
    axes.set_xscale("log")
    axes.set_xlim(right=8 * float(naive.max()))
    axes.set_yticks(y, labels=list(table["system"]))
    axes.invert_yaxis()
    axes.set_xlabel("processor time an evaluation (ms)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=8, frameon=False)
    return figure


if __name__ == "__main__":
    sys.exit(main("comparison_speed", str(__doc__).splitlines()[0], body, seeds={"runs": SEED}))
