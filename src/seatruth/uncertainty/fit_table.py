"""How well each channel of each trial is fitted: an estimate's `fit` and `traces`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.formula import FormulaCost
from seatruth.costs.study_cost import StudyCost
from seatruth.statistics.autoregressive import fit_autoregressive, lag_one_autocorrelation
from seatruth.trials.trial import Trial
from seatruth.uncertainty.prediction import prediction_intervals

FIT_COLUMNS = (
    *("trial", "channel", "rmse", "rmse_start", "noise", "ratio", "bias", "n", "n_eff"),
    *("autocorrelation", "held_out"),
)


def compare_with_records(
    cost: StudyCost, x: Array, holdout: Sequence[Trial]
) -> tuple[pd.DataFrame, pd.DataFrame, list[Array]]:
    """What the answer x (K,) and the start values predict, beside what was measured.

    Args:
        cost: The cost, with its noise at the answer.
        x: The answer.
        holdout: Trials that took no part in the fit.

    Returns:
        `fit`, one row a trial and channel; `traces`, one row a sample of these, with prediction intervals and inputs
        where a formula was fitted; and the predicted outputs (n, D) of each trial of the cost.
    """
    start = np.clip(cost.start, *cost.bounds)
    fitted, before = cost.predict(x), cost.predict(start)
    later, later_before = (cost.predict(at, holdout) for at in (x, start)) if holdout else ([], [])
    rows: list[dict[str, Any]] = []
    parts: list[pd.DataFrame] = []
    runs = [*zip(cost.trials, fitted, before), *zip(holdout, later, later_before)]
    for number, (trial, y, y_start) in enumerate(runs):
        held_out = number >= len(fitted)
        for column, channel in enumerate(cost.problem.model.outputs):
            measured = trial.outputs.get(channel.name)
            if measured is None or not np.isfinite(measured).any():
                continue
            rows.append(_fit_row(cost, trial, channel.name, measured, y[:, column], y_start[:, column], held_out))
            part = {
                "trial": trial.name,
                "t": trial.t,
                "channel": channel.name,
                "measured": measured,
                "fitted": y[:, column],
                "start": y_start[:, column],
                "held_out": held_out,
            }
            if isinstance(cost, FormulaCost):
                half = prediction_intervals(cost, x, [trial])[0].half_width
                part |= {"lower": y[:, column] - half, "upper": y[:, column] + half}
                part |= {f"input {name}": values for name, values in trial.inputs.items()}
            parts.append(pd.DataFrame(part))
    traces = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
    return pd.DataFrame(rows, columns=list(FIT_COLUMNS)), traces, fitted


def _fit_row(
    cost: StudyCost, trial: Trial, channel: str, measured: Array, y: Array, y_start: Array, held_out: bool
) -> dict[str, Any]:
    """One row of an estimate's `fit`.

    Args:
        cost: The cost, with its noise at the answer.
        trial: The trial.
        channel: The output.
        measured: (n,), what was measured of it; NaN where nothing was.
        y: (n,), what the answer predicts.
        y_start: (n,), what the start values predict.
        held_out: Whether the trial took no part in the fit.
    """
    valid = np.isfinite(measured)
    error, before = (measured - y)[valid], (measured - y_start)[valid]
    rmse, noise = _rms(error), cost.sigma.get(channel, math.nan)
    finite, ordered = bool(np.isfinite(error).all()), cost.problem.cost.kind != "formula"
    return {
        "trial": trial.name,
        "channel": channel,
        "rmse": rmse,
        "rmse_start": _rms(before),
        "noise": noise,
        "ratio": rmse / noise if noise > 0 else math.nan,
        "bias": float(error.mean()) if finite else math.nan,
        "n": int(valid.sum()),
        "n_eff": fit_autoregressive(error, ordered).effective_samples(len(error)) if finite else math.nan,
        "autocorrelation": lag_one_autocorrelation(error) if finite and ordered else math.nan,
        "held_out": held_out,
    }


def _rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2))) if error.size else math.nan
