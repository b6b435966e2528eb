"""Figures of predicted manoeuvres: tracks of the estimate and of drawn ships, and measured beside predicted figures."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from seatruth.prediction import Predictions
from seatruth.report.figures.style import (
    BLUE,
    GREY,
    INK,
    MEASURED,
    VERMILLION,
    few_ticks,
    label_width,
    nothing,
    placed,
    rows,
    styled,
    text,
    trace,
    zoomable,
)

_WIDTH = 3.93
_TITLE = 60
"""Letters of a figure's name beside its bar."""


@styled
def predicted_tracks(found: Predictions, manoeuvre: str) -> Figure:
    """Track of one manoeuvre by the estimate, over those of drawn ships; x up, equal axes."""
    own = found.tracks[found.tracks.manoeuvre == manoeuvre]
    if not len(own):
        return nothing("No ship sailed it.")
    x, y = own.x.to_numpy(dtype=float), own.y.to_numpy(dtype=float)
    room = 0.05 * max(float(np.ptp(x)), float(np.ptp(y)), 1e-6)
    limits = (float(y.min()) - room, float(y.max()) + room, float(x.min()) - room, float(x.max()) + room)
    height = float(np.clip(_WIDTH * (limits[3] - limits[2]) / (limits[1] - limits[0]), 1.3, 4.2))
    figure = Figure(figsize=(_WIDTH + 0.87, height + 1.1))
    axes = placed(figure, 0.72, 0.5, _WIDTH, height)
    for ship, part in own.groupby("ship"):
        if ship:
            axes.plot(part.y, part.x, color=MEASURED, linewidth=0.6, alpha=0.7, zorder=1, gid=trace("drawn ships"))
    best = own[own.ship == 0]
    axes.plot(best.y, best.x, color=BLUE, linewidth=1.6, zorder=2, gid=trace("estimate"))
    # Equal scales within the frame that there is: the shorter side gets more room.
    scale = max((limits[1] - limits[0]) / _WIDTH, (limits[3] - limits[2]) / height)
    middle = 0.5 * (limits[0] + limits[1]), 0.5 * (limits[2] + limits[3])
    axes.set_xlim(middle[0] - 0.5 * scale * _WIDTH, middle[0] + 0.5 * scale * _WIDTH)
    axes.set_ylim(middle[1] - 0.5 * scale * height, middle[1] + 0.5 * scale * height)
    zoomable(axes)
    few_ticks(axes)
    axes.set_xlabel("y (m)")
    axes.set_ylabel("x (m)")
    axes.set_title(text(manoeuvre, 40), loc="left")
    handles = [Line2D([], [], color=BLUE, linewidth=1.6), Line2D([], [], color=MEASURED, linewidth=1.0)]
    figure.legend(handles, ["estimate", "draws from what it leaves open"], loc="upper left", ncols=2, fontsize=8)
    return figure


@styled
def measured_beside_predicted(found: Predictions, kind: str) -> Figure:
    """Measured figures and intervals of one kind of manoeuvre, in per cent of the predicted value."""
    own = found.measured[(found.measured.kind == kind) & np.isfinite(found.measured.measured.astype(float))]
    own = own[np.isfinite(own.predicted) & (own.predicted.abs() > 0) & np.isfinite(own.lower)]
    if not len(own):
        return nothing("No trial holds a figure of this kind with an interval.")
    names = [_label(row.trial, row.title) for row in own.itertuples()]
    left = min(label_width([name[:_TITLE] for name in names]) + 1.4, 3.4)
    figure = Figure(figsize=(left + 3.6, 0.22 * len(own) + 0.95))
    axes = placed(figure, left, 0.5, 3.4, 0.22 * len(own))
    for k, row in enumerate(own.to_dict("records")):
        scale = 100.0 / float(row["predicted"])
        low, high = sorted((float(row["lower"]) * scale - 100, float(row["upper"]) * scale - 100))
        axes.plot([_cut(low), _cut(high)], [k, k], color=MEASURED, linewidth=4, solid_capstyle="butt", zorder=1)
        axes.plot(0, k, "|", color=BLUE, markersize=7, zorder=2)
        inside = bool(row["inside"])
        colour = INK if inside else VERMILLION
        face = "white" if row["role"] == "holdout" else colour
        place = _cut(float(row["measured"]) * scale - 100)
        axes.plot(place, k, "o" if inside else "X", color=colour, markersize=4.5, markerfacecolor=face, zorder=3)
    rows(axes, [name[:_TITLE] for name in names])
    axes.axvline(0, color=GREY, linewidth=0.7, zorder=0)
    axes.set_xlabel("difference from the predicted value (%)")
    few_ticks(axes, 6, len(own))
    axes.set_yticks(range(len(names)), labels=[text(name, _TITLE) for name in names])
    handles = [
        Line2D([], [], color=MEASURED, linewidth=4),
        Line2D([], [], color=INK, marker="o", linestyle="", markersize=4.5),
        Line2D([], [], color=VERMILLION, marker="X", linestyle="", markersize=5),
        Line2D([], [], color=INK, marker="o", linestyle="", markersize=4.5, markerfacecolor="white"),
    ]
    words = [f"{100 * found.level:.0f} % interval", "measured, inside", "outside", "held out"]
    figure.legend(handles, words, loc="upper right", ncols=4, fontsize=7.5, handletextpad=0.3, columnspacing=0.8)
    return figure


def _label(trial: str, title: str) -> str:
    return f"{trial}: {title.partition(' (')[0]}"


def _cut(percent: float, most: float = 100.0) -> float:
    """A difference within the frame: an interval without an end is drawn to its edge."""
    return math.copysign(most, percent) if abs(percent) > most else percent


def kinds(found: Predictions) -> list[str]:
    """Kinds of manoeuvres that have measured figures, in the order of the table."""
    known: pd.Series[str] = found.measured.kind[np.isfinite(found.measured.measured.astype(float))]
    return [str(kind) for kind in dict.fromkeys(known)]
