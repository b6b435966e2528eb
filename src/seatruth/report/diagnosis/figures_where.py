"""Figures of where the gap lies: its split, channels, places, tree of causes, time and operating region."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import chance
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
from seatruth.report.text.diagnosis import node_in_words
from seatruth.report.text.gap import channels, fits, ranked

_WIDE = 4.8
_PARTS = (
    ("noise", "noise", MEASURED, ""),
    ("parameters", "coefficients", ORANGE, "//"),
    ("effects", "effects", BLUE, ""),
    ("left", "not explained", VERMILLION, "xx"),
)
LABELS = {"before": "as declared", "refit": "refitted", "effects": "with the effects"}
"""What the fits are called in tables and figures."""
_MARKS = {"before": (VERMILLION, "d"), "refit": (ORANGE, "s"), "effects": (BLUE, "o")}
_LEAST = 0.005
"""Probability below which a place or a node of the tree is not drawn."""
_MOST_PLACES = 12
_MOST_NODES = 18


@styled
def split(diagnosis: Diagnosis) -> Figure:
    """The misfit of the declared model, split into noise, coefficients, effects and what is left."""
    figure = Figure(figsize=(_WIDE, 1.35))
    axes = placed(figure, 0.15, 0.4, _WIDE - 0.4, 0.34)
    start, marks = 0.0, []
    for key, label, colour, hatch in _PARTS:
        share = float(getattr(diagnosis.shares, key))
        share = share if math.isfinite(share) else 0.0
        axes.barh(0, share, left=start, color=colour, edgecolor="white", linewidth=0.8, hatch=hatch, height=1.0)
        start += share
        said = "under 0.1 %" if 0.0 < share < 1e-3 else percent(share) or "0 %"
        marks.append(Rectangle((0, 0), 1, 1, facecolor=colour, edgecolor="white", hatch=hatch, label=f"{label} {said}"))
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(-0.5, 0.5)
    axes.set_yticks([])
    axes.grid(False)
    axes.set_xticks(np.linspace(0, 1, 6), labels=[f"{k} %" for k in range(0, 101, 20)])
    figure.legend(handles=marks, loc="upper left", ncols=2, borderaxespad=0.2, columnspacing=1.4, handlelength=1.4)
    return figure


@styled
def multiples(diagnosis: Diagnosis) -> Figure:
    """Root mean square error of each channel over all trials in multiples of its noise, by fit."""
    found, compared = channels(diagnosis), fits(diagnosis)
    finite = [v for row in found for fit in compared if math.isfinite(v := row.multiple[fit]) and v > 0]
    if not finite:
        return nothing("The noise of no channel is known.")
    names = [row.channel.name for row in found]
    left, height = label_width(names), 0.3 * len(names)
    figure = Figure(figsize=(_WIDE, height + 0.95))
    axes = placed(figure, left, 0.48, _WIDE - left - 0.2, height)
    rows(axes, names)
    log_axis(axes, "x", min(min(finite) / 1.3, 0.8), max(max(finite) * 1.3, 2.0))
    axes.axvspan(axes.get_xlim()[0], 1.0, color=FAINT, linewidth=0, zorder=0)
    axes.axvline(1.0, color=INK, linewidth=1.0, zorder=1)
    for y, row in enumerate(found):
        for fit in compared:
            value, (colour, marker) = row.multiple[fit], _MARKS[fit]
            if math.isfinite(value) and value > 0:
                axes.plot([value], [y], marker=marker, color=colour, markersize=6, markeredgecolor="white", zorder=3)
    axes.set_xlabel("RMSE / noise")
    marks = [
        Line2D([], [], color=_MARKS[fit][0], marker=_MARKS[fit][1], linestyle="", label=LABELS[fit]) for fit in compared
    ]
    figure.legend(handles=marks, loc="upper left", ncols=3, borderaxespad=0.2, columnspacing=1.2, handletextpad=0.2)
    return figure


@styled
def places(diagnosis: Diagnosis) -> Figure:
    """Probability that something acts at each place; those of the verdict in blue."""
    found = [entry for entry in ranked(diagnosis.places) if entry[1] >= _LEAST][:_MOST_PLACES]
    if not found:
        return nothing("No place has a probability worth drawing.")
    named = set(diagnosis.verdict.places)
    bars = [(name.replace(":", " of "), p, name in named) for name, p in found]
    return _bars(bars, "probability")


def nodes(diagnosis: Diagnosis) -> list[tuple[int, str, float]]:
    """Depth, path and probability of the nodes of the tree that are worth showing, parents before children."""
    kept = {node: p for node, p in diagnosis.causes.items() if node and p >= _LEAST}

    def order(node: str) -> list[tuple[float, str]]:
        parts = node.split(".")
        above = [".".join(parts[: k + 1]) for k in range(len(parts))]
        return [(-diagnosis.causes.get(path, 0.0), path) for path in above]

    return [(node.count("."), node, kept[node]) for node in sorted(kept, key=order)]


@styled
def tree(diagnosis: Diagnosis) -> Figure:
    """Probability that something acts, by node of the tree of causes; those of the verdict and above them in blue."""
    found = nodes(diagnosis)[:_MOST_NODES]
    if not found:
        return nothing("No cause has a probability worth drawing.")
    named = [cause.cause for cause in diagnosis.verdict.causes]
    bars = []
    for depth, node, p in found:
        acting = any(cause == node or cause.startswith(f"{node}.") for cause in named)
        bars.append((f"{'    ' * depth}{node_in_words(node)}", p, acting))
    return _bars(bars, "probability", indented=True)


def _bars(bars: list[tuple[str, float, bool]], label: str, *, indented: bool = False) -> Figure:
    names = [name if indented else text(name, 40) for name, *_ in bars]
    widths = [0.062 * len(name.lstrip()) + 0.17 * _depth(name) for name in names]
    left = min(0.25 + max(widths), 2.9)
    height = 0.24 * len(bars)
    figure = Figure(figsize=(_WIDE, height + 0.6))
    axes = placed(figure, left, 0.46, _WIDE - left - 0.85, height)
    for y, (_, p, acting) in enumerate(bars):
        axes.barh(y, p, color=BLUE if acting else MEASURED, height=0.62)
        axes.annotate(chance(p), (p, y), (4, 0), textcoords="offset points", va="center", fontsize=8)
    rows(axes, [""] * len(names))
    axes.set_yticks([])
    for y, name in enumerate(names):
        offset = 72.0 * (0.1 - left) + 12.0 * _depth(name)
        axes.annotate(
            text(name.lstrip(), int((left - 0.25 - 0.17 * _depth(name)) / 0.053)),
            (0.0, y),
            (offset, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
        )
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks(np.linspace(0, 1, 3), labels=["0 %", "50 %", "100 %"])
    axes.set_xlabel(label)
    return figure


def _depth(name: str) -> int:
    """Level of an indented name."""
    return (len(name) - len(name.lstrip())) // 4


@styled
def time_map(diagnosis: Diagnosis) -> Figure:
    """Misfit of the refitted model over time, a row a trial; significant parts carry a dot."""
    cells = diagnosis.time
    if not len(cells):
        return nothing("There are no samples to look at in time.")
    names = [str(name) for name in dict.fromkeys(cells["trial"])]
    left, height = label_width(names), max(0.26 * len(names), 0.3)
    figure = Figure(figsize=(7.2, height + 1.15))
    axes = placed(figure, left, 0.92, 7.2 - left - 0.2, height)
    norm = _norm(cells)
    for _, cell in cells.iterrows():
        start, end = float(cell["from_s"]), float(cell["to_s"])
        _cell(axes, (start, names.index(str(cell["trial"])) - 0.42, end - start, 0.84), cell, norm)
    rows(axes, names)
    axes.set_xlim(0.0, float(cells["to_s"].max()))
    few_ticks(axes, 8, 4)
    axes.set_yticks(range(len(names)), labels=[text(name) for name in names])
    axes.grid(False)
    axes.set_xlabel("t (s)")
    _key(figure, norm, left)
    return figure


@styled
def region_map(diagnosis: Diagnosis) -> Figure:
    """Misfit of the refitted model over cells of each variable of the motion, a row a variable; dots as in time."""
    cells = diagnosis.region
    if not len(cells):
        return nothing("There are too few samples to compare operating regions.")
    variables = [str(name) for name in dict.fromkeys(cells["variable"])]
    left, height = label_width(variables, 0.9), 0.42 * len(variables)
    figure = Figure(figsize=(7.2, height + 0.8))
    axes = placed(figure, left, 0.58, 7.2 - left - 0.2, height)
    norm = _norm(cells)
    for y, variable in enumerate(variables):
        own = cells[cells["variable"] == variable]
        for k, (_, cell) in enumerate(own.iterrows()):
            width = 1.0 / len(own)
            _cell(axes, (k * width, y - 0.42, width, 0.84), cell, norm, _label(cell, len(own)))
    axes.set_xlim(0.0, 1.0)
    rows(axes, variables)
    axes.set_xticks([])
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    _key(figure, norm, left)
    return figure


def _label(cell: pd.Series, many: int) -> str:
    if cell["variable"] == "heading":
        short = {"north": "N", "east": "E", "south": "S", "west": "W"}
        return "".join(short[part] for part in str(cell["cell"]).split("-"))
    scale = shown("", str(cell["unit"]))
    ends = [number(float(cell[end]) * scale.factor, 2) for end in ("from", "to")]
    return f"{ends[0]} … {ends[1]}{' ' + scale.unit if many <= 4 and scale.unit else ''}"


def _norm(cells: pd.DataFrame) -> LogNorm:
    """Colours by the root of the misfit: 1 is noise alone."""
    sizes = np.sqrt(np.maximum(cells["misfit"].to_numpy(dtype=float), 1e-6))
    sizes = sizes[np.isfinite(sizes)]
    return LogNorm(0.7, max(float(sizes.max()) if sizes.size else 1.0, 2.0))


def _cell(axes: Axes, box: tuple[float, float, float, float], cell: pd.Series, norm: LogNorm, label: str = "") -> None:
    misfit = float(cell["misfit"])
    shade = float(np.clip(norm(math.sqrt(max(misfit, 1e-6))), 0.0, 1.0)) if math.isfinite(misfit) else 1.0
    colour = colormaps["Blues"](0.05 + 0.85 * shade)
    x, y, wide, high = box
    axes.add_patch(Rectangle((x, y), wide, high, facecolor=colour, edgecolor="white", linewidth=1.0))
    dark = "white" if shade > 0.62 else INK
    middle = y + high / 2
    if cell["significant"]:
        axes.plot([x + wide / 2], [middle + (0.2 if label else 0.0)], marker="o", color=dark, markersize=3.4)
    if label:
        axes.text(x + wide / 2, middle - 0.12, label, ha="center", va="center", fontsize=7.2, color=dark)


def _key(figure: Figure, norm: LogNorm, left: float) -> None:
    """The scale of colours, and what a dot is."""
    axes = placed(figure, left, 0.3, 1.8, 0.1)
    low, high = float(norm.vmin or 0.7), float(norm.vmax or 2.0)
    colours = colormaps["Blues"](0.05 + 0.85 * np.asarray(norm(np.geomspace(low, high, 64))))
    axes.imshow(colours[None, :, :3], aspect="auto", extent=(math.log(low), math.log(high), 0, 1), interpolation="none")
    ticks = [value for value in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if low <= value <= high]
    if len(ticks) > 5:
        ticks = [value for value in ticks if value in (1, 10, 100, 1000)]
    axes.set_xticks([math.log(value) for value in ticks], labels=[tick(value) for value in ticks])
    axes.set_yticks([])
    axes.grid(False)
    across, up = figure.get_size_inches()
    for x, colour, label in ((1.9, INK, "error / noise"), (2.95, GREY, "●  significant")):
        figure.text((left + x) / across, 0.3 / up, label, fontsize=8, va="bottom", color=colour)


def label_of_cell(value: float) -> str:
    """Root of a misfit as tables show it."""
    return number(math.sqrt(max(value, 0.0)), 3) if math.isfinite(value) else "∞"
