"""Figures of the score of real cases."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from seatruth.report.figures.style import BLUE, FAINT, GREY, INK, ORANGE, VERMILLION, styled

Rows = Sequence[Mapping[str, Any]]
FARTHEST = 3.0
"""m/s: an estimate farther out sits on the edge of its panel."""


@styled
def wind_figure(days: Rows, runs: Rows) -> Figure:
    """The wind as components towards which the air goes, a panel a day: measured by run, estimated by the day's
    diagnosis, and by fits to all runs but one.
    """
    figure = Figure(figsize=(2.5 * max(1, len(days)) + 0.4, 3.1), layout="constrained")
    reach = max([abs(run["measured"][key]) for run in runs for key in ("x", "y")] + [0.2])
    limit = max(1.25 * reach, min(FARTHEST, 1.1 * max(_sizes(days, runs), default=0.0)))
    for k, day in enumerate(days):
        axes = figure.add_subplot(1, len(days), k + 1)
        own = [run for run in runs if run["case"] == day["case"]]
        axes.axhline(0, color=GREY, linewidth=0.6)
        axes.axvline(0, color=GREY, linewidth=0.6)
        axes.plot([r["measured"]["x"] for r in own], [r["measured"]["y"] for r in own], "o", color=INK, markersize=4,
                  label="measured, by run")  # fmt: skip
        others = [_within(r["of_others"], limit) for r in own]
        axes.plot([x for x, _ in others], [y for _, y in others], "x", color=ORANGE, markersize=5,
                  label="fit to the other runs")  # fmt: skip
        if day["estimate"]:
            x, y = _within(day["estimate"], limit)
            axes.errorbar([x], [y], xerr=day["estimate"]["dx"], yerr=day["estimate"]["dy"], color=BLUE, marker="s",
                          markersize=5, linewidth=0.8, linestyle="none", label="diagnosis of the day")  # fmt: skip
        axes.set_xlim(-limit, limit)
        axes.set_ylim(-limit, limit)
        axes.set_aspect("equal")
        axes.set_title(day["day"])
        axes.set_xlabel("towards +x (m/s)")
        if k == 0:
            axes.set_ylabel("towards +y (m/s)")
    handles = {label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels())}
    figure.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=3)
    return figure


def _sizes(days: Rows, runs: Rows) -> list[float]:
    winds = [run["of_others"] for run in runs] + [day["estimate"] for day in days if day["estimate"]]
    return [max(abs(wind["x"]), abs(wind["y"])) for wind in winds]


def _within(wind: Mapping[str, float], limit: float) -> tuple[float, float]:
    x, y = wind["x"], wind["y"]
    shrink = min(1.0, limit / max(abs(x), abs(y), 1e-9))
    return x * shrink, y * shrink


@styled
def left_out_figure(runs: Rows) -> Figure:
    """Error on each run left out over that of the ship alone: with the wind of the others, with the measured one."""
    figure = Figure(figsize=(6.4, 1.0 + 0.24 * len(runs)), layout="constrained")
    axes = figure.add_subplot()
    at = range(len(runs))
    axes.axvline(1.0, color=GREY, linewidth=0.8)
    axes.plot(
        [r["estimated"] for r in runs], at, "s", color=BLUE, markersize=4.5, label="wind estimated from the others"
    )
    axes.plot([r["with_measured"] for r in runs], at, "o", color=VERMILLION, markersize=4.5, markerfacecolor="none",
              label="wind measured")  # fmt: skip
    axes.set_yticks(list(at), labels=[r["run"] for r in runs])
    axes.invert_yaxis()
    axes.set_xlabel("error over that of the ship alone (under 1: the wind helps)")
    figure.legend(loc="outside upper center", ncols=2)
    return figure


@styled
def put_figure(rows: Rows) -> Figure:
    """Of each error put in: the rise of its log-evidence over the control, and the part of its size that was found."""
    figure = Figure(figsize=(7.4, 1.0 + 0.26 * len(rows)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    at = list(range(len(rows)))
    left.axvline(0.0, color=GREY, linewidth=0.8)
    left.set_xscale("symlog", linthresh=1.0)
    for k, row in zip(at, rows, strict=True):
        if row["rise"] is not None:
            first = row["rise_rank"] == 1
            left.plot([row["rise"]], [k], "s", color=BLUE, markerfacecolor=BLUE if first else "none", markersize=5)
        if row["recovered"] is not None:
            part = max(-1.0, min(3.0, row["recovered"]))
            error = row["estimate"][1] / abs(row["size"])
            right.errorbar([part], [k], xerr=[min(error, 4.0)], color=BLUE, marker="s", markersize=4.5, linewidth=0.8)
        else:
            right.text(0.02, k, "not fitted", va="center", color=GREY, fontsize=7.5)
    right.axvline(1.0, color=GREY, linewidth=0.8)
    right.axvline(0.0, color=FAINT, linewidth=0.8)
    right.set_xlim(-1.2, 3.2)
    left.set_yticks(at, labels=[f"{row['family']}: {row['error']} x{row['times']:g}" for row in rows])
    left.invert_yaxis()
    left.set_xlabel("rise of log-evidence over the control\n(full: no other effect rises as much)")
    right.set_xlabel("size found less the control's,\nover the size put in")
    return figure


def degrees(angle: float) -> str:
    """An angle in rad as whole degrees, 0 to 360."""
    return f"{math.degrees(angle) % 360:.0f}"
