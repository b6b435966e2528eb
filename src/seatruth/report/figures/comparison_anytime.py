"""Figures of a comparison over evaluations: accuracy at each budget, expected running time, targets by problem."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from seatruth.report.figures.comparison import (
    COLOURS,
    colours,
    line_of,
    noise_axis,
    panels_of,
)
from seatruth.report.figures.style import DASHES, GREY, INK, log_axis, nothing, styled, text
from seatruth.report.numbers import tick

if TYPE_CHECKING:
    import pandas as pd

    from seatruth.comparison.results import Results

_WIDTH, _HEIGHT = 1.45, 1.35
"""Inches of a small panel: four in a row fit the page."""
_MOST = 40
"""Small panels of one figure."""


@styled
def accuracy_over_budgets(results: Results, noise: str, problem: str) -> Figure:
    """Error of the parameters against the level of one kind of noise, one panel a budget, all on the same axes.

    Dotted: the Cramer-Rao bound. Dashed: the error of the best known fits, which the data leave. Hollow: fewer than
    half of the runs converged.
    """
    table = results.overall
    table = table[(table["noise"] == noise) & (table["problem"] == problem)].dropna(subset=["error_percent"])
    budgets = sorted(set(table["budget"]))
    if not budgets:
        return nothing(f"No accuracy can be told under {noise} noise.")
    figure, panels = panels_of(
        len(budgets), results, costs=list(dict.fromkeys(table["cost"])), bound=True, width=_WIDTH, height=_HEIGHT,
        in_row=4,
    )  # fmt: skip
    bounds = results.accuracy[(results.accuracy["noise"] == noise) & (results.accuracy["problem"] == problem)]
    size = (100.0 * bounds["crlb"] / bounds["truth"].abs()).replace([np.inf, -np.inf], np.nan)
    bound = size.groupby(bounds["level"]).median().dropna()
    levels = sorted(set(table["level"]))
    for axes, budget in zip(panels, budgets):
        own = table[table["budget"] == budget]
        for (cost, solver), line in own.groupby(["cost", "solver"], sort=False):
            error, share = line["error_percent"], line["converged"]
            line_of(axes, results, str(cost), str(solver), levels, line["level"], error, converged=share)
        axes.plot([levels.index(x) for x in bound.index], bound, ":", color=INK, linewidth=1.4, zorder=5)
        left = own.groupby("level")["left_percent"].first()
        left = left[left > 0]
        axes.plot([levels.index(x) for x in left.index], left, "--", color=GREY, linewidth=1.0, zorder=1)
        noise_axis(axes, levels)
        axes.set_title(f"{tick(float(budget))} evaluations", loc="left")
        axes.set_xlabel("noise (%)")
        axes.set_ylabel("error (%)" if budget == budgets[0] else "")
    _same_limits(panels)
    return figure


def _same_limits(panels: list[Axes]) -> None:
    low = min(axes.get_ylim()[0] for axes in panels)
    high = max(axes.get_ylim()[1] for axes in panels)
    for axes in panels:
        log_axis(axes, "y", low, high)


@styled
def expected(results: Results, cost: str) -> Figure:
    """Expected running time of each solver to the headline target, one panel a problem, with the success rates.

    A solver that never succeeds stands at the right edge.
    """
    table = results.expected
    table = table[table["cost"] == cost]
    problems = list(dict.fromkeys(table["problem"]))[:_MOST]
    if not problems:
        return nothing("No run is done.")
    solvers = [label for label in results.solvers if (table["solver"] == label).any()]
    finite = table["ert"][np.isfinite(table["ert"])]
    low = 0.5 * float(finite.min()) if len(finite) else 1.0
    high = 2.0 * max(float(table["budget"].max()), float(finite.max()) if len(finite) else 1.0)
    tall = max(_HEIGHT, 0.13 * len(solvers))
    figure, panels = panels_of(len(problems), results, costs=[], width=1.9, height=tall)
    for axes, problem in zip(panels, problems):
        own = table[table["problem"] == problem].set_index("solver")
        for k, solver in enumerate(solvers):
            if solver not in own.index:
                continue
            row = own.loc[solver]
            colour, marker = colours(results)[solver]
            never = not math.isfinite(row["ert"])
            at = high if never else float(row["ert"])
            axes.plot([at], [-k], color=colour, marker=marker, markersize=4.0, linestyle="none",
                      markerfacecolor="white" if never else colour, clip_on=False, zorder=3)  # fmt: skip
            share = f"{round(100 * row['success_rate']):d} %"
            near = at > math.sqrt(low * high)
            axes.annotate(share, (at, -k), (-5 if near else 5, 0), textcoords="offset points",
                          ha="right" if near else "left", va="center", fontsize=6.0, color=INK)  # fmt: skip
        log_axis(axes, "x", low, high)
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0,), numticks=4))
        axes.set_yticks([])
        axes.set_ylim(-len(solvers) + 0.4, 0.6)
        axes.set_title(text(problem, 40), loc="left")
        axes.set_xlabel("evaluations a success")
    return figure


@styled
def reached_by_problem(results: Results, cost: str) -> Figure:
    """Share of targets reached over evaluations per dimension, one panel a problem."""
    tables = {name: table[table["cost"] == cost] for name, table in results.ecdf_by_problem.items()}
    tables = {name: table for name, table in tables.items() if len(table)}
    if not tables:
        return nothing("No run reached a target.")
    figure, panels = panels_of(min(len(tables), _MOST), results, costs=[])
    for axes, (name, table) in zip(panels, tables.items()):
        steps(axes, results, table, "evaluations")
        axes.set_title(text(name, 40), loc="left")
        axes.set_xlabel("evaluations / dimension")
        axes.set_ylabel("targets reached")
    return figure


def steps(axes: Axes, results: Results, table: pd.DataFrame, column: str) -> None:
    """Draws distributions (`column`, share) of all solvers."""
    high = float(table[column].max()) * 1.3
    low = max(0.5, float(table[column].min()) / 1.3)
    for place, solver in enumerate(results.comparison.solver):
        own = table[table["solver"] == solver]
        if not len(own):
            continue
        x = [low, *own[column], high]
        y = [0.0, *own["share"], own["share"].iloc[-1]]
        dash = DASHES[place // len(COLOURS) % len(DASHES)]
        axes.step(x, y, where="post", color=colours(results)[solver][0], linestyle=dash, linewidth=1.3)
    log_axis(axes, "x", low, max(high, 1.5 * low))
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,), numticks=4))
    axes.set_ylim(0, 1.02)
