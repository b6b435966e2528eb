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
from seatruth.comparison.problem import Problem, Run, random_stream
from seatruth.comparison.realisation import CostCache, NoisyProblem, RealisationSettings, with_values
from seatruth.comparison.spec import Comparison
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.errors import SeatruthError
from seatruth.models.black_box import BlackBox
from seatruth.optimizers import Budget, Optimizer, minimise
from seatruth.uncertainty.covariance import covariance
from seatruth.uncertainty.cross_validation import rms_errors

_REFERENCE_BUDGET = Budget(evaluations=20_000)
"""Far more than a local fit from the truth needs. Chosen here [S]."""
_AT_BOUND = 1e-6
"""Distance from a bound, over the range, below which a parameter is at the bound. Chosen here [S]."""
_POPULATION = 64
"""Candidates of a population that is simulated by the widest kernels."""
_costs = CostCache()
_unpacked: dict[str, NoisyProblem] = {}


@dataclass(frozen=True)
class PackedProblem:
    """A problem on its way to a worker: packed once, unpacked once in each process.

    Attributes:
        digest: Hash of the data.
        data: The pickled NoisyProblem.
    """

    digest: str
    data: bytes

    @classmethod
    def of(cls, problem: Problem, settings: RealisationSettings, runs: Sequence[Run]) -> PackedProblem:
        """Packs what these runs need.

        Trials are simulated here, once, so that an error in them is raised at once. Kernels are compiled here.
        """
        noisy = NoisyProblem(problem, settings)
        assert len(noisy.clean_trials) + len(noisy.holdout)
        _compile_kernels(noisy, runs)
        data = _pickled(noisy)
        return cls(joblib.hash(data), data)


@dataclass(frozen=True)
class Job:
    """One run with all that it needs. `solver` is None for the reference fit."""

    run: Run
    packed: PackedProblem
    solver: Optimizer | None


@dataclass
class RunResult:
    """The result of a run.

    Attributes:
        run: Which run.
        error: Why it failed; "" if it did not.
        numbers: What the store keeps besides, by column.
        estimates: By parameter value, stderr, lower, upper; of a reference value, truth, crlb, unit.
        history: Three lists of the same length: evaluations, best values, seconds.
    """

    run: Run
    error: str = ""
    numbers: dict[str, Any] = field(default_factory=dict)
    estimates: pd.DataFrame = field(default_factory=pd.DataFrame)
    history: list[list[float]] = field(default_factory=list)


def run_job(job: Job) -> RunResult:
    """Does one run. An exception becomes part of the result: one failed run must not cost the others."""
    try:
        with threadpool_limits(1, "blas"):
            problem = _unpack(job.packed)
            if job.solver is None:
                return _fit_reference(problem, job.run)
            return _search(problem, job.run, job.solver)
    except SeatruthError as error:
        return RunResult(job.run, error.message)
    except Exception as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(frame.filename).name}, line {frame.lineno}, in {frame.name}"
        return RunResult(job.run, f"{type(error).__name__}: {error} ({place})")


def _search(problem: NoisyProblem, run: Run, solver: Optimizer) -> RunResult:
    cost = _costs.get(problem, run)
    cost.values(cost.start[None])  # compiled code is loaded and the cost's own tables are made before the clock starts
    names = ("solver", problem.settings.seed, run.problem, run.noise.describe(), run.seed)
    seed = int(random_stream(*names).generate_state(1)[0])
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
        numbers["open_loop"] = _open_loop_cost(problem, run, cost, outcome.x)
        numbers["held_out"] = _prediction_error(problem, cost, outcome.x)
        table = _intervals(cost, outcome.x)
    numbers["scoring_s"] = time.perf_counter() - begun
    return RunResult(run, error, numbers, table, _history(outcome.history))


def _fit_reference(problem: NoisyProblem, run: Run) -> RunResult:
    """The best local fit from the truth and from the study's own start, and the bounds of this realisation."""
    cost = _costs.get(problem, run)
    starts = {parameter.name: parameter.value for parameter in problem.study.free}
    best: Array | None = None
    value = math.inf
    for values in filter(None, (problem.truth, starts)):
        outcome = minimise(_with_start(cost, values), "least_squares", budget=_REFERENCE_BUDGET, seed=0)
        if outcome.value < value:
            best, value = outcome.x, outcome.value
    free = cost.space.free
    table = pd.DataFrame({"unit": [q.unit for q in free]}, index=pd.Index([q.name for q in free], name="parameter"))
    table["value"] = math.nan if best is None else best[: len(free)]
    table["truth"] = math.nan if problem.truth is None else [problem.truth[q.name] for q in free]
    table["crlb"] = _bounds(problem, run)
    numbers: dict[str, Any] = {
        "value": value,
        "n_data": sum(len(g.rows) for g in cost.residual_blocks if g.kind == "data"),
    }
    numbers["dimension"] = len(cost.parameters)
    if problem.truth is not None:
        numbers["value_at_truth"] = float(cost.values(_candidate(cost, problem.truth)[None])[0])
    return RunResult(run, "" if math.isfinite(value) else "no fit could be evaluated", numbers, table)


def _with_start(cost: StudyCost, values: Mapping[str, float]) -> StudyCost:
    """The cost with another start."""
    return cost_of(cost.problem.replace(parameters=with_values(cost.problem, dict(values))), threads=1)


def _bounds(problem: NoisyProblem, run: Run) -> Array:
    """Cramer-Rao bounds of the free parameters for white noise of the added size; NaN without a truth or a noise.

    They are those of the trajectory (or the formula) whatever cost is fitted: the information in the record, not the
    part of it that a method uses.
    """
    free = problem.study.free
    nothing = np.full(len(free), math.nan)
    if problem.truth is None or run.noise.level == 0:
        return nothing
    cost = _costs.get(problem, run, "formula" if run.cost == "formula" else "trajectory")
    x = _candidate(cost, problem.truth)
    residuals, jacobian = cost.residuals(x), cost.jacobian(x)
    if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
        return nothing
    return np.asarray(covariance(residuals, jacobian, cost.residual_blocks, white=True).crlb[: len(free)])


def _candidate(cost: StudyCost, values: Mapping[str, float]) -> Array:
    """The candidate with these values, nuisances at their start."""
    x = cost.start.copy()
    for k, parameter in enumerate(cost.space.free):
        x[k] = values[parameter.name]
    return x


def _open_loop_cost(problem: NoisyProblem, run: Run, cost: StudyCost, x: Array) -> float:
    """Cost of the trajectory at a regression's answer; NaN for the other kinds of cost."""
    if run.cost != "regression":
        return math.nan
    trajectory = _costs.get(problem, run, "trajectory")
    candidate = _candidate(trajectory, {q.name: float(v) for q, v in zip(cost.space.free, x)})
    return float(trajectory.values(candidate[None])[0])


def _prediction_error(problem: NoisyProblem, cost: StudyCost, x: Array) -> float:
    """Root mean square error over the trials held out, of each output over its range, all outputs together."""
    trials = problem.holdout
    if not len(trials):
        return math.nan
    squares, count = 0.0, 0
    for trial, y in zip(trials, cost.predict(x, list(trials))):
        for name, error in rms_errors(problem.study, trial.outputs, y).items():
            squares += (error / problem.ranges[name]) ** 2 if name in problem.ranges else 0.0
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
            gradient = jacobian.T @ residuals
            below, above = x - low <= _AT_BOUND * width, high - x <= _AT_BOUND * width
        has_width = np.isfinite(width)
        fixed = has_width & ((below & (gradient > 0)) | (above & (gradient < 0)))
        uncertainty = covariance(residuals, jacobian, cost.residual_blocks, fixed)
        stderr, half = uncertainty.stderr[:size], uncertainty.half_width()[:size]
    with np.errstate(invalid="ignore"):
        return table.assign(stderr=stderr, lower=x[:size] - half, upper=x[:size] + half)


def _history(history: pd.DataFrame) -> list[list[float]]:
    """The finite part of the history without rows in which nothing changed; the last one always."""
    history = history[np.isfinite(history["best"])]
    change = history["best"].diff().fillna(1.0).to_numpy() != 0
    if len(change):
        change[-1] = True
    kept = history[change]
    return [kept[name].tolist() for name in ("evaluations", "best", "seconds")]


def jobs_of(comparison: Comparison, runs: list[Run]) -> list[Job]:
    """Jobs in an order in which the runs of an instance follow each other; each problem is packed once."""
    settings = RealisationSettings(comparison.seed, comparison.base_level)
    by_problem: dict[str, list[Run]] = {}
    for run in runs:
        by_problem.setdefault(run.problem, []).append(run)
    packed = {
        name: PackedProblem.of(comparison.problem(name), settings, runs_of_problem)
        for name, runs_of_problem in by_problem.items()
    }
    solvers = comparison.solver
    return [Job(run, packed[run.problem], solvers[run.solver] if run.solver else None) for run in runs]


def _compile_kernels(problem: NoisyProblem, runs: Sequence[Run]) -> None:
    """Compiles all kernels and keeps them on disk, so that the workers load them instead of compiling each their own.

    An error here occurs again in the runs, and is stored with them.
    """
    if isinstance(problem.study.model, BlackBox):
        return
    for run in {run.cost: run for run in runs}.values():
        with suppress(SeatruthError):
            cost = cost_of(problem.realise(run.cost, run.noise, run.seed), threads=1)
            for population in (1, _POPULATION):
                cost.values(np.repeat(cost.start[None], population, axis=0))
            cost.residuals(cost.start)
            cost.jacobian(cost.start)
            cost.predict(cost.start)
            cost.regression()


def _unpack(packed: PackedProblem) -> NoisyProblem:
    if packed.digest not in _unpacked:
        _unpacked[packed.digest] = cloudpickle.loads(packed.data)
    return _unpacked[packed.digest]


def _pickled(problem: NoisyProblem) -> bytes:
    """The problem as bytes. The model of a user's file is included, as no other process knows that file's module."""
    module = sys.modules.get(type(problem.study.model).__module__)
    by_value = module is not None and module.__name__.startswith(("seatruth_user_", "__main__"))
    if by_value:
        cloudpickle.register_pickle_by_value(module)
    try:
        return bytes(cloudpickle.dumps(problem))
    finally:
        if by_value:
            cloudpickle.unregister_pickle_by_value(module)
