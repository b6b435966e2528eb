"""What the page's words and tables read off an Estimate: ratios to the noise, correlated pairs, findings in order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.report.view import View


def channel_ratios(rows: pd.DataFrame) -> dict[str, float]:
    """RMSE over noise of each channel, pooled over its trials by their samples."""
    out = {}
    for name, part in rows.groupby("channel", sort=False):
        ratio = pooled(part, "ratio")
        if math.isfinite(ratio):
            out[str(name)] = ratio
    return out


def pooled(part: pd.DataFrame, column: str) -> float:
    """Root mean square of a column, each row counted with its samples; NaN without any."""
    part = part[np.isfinite(part[column])]
    if not len(part):
        return math.nan
    weight = part["n"].fillna(1.0).clip(lower=1.0)
    return float(np.sqrt(np.average(part[column] ** 2, weights=weight)))


def estimated(data: View) -> set[str]:
    """Channels whose noise was estimated from the residuals."""
    noise = (getattr(data.estimate, "cost", None) or {}).get("noise")
    if not isinstance(noise, Mapping):
        return set()
    return {str(name) for name, said in noise.items() if isinstance(said, Mapping) and said.get("estimated")}


def fits_trajectories(data: View) -> bool:
    """Whether the residuals that the page shows are those that the search made small; a regression has its own."""
    return str((getattr(data.estimate, "cost", None) or {}).get("kind", "trajectory")) == "trajectory"


def unfinished(data: View) -> bool:
    """Whether the search ended before it could converge."""
    return str(data.outcome.get("code", "")) in ("budget", "deadline", "interrupted", "failed")


def strong_pairs(data: View, least: float) -> list[tuple[str, str, float]]:
    """Pairs of estimates with a correlation of at least `least`, the strongest first; of a nuisance only those with
    a parameter."""
    table, own = data.correlation, set(data.parameters.index)
    values = table.to_numpy(dtype=float)
    pairs = []
    names = [str(name) for name in table.index]
    for i, j in zip(*np.nonzero(np.triu(np.abs(np.nan_to_num(values)) >= least, 1))):
        if names[i] in own or names[j] in own:
            pairs.append((names[i], names[j], float(values[i, j])))
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def findings_of(data: View) -> list[dict[str, str]]:
    """The findings of an estimate as plain texts, the gravest first."""
    return in_order(getattr(data.estimate, "findings", None) or [])


def in_order(given: Sequence[Any]) -> list[dict[str, str]]:
    """Findings as plain texts, the gravest first."""
    keys = ("severity", "code", "trial", "channel", "where", "message", "do")
    order = {"error": 0, "warning": 1, "note": 2}
    found = []
    for finding in given:
        read: Any = finding.get if isinstance(finding, dict) else lambda key, f=finding: getattr(f, key, "")
        texts = {key: str(read(key) or "") for key in keys}
        found.append(texts | {"where": without_folders(texts["where"])})
    return sorted(found, key=lambda finding: order.get(finding["severity"], 3))


def without_folders(where: str) -> str:
    """ "/home/me/a.csv, line 3" as "a.csv, line 3": a report is passed on, and its reader has other folders."""
    file, comma, rest = where.partition(", ")
    return f"{file.replace(chr(92), '/').rsplit('/', 1)[-1]}{comma}{rest}"
