"""The field's figures of the recorded manoeuvres with intervals, measured beside predicted, and IMO's turns."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from seatruth import Estimate, Study, predict

DRAWS, QUICK_DRAWS = 120, 60
SHOWN = ("advance", "transfer", "tactical_diameter", "steady_diameter", "first_overshoot", "second_overshoot")
"""Figures of the table; the CSV holds all."""


def predicted(study: Study, estimate: Estimate, draws: int, threads: int | None) -> dict[str, Any]:
    """IMO's turns and zigzags, and the manoeuvres of all trials: rows of two tables, and how far they were widened."""
    found = predict(study, estimate, draws=draws, threads=threads)
    return {
        "planned": found.figures.to_dict("records"),
        "measured": found.measured.to_dict("records"),
        "lack_of_fit": found.lack_of_fit,
        "model_error": found.model_error,
        "conditions": found.conditions,
        "findings": [str(finding) for finding in found.findings],
    }


def text(name: str, found: dict[str, Any], groups: dict[str, list[str]]) -> str:
    """Tables in words: the planned manoeuvres; measured beside predicted by set of runs (names of trials by set)."""
    lines = [
        f"### {name}: figures with 95 % intervals",
        f"Variance of the trials' part times {max(1.0, found['lack_of_fit']):.2g} for their disagreement; intervals "
        f"hold {100 * found['model_error']:.2g} % besides (standard deviation) for misses of the fitted figures. "
        f"Approach {found['conditions']['speed']:.3g} m/s.",
        "| manoeuvre | figure | value | interval | half width | held by (share of priors) |\n|---|---|---|---|---|---|",
    ]
    for row in known_or_nan(found["planned"]):
        if row["figure"] in SHOWN:
            lines[-1] += f"\n| {row['manoeuvre']} | {row['title']} | {_cells(row, 'value')} |"
    lines.append("| runs | figure | n | inside | median error | median half width |\n|---|---|---|---|---|---|")
    for group, part in coverage(found, groups).groupby("set", sort=False):
        for cells in part.to_dict("records"):
            lines[-1] += (
                f"\n| {group} | {cells['figure']} | {cells['n']} | {cells['inside']} | {cells['error']:.1f} % "
                f"| {cells['half width']:.1f} % |"
            )
    return "\n\n".join(lines)


def coverage(found: dict[str, Any], groups: dict[str, list[str]]) -> pd.DataFrame:
    """Rows (set, figure): number of measured figures, how many are inside, median error and half width in per cent."""
    table = pd.DataFrame(known_or_nan(found["measured"]))
    rows = []
    for group, names in groups.items():
        own = table[table.trial.isin(names) & np.isfinite(table.measured.astype(float))] if len(table) else table
        own = own[np.isfinite(own.lower) & np.isfinite(own.predicted)] if len(own) else own
        for figure, part in own.groupby("figure", sort=False) if len(own) else ():
            rows.append(
                {
                    "set": group,
                    "figure": figure,
                    "n": len(part),
                    "inside": int(part.inside.astype(bool).sum()),
                    "error": float(100 * (part.predicted / part.measured - 1).abs().median()),
                    "half width": float((50 * (part.upper - part.lower) / part.predicted.abs()).median()),
                }
            )
    return pd.DataFrame(rows, columns=["set", "figure", "n", "inside", "error", "half width"])


def known_or_nan(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows with NaN where there is no number: a finished stage is kept as JSON, which has none."""
    return [{key: np.nan if value is None else value for key, value in row.items()} for row in rows]


def _cells(row: dict[str, Any], center: str) -> str:
    angle = 180 / np.pi if row["unit"] == "rad" else 1.0
    unit = "deg" if row["unit"] == "rad" else row["unit"]
    value, low, high = (angle * float(row[name]) for name in (center, "lower", "upper"))
    half = 50 * (high - low) / abs(value) if value else np.nan
    share = float(row["prior_share"])
    held = f"{row['held_by']} ({100 * share:.0f} %)" if np.isfinite(share) else ""
    return f"{value:.3g} {unit} | {low:.3g} to {high:.3g} | {half:.0f} % | {held}"


def picture(found: dict[str, dict[str, Any]], colours: tuple[str, ...]) -> Any:
    """Measured figures and intervals in per cent of the predicted value, one panel a study."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(found), figsize=(4.2 * len(found), 4.6), layout="constrained", squeeze=False)
    for axis, (name, own) in zip(axes[0], found.items(), strict=True):
        table = pd.DataFrame(known_or_nan(own["measured"]))
        known = table[table.figure.isin(SHOWN) & np.isfinite(table.measured.astype(float)) & np.isfinite(table.lower)]
        names = [figure for figure in SHOWN if figure in set(known.figure)]
        for k, wanted in enumerate(names):
            part = known[known.figure == wanted].reset_index(drop=True)
            places = k + np.linspace(-0.35, 0.35, max(len(part), 2))[: len(part)]
            low, high, true = (100 * (part[c] / part.predicted - 1) for c in ("lower", "upper", "measured"))
            axis.vlines(places, np.clip(low, -100, 100), np.clip(high, -100, 100), color="#a6a6a6", linewidth=2)
            for role, marker in (("fit", "s"), ("holdout", "o")):
                chosen = (part.role == role).to_numpy()
                inside = part.inside.astype(bool).to_numpy()
                for good, colour in ((True, colours[0]), (False, colours[3])):
                    pick = chosen & (inside == good)
                    axis.plot(places[pick], np.clip(true[pick], -100, 100), marker, color=colour, markersize=4)
        axis.set_xticks(range(len(names)), [name.replace("_", "\n") for name in names], fontsize=7)
        axis.axhline(0, color="black", linewidth=0.6)
        axis.set_ylim(-100, 100)
        axis.set_title(name, fontsize=9)
    axes[0][0].set_ylabel("difference from the predicted value (%)")
    figure.suptitle(
        "95 % intervals (grey) and measured figures: squares fitted, circles left out; blue inside, orange outside",
        fontsize=9,
    )
    return figure
