"""Study -> Estimate."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from seatruth.analysis import Analysis, part_missing
from seatruth.arrays import Array
from seatruth.costs.formula import FormulaCost
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.errors import BadInput, SeatruthError, nearest
from seatruth.estimate import Estimate
from seatruth.optimizers import Budget, Optimizer, Outcome, minimise, starting_points
from seatruth.processes import require_workers
from seatruth.progress import Progress, ProgressEvent, silent
from seatruth.storage.checkpoint import Checkpoint, jobs_file, starts_file
from seatruth.study.settings import RunSettings, run_settings
from seatruth.study.study import Study
from seatruth.trials.finding import Finding
from seatruth.uncertainty import leave_one_out, profiles
from seatruth.uncertainty.cross_validation import pool_parts, split_rows
from seatruth.uncertainty.ensemble import near_optimal, posterior_members, with_bands
from seatruth.uncertainty.input_hold import held_inputs
from seatruth.uncertainty.multistart import best_of, search_from
from seatruth.uncertainty.posterior import posterior_findings, require_emcee, sample_posterior
from seatruth.uncertainty.remedy import other_ways, remedy_finding, untried_finding
from seatruth.uncertainty.reversed_inputs import reversed_inputs

_INTERRUPTED = "stopped by the user"


def identify(
    study: Study,
    optimizer: str | Optimizer | Sequence[str | Optimizer] | None = None,
    *,
    starts: int | None = None,
    budget: Budget | None = None,
    seed: int | None = None,
    checkpoint: str | Path | None = None,
    progress: Progress | None = None,
    cross_validate: bool | None = None,
    profile: Sequence[str] | None = None,
    posterior: bool | None = None,
    posterior_steps: int | None = None,
    threads: int | None = None,
    workers: int = 1,
) -> Estimate:
    """Identifies the free parameters of a study.

    What the study says is what runs. An argument that is not None replaces it; the estimate records in
    `provenance["settings"]` where every setting came from, and a finding names what was replaced in a study file.

    Args:
        study: the model, its trials and the settings of the search.
        optimizer: name, `Optimizer`, or a list of them for a hybrid.
        starts: from how many starts the search is made: the study's start values, then points spread over the bounds or
            priors (`starting_points`). The answer is the best of their ends; `Estimate.starts` compares them.
        budget: limits of the search from each start.
        seed: seed of everything random, 0 or more.
        checkpoint: file that keeps the search (and beside it, with the ending .starts, the further starts, and with
            .jobs, the profile, the posterior and the trials left out). The same call goes on where an interrupted one
            stopped and ends with the same estimate. The files stay, so that an estimate that could not be saved is soon
            made again; remove them afterwards.
        progress: called with a `ProgressEvent` about ten times a second.
        cross_validate: leave out each trial in turn, fit the others and predict it.
        profile: names of the free parameters whose likelihood is profiled.
        posterior: sample the posterior with emcee (the extra "posterior").
        posterior_steps: steps of that sample at most.
        threads: threads of a simulation, None for all processors. They do not change the result.
        workers: starts, profile points or left-out trials that run at once. They do not change the result.

    Returns:
        The estimate. An interrupt (Ctrl-C) at any time returns the best so far with the outcome's code "interrupted";
        parts that were not reached are empty.

    Raises:
        BadInput: the study cannot be started as asked.

    Example:
        >>> from seatruth import Budget, identify
        >>> import seatruth.sample
        >>> study = seatruth.sample.load("study.toml")
        >>> estimate = identify(study, budget=Budget(evaluations=40))
        >>> estimate.outcome["code"], estimate.seed
        ('budget', 1)
        >>> estimate.provenance["settings"]["seed"]["from"], estimate.provenance["settings"]["budget"]["from"]
        ('study file', 'argument')
    """
    settings = run_settings(study, optimizer, budget, seed, cross_validate, profile, starts, posterior, posterior_steps)
    _check(study, settings, workers)
    # One thread for linear algebra: its matrices are small, and more would change the last digits of the result.
    with threadpool_limits(limits=1, user_api="blas"):
        cost = cost_of(study, threads=threads)
        if isinstance(cost, FormulaCost):
            cost.require_values()
        outcome = minimise(
            cost,
            settings.optimizer,
            budget=settings.budget,
            seed=settings.seed,
            checkpoint=checkpoint,
            progress=progress,
        )
        show = _timed(progress or silent, time.perf_counter() - outcome.wall_s)
        points, outcomes = _further_starts(study, cost, outcome, settings, checkpoint, show, threads, workers)
        best = best_of(outcomes)
        if len(outcomes) < len(points):
            best = dataclasses.replace(best, code="interrupted", reason=_INTERRUPTED)
        analysis = Analysis(study, cost, best, settings.origin, points, outcomes)
        return _analysed(analysis, settings, checkpoint, show, threads, workers)


def _check(study: Study, settings: RunSettings, workers: int) -> None:
    """Refuses what cannot be started."""
    free = [parameter.name for parameter in study.free]
    if not free:
        raise BadInput("no parameter varies", where=f"study {study.name!r}", do="Set `vary = true` for one or more.")
    for name in settings.profile:
        if name not in free:
            raise BadInput(f"{name!r} is no free parameter, so it has no profile", do=nearest(name, free))
    if settings.posterior:
        require_emcee()  # before hours of searching
    require_workers(workers)
    if settings.cross_validate and len(study.trials) < 2 and study.cost.kind != "formula":
        raise BadInput("leaving trials out needs at least two to fit", do="Add a trial or leave cross_validate out.")


def _timed(progress: Progress, began: float) -> Progress:
    """The progress with the time since the run began."""

    def show(event: ProgressEvent, /) -> None:
        progress(dataclasses.replace(event, elapsed_s=time.perf_counter() - began))

    return show


def _further_starts(
    study: Study,
    cost: StudyCost,
    first: Outcome,
    settings: RunSettings,
    checkpoint: str | Path | None,
    progress: Progress,
    threads: int | None,
    workers: int,
) -> tuple[Array, list[Outcome]]:
    """All starts (N, K), and the outcomes of their searches; the cost is left with its noise at the best."""
    if settings.starts < 2 or first.code == "interrupted":
        return first.x[None], [first]
    points = starting_points(cost, settings.starts, settings.seed)
    # Not the number of starts: those that are done serve a run with more of them.
    work = f"{study.content_hash} {settings.optimizer.describe()} {settings.budget} {settings.seed}"
    place = None if checkpoint is None else starts_file(checkpoint)
    with Checkpoint(place, work, drop_other_work=True) as kept:
        outcomes = search_from(
            study,
            points,
            settings.optimizer,
            settings.budget,
            settings.seed,
            checkpoint=kept,
            progress=progress,
            threads=threads,
            workers=workers,
        )
    outcomes = [first, *outcomes]
    cost.reweight(best_of(outcomes).x)
    return points, outcomes


def _analysed(
    analysis: Analysis,
    settings: RunSettings,
    checkpoint: str | Path | None,
    show: Progress,
    threads: int | None,
    workers: int,
) -> Estimate:
    """Everything after the search."""
    study, cost, outcome = analysis.study, analysis.cost, analysis.outcome
    show(ProgressEvent("Uncertainty", best=outcome.value))
    try:
        analysis.run()
        if analysis.astray and outcome.code != "interrupted":
            show(ProgressEvent("Other ways into the problem"))
            analysis.findings += _other_ways(analysis, threads)
        elif outcome.code != "interrupted":
            analysis.findings += _held(analysis, threads)
    except KeyboardInterrupt:
        return analysis.estimate(interrupted=_INTERRUPTED)
    usable = math.isfinite(outcome.value)
    if outcome.code == "interrupted" or not usable:
        return analysis.estimate()
    estimate = analysis.estimate()
    jobs = _finished_jobs(study, outcome, checkpoint, estimate)
    try:
        if settings.profile:
            try:
                estimate.profile = profiles(
                    study,
                    settings.profile,
                    outcome.x,
                    analysis.stderr,
                    checkpoint=jobs,
                    progress=show,
                    threads=threads,
                    workers=workers,
                )
            except SeatruthError as problem:
                estimate.findings.append(part_missing("The profile", problem))
        _ensemble(analysis, estimate, settings, jobs, show, threads)
        if settings.cross_validate:
            try:
                by_row = study.cost.kind == "formula" and len(study.trials) == 1
                parts = split_rows(study) if by_row else study
                left = leave_one_out(
                    parts, _values(cost, outcome), checkpoint=jobs, progress=show, threads=threads, workers=workers
                )
                if by_row:
                    left = pool_parts(left, parts, study.trials[0].name)
                estimate.cross_validation = _with_fit(left, estimate.fit)
            except SeatruthError as problem:
                estimate.findings.append(part_missing("The prediction of trials left out", problem))
    except KeyboardInterrupt:
        estimate.outcome |= {"code": "interrupted", "reason": f"{_INTERRUPTED} after the search had ended"}
    finally:
        jobs.close()
    if jobs.write_error:
        estimate.findings.append(_checkpoint_finding(jobs.write_error))
    return estimate


def _ensemble(
    analysis: Analysis,
    estimate: Estimate,
    settings: RunSettings,
    jobs: Checkpoint,
    show: Progress,
    threads: int | None,
) -> None:
    """Samples the posterior if asked, and simulates what the trials cannot tell apart: its draws, or ends of starts."""
    study, x, size = analysis.study, analysis.x, analysis.size
    members = np.zeros((0, size))
    source: Literal["posterior", "starts"] = "starts"
    try:
        if settings.posterior:
            show(ProgressEvent("Posterior"))
            uncertainty = analysis.uncertainty
            found = sample_posterior(
                cost_of(study, threads=threads),
                x,
                np.zeros((size, size)) if uncertainty is None else uncertainty.covariance,
                steps=settings.posterior_steps,
                seed=settings.seed,
                checkpoint=jobs,
                progress=show,
            )
            estimate.posterior = found
            estimate.findings += posterior_findings(found, analysis.inflation)
            members, source = posterior_members(found, settings.seed), "posterior"
        elif analysis.starts is not None:
            members = near_optimal(analysis.starts, analysis.cost.names, analysis.inflation)
        if len(members) > 1 and study.cost.kind != "formula":  # a formula's rows have their prediction intervals
            estimate.traces, estimate.ensemble = with_bands(
                estimate.traces, analysis.cost, members, source, study.holdout, progress=show
            )
    except SeatruthError as problem:
        estimate.findings.append(part_missing("The posterior" if settings.posterior else "The bands", problem))


def _other_ways(analysis: Analysis, threads: int | None) -> list[Finding]:
    """What other ways into the problem give where the runs stray, and whether an input is turned round."""
    reversed_ = reversed_inputs(analysis.study, threads=threads)
    try:
        remedy = other_ways(analysis.study, analysis.outcome, more_starts=analysis.starts is None, threads=threads)
    except SeatruthError as problem:
        return [*reversed_, untried_finding(problem.message)]
    if remedy is None:
        return reversed_
    parameters = analysis.cost.space.free
    return [*reversed_, remedy_finding(remedy, analysis.outcome.value, analysis.inflation, parameters)]


def _held(analysis: Analysis, threads: int | None) -> list[Finding]:
    """Whether inputs that step fit better held between samples, where this can be simulated."""
    if not math.isfinite(analysis.outcome.value):
        return []
    try:
        found = held_inputs(analysis.study, analysis.x, threads=threads)
    except SeatruthError:
        return []
    return [] if found is None else [found]


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
    do = "Make room for the checkpoint, or name another folder, if a run that is stopped shall go on where it was."
    return Finding("warning", "checkpoint", message, "search", do)


def _values(cost: StudyCost, outcome: Outcome) -> dict[str, float]:
    return {parameter.name: float(value) for parameter, value in zip(cost.space.free, outcome.x)}


def _with_fit(left: pd.DataFrame, fit: pd.DataFrame) -> pd.DataFrame:
    """Errors of prediction, with the errors of the fit and the noise in further columns."""
    fitted = fit.loc[~fit["held_out"].astype(bool), ["trial", "channel", "rmse", "noise"]]
    return left.merge(fitted.rename(columns={"rmse": "rmse_fitted"}), on=["trial", "channel"], how="left")
