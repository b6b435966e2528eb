"""Runs a comparison: what is missing in its store, by any number of workers, here or on a cluster."""

from __future__ import annotations

import contextlib
import os
import time
from collections import defaultdict
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import joblib
from joblib.externals.loky.process_executor import BrokenProcessPool

from seatruth.comparison.problem import Run
from seatruth.comparison.results import Results
from seatruth.comparison.spec import Comparison
from seatruth.comparison.store import Store
from seatruth.comparison.worker import Job, RunResult, jobs_of, run_job
from seatruth.errors import BadInput, Interrupted, SeatruthError
from seatruth.memory import require_memory
from seatruth.processes import end_with, require_workers, safe_search_path
from seatruth.progress import Progress, ProgressEvent, silent

STORE = "comparison.sqlite"
_WRITE_S = 0.2
"""Longest time in s that a finished run waits to be stored together with others. Chosen here [S]."""
_WORKER_BYTES = 2e8
"""Memory of a worker with its libraries: 0.2 GB measured, on Linux."""
Backend = Literal["loky", "dask"]


def compare(
    comparison: Comparison,
    folder: str | Path,
    *,
    workers: int = 1,
    backend: Backend = "loky",
    fresh: bool = False,
    retry_failed: bool = False,
    part: tuple[int, int] = (1, 1),
    progress: Progress | None = None,
) -> Results:
    """Makes the runs of a comparison that are missing in its store, and returns all its results.

    Whatever ends it, even `kill -9` or a full disk, costs the runs under way only: the same call goes on.

    Args:
        comparison: what is compared.
        folder: gets the store, `comparison.sqlite`; runs that are in it are not made again.
        workers: processes that run at once; they do not change the results.
        backend: "loky" (processes of this machine), or "dask" (the workers of this process's dask client).
        fresh: repeat all runs.
        retry_failed: repeat the runs that failed.
        part: (k, n): only the k-th of n parts of the realisations, so that n machines share the work; see `merge`.
        progress: called with a `ProgressEvent` after every group of runs.

    Returns:
        The results of all runs in the store that belong to the comparison.

    Raises:
        BadInput: another program writes to the store, or one of another version made it.
        Interrupted: the user stopped it; finished runs are kept.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import Comparison, compare
        >>> from seatruth.comparison import Noise, Problem
        >>> study = seatruth.sample.load()
        >>> problems = [Problem("sample", study.replace(trials=study.trials[:1]), start="study")]
        >>> comparison = Comparison(problems, ["cma_es"], [Noise("white", 0.01)], seeds=1, budgets=[30])
        >>> results = compare(comparison, "comparison-result")
        >>> results.runs["evaluations"].tolist()
        [30]
    """
    require_workers(workers)
    if not 1 <= part[0] <= part[1]:
        raise BadInput(f"there is no part {part[0]} of {part[1]}", do="Count the parts from 1.")
    where = Path(folder)
    if where.exists() and not where.is_dir():
        raise BadInput("the folder of the comparison is a file", where=str(where), do="Name a folder.")
    instances = {fit.instance: place for place, fit in enumerate(comparison.references)}
    wanted = [
        run for run in (*comparison.references, *comparison.runs) if instances[run.instance] % part[1] == part[0] - 1
    ]
    hashes = {
        (problem.name, cost): problem.study.content_hash
        for problem in comparison.problems
        for cost in comparison.costs_of(problem)
    }
    with Store(where / STORE) as store:
        if fresh:
            store.clear(run.key for run in wanted)
        known = store.known((run.key for run in wanted), failed=not retry_failed)
        missing = _ordered([run for run in wanted if run.key not in known])
        store.describe(comparison.name, dict(comparison.made_of))
        clock = _Clock(comparison, store, [run for run in missing if run.solver], workers, progress or silent)
        try:
            for results in _in_groups(_results(jobs_of(comparison, missing), workers, backend)):
                store.add(results, hashes)
                clock.tick(results)
        except KeyboardInterrupt:
            raise Interrupted(
                "interrupted; finished runs are kept", do="Run the same command again to go on."
            ) from None
        return Results.of(comparison, store)


def merge(folder: str | Path, others: Sequence[str | Path]) -> int:
    """Copies into the store of a folder what the stores of other folders have more; returns how many runs and fits.

    So that several machines can each make a part of a comparison (`compare(..., part=(1, 2))`). Runs that are done stay
    as they are, failed ones are replaced by done ones, damaged ones are not copied.

    Raises:
        BadInput: a store is missing, damaged, of another version, or the first is being written to.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import Comparison, compare
        >>> from seatruth.comparison import Noise, Problem, merge
        >>> study = seatruth.sample.load()
        >>> problems = [Problem("sample", study.replace(trials=study.trials[:1]), start="study")]
        >>> comparison = Comparison(problems, ["cma_es"], [Noise("white", 0.01)], seeds=2, budgets=[30])
        >>> for number in (1, 2):
        ...     _ = compare(comparison, f"machine-{number}", part=(number, 2))
        >>> merge("machine-1", ["machine-2"])  # a run and its reference
        2
        >>> compare(comparison, "machine-1").left
        0
    """
    with Store(Path(folder) / STORE) as store:
        copied = 0
        for other in others:
            with Store(Path(other) / STORE, write=False) as source:
                copied += store.take_from(source)
        return copied


def standing(comparison: Comparison, folder: str | Path) -> Results:
    """The results so far. Another program may be running the comparison meanwhile."""
    with Store(Path(folder) / STORE, write=False) as store:
        return Results.of(comparison, store)


def _ordered(runs: Sequence[Run]) -> list[Run]:
    """The runs seed by seed, and within a seed the runs of an instance together, its reference first."""
    places: dict[str, int] = {}
    for run in runs:
        places.setdefault(run.instance, len(places))
    return sorted(runs, key=lambda run: (run.seed, places[run.instance], run.budget))


def _results(jobs: list[Job], workers: int, backend: Backend) -> Generator[RunResult, None, None]:
    """The results of the jobs, in any order.

    A run that ends its process (memory, a fault in compiled code) ends the other processes too. The runs that were
    being made are then made one at a time, each in a new process, so that the faulty one is known.
    """
    if backend == "dask":
        _check_dask()
    left = {job.run.key: job for job in jobs}
    while left:
        begun: list[str] = []
        try:
            for done in _parallel(list(left.values()), workers, backend, begun):
                left.pop(done[-1].run.key)
                yield from done
        except Exception as problem:
            if type(problem).__name__ == "KilledWorker":  # dask's own class, which may not be installed
                raise SeatruthError(
                    "one run ended every worker that took it on",
                    where="dask",
                    do="Finished runs are kept. Run the same command without --dask to find that run and continue.",
                ) from None
            if not isinstance(problem, BrokenProcessPool):
                raise
            for key in [key for key in begun if key in left]:
                yield from _run_in_own_process(left.pop(key))


def _parallel(jobs: list[Job], workers: int, backend: Backend, begun: list[str]) -> Iterator[list[RunResult]]:
    def handed_out() -> Iterator[Any]:
        for job in jobs:
            begun.append(job.run.key)
            yield joblib.delayed(run_job)(job)

    options: dict[str, Any] = {"backend": backend}
    if backend == "loky":
        workers = min(workers, len(jobs))
        if workers > 1:
            do = "Ask for fewer workers."
            require_memory(workers * _WORKER_BYTES, f"{workers} workers", where="the comparison", do=do)
        options |= {"n_jobs": workers, "inner_max_num_threads": 1, "initializer": end_with, "initargs": (os.getpid(),)}
    with joblib.parallel_config(**options), safe_search_path():
        yield from joblib.Parallel(return_as="generator_unordered", pre_dispatch="3*n_jobs")(handed_out())


def _run_in_own_process(job: Job) -> list[RunResult]:
    """One job in a new process: if that process ends, this job ended it."""
    from joblib.externals.loky import ProcessPoolExecutor

    with safe_search_path(), ProcessPoolExecutor(1, initializer=end_with, initargs=(os.getpid(),)) as pool:
        try:
            results: list[RunResult] = pool.submit(run_job, job).result()
            return results
        except BrokenProcessPool as problem:
            cause = str(problem).splitlines()[0] if str(problem) else type(problem).__name__
            return [RunResult(run, f"it ended its process: {cause}") for run in job.runs]


def _in_groups(results: Generator[RunResult, None, None]) -> Iterator[list[RunResult]]:
    """Results as they come, those of a moment together, so that one transaction of the disk stores them all."""
    group: list[RunResult] = []
    since = time.monotonic()
    with contextlib.closing(results):
        for done in results:
            group.append(done)
            if time.monotonic() - since >= _WRITE_S:
                yield group
                group, since = [], time.monotonic()
    if group:
        yield group


class _Clock:
    """Counts runs and predicts the remaining time from the mean time of each solver on each problem."""

    def __init__(
        self,
        comparison: Comparison,
        store: Store,
        missing: Sequence[Run],
        workers: int,
        progress: Progress,
    ) -> None:
        self._progress, self._workers = progress, workers
        self._left = {run.key: _kind(run) for run in missing}
        self._total, self._begun = len(comparison.runs), time.monotonic()
        keys = {run.key for run in comparison.runs} - set(self._left)
        self._failed = len(store.known(keys)) - len(store.known(keys, failed=False))
        self._times: dict[Any, list[float]] = defaultdict(list)
        self._show()

    def tick(self, results: Sequence[RunResult]) -> None:
        for result in results:
            if not result.run.solver:
                continue
            self._left.pop(result.run.key, None)
            self._failed += bool(result.error)
            spent = result.numbers.get("search_s", 0.0) + result.numbers.get("scoring_s", 0.0)
            if result.run.of == result.run.budget:
                self._times[_kind(result.run)].append(spent)
        self._show()

    def _show(self) -> None:
        self._progress(
            ProgressEvent(
                "Comparison",
                done=self._total - len(self._left),
                total=self._total,
                unit="runs",
                elapsed_s=time.monotonic() - self._begun,
                remaining_s=self._seconds(),
                message=f"{self._failed} failed" if self._failed else "",
            )
        )

    def _seconds(self) -> float | None:
        if not self._times:
            return None
        means = {kind: sum(times) / len(times) for kind, times in self._times.items()}
        usual = sum(means.values()) / len(means)
        # A search takes the time of its largest budget; its smaller ones are included.
        return sum(means.get(kind, usual) for kind in self._left.values() if kind.whole) / self._workers


class _Kind(NamedTuple):
    """Runs that take about as long."""

    problem: str
    cost: str
    solver: str
    budget: int
    whole: bool


def _kind(run: Run) -> _Kind:
    return _Kind(run.problem, run.cost, run.solver, run.budget, run.of == run.budget)


def _check_dask() -> None:
    try:
        from distributed import get_client
    except ImportError:
        raise BadInput(
            "the dask backend is not installed", where="backend", do="pip install 'seatruth[dask]'."
        ) from None
    try:
        get_client()
    except ValueError:
        raise BadInput(
            "there is no dask client", where="backend", do='Make one first: Client("tcp://scheduler:8786").'
        ) from None
