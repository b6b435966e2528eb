"""Figures of the parameters: estimates with their intervals, correlation, sensitivity, profile likelihood."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from seatruth.report.figures.style import (
    BLUE,
    FAINT,
    GREY,
    INK,
    ORANGE,
    VERDICTS,
    few_ticks,
    label_width,
    nothing,
    placed,
    rows,
    styled,
    text,
)
from seatruth.report.numbers import MINUS, number
from seatruth.report.view import View, view

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

MOST_CORRELATED = 40
"""Parameters in the figure of the correlations; of more, those with the strongest."""
_ROW = 0.235
_NUMBERED = 16
"""Parameters up to which the figure of the correlations has its numbers in it."""
_SIZES = {"^": 8.0, "X": 7.5}
"""Points across: markers of little area are drawn larger."""
_OFF_START = 4.0
"""The axis of the change from the start reaches no farther than this multiple of the typical reach."""
_DROP_95 = 1.92
"""Rise of minus log likelihood that bounds a 95 % interval: half the 95 % point of chi-square with 1 degree."""


@styled
def parameters(estimate: Estimate | View, against: Literal["start", "bounds"] = "start") -> Figure:
    """Estimates with 95 % intervals: as change from the start in %, or as place between the bounds (0 to 100 %)."""
    data = view(estimate)
    frame = data.parameters
    spans = _change(frame) if against == "start" else _place(frame)
    if not len(frame) or not np.isfinite(spans["value"]).any():
        why = (
            "No parameter started from a value other than 0." if against == "start" else "No parameter has two bounds."
        )
        return nothing(why)
    names = [str(name) for name in frame.index]
    left = label_width(names)
    height = _ROW * len(names)
    figure = Figure(figsize=(4.8, height + 1.05))
    axes = placed(figure, left, 0.5, 4.8 - left - 0.2, height)
    rows(axes, names)
    low, high = _reach(spans, frame["verdict"]) if against == "start" else (-4.0, 104.0)
    axes.set_xlim(low, high)
    for y, verdict in enumerate(frame["verdict"]):
        _estimate(axes, y, spans.iloc[y].to_dict(), str(verdict))
    if against == "start":
        axes.axvline(0, color=GREY, linewidth=0.9, zorder=1)
        axes.set_xlabel("change from the start (%)")
    else:
        axes.axvline(0, color=INK, linewidth=1.2, zorder=1)
        axes.axvline(100, color=INK, linewidth=1.2, zorder=1)
        axes.set_xticks([0, 25, 50, 75, 100], labels=["min", "25", "50", "75", "max"])
        axes.set_xlabel("place between the bounds (%)")
    _verdict_legend(figure, frame, spans)
    return figure


def _change(frame: pd.DataFrame) -> pd.DataFrame:
    """Change from the start in % of the start's size; NaN where the start is 0."""
    size = frame["start"].abs().where(frame["start"] != 0)
    out = {name: 100.0 * (frame[name] - frame["start"]) / size for name in ("value", "lower", "upper")}
    prior = {"prior_low": frame["prior_mean"] - 1.96 * frame["prior_sd"]}
    prior["prior_high"] = frame["prior_mean"] + 1.96 * frame["prior_sd"]
    return pd.DataFrame(out | {k: 100.0 * (v - frame["start"]) / size for k, v in prior.items()} | {"start": 0.0})


def _place(frame: pd.DataFrame) -> pd.DataFrame:
    """Place between min (0) and max (100); NaN without two finite bounds."""
    span = (frame["max"] - frame["min"]).where(np.isfinite(frame["min"]) & np.isfinite(frame["max"]))
    ends = {name: frame[name] for name in ("value", "lower", "upper", "start")}
    ends["prior_low"] = frame["prior_mean"] - 1.96 * frame["prior_sd"]
    ends["prior_high"] = frame["prior_mean"] + 1.96 * frame["prior_sd"]
    return pd.DataFrame({name: 100.0 * (end - frame["min"]) / span for name, end in ends.items()})


def _reach(spans: pd.DataFrame, verdicts: pd.Series[str]) -> tuple[float, float]:
    """Limits that show the identified parameters; what reaches farther is cut and marked by arrows."""
    ends = spans[["value", "lower", "upper"]].to_numpy(dtype=float)
    finite = np.isfinite(ends).any(axis=1)
    each = np.nanmax(np.abs(np.where(np.isfinite(ends), ends, np.nan)[finite]), axis=1)
    known = (verdicts == "identified").to_numpy()[finite]
    typical = float(np.quantile(each[known] if known.any() else each, 0.75))
    reach = max(min(float(each.max()), _OFF_START * typical), 1.0) * 1.12
    return -reach, reach


def _estimate(axes: Axes, y: int, row: Mapping[Any, float], verdict: str) -> None:
    colour, marker = VERDICTS.get(str(verdict), (INK, "o"))
    low, high = axes.get_xlim()
    value, lower, upper = (float(row[name]) for name in ("value", "lower", "upper"))
    if math.isfinite(row["prior_low"]) and math.isfinite(row["prior_high"]):
        ends = np.clip([row["prior_low"], row["prior_high"]], low, high)
        axes.plot(ends, [y, y], color="#c9c9c9", linewidth=6.0, solid_capstyle="butt", zorder=1)
    if not math.isfinite(value):
        return
    if math.isfinite(lower) and math.isfinite(upper):
        cut = np.clip([lower, upper], low, high)
        axes.plot(cut, [y, y], color=colour, linewidth=1.8, solid_capstyle="butt", zorder=3)
        for end, edge, arrow in ((lower, low, "<"), (upper, high, ">")):
            if (end < low) if edge == low else (end > high):
                axes.plot([edge], [y], marker=arrow, color=colour, markersize=5, clip_on=False, zorder=4)
    if math.isfinite(row["start"]) and low <= row["start"] <= high:
        axes.plot([row["start"]], [y], marker="|", color=INK, markersize=9, markeredgewidth=1.3, zorder=4)
    if low <= value <= high:
        axes.plot(
            [value],
            [y],
            marker=marker,
            color=colour,
            markersize=_SIZES.get(marker, 6.0),
            markeredgecolor="white",
            markeredgewidth=0.6,
            zorder=5,
        )
    else:
        at, align = (high, "right") if value > high else (low, "left")
        arrow = ">" if value > high else "<"
        axes.plot([at], [y], marker=arrow, color=colour, markersize=5, clip_on=False, zorder=4)
        sign = "+" if value > 0 else MINUS
        axes.annotate(
            f"{sign}{number(abs(value), 2)} %",
            (at, y),
            (-7 if align == "right" else 7, 0),
            textcoords="offset points",
            ha=align,
            va="center",
            fontsize=7.5,
            color=INK,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
            zorder=6,
        )


def _verdict_legend(figure: Figure, frame: pd.DataFrame, spans: pd.DataFrame) -> None:
    marks = [
        Line2D([], [], color=colour, marker=marker, markersize=5.5, linewidth=1.8, label=verdict)
        for verdict, (colour, marker) in VERDICTS.items()
        if (frame["verdict"] == verdict).any()
    ]
    marks.append(Line2D([], [], color=INK, marker="|", markersize=9, markeredgewidth=1.3, linestyle="", label="start"))
    if np.isfinite(spans["prior_low"]).any():
        marks.append(Line2D([], [], color="#c9c9c9", linewidth=6.0, label="prior, 95 %"))
    figure.legend(
        handles=marks,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=4 if len(marks) > 3 else len(marks),
        columnspacing=1.2,
        handlelength=1.6,
        borderaxespad=0.2,
    )


@styled
def correlation(estimate: Estimate | View, most: int = MOST_CORRELATED) -> Figure:
    """Correlation of the estimates of the parameters (not of the nuisances), numbers in the cells if they fit."""
    data = view(estimate)
    table = correlated(data, most)
    n = len(table)
    if n < 2:
        return nothing("Fewer than two free parameters: nothing to correlate.")
    names = [str(name) for name in table.index]
    cell = 0.36 if n <= _NUMBERED else 0.24 if n <= 25 else 0.2
    left = label_width(names)
    side = cell * n
    figure = Figure(figsize=(max(left + side + 0.15, 3.0), side + left + 0.72))
    axes = placed(figure, left, 0.6, side, side)
    axes.imshow(table.to_numpy(), cmap="RdBu_r", vmin=-1, vmax=1, interpolation="none", aspect="auto")
    axes.set_yticks(range(n), labels=[text(name) for name in names])
    axes.set_xticks(range(n), labels=[text(name) for name in names], rotation=90)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    values = table.to_numpy(dtype=float)
    if n <= _NUMBERED:
        for i in range(n):
            for j in range(n):
                value = float(values[i, j])
                if i != j and math.isfinite(value):
                    colour = "white" if abs(value) > 0.65 else INK
                    axes.text(j, i, _two(value), ha="center", va="center", fontsize=7.2, color=colour)
    key = placed(figure, left, 0.36, max(min(side, 3.0), 1.2), 0.09)
    key.imshow(np.linspace(-1, 1, 64)[None], cmap="RdBu_r", aspect="auto", extent=(-1, 1, 0, 1), interpolation="none")
    key.set_yticks([])
    key.set_xticks([-1, -0.5, 0, 0.5, 1], labels=[f"{MINUS}1", f"{MINUS}0.5", "0", "0.5", "1"])
    key.grid(False)
    return figure


def correlated(data: View, most: int = MOST_CORRELATED) -> pd.DataFrame:
    """Correlations among the parameters; of more than `most`, those with the strongest."""
    table = data.correlation
    if table.empty or not table.index.is_unique or not table.columns.is_unique:
        return pd.DataFrame()
    names = [name for name in table.index if name in set(data.parameters.index) and name in table.columns]
    table = table.loc[names, names]
    # A parameter at a bound has no error, so nothing to correlate.
    known = table.notna().any(axis=1).to_numpy()
    table = table.loc[known, known]
    names = [str(name) for name in table.index]
    if len(names) <= most:
        return table
    strongest = table.abs().to_numpy(copy=True)
    np.fill_diagonal(strongest, 0.0)
    strength = np.nan_to_num(strongest).max(axis=1)
    kept = np.sort(np.argsort(-strength, kind="stable")[:most])
    return table.iloc[kept, kept]


def _two(value: float) -> str:
    """A correlation in a small cell: ".87", "−.5"."""
    written = f"{abs(value):.2f}".replace("0.", ".", 1).replace("1.00", "1")
    return ("" if value >= 0 else MINUS) + written if written != ".00" else "0"


@styled
def sensitivity(estimate: Estimate | View) -> Figure:
    """How much each output changes, relative to its size, for a relative change of each parameter."""
    data = view(estimate)
    table = data.sensitivity
    values = table.to_numpy(dtype=float)
    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return nothing("No sensitivities.")
    names, outputs = [str(name) for name in table.index], [str(name) for name in table.columns]
    left = label_width(names)
    cell = min(0.62, max(0.42, (4.6 - left) / len(outputs)))
    width, height = cell * len(outputs), 0.25 * len(names)
    longest = max(len(text(name)) for name in outputs)
    turned = cell < 0.085 * longest
    top = 0.2 + (max(0.16, 0.075 * longest) if turned else 0.16)
    figure = Figure(figsize=(left + width + 0.15, height + top + 0.1))
    axes = placed(figure, left, 0.1, width, height)
    low = max(float(positive.min()), float(positive.max()) * 1e-4)
    shade = np.where(values > 0, values, low)
    norm = LogNorm(low, max(float(positive.max()), low * 10))
    axes.imshow(np.clip(shade, low, None), cmap="Blues", norm=norm, interpolation="none", aspect="auto", alpha=0.85)
    for i, j in np.ndindex(*values.shape):
        value = float(values[i, j])
        if math.isfinite(value):
            dark = float(norm(max(value, low))) > 0.74
            axes.text(j, i, _small(value), ha="center", va="center", fontsize=7.2, color="white" if dark else INK)
    axes.set_yticks(range(len(names)), labels=[text(name) for name in names])
    axes.set_xticks(range(len(outputs)), labels=[text(name) for name in outputs], rotation=90 if turned else 0)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return figure


def _small(value: float) -> str:
    return number(value, 2) if value >= 0.001 or value == 0 else "<.001"


@styled
def profile(estimate: Estimate | View, names: Sequence[str] | None = None) -> Figure:
    """Profile likelihood: the least cost for each value of one parameter, above the lowest."""
    data = view(estimate)
    chosen = [name for name in data.profile if names is None or name in names]
    if not chosen:
        return nothing("No parameter was profiled.")
    across = min(len(chosen), 2)
    down = math.ceil(len(chosen) / across)
    figure = Figure(figsize=(4.8 * across, 2.5 * down))
    for k, name in enumerate(chosen):
        axes = placed(figure, 4.8 * (k % across) + 0.62, 2.5 * (down - 1 - k // across) + 0.48, 4.0, 1.7)
        _profile(axes, data, name)
    return figure


def _profile(axes: Axes, data: View, name: str) -> None:
    curve = data.profile[name]
    rise = curve["cost"] - curve["cost"].min()
    axes.plot(curve["value"], rise, color=BLUE, marker="o", markersize=3.5)
    axes.axhline(_DROP_95, color=INK, linewidth=0.9, linestyle=(0, (5, 2)))
    axes.set_ylim(-0.04 * min(float(rise.max()), 12.0) - 0.02, max(min(float(rise.max()) * 1.05, 12.0), 2.4))
    axes.annotate("95 %", (1, _DROP_95), (-2, 2), xycoords=("axes fraction", "data"), textcoords="offset points",
                  ha="right", fontsize=7.5)  # fmt: skip
    unit = ""
    if name in data.parameters.index:
        row = dict(data.parameters.loc[name])
        unit = "" if row["unit"] in ("", "1") else f" ({row['unit']})"
        value, lower, upper = (float(row[key]) for key in ("value", "lower", "upper"))
        if math.isfinite(lower) and math.isfinite(upper):
            axes.axvspan(lower, upper, color=ORANGE, alpha=0.18, linewidth=0)
        if math.isfinite(value):
            axes.axvline(value, color=GREY, linewidth=0.9, linestyle=(0, (1, 1.5)))
    low, high = float(curve["value"].min()), float(curve["value"].max())
    axes.set_xlim(low - 0.03 * (high - low), high + 0.03 * (high - low))
    few_ticks(axes, 5, 4)
    axes.set_xlabel(text(f"{name}{unit}"))
    axes.set_ylabel("cost above the least")
    axes.grid(True, color=FAINT)
