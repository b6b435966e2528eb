"""Figures of where the gap lies: its split, channels, time and operating region."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from seatruth.diagnosis.results import Diagnosis
from seatruth.report.diagnosis.words import channels
from seatruth.report.figures.style import (
    BLUE,
    FAINT,
    GREY,
    INK,
    MEASURED,
    ORANGE,
    VERMILLION,
    few_ticks,
    label_width,
    log_axis,
    nothing,
    placed,
    rows,
    styled,
    text,
)
from seatruth.report.numbers import number, percent, shown, tick

_WIDE = 4.8
_PARTS = (
    ("noise", "noise", MEASURED, ""),
    ("parameters", "coefficients", ORANGE, "//"),
    ("effects", "effects", BLUE, ""),
    ("left", "left over", VERMILLION, "xx"),
)
FITS = (("before", "as believed", VERMILLION, "d"), ("refit", "refitted", ORANGE, "s"), ("effect", "", BLUE, "o"))
"""Key, label, colour and marker of the three fits that are compared."""


@styled
def split(diagnosis: Diagnosis) -> Figure:
    """The misfit of the model as it was believed, split into noise, coefficients, effects and what is left."""
    figure = Figure(figsize=(7.2, 1.15))
    axes = placed(figure, 0.1, 0.42, 6.8, 0.34)
    start = 0.0
    for key, _, colour, hatch in _PARTS:
        share = float(diagnosis.shares[key])
        axes.barh(0, share, left=start, color=colour, edgecolor="white", linewidth=0.8, hatch=hatch, height=1.0)
        start += share
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(-0.5, 0.5)
    axes.set_yticks([])
    axes.grid(False)
    axes.set_xticks(np.linspace(0, 1, 6), labels=[f"{k} %" for k in range(0, 101, 20)])
    marks = [
        Rectangle(
            (0, 0), 1, 1, facecolor=colour, edgecolor="white", hatch=hatch, label=f"{label} {_share(diagnosis, key)}"
        )
        for key, label, colour, hatch in _PARTS
    ]
    figure.legend(handles=marks, loc="upper left", ncols=4, borderaxespad=0.2, columnspacing=1.4, handlelength=1.4)
    return figure


def _share(diagnosis: Diagnosis, key: str) -> str:
    share = float(diagnosis.shares[key])
    return "under 0.1 %" if 0.0 < share < 1e-3 else percent(share) or "0 %"


def best_label(diagnosis: Diagnosis) -> str:
    """What the third fit is called."""
    return "with the named effects" if diagnosis.augmented["effects"] else "without any effect"


@styled
def multiples(diagnosis: Diagnosis) -> Figure:
    """Root mean square error of each channel over all trials in multiples of its noise, for the three fits."""
    found = channels(diagnosis)
    names = [row["channel"] for row in found]
    fits = FITS if diagnosis.augmented["effects"] else FITS[:2]
    values = [row[f"multiple_{key}"] for row in found for key, *_ in fits]
    finite = [value for value in values if math.isfinite(value) and value > 0]
    if not finite:
        return nothing("The noise of no channel is known.")
    left, height = label_width(names), 0.3 * len(names)
    figure = Figure(figsize=(_WIDE, height + 0.95))
    axes = placed(figure, left, 0.48, _WIDE - left - 0.2, height)
    rows(axes, names)
    high = max(max(finite) * 1.3, 2.0)
    log_axis(axes, "x", min(min(finite) / 1.3, 0.8), high)
    axes.axvspan(axes.get_xlim()[0], 1.0, color=FAINT, linewidth=0, zorder=0)
    axes.axvline(1.0, color=INK, linewidth=1.0, zorder=1)
    for y, row in enumerate(found):
        for key, _, colour, marker in fits:
            value = row[f"multiple_{key}"]
            if math.isfinite(value) and value > 0:
                axes.plot([value], [y], marker=marker, color=colour, markersize=6, markeredgecolor="white", zorder=3)
    axes.set_xlabel("RMSE / noise")
    marks = [
        Line2D([], [], color=colour, marker=marker, linestyle="", label=label or best_label(diagnosis))
        for key, label, colour, marker in fits
    ]
    figure.legend(handles=marks, loc="upper left", ncols=3, borderaxespad=0.2, columnspacing=1.2, handletextpad=0.2)
    return figure


@styled
def time_map(diagnosis: Diagnosis) -> Figure:
    """Misfit of the refitted model over time, a row a trial; parts that stand out carry a dot."""
    cells = diagnosis.where["time"]
    if not cells:
        return nothing("No samples to look at in time.")
    names = list(dict.fromkeys(str(cell["trial"]) for cell in cells))
    left, height = label_width(names), max(0.26 * len(names), 0.3)
    figure = Figure(figsize=(7.2, height + 1.15))
    axes = placed(figure, left, 0.92, 7.2 - left - 0.2, height)
    norm = _norm(cells)
    for cell in cells:
        y = names.index(str(cell["trial"]))
        _cell(axes, float(cell["from_s"]), y - 0.42, float(cell["to_s"] - cell["from_s"]), 0.84, cell, norm)
    rows(axes, names)
    axes.set_xlim(0.0, max(float(cell["to_s"]) for cell in cells))
    few_ticks(axes, 8, 4)
    axes.set_yticks(range(len(names)), labels=[text(name) for name in names])
    axes.grid(False)
    axes.set_xlabel("t (s)")
    _key(figure, norm, left)
    return figure


@styled
def region_map(diagnosis: Diagnosis) -> Figure:
    """Misfit of the refitted model over cells of each variable of the motion, a row a variable; dots as in time."""
    cells = diagnosis.where["region"]
    if not cells:
        return nothing("Too few samples to compare operating regions.")
    variables = list(dict.fromkeys(str(cell["variable"]) for cell in cells))
    left = label_width(variables, 0.9)
    height = 0.42 * len(variables)
    figure = Figure(figsize=(7.2, height + 0.8))
    axes = placed(figure, left, 0.58, 7.2 - left - 0.2, height)
    norm = _norm(cells)
    for y, variable in enumerate(variables):
        own = [cell for cell in cells if cell["variable"] == variable]
        for k, cell in enumerate(own):
            width = 1.0 / len(own)
            _cell(axes, k * width, y - 0.42, width, 0.84, cell, norm, _label(cell, len(own)))
    axes.set_xlim(0.0, 1.0)
    rows(axes, variables)
    axes.set_xticks([])
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    _key(figure, norm, left)
    return figure


def _label(cell: dict[str, Any], many: int) -> str:
    if cell["variable"] == "heading":
        short = {"north": "N", "east": "E", "south": "S", "west": "W"}
        return "".join(short[part] for part in str(cell["cell"]).split("-"))
    channel = shown("", str(cell["unit"]))
    ends = [number(float(cell[key]) * channel.factor, 2) for key in ("from", "to")]
    return f"{ends[0]} … {ends[1]}{' ' + channel.unit if many <= 4 and channel.unit else ''}"


def _norm(cells: Sequence[dict[str, Any]]) -> LogNorm:
    """Colours by the root of the misfit: 1 is noise alone."""
    sizes = [math.sqrt(max(float(cell["misfit"]), 1e-6)) for cell in cells if math.isfinite(float(cell["misfit"]))]
    return LogNorm(0.7, max(max(sizes, default=1.0), 2.0))


def _cell(
    axes: Axes, x: float, y: float, wide: float, high: float, cell: dict[str, Any], norm: LogNorm, label: str = ""
) -> None:
    size = math.sqrt(max(float(cell["misfit"]), 1e-6))
    shade = float(np.clip(norm(size), 0.0, 1.0))
    colour = colormaps["Blues"](0.05 + 0.85 * shade)
    axes.add_patch(Rectangle((x, y), wide, high, facecolor=colour, edgecolor="white", linewidth=1.0))
    dark = "white" if shade > 0.62 else INK
    middle = y + high / 2
    if cell["stands_out"]:
        axes.plot([x + wide / 2], [middle + (0.2 if label else 0.0)], marker="o", color=dark, markersize=3.4)
    if label:
        axes.text(x + wide / 2, middle - 0.12, label, ha="center", va="center", fontsize=7.2, color=dark)


def _key(figure: Figure, norm: LogNorm, left: float) -> None:
    """The scale of colours, and what a dot is."""
    axes = placed(figure, left, 0.3, 2.2, 0.1)
    low, high = float(norm.vmin or 0.7), float(norm.vmax or 2.0)
    values = np.geomspace(low, high, 64)
    colours = colormaps["Blues"](0.05 + 0.85 * np.asarray(norm(values)))
    axes.imshow(colours[None, :, :3], aspect="auto", extent=(math.log(low), math.log(high), 0, 1), interpolation="none")
    ticks = [value for value in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if low <= value <= high]
    if len(ticks) > 6:
        ticks = [value for value in ticks if value in (1, 10, 100, 1000)]
    axes.set_xticks([math.log(value) for value in ticks], labels=[tick(value) for value in ticks])
    axes.set_yticks([])
    axes.grid(False)
    figure.text((left + 2.35) / figure.get_size_inches()[0], 0.3 / figure.get_size_inches()[1],
                "misfit / noise", fontsize=8, va="bottom", color=INK)  # fmt: skip
    figure.text((left + 3.5) / figure.get_size_inches()[0], 0.3 / figure.get_size_inches()[1],
                "●  stands out", fontsize=8, va="bottom", color=GREY)  # fmt: skip
