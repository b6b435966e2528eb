"""Figures of a sample of the posterior: the corner plot, the chains, and the bands of the time histories."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from seatruth.arrays import Array
from seatruth.report.figures.style import (
    BLUE,
    FAINT,
    GREY,
    INK,
    VERMILLION,
    few_ticks,
    nothing,
    placed,
    styled,
    text,
    thinned,
    trace,
)
from seatruth.report.view import View, view
from seatruth.statistics.posterior_sample import LEVEL, VALUE

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

MOST_CORNER = 5
"""Parameters in a corner plot: as many as can be read at the width of a phone."""
HALF, MOST = "#4d9ac7", "#b9d8ea"
"""Regions of 50 and 95 % of the draws: two tints of blue that a print in black and white keeps apart."""
_WIDTH = 4.8
_LEFT, _RIGHT, _BOTTOM, _TOP = 0.86, 0.08, 0.9, 0.3
_LARGEST_CELL = 1.3
_GAP = 0.07
"""Inches."""
_BINS = 32
_SMOOTH = 1.2
"""Bins over which the cloud of the draws is smoothed, so that its outline is not that of chance. Chosen here [S]."""
_LINEAR = (0, (4, 2))
_WALKERS = 2
"""Walkers that a plot of the chain shows one by one."""
_STEPS = 100
"""Steps that a plot of the chain draws at most."""


@styled
def corner(estimate: Estimate | View, names: Sequence[str] | None = None) -> Figure:
    """Draws of the posterior, parameter by parameter and pair by pair, with the linear picture dashed.

    `names`: by default the first `MOST_CORNER` of `corner_names`.
    """
    data = view(estimate)
    shown = [name for name in corner_names(data) if names is None or name in names]
    shown = shown[:MOST_CORNER] if names is None else shown
    if not shown:
        return nothing("The posterior was not sampled.")
    size = len(shown)
    cell = min(_LARGEST_CELL, (_WIDTH - _LEFT - _RIGHT) / size)
    side = cell - _GAP
    figure = Figure(figsize=(_WIDTH, _BOTTOM + cell * size + _TOP))
    draws = data.draws[shown].to_numpy(dtype=float)
    limits = [_limits(data, name, draws[:, k]) for k, name in enumerate(shown)]
    for row in range(size):
        for column in range(row + 1):
            axes = placed(figure, _LEFT + cell * column, _BOTTOM + cell * (size - 1 - row), side, side)
            axes.grid(False)
            axes.set_xlim(limits[column])
            if row == column:
                _alone(axes, data, shown[row], draws[:, row])
            else:
                axes.set_ylim(limits[row])
                _pair(axes, data, (shown[column], shown[row]), draws[:, [column, row]])
            _label(axes, data, shown, (row, column), side)
    handles: list[Artist] = [Patch(color=HALF, label="50 %"), Patch(color=MOST, label="95 % of the draws")]
    handles.append(Line2D([], [], color=VERMILLION, linestyle=_LINEAR, linewidth=1.0, label="linear, 95 %"))
    handles.append(Line2D([], [], color=INK, linestyle=(0, (1, 1.5)), linewidth=0.9, label="estimate"))
    figure.legend(handles=handles, loc="upper left", ncols=4, columnspacing=1.0, handlelength=1.4, borderaxespad=0.2)
    return figure


def corner_names(data: View) -> list[str]:
    """Parameters with draws that differ, those of the strongest correlation first where there are many."""
    draws = data.draws
    names = [str(name) for name in data.parameters.index if name in draws and np.ptp(draws[name].to_numpy()) > 0]
    if len(names) <= MOST_CORNER:
        return names
    strength = np.abs(np.corrcoef(draws[names].to_numpy(dtype=float).T))
    np.fill_diagonal(strength, 0.0)
    order = np.argsort(-strength.max(axis=1), kind="stable")
    first = set(order[:MOST_CORNER])
    rest = [k for k in range(len(names)) if k not in first]
    return [names[k] for k in [*sorted(first), *rest]]


def _limits(data: View, name: str, values: Array) -> tuple[float, float]:
    """All draws but the farthest of a thousand, and the estimate."""
    low, high = (float(end) for end in np.quantile(values, [0.001, 0.999]))
    value = _number(data, name, "value")
    if math.isfinite(value):
        low, high = min(low, value), max(high, value)
    room = 0.04 * ((high - low) or abs(high) or 1.0)
    return low - room, high + room


def _alone(axes: Axes, data: View, name: str, values: Array) -> None:
    """The histogram of one parameter with the intervals of 50 and 95 % tinted; the linear picture dashed."""
    low, high = axes.get_xlim()
    counts, edges = np.histogram(values, bins=_BINS, range=(low, high), density=True)
    middle = 0.5 * (edges[1:] + edges[:-1])
    axes.stairs(counts, edges, color=FAINT, fill=True)
    for part, tint in ((LEVEL, MOST), (0.5, HALF)):
        lower, upper = np.quantile(values, [0.5 - part / 2.0, 0.5 + part / 2.0])
        axes.stairs(np.where((middle >= lower) & (middle <= upper), counts, 0.0), edges, color=tint, fill=True)
    value, sd = (_number(data, name, key) for key in ("value", "stderr"))
    top = float(counts.max(initial=0.0))
    if math.isfinite(sd) and sd > 0:
        at = np.linspace(low, high, 80)
        with np.errstate(over="ignore"):  # far from the estimate the density is zero
            curve = np.exp(-0.5 * ((at - value) / sd) ** 2) / (sd * math.sqrt(2.0 * math.pi))
        axes.plot(at, curve, color=VERMILLION, linestyle=_LINEAR, linewidth=1.0)
        top = max(top, min(float(curve.max()), 2.0 * top))
    axes.axvline(value, color=INK, linestyle=(0, (1, 1.5)), linewidth=0.9)
    axes.set_ylim(0.0, 1.08 * top or 1.0)


def _pair(axes: Axes, data: View, names: tuple[str, str], values: Array) -> None:
    """Regions of highest density that hold 50 and 95 % of the draws; the linear ellipse of 95 % dashed."""
    # In coordinates without correlation: smoothing would otherwise widen a narrow valley.
    middle = values.mean(axis=0)
    root = np.linalg.cholesky(np.cov(values.T) + 1e-12 * np.diag(values.var(axis=0)))
    white = np.linalg.solve(root, (values - middle).T).T
    low, high = np.quantile(white, [0.0005, 0.9995], axis=0)
    box = list(zip(low - 0.5, high + 0.5))
    counts, x, y = np.histogram2d(white[:, 0], white[:, 1], bins=_BINS, range=box)
    smooth = scipy.ndimage.gaussian_filter(counts.T, _SMOOTH)
    ordered = np.sort(smooth.ravel())[::-1]
    mass = np.cumsum(ordered) / max(float(ordered.sum()), 1e-300)
    levels = [float(ordered[min(int(np.searchsorted(mass, part)), len(ordered) - 1)]) for part in (LEVEL, 0.5)]
    if 0.0 < levels[0] < levels[1] < ordered[0]:
        grid = np.stack(np.meshgrid(*(0.5 * (edges[1:] + edges[:-1]) for edges in (x, y))))
        across, up = np.tensordot(root, grid, axes=1) + middle[:, None, None]
        axes.contourf(across, up, smooth, levels=[*levels, float(ordered[0])], colors=[MOST, HALF])
    centre = [_number(data, name, "value") for name in names]
    ellipse = _ellipse(data, names)
    if ellipse is not None:
        axes.plot(centre[0] + ellipse[0], centre[1] + ellipse[1], color=VERMILLION, linestyle=_LINEAR, linewidth=1.0)
    for line, at in ((axes.axvline, centre[0]), (axes.axhline, centre[1])):
        line(at, color=INK, linestyle=(0, (1, 1.5)), linewidth=0.7)


def _ellipse(data: View, names: tuple[str, str]) -> Array | None:
    """(2, n): the linear region of 95 % around the estimate; None without a covariance."""
    table = data.correlation
    if not set(names) <= set(table.index):
        return None
    sd = data.parameters.loc[list(names), "stderr"].to_numpy(dtype=float)
    matrix = table.loc[list(names), list(names)].to_numpy(dtype=float) * np.outer(sd, sd)
    if not np.isfinite(matrix).all():
        return None
    values, vectors = np.linalg.eigh(matrix)
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = np.sqrt(scipy.special.chdtri(2, 1.0 - LEVEL)) * np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray(vectors @ (np.sqrt(np.clip(values, 0.0, None))[:, None] * circle))


def _label(axes: Axes, data: View, shown: Sequence[str], place: tuple[int, int], side: float) -> None:
    """Names, units and numbers along the left and the bottom edge alone; `side` of the axes in inches."""
    row, column = place
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(3, prune="both", min_n_ticks=1))
    last = row == len(shown) - 1
    axes.tick_params(labelbottom=last, labelleft=column == 0 and row > 0, labelsize=7.0, length=2.0)
    axes.tick_params(axis="x", rotation=90)
    if row == column:
        axes.set_yticks([])
    if last:
        axes.set_xlabel(_named(data, shown[column]), fontsize=7.5)
        axes.xaxis.set_label_coords(0.5, -0.5 / side)
    if column == 0 and row > 0:
        axes.set_ylabel(_named(data, shown[row]), fontsize=7.5)
        axes.yaxis.set_label_coords(-0.5 / side, 0.5)


def _named(data: View, name: str, between: str = "\n") -> str:
    unit = str(data.parameters.loc[name, "unit"])
    return text(name, 14) + ("" if unit in ("", "1") else f"{between}({text(unit, 12)})")


@styled
def chains(estimate: Estimate | View, names: Sequence[str] | None = None) -> Figure:
    """The walkers over the steps, one panel a parameter: median and 95 % of all, two of them one by one."""
    data = view(estimate)
    columns = {str(name): f"{VALUE}{name}" for name in data.parameters.index}
    chain = data.chain
    chosen = [name for name, column in columns.items() if column in chain and (names is None or name in names)]
    if not chosen:
        return nothing("The posterior was not sampled.")
    height = 1.75
    figure = Figure(figsize=(4.8, height * len(chosen)))
    for k, name in enumerate(chosen):
        axes = placed(figure, 0.78, height * (len(chosen) - 1 - k) + 0.46, 3.87, 1.18)
        table = chain.pivot_table(index="step", columns="walker", values=columns[name])
        table = table.iloc[np.unique(np.linspace(0, len(table) - 1, _STEPS).round().astype(int))]
        steps, values = table.index.to_numpy(dtype=float), table.to_numpy(dtype=float)
        tail = (1.0 - LEVEL) / 2.0
        lower, middle, upper = np.quantile(values, [tail, 0.5, 1.0 - tail], axis=1)
        axes.fill_between(steps, lower, upper, color=MOST, linewidth=0)
        axes.plot(steps, values[:, :_WALKERS], color=GREY, linewidth=0.5)
        axes.plot(steps, middle, color=BLUE, linewidth=1.2)
        if data.burn_in > 0:
            axes.axvspan(0, data.burn_in, color=FAINT, linewidth=0, zorder=0)
            axes.axvline(data.burn_in, color=INK, linewidth=0.8, linestyle=_LINEAR)
        axes.set_xlim(0, max(float(steps[-1]), 1.0))
        few_ticks(axes, 5, 3)
        axes.set_xlabel("step")
        axes.set_ylabel(_named(data, name, " "))
        axes.yaxis.set_label_coords(-0.15, 0.5)
    return figure


_BUCKETS = 20
"""Stretches of time in which the edges of a band are drawn by four samples each: they are smooth."""


def band(upper: Axes, lower: Axes, t: Array, fitted: Array, edges: tuple[Array, Array]) -> None:
    """The band of an ensemble behind the history, and around the zero of the residuals as departure from the fit."""
    kept = np.unique(np.concatenate([thinned(t, edge, _BUCKETS) for edge in edges]))
    low, high = (np.where(np.isfinite(edge), edge, np.nan)[kept] for edge in edges)
    # Above the grey band of the noise, below all lines.
    look: dict[str, Any] = {"linewidth": 0, "zorder": 1.5, "gid": trace("band")}
    if np.isfinite(low).any():
        upper.fill_between(t[kept], low, high, color=HALF, alpha=0.45, **look)
        # A residual is measured less fitted; with the member for the fit it would move the other way.
        lower.fill_between(t[kept], fitted[kept] - high, fitted[kept] - low, color=HALF, alpha=0.8, **look)


def _number(data: View, name: str, key: str) -> float:
    return float(data.parameters[key].to_dict()[name])
