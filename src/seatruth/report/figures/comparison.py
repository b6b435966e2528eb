"""Figures of a comparison: accuracy against noise, ranks, how soon solvers get there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from seatruth.comparison.ranks import Ranking
from seatruth.report.figures.style import (
    CYCLE,
    DASHES,
    GREY,
    INK,
    distinct,
    few_ticks,
    log_axis,
    nothing,
    placed,
    styled,
    text,
)
from seatruth.report.numbers import tick

if TYPE_CHECKING:
    from seatruth.comparison.results import Results

COLOURS = (*CYCLE, "#56B4E9", "#8C6D1F", "#7F7F7F", "#332288", "#882255", "#44AA99", "#DDCC77", "#AA4499")
"""Those of Okabe and Ito, and of Tol's muted scheme; markers keep apart what is still alike."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")
_ASIDE = 0.035
_COLUMNS = 3
_MOST_PANELS = 24
_ROOM = 0.62
_LEAST = 5.2
"""Inches across of any figure: room for the names of the solvers."""


def colours(results: Results) -> dict[str, tuple[str, str]]:
    """Colour and marker of each solver, the same in all figures."""
    return {
        label: (COLOURS[k % len(COLOURS)], MARKERS[(k + 3 * (k // len(COLOURS))) % len(MARKERS)])
        for k, label in enumerate(results.comparison.solver)
    }


@styled
def accuracy(results: Results, noise: str) -> Figure:
    """The central figure: error of the parameters against the level of one kind of noise, one panel a problem.

    Where the truth is not known: error of prediction of the trials held out. Hollow: fewer than half converged.
    """
    table = results.overall
    table = table[(table["noise"] == noise) & (table["budget"] == table["problem"].map(_budgets(results)))]
    problems = [name for name in dict.fromkeys(table["problem"]) if _shown(table[table["problem"] == name])]
    if not problems:
        return nothing(f"No accuracy can be told under {noise} noise.")
    bounds = results.accuracy[results.accuracy["noise"] == noise] if len(results.accuracy) else results.accuracy
    figure, panels = panels_of(len(problems), results, costs=list(dict.fromkeys(table["cost"])), bound=True)
    for axes, name in zip(panels, problems):
        own = table[table["problem"] == name]
        known = own["error_percent"].notna().any()
        what = "error_percent" if known else "held_out"
        factor = 1.0 if known else 100.0
        levels = sorted(set(own["level"]))
        for (cost, solver), line in own.groupby(["cost", "solver"], sort=False):
            share = line["converged"]
            line_of(axes, results, str(cost), str(solver), levels, line["level"], factor * line[what], converged=share)
        if known:
            part = bounds[bounds["problem"] == name]
            size = (100.0 * part["crlb"] / part["truth"].abs()).replace([np.inf, -np.inf], np.nan)
            bound = size.groupby(part["level"]).median().dropna()
            axes.plot([levels.index(x) for x in bound.index], bound, ":", color=INK, linewidth=1.4, zorder=5)
        noise_axis(axes, levels)
        axes.set_title(text(name, 40), loc="left")
        axes.set_ylabel("error of parameters (%)" if known else "error of prediction (%)")
    return figure


@styled
def kinds(results: Results, level: float) -> Figure:
    """Error of the parameters under the kinds of noise of one level, one panel a problem."""
    table = results.overall
    table = table[(table["level"] == level) & (table["budget"] == table["problem"].map(_budgets(results)))]
    problems = [name for name in dict.fromkeys(table["problem"]) if _shown(table[table["problem"] == name])]
    names = list(dict.fromkeys(table["noise"]))
    if not problems:
        return nothing("No accuracy can be told.")
    figure, panels = panels_of(len(problems), results, costs=list(dict.fromkeys(table["cost"])))
    for axes, name in zip(panels, problems):
        own = table[table["problem"] == name]
        known = own["error_percent"].notna().any()
        for (cost, solver), line in own.groupby(["cost", "solver"], sort=False):
            values = line["error_percent"] if known else 100.0 * line["held_out"]
            line_of(axes, results, str(cost), str(solver), names, line["noise"], values, joined=False)
        axes.set_xticks(range(len(names)), labels=[text(str(kind), 9) for kind in names], fontsize=6.2)
        axes.set_xlim(-0.5, len(names) - 0.5)
        _error_axis(axes)
        axes.set_title(text(name, 40), loc="left")
        axes.set_xlabel(f"kind of noise, {100 * level:g} %")
        axes.set_ylabel("error of parameters (%)" if known else "error of prediction (%)")
    return figure


@styled
def by_parameter(results: Results, problem: str, noise: str) -> Figure:
    """Root mean square error of each parameter against the noise, and its Cramer-Rao bound, one panel a parameter."""
    table = results.accuracy
    table = table[(table["problem"] == problem) & (table["noise"] == noise)]
    table = table[table["budget"] == _budgets(results)[problem]].dropna(subset=["rmse"])
    names = list(dict.fromkeys(table["parameter"]))[:_MOST_PANELS]
    if not names:
        return nothing("The true parameters are not known.")
    figure, panels = panels_of(len(names), results, costs=list(dict.fromkeys(table["cost"])), bound=True)
    for axes, name in zip(panels, names):
        own = table[table["parameter"] == name]
        levels = sorted(set(own["level"]))
        truth, unit = abs(float(own["truth"].iloc[0])), str(own["unit"].iloc[0])
        factor = 100.0 / truth if truth > 0 else 1.0
        for (cost, solver), line in own.groupby(["cost", "solver"], sort=False):
            line_of(axes, results, str(cost), str(solver), levels, line["level"], factor * line["rmse"])
        bound = own.groupby("level")["crlb"].first().dropna()
        bound = bound[np.isfinite(bound)]
        axes.plot([levels.index(x) for x in bound.index], factor * bound, ":", color=INK, linewidth=1.4, zorder=5)
        noise_axis(axes, levels)
        axes.set_title(text(name), loc="left")
        axes.set_ylabel(
            "rms error (%)" if truth > 0 else f"rms error ({unit})" if unit not in ("", "1") else "rms error"
        )
    return figure


@styled
def ranks(made: Ranking) -> Figure:
    """Critical-difference diagram: mean ranks, the best at the left; bars join what no test tells apart."""
    names, mean = made.order, made.table["mean_rank"].to_numpy(dtype=float)
    size = len(names)
    half = (size + 1) // 2
    height = 0.62 + 0.13 * len(made.groups) + 0.19 * half
    shown = distinct(names)
    labels = [f"{shown[name]} ({mean[k]:.2f})" for k, name in enumerate(names)]
    side = 0.2 + 0.068 * max(len(label) for label in labels)
    figure = Figure(figsize=(2.6 + 2.0 * side, height))
    axes = placed(figure, side, 0.05, 2.6, height - 0.1)
    axes.set_xlim(1, size)
    axes.set_ylim(0, height - 0.1)
    axes.axis("off")
    top = height - 0.42
    axes.plot([1, size], [top, top], color=INK, linewidth=1.0)
    for rank in range(1, size + 1):
        axes.plot([rank, rank], [top, top + 0.05], color=INK, linewidth=1.0)
        axes.annotate(str(rank), (rank, top + 0.08), ha="center", va="bottom", fontsize=8)
    for place, group in enumerate(made.groups):
        found = [mean[names.index(name)] for name in group]
        y = top - 0.11 - 0.13 * place
        axes.plot([min(found) - 0.06, max(found) + 0.06], [y, y], color=INK, linewidth=3.2, solid_capstyle="butt")
    low = top - 0.14 - 0.13 * len(made.groups)
    for k, label in enumerate(labels):
        left = k < half
        y = low - 0.19 * (k if left else size - 1 - k)
        edge = 1.0 if left else float(size)
        axes.plot([mean[k], mean[k], edge], [top, y, y], color=GREY, linewidth=0.8, clip_on=False)
        axes.annotate(
            label,
            (edge, y),
            (-4 if left else 4, 0),
            textcoords="offset points",
            ha="right" if left else "left",
            va="center",
            fontsize=8,
            annotation_clip=False,
        )
    return figure


@styled
def reached(results: Results, cost: str, what: str) -> Figure:
    """Distribution of how soon targets are reached ("ecdf"), or performance profiles ("profiles"), of one cost."""
    table = results.ecdf if what == "ecdf" else results.profiles
    table = table[table["cost"] == cost]
    if not len(table):
        return nothing("No run reached a target.")
    column = "evaluations" if what == "ecdf" else "factor"
    figure, (axes,) = panels_of(1, results, costs=[], width=4.3, height=2.5)
    high = float(table[column].max()) * (1.3 if what == "ecdf" else 1.05)
    low = max(0.5, float(table[column].min()) / 1.3) if what == "ecdf" else 1.0
    for solver in results.solvers:
        own = table[table["solver"] == solver]
        if not len(own):
            continue
        colour, _ = colours(results)[solver]
        x = [low, *own[column], high]
        y = [float(own["share"].iloc[0]) if own[column].iloc[0] <= low else 0.0, *own["share"], own["share"].iloc[-1]]
        place = list(results.comparison.solver).index(solver)
        axes.step(
            x, y, where="post", color=colour, linestyle=DASHES[place // len(COLOURS) % len(DASHES)], linewidth=1.5
        )
    axes.set_xscale("log")
    axes.set_xlim(low, max(high, low * 1.5))
    axes.set_ylim(0, 1.02)
    axes.xaxis.set_major_formatter(lambda value, _: tick(value))
    axes.set_xlabel("evaluations / dimension" if what == "ecdf" else "evaluations over those of the fastest")
    axes.set_ylabel("share of targets reached" if what == "ecdf" else "share of realisations")
    return figure


@styled
def against_time(results: Results) -> Figure:
    """Median excess over the best known fit against search time, one panel a problem and cost."""
    table = results.wall_time
    places = list(dict.fromkeys(zip(table["problem"], table["cost"])))[:_MOST_PANELS]
    if not places:
        return nothing("No run has a history.")
    figure, panels = panels_of(len(places), results, costs=[])
    for axes, (problem, cost) in zip(panels, places):
        own = table[(table["problem"] == problem) & (table["cost"] == cost)]
        for solver, line in own.groupby("solver", sort=False):
            colour, _ = colours(results)[str(solver)]
            axes.plot(line["seconds"], line["excess"], color=colour, linewidth=1.4)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.axhline(results.comparison.success, color=GREY, linewidth=0.8, linestyle="--")
        axes.set_title(text(f"{problem}, {cost}", 40), loc="left")
        axes.set_xlabel("search time (s)")
        axes.set_ylabel("excess (chi-square)")
    return figure


def line_of(
    axes: Axes,
    results: Results,
    cost: str,
    solver: str,
    levels: Sequence[Any],
    at: Any,
    values: Any,
    *,
    joined: bool = True,
    converged: Any = None,
) -> None:
    """A solver's line; where fewer than half of its runs `converged`, the markers are hollow."""
    colour, marker = colours(results)[solver]
    costs = list(dict.fromkeys(results.runs["cost"]))
    # Solvers that end at the same fit lie on each other: each is moved a little to its own side.
    place = list(results.comparison.solver).index(solver) - (len(results.comparison.solver) - 1) / 2.0
    x = [levels.index(level) + _ASIDE * place for level in at]
    y = np.asarray(values, dtype=float)
    keep = np.isfinite(y) & (y > 0)
    dash = DASHES[costs.index(cost) % len(DASHES)] if joined else "none"
    face = "white" if not joined and costs.index(cost) else colour
    axes.plot(
        np.array(x)[keep],
        y[keep],
        color=colour,
        marker=marker,
        linestyle=dash,
        markersize=3.6,
        linewidth=1.2,
        alpha=0.9,
        markerfacecolor=face,
    )
    if converged is not None:
        astray = keep & (np.asarray(converged, dtype=float) < 0.5)
        axes.plot(np.array(x)[astray], y[astray], color=colour, marker=marker, linestyle="none", markersize=3.6,
                  markerfacecolor="white", zorder=4)  # fmt: skip


def noise_axis(axes: Axes, levels: Sequence[float]) -> None:
    axes.set_xticks(range(len(levels)), labels=[f"{100 * level:g}" for level in levels])
    axes.set_xlim(-0.3, len(levels) - 0.7)
    axes.set_xlabel("noise (% of each channel's range)")
    _error_axis(axes)


def _error_axis(axes: Axes) -> None:
    shown = [line.get_ydata() for line in axes.get_lines()]
    values = np.concatenate([np.asarray(y, dtype=float).ravel() for y in shown]) if shown else np.zeros(0)
    values = values[np.isfinite(values) & (values > 0)]
    if not values.size:
        return
    high = float(values.max()) * 1.5
    # An exact fit of noiseless records errs by rounding alone: decades of that would hide everything else.
    low = max(float(values.min()) / 1.5, min(1e-3, high / 1e3))
    log_axis(axes, "y", min(low, high / 12.0), high)


def _shown(rows: pd.DataFrame) -> bool:
    return bool(rows["error_percent"].notna().any() or rows["held_out"].notna().any())


def _budgets(results: Results) -> dict[str, int]:
    return {p.name: max(results.comparison.budgets_of(p)) for p in results.comparison.problems}


def panels_of(
    many: int,
    results: Results,
    *,
    costs: Sequence[str],
    bound: bool = False,
    width: float = 2.05,
    height: float = 1.75,
    in_row: int = _COLUMNS,
) -> tuple[Figure, list[Axes]]:
    """Panels in rows, under a legend of the solvers."""
    columns = min(in_row, many)
    lines = math.ceil(many / columns)
    across = max(_LEAST, columns * (width + _ROOM) + 0.15)
    marks = [
        Line2D(
            [],
            [],
            color=colours(results)[label][0],
            marker=colours(results)[label][1],
            markersize=3.6,
            label=short,
        )
        for label, short in distinct(results.solvers).items()
    ]
    if len(costs) > 1:
        every = list(dict.fromkeys(results.runs["cost"]))
        marks += [Line2D([], [], color=GREY, linestyle=DASHES[every.index(c) % len(DASHES)], label=c) for c in costs]
    if bound:
        marks.append(Line2D([], [], color=INK, linestyle=":", linewidth=1.4, label="Cramer-Rao bound"))
    longest = 0.5 + 0.068 * max(len(str(mark.get_label())) for mark in marks)
    per_row = max(1, int(across / longest))
    legend = 0.19 * math.ceil(len(marks) / per_row) + 0.1
    tall = lines * (height + 0.72) + legend
    figure = Figure(figsize=(across, tall))
    figure.legend(
        handles=marks, loc="upper left", bbox_to_anchor=(0, 1), ncols=per_row, borderaxespad=0.2, handlelength=1.8
    )
    panels = []
    for k in range(many):
        row, column = divmod(k, columns)
        left = column * (width + _ROOM) + _ROOM
        bottom = tall - legend - (row + 1) * (height + 0.72) + 0.47
        axes = placed(figure, left, bottom, width, height)
        few_ticks(axes)
        panels.append(axes)
    return figure, panels
