"""The map of a log: its track and time histories with the stretches that can become trials, as one HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import blended_transform_factory
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.report.blocks import Block, Column, Pictures, Section, Statement, Table
from seatruth.report.figures.style import (
    BLUE,
    FAINT,
    GREEN,
    GREY,
    INK,
    MEASURED,
    ORANGE,
    PURPLE,
    VERMILLION,
    few_ticks,
    placed,
    styled,
    thinned,
    trace,
    zoomable,
)
from seatruth.report.page import page
from seatruth.report.sections.pictures import Album
from seatruth.trials import STANDARD_CHANNELS, Trial
from seatruth.trials.stretches import Stretch

COLOURS = {
    "zigzag": BLUE,
    "turning circle": VERMILLION,
    "stop": PURPLE,
    "straight run": GREEN,
    "steady": ORANGE,
}
"""Of each kind; the numbers say the same without colour. Parts and runs take BLUE and GREEN by turns."""

_SHOWN = ("delta", "delta_s", "psi", "theta", "u", "n", "r", "depth", "z")
"""Channels over time, at most _PANELS of them."""
_PANELS = 5
_POINTS = 1500
"""Points of a track; a pixel of the page holds more of them than can be seen."""
_NO_BREAK = "\N{NO-BREAK SPACE}"
_UNITS = "Angles are shown in degrees; everything else in SI units. x is up, y to the right."
_SYNTHETIC = "This log says that a simulator made it. Nothing here was measured at sea."


def log_map(log: Trial, stretches: Sequence[Stretch], chosen: Sequence[str], how: str) -> str:
    """The page as HTML text.

    Args:
        log: the whole recording.
        stretches: what was found, in the order of the numbers in the page.
        chosen: names of the stretches that are written as trials.
        how: in words, how the stretches were found ("manoeuvres").
    """
    facts = [
        ("Log", log.source),
        ("Time", f"{log.t[0]:g} to {log.t[-1]:g} s, {len(log)} samples"),
        ("Channels", ", ".join((*log.inputs, *log.outputs))),
        ("Split by", how),
    ]
    album = Album()
    blocks: list[Block] = [_statement(stretches, chosen, how)]
    pictures = []
    if {"x", "y"} <= set(log.outputs):
        alt = f"Track of the log in x and y with {len(stretches)} numbered stretches"
        pictures.append(
            album.picture(track(log, stretches), alt, "Track, x up. The number of a stretch stands at its start.")
        )
    alt = f"Channels of the log over time with {len(stretches)} numbered stretches"
    pictures.append(album.picture(histories(log, stretches), alt, "Channels over time."))
    blocks.append(_table(stretches, chosen))
    sections = [Section("summary", "Stretches", blocks), Section("map", "Map", [Pictures(pictures, wide=True)])]
    synthetic = _SYNTHETIC if log.synthetic else ""
    return page("Log", log.name, facts, sections, synthetic=synthetic, units=_UNITS)


def _statement(stretches: Sequence[Stretch], chosen: Sequence[str], how: str) -> Statement:
    if not stretches:
        return Statement("Nothing was found", f"The log holds no stretch of this kind ({how}).", "unsure")
    kinds = list(dict.fromkeys(stretch.kind for stretch in stretches))
    counts = ", ".join(f"{sum(s.kind == kind for s in stretches)} × {kind}" for kind in kinds)
    return Statement(
        counts,
        f"{len(chosen)} of {len(stretches)} are taken as trials. To take others, run the command again with --pick and "
        "the numbers below, as --pick 1,3-5.",
    )


def _table(stretches: Sequence[Stretch], chosen: Sequence[str]) -> Table:
    columns = [
        Column("number"),
        Column("trial"),
        Column("kind"),
        Column("start (s)", "number"),
        Column("end (s)", "number"),
        Column("length (s)", "number"),
        Column("taken"),
        Column("what it holds", "long"),
    ]
    rows = [
        [
            str(k),
            stretch.name,
            stretch.kind,
            f"{stretch.start:.1f}",
            f"{stretch.end:.1f}",
            f"{stretch.duration:.1f}",
            "yes" if stretch.name in chosen else "no",
            stretch.facts,
        ]
        for k, stretch in enumerate(stretches, 1)
    ]
    return Table("Stretches of the log", columns, rows)


def colour(stretch: Stretch, number: int) -> str:
    """The colour of a stretch; parts and runs take two by turns."""
    return COLOURS.get(stretch.kind, BLUE if number % 2 else GREEN)


@styled
def track(log: Trial, stretches: Sequence[Stretch]) -> Figure:
    """x over y in metres, each stretch in the colour of its kind with its number at its start."""
    east, north = log.outputs["y"], log.outputs["x"]
    known = np.isfinite(east) & np.isfinite(north)
    high = _height(east[known], north[known])
    figure = Figure(figsize=(9.2, high + 0.65))
    axes = placed(figure, 0.75, 0.5, 8.2, high)
    if not known.any():
        axes.text(0.5, 0.5, "No position is valid.", ha="center", transform=axes.transAxes, color=GREY)
        return figure
    whole = np.flatnonzero(known)
    axes.plot(*_line(east, north, whole), color=MEASURED, linewidth=0.9, gid=trace("whole log"))
    for number, stretch in enumerate(stretches, 1):
        rows = np.flatnonzero(known & (log.t >= stretch.start) & (log.t <= stretch.end))
        if not rows.size:
            continue
        shade = colour(stretch, number)
        axes.plot(*_line(east, north, rows), color=shade, linewidth=2.0, solid_capstyle="butt", gid=trace(stretch.kind))
        at = (float(east[rows[0]]), float(north[rows[0]]))
        axes.plot(*at, marker="o", color=shade, markersize=4)
        # It begins at the very point, so that it stays there when a reader zooms.
        axes.text(*at, f"{_NO_BREAK}{number}", color=INK, fontweight="bold", clip_on=True)
    kinds = {stretch.kind: colour(stretch, number) for number, stretch in enumerate(stretches, 1)}
    lines = [Line2D([], [], color=shade, linewidth=2.0, label=kind) for kind, shade in kinds.items()]
    lines.append(Line2D([], [], color=MEASURED, linewidth=0.9, label="no stretch"))
    axes.legend(handles=lines, loc="best")
    axes.set_aspect("equal", adjustable="datalim")
    axes.apply_aspect()
    zoomable(axes)
    few_ticks(axes, 7, 6)
    axes.set_xlabel("y (m)")
    axes.set_ylabel("x (m)")
    return figure


def _height(east: Array, north: Array) -> float:
    """Inches for axes 8.2 in wide, so that the scales of x and y are equal without much empty paper."""
    if not east.size:
        return 2.0
    shape = float(np.ptp(north)) / max(float(np.ptp(east)), 1e-9)
    return float(np.clip(8.2 * shape, 2.5, 7.5))


def _line(east: Array, north: Array, rows: NDArray[np.intp]) -> tuple[Array, Array]:
    """Points of a line through some samples, every so many of them."""
    few = rows[:: max(1, rows.size // _POINTS)]
    few = few if few[-1] == rows[-1] else np.append(few, rows[-1])
    return east[few], north[few]


@styled
def histories(log: Trial, stretches: Sequence[Stretch]) -> Figure:
    """Channels over time, one panel each, the stretches as bands with their numbers above the first."""
    recorded = {**log.inputs, **log.outputs}
    names = [name for name in _SHOWN if name in recorded and np.isfinite(recorded[name]).any()][:_PANELS]
    names = names or list(recorded)[:1]
    height = 1.15
    figure = Figure(figsize=(9.2, height * len(names) + 0.85))
    for k, name in enumerate(names):
        axes = placed(figure, 0.75, 0.5 + height * (len(names) - 1 - k), 8.2, height - 0.18)
        _history(axes, log, name)
        _bands(axes, stretches, numbers=k == 0)
        axes.set_xlim(float(log.t[0]), float(log.t[-1]))
        zoomable(axes, "t")
        if k + 1 < len(names):
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("time (s)")
    return figure


def _history(axes: Axes, log: Trial, name: str) -> None:
    values = log.channel(name)
    unit = STANDARD_CHANNELS[name].unit if name in STANDARD_CHANNELS else ""
    if unit.startswith("rad"):
        if name == "psi":
            known = np.isfinite(values)
            values = np.array(values)
            values[known] = np.unwrap(values[known])
        values, unit = np.degrees(values), unit.replace("rad", "deg")
    rows = thinned(log.t, values, 500)
    axes.plot(log.t[rows], values[rows], color=INK, linewidth=0.8)
    few_ticks(axes, 8, 3)
    axes.set_ylabel(f"{name} ({unit})" if unit else name)


def _bands(axes: Axes, stretches: Sequence[Stretch], *, numbers: bool) -> None:
    across = blended_transform_factory(axes.transData, axes.transAxes)
    for number, stretch in enumerate(stretches, 1):
        axes.axvspan(stretch.start, stretch.end, color=colour(stretch, number), alpha=0.22, linewidth=0)
        axes.axvline(stretch.start, color=FAINT, linewidth=0.6)
        if numbers:
            middle = 0.5 * (stretch.start + stretch.end)
            look: dict[str, Any] = {"ha": "center", "va": "top", "fontweight": "bold", "clip_on": True}
            axes.text(middle, 0.97, str(number), transform=across, **look)
