"""Leave-one-trial-out cross-validation: fit all trials but one, and predict that one."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import TypeVar

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.optimizers import Budget
from seatruth.progress import Progress, ProgressEvent, remaining
from seatruth.storage.checkpoint import Checkpoint
from seatruth.trials.trial import Trials
from seatruth.uncertainty.refits import refit, run_in_order

_BUDGET = Budget(evaluations=50_000)
"""Far more than a local fit from a good start needs: a limit for fits that do not converge. Chosen here [S]."""
ProblemT = TypeVar("ProblemT", bound=EstimationProblem)


def leave_one_out(
    study: EstimationProblem,
    estimate: dict[str, float],
    *,
    checkpoint: Checkpoint,
    progress: Progress,
    threads: int | None,
    workers: int,
) -> pd.DataFrame:
    """Root mean square error of each trial, predicted in open loop by a fit to the other trials.

    Each fit is local (least squares).

    Args:
        study: The study with its trials.
        estimate: Parameter values where the fit to all trials ended; each fit starts there.
        checkpoint: Finished fits are read from it and stored in it.
        progress: Called with a `ProgressEvent` after each fit.
        threads: Threads of a simulation; None for all processors.
        workers: Fits that run at once; the result does not depend on it.

    Returns:
        Columns trial, channel, rmse (in the channel's unit). NaN where the prediction diverges; no row for a channel
        that was not recorded.
    """
    names = list(study.trials.names)
    missing = [name for name in names if _key(name) not in checkpoint]

    def errors_without(name: str) -> tuple[str, dict[str, float]]:
        others = Trials([trial for trial in study.trials if trial.name != name])
        started = tuple(
            parameter.replace(value=float(np.clip(estimate[parameter.name], parameter.min, parameter.max)))
            if parameter.name in estimate
            else parameter
            for parameter in study.parameters
        )
        cost = cost_of(study.with_trials(others).replace(parameters=started), threads=threads)
        outcome = refit(cost, _BUDGET)
        trial = study.trials[name]
        predicted = cost.predict(outcome.x, [trial])[0]
        return name, rms_errors(study, trial.outputs, predicted)

    began = time.perf_counter()
    for done, (name, errors) in enumerate(run_in_order(errors_without, [(name,) for name in missing], workers), 1):
        checkpoint.put(_key(name), errors)
        left = remaining(done, len(missing), time.perf_counter() - began)
        progress(ProgressEvent("Cross-validation", done, len(missing), "trials left out", remaining_s=left))
    rows = [
        {"trial": name, "channel": channel, "rmse": float(rmse)}
        for name in names
        for channel, rmse in checkpoint.get(_key(name)).items()
    ]
    return pd.DataFrame(rows, columns=["trial", "channel", "rmse"])


def split_rows(study: ProblemT, parts: int = 10) -> ProblemT:
    """A formula's study whose one table is split at random into parts, each of them a trial.

    Leave-one-trial-out then leaves out rows. Which row is in which part depends on the number of rows alone.
    """
    table = study.trials[0]
    order = np.random.default_rng(len(table)).permutation(len(table))
    rows_of_parts = np.array_split(order, min(parts, len(table)))
    trials = [table.samples(np.sort(rows), f"part {k + 1}") for k, rows in enumerate(rows_of_parts)]
    return study.replace(trials=Trials(trials))


def pool_parts(errors: pd.DataFrame, study: EstimationProblem, name: str) -> pd.DataFrame:
    """Combines the errors of all parts of a table (`split_rows`) into those of the table, called `name`."""
    rows = []
    for channel, part in errors.groupby("channel", sort=False):
        counts = [np.isfinite(study.trials[str(trial)].outputs[str(channel)]).sum() for trial in part["trial"]]
        rmse = math.sqrt(float(np.average(part["rmse"] ** 2, weights=counts)))
        rows.append({"trial": name, "channel": channel, "rmse": rmse})
    return pd.DataFrame(rows, columns=["trial", "channel", "rmse"])


def rms_errors(study: EstimationProblem, measured: Mapping[str, Array], predicted: Array) -> dict[str, float]:
    """Root mean square of measured less predicted (n, outputs), by recorded output, in its unit."""
    errors = {}
    for column, channel in enumerate(study.model.outputs):
        record = measured.get(channel.name)
        if record is not None and np.isfinite(record).any():
            error = (record - predicted[:, column])[np.isfinite(record)]
            errors[channel.name] = float(np.sqrt(np.mean(error**2)))
    return errors


def _key(name: str) -> str:
    return f"without {name}"
