"""Study + Optimizer -> Estimate."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from threadpoolctl import threadpool_limits

from seatruth.analysis import Analysis, part_missing
from seatruth.costs.formula import FormulaCost
from seatruth.costs.study import Group, ParameterSpace, Study, StudyCost, cost_of
from seatruth.errors import BadInput, SeatruthError, nearest
from seatruth.estimate import Estimate
from seatruth.optimizers import Budget, Optimizer, Outcome, minimise
from seatruth.optimizers.evaluator import Progress
from seatruth.storage.checkpoint import Checkpoint, jobs_file
from seatruth.trials.finding import Finding
from seatruth.uncertainty import leave_one_out, profiles
from seatruth.uncertainty.cross_validation import pool_parts, split_rows

__all__ = ["Estimate", "Group", "ParameterSpace", "Study", "StudyCost", "cost_of", "identify"]

_INTERRUPTED = "stopped by the user"


def identify(
    study: Study,
    optimizer: str | Optimizer | Sequence[str | Optimizer] = "least_squares",
    *,
    budget: Budget | None = None,
    seed: int = 0,
    checkpoint: str | Path | None = None,
    progress: Progress | None = None,
    cross_validate: bool = False,
    profile: Sequence[str] = (),
    threads: int | None = None,
    workers: int = 1,
) -> Estimate:
    """Identifies the free parameters of a study.

    `optimizer` is a name, an Optimizer, or a list of them for a hybrid; `budget` and `seed` are the search's.
    `checkpoint` names a file in which the search is kept (and beside it, with the ending .jobs, the profile and the
    trials left out): the same call goes on where an interrupted one stopped and ends with the same estimate. Both
    files stay, so that an estimate that could not be saved is soon made again; remove them when it is.
    `profile` names free parameters whose likelihood is profiled; `cross_validate` leaves each trial out in turn.
    `threads` are those of a simulation (all processors where None), `workers` how many profile points or left-out
    trials run at once; neither changes the result.

    An interrupt (Ctrl-C) at any time gives the best so far with the outcome's code "interrupted"; what it had no time
    for is missing. Raises BadInput for what cannot be started.
    """
    free = [parameter.name for parameter in study.free]
    if not free:
        raise BadInput("no parameter varies", where=f"study {study.name!r}", do="Set `vary = true` for one or more.")
    for name in profile:
        if name not in free:
            raise BadInput(f"{name!r} is no free parameter, so it has no profile", do=nearest(name, free))
    if workers < 1:
        raise BadInput(f"{workers} workers are not possible", do="Ask for 1 or more.")
    if cross_validate and len(study.trials) < 2 and study.cost != "formula":
        raise BadInput("leaving trials out needs at least two to fit", do="Add a trial or leave cross_validate out.")
    # One thread for linear algebra: its matrices are small, and more would change the last digits of the result.
    with threadpool_limits(limits=1, user_api="blas"):
        cost = cost_of(study, threads=threads)
        if isinstance(cost, FormulaCost):
            cost.require_values()
        outcome = minimise(cost, optimizer, budget=budget, seed=seed, checkpoint=checkpoint, progress=progress)
        return _judged(study, cost, outcome, checkpoint, _speaker(progress), cross_validate, profile, threads, workers)


def _judged(
    study: Study,
    cost: StudyCost,
    outcome: Outcome,
    checkpoint: str | Path | None,
    say: Callable[[str], None],
    cross_validate: bool,
    profile: Sequence[str],
    threads: int | None,
    workers: int,
) -> Estimate:
    """Everything after the search."""
    say("Uncertainty")
    analysis = Analysis(study, cost, outcome)
    try:
        analysis.run()
    except KeyboardInterrupt:
        return analysis.estimate(interrupted=_INTERRUPTED)
    usable = math.isfinite(outcome.value)
    if outcome.code == "interrupted" or not usable:
        return analysis.estimate()
    estimate = analysis.estimate()
    jobs = _finished_jobs(study, outcome, checkpoint, estimate)
    try:
        if profile:
            try:
                estimate.profile = profiles(
                    study,
                    profile,
                    outcome.x,
                    analysis.stderr,
                    checkpoint=jobs,
                    say=say,
                    threads=threads,
                    workers=workers,
                )
            except SeatruthError as problem:
                estimate.findings.append(part_missing("The profile", problem))
        if cross_validate:
            values = _values(cost, outcome)
            try:
                by_row = study.cost == "formula" and len(study.trials) == 1
                parts = split_rows(study) if by_row else study
                left = leave_one_out(parts, values, checkpoint=jobs, say=say, threads=threads, workers=workers)
                if by_row:
                    left = pool_parts(left, parts, study.trials[0].name)
                estimate.cross_validation = _beside_fit(left, estimate.fit)
            except SeatruthError as problem:
                estimate.findings.append(part_missing("The prediction of trials left out", problem))
    except KeyboardInterrupt:
        estimate.outcome |= {"code": "interrupted", "reason": f"{_INTERRUPTED} after the search had ended"}
    finally:
        jobs.close()
    if jobs.write_error:
        estimate.findings.append(_checkpoint_finding(jobs.write_error))
    return estimate


def _finished_jobs(study: Study, outcome: Outcome, checkpoint: str | Path | None, estimate: Estimate) -> Checkpoint:
    """The jobs that an earlier call has finished. A file that cannot be used costs the checkpoint, not the answer."""
    work = f"{study.content_hash} {outcome.x.tobytes().hex()}"
    if checkpoint is None:
        return Checkpoint(None, work)
    try:
        return Checkpoint(jobs_file(checkpoint), work, drop_other_work=True)
    except SeatruthError as problem:
        estimate.findings.append(_checkpoint_finding(problem.message))
        return Checkpoint(None, work)


def _checkpoint_finding(message: str) -> Finding:
    return Finding("warning", "checkpoint", message, "search")


def _values(cost: StudyCost, outcome: Outcome) -> dict[str, float]:
    return {parameter.name: float(value) for parameter, value in zip(cost.space.free, outcome.x)}


def _beside_fit(left: pd.DataFrame, fit: pd.DataFrame) -> pd.DataFrame:
    """Errors of prediction beside those of the fit, and the noise."""
    fitted = fit.loc[~fit["held_out"].astype(bool), ["trial", "channel", "rmse", "noise"]]
    own = fitted.rename(columns={"rmse": "rmse_fitted"})
    return left.merge(own, on=["trial", "channel"], how="left")


def _speaker(progress: Progress | None) -> Callable[[str], None]:
    """Says which stage is under way, where the progress display can."""
    show: Any = getattr(progress, "show", None)
    if not callable(show):
        return lambda text: None

    def say(text: str) -> None:
        show(text, now=False)

    return say
