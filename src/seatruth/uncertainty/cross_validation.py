"""Leave one trial out, fit the others, predict it."""

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
from seatruth.storage.checkpoint import Pieces, in_order, refit
from seatruth.trials.trial import Trials

_BUDGET = Budget(evaluations=50_000)
ProblemT = TypeVar("ProblemT", bound=EstimationProblem)


def leave_one_out(
    study: EstimationProblem,
    estimate: dict[str, float],
    *,
    pieces: Pieces,
    progress: Progress,
    threads: int | None,
    workers: int,
) -> pd.DataFrame:
    """Root mean square error of each trial predicted in the open loop by a fit to the others: trial, channel, rmse.

    Each fit is a local one (least squares) that starts where the fit to all trials ended: `estimate` holds its values.
    NaN where the prediction diverges; nothing for a channel that was not recorded.
    """
    names = list(study.trials.names)
    ahead = [name for name in names if _key(name) not in pieces]

    def one(name: str) -> tuple[str, dict[str, float]]:
        others = Trials([trial for trial in study.trials if trial.name != name])
        started = tuple(
            parameter.replace(value=float(np.clip(estimate[parameter.name], parameter.min, parameter.max)))
            if parameter.name in estimate
            else parameter
            for parameter in study.parameters
        )
        cost = cost_of(study.with_trials(others).replace(parameters=started), threads=threads)
        found = refit(cost, _BUDGET)
        trial = study.trials[name]
        predicted = cost.predict(found.x, [trial])[0]
        return name, rms_errors(study, trial.outputs, predicted)

    began = time.perf_counter()
    for done, (name, errors) in enumerate(in_order(one, [(name,) for name in ahead], workers), 1):
        pieces.add(_key(name), errors)
        left = remaining(done, len(ahead), time.perf_counter() - began)
        progress(ProgressEvent("Cross-validation", done, len(ahead), "trials left out", remaining_s=left))
    rows = [
        {"trial": name, "channel": channel, "rmse": math.nan if rmse is None else float(rmse)}
        for name in names
        for channel, rmse in pieces[_key(name)].items()
    ]
    return pd.DataFrame(rows, columns=["trial", "channel", "rmse"])


def by_rows(study: ProblemT, parts: int = 10) -> ProblemT:
    """A formula's study whose one table is cut at random into parts, each a trial: to leave rows out instead of trials.

    Which row is in which part depends on their number alone.
    """
    table = study.trials[0]
    order = np.random.default_rng(len(table)).permutation(len(table))
    cut = np.array_split(order, min(parts, len(table)))
    return study.replace(trials=Trials([table.samples(np.sort(rows), f"part {k + 1}") for k, rows in enumerate(cut)]))


def pooled(left: pd.DataFrame, study: EstimationProblem, name: str) -> pd.DataFrame:
    """The errors of all parts of a table as those of the table."""
    rows = []
    for channel, part in left.groupby("channel", sort=False):
        counts = [np.isfinite(study.trials[str(trial)].outputs[str(channel)]).sum() for trial in part["trial"]]
        rmse = math.sqrt(float(np.average(part["rmse"] ** 2, weights=counts)))
        rows.append({"trial": name, "channel": channel, "rmse": rmse})
    return pd.DataFrame(rows, columns=["trial", "channel", "rmse"])


def rms_errors(study: EstimationProblem, measured: Mapping[str, Array], predicted: Array) -> dict[str, float]:
    """Root mean square of measured less predicted for each recorded output."""
    found = {}
    for column, channel in enumerate(study.model.outputs):
        record = measured.get(channel.name)
        if record is not None and np.isfinite(record).any():
            error = (record - predicted[:, column])[np.isfinite(record)]
            found[channel.name] = float(np.sqrt(np.mean(error**2)))
    return found


def _key(name: str) -> str:
    return f"without {name}"
