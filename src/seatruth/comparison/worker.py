"""What a worker does: one run, from its realisation to what the store keeps of it."""

from __future__ import annotations

import math
import sys
import time
import traceback
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cloudpickle
import joblib
import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from seatruth.arrays import Array
from seatruth.comparison.realisation import Bench, Costs, Setting, with_values
from seatruth.comparison.spec import Comparison, Problem, Run, stream
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.errors import SeatruthError
from seatruth.models.blackbox import BlackBox
from seatruth.optimizers import Budget, Optimizer, minimise
from seatruth.uncertainty.covariance import covariance
from seatruth.uncertainty.cross_validation import rms_errors

_REFERENCE = Budget(evaluations=20_000)
_AT_BOUND = 1e-6
_WIDE = 64
"""Candidates of a population that is simulated by the widest kernels."""
_costs = Costs()
_benches: dict[str, Bench] = {}


@dataclass(frozen=True)
class Parcel:
    """A problem on its way to a worker: packed once, unpacked once in each process."""

    digest: str
    packed: bytes

    @classmethod
    def of(cls, problem: Problem, setting: Setting, runs: Sequence[Run]) -> Parcel:
        """Packs what these runs need. Trials are simulated here, once, so that what is wrong is said at once."""
        bench = Bench(problem, setting)
        assert len(bench.clean) + len(bench.held_out)
        _compile(bench, runs)
        packed = _packed(bench)
        return cls(joblib.hash(packed), packed)


@dataclass(frozen=True)
class Job:
    """One run with all that it needs."""

    run: Run
    parcel: Parcel
    solver: Optimizer | None


@dataclass
class Done:
    """What became of a run. `error` is "" unless it failed."""

    run: Run
    error: str = ""
    numbers: dict[str, Any] = field(default_factory=dict)
    estimates: pd.DataFrame = field(default_factory=pd.DataFrame)
    """By parameter: value, stderr, lower, upper; of a reference: value, truth, crlb, unit."""
    history: list[list[float]] = field(default_factory=list)
    """Evaluations, best values, seconds: three lists of the same length."""


def work(job: Job) -> Done:
    """Does one run. What it raises becomes part of the result: one failed run is no reason to lose the others."""
    try:
        with threadpool_limits(1, "blas"):
            bench = _bench(job.parcel)
            return _search(bench, job.run, job.solver) if job.solver is not None else _reference(bench, job.run)
    except SeatruthError as problem:
        return Done(job.run, problem.message)
    except Exception as problem:
        frame = traceback.extract_tb(problem.__traceback__)[-1]
        place = f"{Path(frame.filename).name}, line {frame.lineno}, in {frame.name}"
        return Done(job.run, f"{type(problem).__name__}: {problem} ({place})")


def _search(bench: Bench, run: Run, solver: Optimizer | None) -> Done:
    assert solver is not None
    cost = _costs.of(bench, run)
    cost.values(cost.start[None])  # compiled code is loaded and the cost's own tables are made before the clock starts
    seed = int(stream("solver", bench.setting.seed, run.problem, run.noise.describe(), run.seed).generate_state(1)[0])
    if not cost.noise_known:
        cost.reweight(cost.start)  # weights must not depend on which solver had this cost before
    outcome = minimise(cost, solver, budget=Budget(evaluations=run.budget), seed=seed)
    begun = time.perf_counter()
    numbers: dict[str, Any] = {
        "code": outcome.code,
        "reason": outcome.reason,
        "value": outcome.value,
        "evaluations": outcome.evaluations,
        "diverged": outcome.diverged,
        "search_s": outcome.wall_s,
    }
    error = outcome.reason if outcome.code == "failed" else ""
    table = pd.DataFrame()
    if math.isfinite(outcome.value):
        numbers["open_loop"] = _open_loop(bench, run, cost, outcome.x)
        numbers["held_out"] = _prediction(bench, cost, outcome.x)
        table = _intervals(cost, outcome.x)
    numbers["scoring_s"] = time.perf_counter() - begun
    return Done(run, error, numbers, table, _steps(outcome.history))


def _reference(bench: Bench, run: Run) -> Done:
    """The best local fit from the truth and from the study's own start, and the bounds of this realisation."""
    cost = _costs.of(bench, run)
    starts = {parameter.name: parameter.value for parameter in bench.study.free}
    best: Array | None = None
    value = math.inf
    for values in filter(None, (bench.truth, starts)):
        outcome = minimise(_moved(bench, run, cost, values), "least_squares", budget=_REFERENCE, seed=0)
        if outcome.value < value:
            best, value = outcome.x, outcome.value
    free = cost.space.free
    table = pd.DataFrame({"unit": [q.unit for q in free]}, index=pd.Index([q.name for q in free], name="parameter"))
    table["value"] = math.nan if best is None else best[: len(free)]
    table["truth"] = math.nan if bench.truth is None else [bench.truth[q.name] for q in free]
    table["crlb"] = _bounds(bench, run)
    numbers: dict[str, Any] = {
        "value": value,
        "n_data": sum(len(g.rows) for g in cost.residual_blocks if g.kind == "data"),
    }
    numbers["dimension"] = len(cost.parameters)
    if bench.truth is not None:
        numbers["value_at_truth"] = float(cost.values(_x(cost, bench.truth)[None])[0])
    return Done(run, "" if math.isfinite(value) else "no fit could be evaluated", numbers, table)


def _moved(bench: Bench, run: Run, cost: StudyCost, values: Mapping[str, float]) -> StudyCost:
    """The cost with another start."""
    return cost_of(cost.problem.replace(parameters=with_values(cost.problem, dict(values))), threads=1)


def _bounds(bench: Bench, run: Run) -> Array:
    """Cramer-Rao bounds of the free parameters for white noise of the added size; NaN without a truth or a noise.

    They are those of the trajectory (or the formula) whatever cost is fitted: what the record holds, not what a method
    takes from it.
    """
    free = bench.study.free
    nothing = np.full(len(free), math.nan)
    if bench.truth is None or run.noise.level == 0:
        return nothing
    cost = _costs.of(bench, run, "formula" if run.cost == "formula" else "trajectory")
    x = _x(cost, bench.truth)
    residuals, jacobian = cost.residuals(x), cost.jacobian(x)
    if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
        return nothing
    return np.asarray(covariance(residuals, jacobian, cost.residual_blocks, white=True).crlb[: len(free)])


def _x(cost: StudyCost, values: Mapping[str, float]) -> Array:
    """The candidate with these values, nuisances at their start."""
    x = cost.start.copy()
    for k, parameter in enumerate(cost.space.free):
        x[k] = values[parameter.name]
    return x


def _open_loop(bench: Bench, run: Run, cost: StudyCost, x: Array) -> float:
    """Cost of the trajectory at a regression's answer; that of the run itself otherwise."""
    if run.cost != "regression":
        return math.nan
    other = _costs.of(bench, run, "trajectory")
    candidate = _x(other, {q.name: float(v) for q, v in zip(cost.space.free, x)})
    return float(other.values(candidate[None])[0])


def _prediction(bench: Bench, cost: StudyCost, x: Array) -> float:
    """Root mean square error over the trials held out, of each output over its range, all outputs together."""
    held = bench.held_out
    if not len(held):
        return math.nan
    squares, count = 0.0, 0
    for trial, y in zip(held, cost.predict(x, list(held))):
        for name, error in rms_errors(bench.study, trial.outputs, y).items():
            squares += (error / bench.ranges[name]) ** 2 if name in bench.ranges else 0.0
            count += 1
    return math.sqrt(squares / count) if count and math.isfinite(squares) else math.inf if count else math.nan


def _intervals(cost: StudyCost, x: Array) -> pd.DataFrame:
    """The free parameters with standard errors and 95 % intervals, NaN where there are none."""
    free = cost.space.free
    size = len(free)
    table = pd.DataFrame({"value": x[:size]}, index=pd.Index([q.name for q in free], name="parameter"))
    if not cost.noise_known:
        cost.reweight(x)
    residuals, jacobian = cost.residuals(x), cost.jacobian(x)
    stderr, half = np.full(size, math.nan), np.full(size, math.nan)
    if np.isfinite(residuals).all() and np.isfinite(jacobian).all():
        low, high = cost.bounds
        with np.errstate(invalid="ignore"):
            width = np.where(np.isfinite(high - low), high - low, np.inf)
            slope = jacobian.T @ residuals
            below, above = x - low <= _AT_BOUND * width, high - x <= _AT_BOUND * width
        width_known = np.isfinite(width)
        held = width_known & ((below & (slope > 0)) | (above & (slope < 0)))
        found = covariance(residuals, jacobian, cost.residual_blocks, held)
        stderr, half = found.stderr[:size], found.half_width()[:size]
    with np.errstate(invalid="ignore"):
        return table.assign(stderr=stderr, lower=x[:size] - half, upper=x[:size] + half)


def _steps(history: pd.DataFrame) -> list[list[float]]:
    """The finite part of the history without rows in which nothing changed; the last one always."""
    history = history[np.isfinite(history["best"])]
    change = history["best"].diff().fillna(1.0).to_numpy() != 0
    if len(change):
        change[-1] = True
    kept = history[change]
    return [kept[name].tolist() for name in ("evaluations", "best", "seconds")]


def jobs_of(comparison: Comparison, runs: list[Run]) -> list[Job]:
    """Jobs in an order in which the runs of an instance follow each other; each problem is packed once."""
    setting = Setting(comparison.seed, comparison.base_level)
    of: dict[str, list[Run]] = {}
    for run in runs:
        of.setdefault(run.problem, []).append(run)
    parcels = {name: Parcel.of(comparison.problem(name), setting, own) for name, own in of.items()}
    solvers = comparison.solver
    return [Job(run, parcels[run.problem], solvers[run.solver] if run.solver else None) for run in runs]


def _compile(bench: Bench, runs: Sequence[Run]) -> None:
    """Has all kernels made and kept on disk, where the workers find them, instead of each making its own.

    What goes wrong here goes wrong again in the runs, and is kept with them.
    """
    if isinstance(bench.study.model, BlackBox):
        return
    for run in {run.cost: run for run in runs}.values():
        with suppress(SeatruthError):
            cost = cost_of(bench.realised(run.cost, run.noise, run.seed), threads=1)
            for population in (1, _WIDE):
                cost.values(np.repeat(cost.start[None], population, axis=0))
            cost.residuals(cost.start)
            cost.jacobian(cost.start)
            cost.predict(cost.start)
            cost.regression()


def _bench(parcel: Parcel) -> Bench:
    if parcel.digest not in _benches:
        _benches[parcel.digest] = cloudpickle.loads(parcel.packed)
    return _benches[parcel.digest]


def _packed(bench: Bench) -> bytes:
    """The bench as bytes; the model of a user's file goes with it, as no other process knows that file's module."""
    module = sys.modules.get(type(bench.study.model).__module__)
    by_value = module is not None and module.__name__.startswith(("seatruth_user_", "__main__"))
    if by_value:
        cloudpickle.register_pickle_by_value(module)
    try:
        return bytes(cloudpickle.dumps(bench))
    finally:
        if by_value:
            cloudpickle.unregister_pickle_by_value(module)
