"""How well each channel of each trial is fitted: the rows of an estimate's `fit`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.study_cost import StudyCost
from seatruth.statistics.autoregressive import fit_autoregressive, lag_one_autocorrelation
from seatruth.trials.trial import Trial

FIT_COLUMNS = (
    *("trial", "channel", "rmse", "rmse_start", "noise", "ratio", "bias", "n", "n_eff"),
    *("autocorrelation", "held_out"),
)


def fit_row(
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
