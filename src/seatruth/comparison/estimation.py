"""Measures of estimation: how near the parameters come to the truth, and whether their intervals know it.

Errors can be told only where the truth is known; elsewhere these columns are empty and the prediction of trials held
out is what there is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

_BY = ["problem", "cost", "solver", "noise", "level", "budget"]


def by_parameter(runs: pd.DataFrame, estimates: pd.DataFrame) -> pd.DataFrame:
    """By place, solver, budget and parameter, over the seeds.

    `bias` and `bias_se` (its own standard error), `rmse`, `rmse_percent` of the truth, `crlb` (root mean square of the
    Cramer-Rao bounds of the realisations), `efficiency` = rmse / crlb, `coverage` of the 95 % intervals, over the
    `intervals` that there are. Runs without an answer are left out here and counted in `missing`.
    """
    wanted: dict[Any, int] = runs.groupby(_BY, sort=False).size().to_dict()
    rows = []
    for place, group in estimates.groupby([*_BY, "parameter"], sort=False, observed=True):
        truth, value = group["truth"].to_numpy(dtype=float), group["value"].to_numpy(dtype=float)
        error = value - truth
        known = bool(np.isfinite(error).all())
        row: dict[str, Any] = dict(zip([*_BY, "parameter"], place))
        row |= {
            "unit": group["unit"].iloc[0],
            "truth": float(truth[0]),
            "mean": float(value.mean()),
            "runs": len(group),
        }
        row["missing"] = wanted[place[:-1]] - len(group)
        row["spread"] = float(value.std(ddof=1)) if len(group) > 1 else math.nan
        row["bias"] = float(error.mean()) if known else math.nan
        row["bias_se"] = row["spread"] / math.sqrt(len(group)) if known else math.nan
        row["rmse"] = _rms(error) if known else math.nan
        row["rmse_percent"] = 100.0 * row["rmse"] / abs(truth[0]) if known and truth[0] != 0 else math.nan
        row["crlb"] = _rms(group["crlb"].to_numpy(dtype=float))
        row["efficiency"] = row["rmse"] / row["crlb"] if row["crlb"] > 0 else math.nan
        row |= _coverage(group)
        rows.append(row)
    return pd.DataFrame(rows)


def overall(runs: pd.DataFrame, estimates: pd.DataFrame) -> pd.DataFrame:
    """By place, solver and budget, over seeds and parameters.

    `error_percent`: median over the parameters of their rms errors in per cent of the truth; `efficiency`: median of
    their rms errors over the bounds; `coverage` of all intervals; `held_out`: median error of prediction, a part of
    the outputs' range.
    """
    table = by_parameter(runs, estimates)
    parts = dict(list(table.groupby(_BY, sort=False))) if len(table) else {}
    rows = []
    for place, group in runs.groupby(_BY, sort=False):
        own = parts.get(place, table.iloc[:0])
        done = group["status"] == "done"
        row: dict[str, Any] = dict(zip(_BY, place))
        row |= {"runs": len(group), "failed": int((~done).sum())}
        row["excess"] = float(group["excess"].median())
        for name, source in (("error_percent", "rmse_percent"), ("efficiency", "efficiency")):
            values = own[source].dropna() if len(own) else pd.Series(dtype=float)
            row[name] = float(values.median()) if len(values) else math.nan
        covered = own.dropna(subset=["coverage"]) if len(own) else own
        total = int(covered["intervals"].sum()) if len(covered) else 0
        row["coverage"] = float((covered["coverage"] * covered["intervals"]).sum() / total) if total else math.nan
        row["intervals"] = total
        held = pd.to_numeric(group["held_out"], errors="coerce").dropna()
        row["held_out"] = float(held.median()) if len(held) else math.nan
        row["evaluations"] = float(group["evaluations"].median())
        row["search_s"] = float(group["search_s"].median())
        rows.append(row)
    return pd.DataFrame(rows)


def _coverage(group: pd.DataFrame) -> dict[str, Any]:
    """Share of the intervals that hold the truth, of those that are there."""
    if float(group["level"].iloc[0]) == 0:
        return {"coverage": math.nan, "intervals": 0}  # intervals speak of noise, and here is none
    inside = group[np.isfinite(group["lower"]) & np.isfinite(group["upper"]) & np.isfinite(group["truth"])]
    if not len(inside):
        return {"coverage": math.nan, "intervals": 0}
    held = (inside["lower"] <= inside["truth"]) & (inside["truth"] <= inside["upper"])
    return {"coverage": float(held.mean()), "intervals": len(inside)}


def _rms(values: Any) -> float:
    values = np.asarray(values, dtype=float)
    values = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan
