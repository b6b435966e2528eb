"""Figures of the fit against the noise, of the cross-validation, and of the search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from seatruth.report.figures.style import (
    BLUE,
    FAINT,
    GREEN,
    GREY,
    INK,
    VERMILLION,
    few_ticks,
    label_width,
    log_axis,
    nothing,
    placed,
    rows,
    styled,
)
from seatruth.report.view import View, view

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

AT_START = "at the start"
_MOST_ROWS = 48
"""Rows of (channel, trial); with more, the trials of a channel share one row."""
_ROW = 0.205
_WIDEST = 1e5
"""Largest range of the axis: beyond it points sit on the edge."""


@styled
def fit(estimate: Estimate | View) -> Figure:
    """RMSE over noise for each channel and trial, before and after; 1 means that only the noise is left."""
    data = view(estimate)
    points = []
    for _, row in data.fit.iterrows():
        after = (GREEN, "s", "held out, predicted") if row["held_out"] else (BLUE, "o", "fitted")
        points.append((row["channel"], row["trial"], row["ratio_start"], VERMILLION, "d", AT_START))
        points.append((row["channel"], row["trial"], row["ratio"], *after))
    columns = ["channel", "trial", "ratio", "colour", "marker", "label"]
    return _dots(data, pd.DataFrame(points, columns=columns), "RMSE / noise", list(data.fit["channel"].unique()))


@styled
def cross_validation(estimate: Estimate | View) -> Figure:
    """RMSE over noise of each trial when it was fitted to, and when it was left out and predicted."""
    data = view(estimate)
    table = data.cross_validation
    noise = table["noise"].where(table["noise"] > 0)
    parts = [
        pd.DataFrame(
            {
                "channel": table["channel"],
                "trial": table["trial"],
                "ratio": table[column] / noise,
                "colour": colour,
                "marker": marker,
                "label": label,
            }
        )
        for column, colour, marker, label in (
            ("fitted", BLUE, "o", "fitted to"),
            ("predicted", GREEN, "s", "left out, predicted"),
        )
    ]
    return _dots(data, pd.concat(parts, ignore_index=True), "RMSE / noise", list(table["channel"].unique()))


def _dots(data: View, points: pd.DataFrame, label: str, channels: Sequence[str]) -> Figure:
    points = points[np.isfinite(points["ratio"].astype(float)) & (points["ratio"] > 0)]
    if not len(points):
        return nothing("No channel's noise is known, so there is nothing to compare with.")
    keys = points[["channel", "trial"]].drop_duplicates()
    single = len(keys) > _MOST_ROWS
    names: list[str] = []
    place: dict[Any, int] = {}
    at, heads = 0, []
    for channel in (name for name in channels if (keys["channel"] == name).any()):
        if single:
            place[channel] = len(names)
            names.append(channel)
            continue
        heads.append((at, channel))
        for trial in keys.loc[keys["channel"] == channel, "trial"]:
            place[channel, trial] = len(names)
            names.append(trial)
        at = len(names)
    left = label_width(names) + (0.0 if single else 0.42)
    height = (_ROW if not single else 0.3) * len(names)
    figure = Figure(figsize=(4.8, height + 0.92))
    axes = placed(figure, left, 0.48, 4.8 - left - 0.2, height)
    rows(axes, names)
    for row, channel in heads:
        axes.axhline(row - 0.5, color=GREY, linewidth=0.6)
        axes.annotate(
            channel if len(channel) < 8 else f"{channel[:7]}…",
            (0.0, row),
            (-72 * left + 4, 0),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            va="center",
            fontweight="bold",
        )
    low, high = float(points["ratio"].min()), float(points["ratio"].max())
    low, high = min(low / 1.25, 0.8), max(high * 1.25, 1.6)
    high = min(high, low * _WIDEST)
    log_axis(axes, "x", low, high)
    axes.axvspan(low, 1.0, color=FAINT, linewidth=0, zorder=0)
    axes.axvline(1.0, color=INK, linewidth=1.0, zorder=1)
    for key, group in points.groupby(["channel", "trial"], sort=False):
        channel, trial = (str(part) for part in key)
        y = place[channel] if single else place[channel, trial]
        ratios = np.clip(group["ratio"].to_numpy(dtype=float), low, high)
        axes.plot([ratios.min(), ratios.max()], [y, y], color="#bdbdbd", linewidth=0.9, zorder=2)
        for ratio, (_, point) in zip(ratios, group.iterrows()):
            hollow = point["label"] == AT_START
            axes.plot(
                [ratio],
                [y],
                marker=point["marker"],
                color=point["colour"],
                markerfacecolor="white" if hollow else point["colour"],
                markersize=5,
                alpha=0.7 if single else 1.0,
                clip_on=False,
                zorder=4,
            )
    axes.set_xlabel(f"{label} (1 = only noise left)")
    shown = points.drop_duplicates("label")
    handles = [
        Line2D(
            [],
            [],
            color=row["colour"],
            marker=row["marker"],
            linestyle="",
            markersize=5,
            markerfacecolor="white" if row["label"] == AT_START else row["colour"],
            label=row["label"],
        )
        for _, row in shown.iterrows()
    ]
    figure.legend(handles=handles, loc="upper left", ncols=3, columnspacing=1.2, handletextpad=0.3, borderaxespad=0.2)
    return figure


@styled
def history(estimate: Estimate | View) -> Figure:
    """The best cost over the evaluations."""
    data = view(estimate)
    table = data.history
    if not len(table):
        return nothing("No history.")
    figure = Figure(figsize=(4.8, 2.3))
    axes = placed(figure, 0.72, 0.48, 3.9, 1.68)
    x, y = table["evaluations"].to_numpy(), table["best"].to_numpy()
    few_ticks(axes, 5, 4)
    if y.min() > 0 and y.max() > 5 * y.min():
        low, high = float(y.min()), min(float(y.max()), float(y.min()) * _WIDEST**2)
        room = (high / low) ** 0.06
        log_axis(axes, "y", low / room, high * room)
    axes.step(x, y, where="post", color=BLUE, linewidth=1.4)
    axes.plot([x[-1]], [y[-1]], marker="o", color=BLUE, markersize=4)
    axes.set_xlim(0, max(float(x[-1]) * 1.03, 1.0))
    axes.set_xlabel("evaluations")
    axes.set_ylabel("best cost")
    return figure


def worst_ratio(data: View, trial: str) -> float:
    """The largest RMSE over noise of a trial's channels; where no noise is known, NaN."""
    rows_ = data.fit.loc[data.fit["trial"] == trial, "ratio"]
    known = rows_[np.isfinite(rows_)]
    return float(known.max()) if len(known) else math.nan
