"""Measures of estimation: errors of the parameters, and the coverage of their intervals.

They need the truth. Where it is not known these columns are empty, and the prediction of trials held out remains.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

_BY = ["problem", "cost", "solver", "noise", "level", "budget"]
_COLUMNS = (
    *("unit", "truth", "mean", "runs", "missing", "spread", "bias", "bias_se", "rmse", "rmse_percent", "crlb"),
    *("efficiency", "coverage", "intervals"),
)


def by_parameter(runs: pd.DataFrame, estimates: pd.DataFrame) -> pd.DataFrame:
    """By condition, solver, budget and parameter, over the seeds.

    `bias` and `bias_se` (its own standard error), `rmse`, `rmse_percent` of the truth, `crlb` (root mean square of the
    Cramer-Rao bounds of the realisations), `efficiency` = rmse / crlb, `coverage` of the 95 % intervals, over the
    `intervals` that there are. Runs without an answer are left out here and counted in `missing`.
    """
    if not len(estimates):
        return pd.DataFrame()
    truth, noisy = estimates["truth"], estimates["level"] > 0  # without noise there is no interval
    with_interval = np.isfinite(estimates["lower"]) & np.isfinite(estimates["upper"]) & np.isfinite(truth) & noisy
    held = with_interval & (estimates["lower"] <= truth) & (truth <= estimates["upper"])
    error = estimates["value"] - truth
    parts = estimates[[*_BY, "parameter", "value", "truth", "unit"]].assign(
        error=error, square=error**2, bound=estimates["crlb"] ** 2, with_interval=with_interval, held=held
    )
    groups = parts.groupby([*_BY, "parameter"], sort=False, observed=True)
    summary = groups.agg(
        unit=("unit", "first"),
        truth=("truth", "first"),
        mean=("value", "mean"),
        runs=("value", "size"),
        spread=("value", "std"),
        bias=("error", "mean"),
        square=("square", "mean"),
        bound=("bound", "mean"),
        intervals=("with_interval", "sum"),
        held=("held", "sum"),
    ).reset_index()
    wanted = runs.groupby(_BY, sort=False).size().rename("asked").reset_index()
    summary = summary.merge(wanted, on=_BY)
    summary["missing"] = summary["asked"] - summary["runs"]
    known = summary["truth"].notna()
    summary["bias_se"] = (summary["spread"] / np.sqrt(summary["runs"])).where(known)
    summary["rmse"], summary["crlb"] = np.sqrt(summary["square"]), np.sqrt(summary["bound"])
    size = summary["truth"].abs()
    summary["rmse_percent"] = (100.0 * summary["rmse"] / size.where(size > 0)).where(known)
    summary["efficiency"] = summary["rmse"] / summary["crlb"].where(summary["crlb"] > 0)
    summary["coverage"] = summary["held"] / summary["intervals"].where(summary["intervals"] > 0)
    return summary[[*_BY, "parameter", *_COLUMNS]]


def left_by_data(best_fits: pd.DataFrame) -> pd.DataFrame:
    """By condition, the error that the data leave: that of the best known fits, over the realisations.

    `left_percent`: median over the parameters of their rms errors in per cent of the truth.
    """
    known = best_fits[best_fits["truth"].abs() > 0]
    if not len(known):
        return pd.DataFrame(columns=[*_BY[:2], *_BY[3:5], "left_percent"])
    square = ((known["value"] - known["truth"]) / known["truth"]) ** 2
    by = [*_BY[:2], *_BY[3:5]]
    means = known.assign(square=square).groupby([*by, "parameter"], sort=False)["square"].mean()
    medians: pd.Series = (100.0 * np.sqrt(means)).groupby(level=by, sort=False).median()
    return medians.rename("left_percent").reset_index()


def overall(runs: pd.DataFrame, table: pd.DataFrame, best_fits: pd.DataFrame, success: float = 1.0) -> pd.DataFrame:
    """By condition, solver and budget, over seeds and parameters; `table` is that of `by_parameter`.

    `error_percent`: median over the parameters of their rms errors in per cent of the truth; `efficiency`: median of
    their rms errors over the bounds; `coverage` of all intervals; `held_out`: median error of prediction, a part of
    the outputs' range; `converged`: share of the runs within `success` of the best known fit; `left_percent`: the
    error that the best known fits have. Where a solver converged, its error is that which the data leave; where it did
    not, the error is the search's.
    """
    parts = dict(list(table.groupby(_BY, sort=False))) if len(table) else {}
    rows = []
    for key, group in runs.groupby(_BY, sort=False):
        parameters = parts.get(key, table.iloc[:0])
        done = group["status"] == "done"
        row: dict[str, Any] = dict(zip(_BY, key))
        row |= {"runs": len(group), "failed": int((~done).sum())}
        row["excess"] = float(group["excess"].median())
        row["converged"] = float((done & (group["excess"] <= success)).mean())
        for name, source in (("error_percent", "rmse_percent"), ("efficiency", "efficiency")):
            values = parameters[source].dropna() if len(parameters) else pd.Series(dtype=float)
            row[name] = float(values.median()) if len(values) else math.nan
        covered = parameters.dropna(subset=["coverage"]) if len(parameters) else parameters
        total = int(covered["intervals"].sum()) if len(covered) else 0
        row["coverage"] = float((covered["coverage"] * covered["intervals"]).sum() / total) if total else math.nan
        row["intervals"] = total
        held = pd.to_numeric(group["held_out"], errors="coerce").dropna()
        row["held_out"] = float(held.median()) if len(held) else math.nan
        row["evaluations"] = float(group["evaluations"].median())
        row["search_s"] = float(group["search_s"].median())
        rows.append(row)
    if not rows:
        return pd.DataFrame()
    return pd.DataFrame(rows).merge(left_by_data(best_fits), on=[*_BY[:2], *_BY[3:5]], how="left")
