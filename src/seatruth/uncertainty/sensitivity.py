"""Output sensitivities: how much the outputs change with each parameter (Perez and Blanke 2002)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.study_cost import StudyCost

STEP = 0.1
"""Relative change of the parameter, as in the source."""


def sensitivity(cost: StudyCost, x: Array, step: float = STEP) -> pd.DataFrame:
    """Relative change of each output over the relative change of each parameter.

    S = sum |y((1 + step) c) - y(c)| / (step sum |y(c)|) over all samples of all trials, with the same inputs.

    Args:
        cost: The cost of a study.
        x: (K,), parameters and nuisances.
        step: Relative change of a parameter.

    Returns:
        Index parameter; one column an output, and "largest", their maximum. NaN where the changed simulation diverges,
        and for a parameter that is zero.
    """
    channels = [channel.name for channel in cost.problem.model.outputs]
    names = [parameter.name for parameter in cost.parameters if parameter.name not in cost.nuisances]
    base = np.concatenate(cost.predict(x))
    size = np.nansum(np.abs(base), axis=0)
    rows = {}
    for k, name in enumerate(names):
        moved = np.array(x, dtype=np.float64)
        moved[k] *= 1.0 + step
        if moved[k] == x[k]:
            rows[name] = np.full(len(channels), np.nan)
            continue
        change = np.abs(np.concatenate(cost.predict(moved)) - base)
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = change.sum(axis=0) / (step * size)
        rows[name] = np.where(size > 0, relative, np.nan)
    frame = pd.DataFrame.from_dict(rows, orient="index", columns=channels, dtype=float)
    frame.index.name = "parameter"
    with np.errstate(all="ignore"):
        frame["largest"] = frame.max(axis=1) if len(frame) else pd.Series(dtype=float)
    return frame
