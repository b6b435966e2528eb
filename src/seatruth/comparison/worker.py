"""What a worker does: one run, from its realisation to what the store keeps of it."""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
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
from seatruth.comparison.scoring import bounds, candidate, intervals, open_loop_cost, prediction_error
from seatruth.comparison.spec import Comparison
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.errors import SeatruthError
from seatruth.models.black_box import BlackBox
from seatruth.optimizers import Budget, Optimizer, Outcome, Snapshot, minimise
from seatruth.workers import by_value

_REFERENCE_BUDGET = Budget(evaluations=20_000)
"""Far more than a local fit from the truth needs. Chosen here [S]."""
_POPULATIONS = (1, 8, 64)
"""Candidates of populations that are simulated by the kernels of each width, from one alone to the widest."""
_costs = CostCache()
_unpacked: dict[str, NoisyProblem] = {}
_reference_values: dict[str, float] = {}
"""Cost of the reference fit by instance: the runs of an instance follow each other."""
_NEAR = 0.1
"""Part of the smallest target within which a search may end. Chosen here [S]."""
_RESOLUTION = 0.01
"""Relative resolution of the evaluations in a stored history: as fine as scores are compared. Chosen here [S]."""


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
        noisy.simulate()
        _compile_kernels(noisy, runs)
        data = by_value(noisy)
        return cls(joblib.hash(data), data)


@dataclass(frozen=True)
class Job:
    """One search with all that it needs.

    Attributes:
        run: The run with the search's whole budget.
        packed: Its problem.
        solver: None for the reference fit.
        earlier: Runs with smaller budgets, by rising budget: how the search stood then.
        precision: The search ends within this excess of the reference fit; 0 lets it use its budget.
    """

    run: Run
    packed: PackedProblem
    solver: Optimizer | None
    earlier: tuple[Run, ...] = ()
    precision: float = 0.0

    @property
    def runs(self) -> tuple[Run, ...]:
        """All runs that the search gives."""
        return (*self.earlier, self.run)


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


def run_job(job: Job) -> list[RunResult]:
    """Does one search. An exception becomes part of the results: one failed run must not cost the others."""
    try:
        with threadpool_limits(1, "blas"):
            problem = _unpack(job.packed)
            if job.solver is None:
                return [_fit_reference(problem, job.run)]
            return _search(problem, job, job.solver)
    except SeatruthError as error:
        message = error.message
    except Exception as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(frame.filename).name}, line {frame.lineno}, in {frame.name}"
        message = f"{type(error).__name__}: {error} ({place})"
    return [RunResult(run, message) for run in job.runs]


def _search(problem: NoisyProblem, job: Job, solver: Optimizer) -> list[RunResult]:
    """The search, and how it stood at each smaller budget."""
    run = job.run
    cost = _costs.get(problem, run)
    cost.values(cost.start[None])  # compiled code is loaded and the cost's own tables are made before the clock starts
    names = ("solver", problem.settings.seed, run.problem, run.noise.describe(), run.seed)
    seed = int(random_stream(*names).generate_state(1)[0])
    if not cost.noise_known:
        cost.reweight(cost.start)  # weights must not depend on which solver had this cost before
    target = _target(problem, run, job.precision)
    budget = Budget(evaluations=run.budget, target=target if math.isfinite(target) else None)
    outcome = minimise(cost, solver, budget=budget, seed=seed, snapshots=[part.budget for part in job.earlier])
    whole = Snapshot(outcome.evaluations, outcome.x, outcome.value, outcome.wall_s)
    results = []
    for part, stand in zip(job.runs, (*outcome.snapshots, whole)):
        ended = stand.evaluations == outcome.evaluations
        numbers: dict[str, Any] = {
            "code": outcome.code if ended else "budget",
            "reason": outcome.reason if ended else f"its first {part.budget} evaluations",
            "value": stand.value,
            "evaluations": stand.evaluations,
            "diverged": outcome.diverged if ended else None,
            "search_s": stand.seconds,
        }
        error = outcome.reason if outcome.code == "failed" and ended else ""
        if not (error or math.isfinite(stand.value)):
            error = f"none of its first {part.budget} candidates could be evaluated"
        results.append(_scored(problem, cost, part, stand, RunResult(part, error, numbers)))
        results[-1].history = _history(outcome.history, stand)
    return results


def trial_search(job: Job, evaluations: int) -> tuple[int, float, bool]:
    """A short search: the evaluations and the time in s that it took, and whether it ended before its budget."""
    assert job.solver is not None  # a reference fit is no search
    with threadpool_limits(1, "blas"):
        cost = _costs.get(_unpack(job.packed), job.run)
        cost.values(cost.start[None])
        outcome = minimise(cost, job.solver, budget=Budget(evaluations=min(evaluations, job.run.budget)), seed=0)
    return outcome.evaluations, outcome.wall_s, outcome.code not in ("budget", "deadline")


def _scored(problem: NoisyProblem, cost: StudyCost, run: Run, stand: Snapshot, result: RunResult) -> RunResult:
    """The result with estimates and errors of prediction."""
    begun = time.perf_counter()
    if math.isfinite(stand.value):
        result.numbers["open_loop"] = open_loop_cost(_costs, problem, run, cost, stand.x)
        result.numbers["held_out"] = prediction_error(problem, cost, stand.x)
        result.estimates = intervals(cost, stand.x)
    result.numbers["scoring_s"] = time.perf_counter() - begun
    return result


def _target(problem: NoisyProblem, run: Run, precision: float) -> float:
    """The cost at which a search is near enough to the reference fit; -inf where it is to go on."""
    if not precision:
        return -math.inf
    if run.instance not in _reference_values:
        cost = _costs.get(problem, run)
        _reference_values[run.instance] = min((fit.value for fit in _local_fits(problem, cost)), default=math.inf)
    # An excess is twice the difference in cost. A tenth of it stays free for a best fit that is still a little lower.
    value = _reference_values[run.instance] + 0.5 * _NEAR * precision
    return value if math.isfinite(value) else -math.inf


def _local_fits(problem: NoisyProblem, cost: StudyCost) -> Iterator[Outcome]:
    """Local fits from the truth and from the study's own start."""
    starts = {parameter.name: parameter.value for parameter in problem.study.free}
    tried: list[Mapping[str, float]] = []
    for values in filter(None, (problem.truth, starts)):
        if values not in tried:
            tried.append(values)
            yield minimise(_with_start(cost, values), "least_squares", budget=_REFERENCE_BUDGET, seed=0)


def _fit_reference(problem: NoisyProblem, run: Run) -> RunResult:
    """The best local fit from the truth and from the study's own start, and the bounds of this realisation."""
    cost = _costs.get(problem, run)
    best: Array | None = None
    value = math.inf
    for outcome in _local_fits(problem, cost):
        if outcome.value < value:
            best, value = outcome.x, outcome.value
    free = cost.space.free
    table = pd.DataFrame({"unit": [q.unit for q in free]}, index=pd.Index([q.name for q in free], name="parameter"))
    table["value"] = math.nan if best is None else best[: len(free)]
    table["truth"] = math.nan if problem.truth is None else [problem.truth[q.name] for q in free]
    table["crlb"] = bounds(_costs, problem, run)
    numbers: dict[str, Any] = {
        "value": value,
        "n_data": sum(len(g.rows) for g in cost.residual_blocks if g.kind == "data"),
    }
    numbers["dimension"] = len(cost.parameters)
    if problem.truth is not None:
        numbers["value_at_truth"] = float(cost.values(candidate(cost, problem.truth)[None])[0])
    return RunResult(run, "" if math.isfinite(value) else "no fit could be evaluated", numbers, table)


def _with_start(cost: StudyCost, values: Mapping[str, float]) -> StudyCost:
    """The cost with another start."""
    return cost_of(cost.problem.replace(parameters=with_values(cost.problem, dict(values))), threads=1)


def _history(history: pd.DataFrame, stand: Snapshot) -> list[list[float]]:
    """The finite part of the history up to where it stood, without rows in which little changed; that one always.

    Of the rows whose evaluations differ by less than `_RESOLUTION` the last one stays, so that no target is recorded as
    reached before it was.
    """
    before = history[np.isfinite(history["best"]) & (history["evaluations"] < stand.evaluations)]
    rows: Array = before[["evaluations", "best", "seconds"]].to_numpy(dtype=float)
    if math.isfinite(stand.value):
        best = min(stand.value, rows[-1, 1] if len(rows) else math.inf)
        rows = np.vstack([rows, [stand.evaluations, best, stand.seconds]])
    if not len(rows):
        return [[], [], []]
    changed = np.append(True, np.diff(rows[:, 1]) != 0)
    changed[-1] = True
    rows = rows[changed]
    place = np.floor(np.log(rows[:, 0]) / math.log1p(_RESOLUTION))
    rows = rows[np.append(np.diff(place) != 0, True)]
    return [rows[:, 0].astype(int).tolist(), rows[:, 1].tolist(), rows[:, 2].tolist()]


def jobs_of(comparison: Comparison, runs: Sequence[Run]) -> list[Job]:
    """Searches in the order of the runs; those of an instance follow each other, and each problem is packed once."""
    settings = RealisationSettings(comparison.seed, comparison.base_level)
    together: dict[tuple[str, str, int], list[Run]] = {}
    for run in comparison.runs:
        together.setdefault((run.instance, run.solver, run.of), []).append(run)
    by_problem: dict[str, list[Run]] = {}
    for run in runs:
        by_problem.setdefault(run.problem, []).append(run)
    packed = {
        name: PackedProblem.of(comparison.problem(name), settings, runs_of_problem)
        for name, runs_of_problem in by_problem.items()
    }
    jobs: dict[str, Job] = {}
    precision = min(comparison.targets) if comparison.stop == "targets" else 0.0
    for run in runs:
        if not run.solver:
            jobs[run.key] = Job(run, packed[run.problem], None)
            continue
        *earlier, whole = together[run.instance, run.solver, run.of]
        if whole.key not in jobs:
            solver = comparison.solver[run.solver]
            jobs[whole.key] = Job(whole, packed[run.problem], solver, tuple(earlier), precision)
    return list(jobs.values())


def _compile_kernels(problem: NoisyProblem, runs: Sequence[Run]) -> None:
    """Compiles all kernels and keeps them on disk, so that the workers load them instead of compiling each their own.

    An error here occurs again in the runs, and is stored with them.
    """
    if isinstance(problem.study.model, BlackBox):
        return
    for run in {run.cost: run for run in runs}.values():
        with suppress(SeatruthError):
            cost = cost_of(problem.realise(run.cost, run.noise, run.seed), threads=1)
            for population in _POPULATIONS:
                cost.values(np.repeat(cost.start[None], population, axis=0))
            cost.residuals(cost.start)
            cost.jacobian(cost.start)
            cost.predict(cost.start)
            cost.regression()


def _unpack(packed: PackedProblem) -> NoisyProblem:
    if packed.digest not in _unpacked:
        _unpacked[packed.digest] = cloudpickle.loads(packed.data)
    return _unpacked[packed.digest]
