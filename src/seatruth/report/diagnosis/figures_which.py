"""Figures of which effect causes the gap: answers, signatures, and effects that are taken for each other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import chance
from seatruth.report.figures.style import (
    BLUE,
    FAINT,
    GREY,
    INK,
    MEASURED,
    VERMILLION,
    few_ticks,
    nothing,
    placed,
    rows,
    spaced,
    styled,
    text,
    thinned,
)
from seatruth.report.numbers import number, shown
from seatruth.report.text.diagnosis import NEAR, in_titles, titles

_CELL = (4.8, 2.6)
_LEAST = 0.001
"""Probability below which an answer is not drawn."""
_MOST_ANSWERS = 8
_MOST_EFFECTS = 8


@styled
def answers(diagnosis: Diagnosis) -> Figure:
    """Probabilities of the leading answers as bars."""
    found = [(key, p) for key, p in diagnosis.answers() if p >= _LEAST][:_MOST_ANSWERS]
    if not found:
        return nothing("There is no answer.")
    names = [text(in_titles(diagnosis, key), 44) for key, _ in found]
    left = min(0.2 + 0.062 * max(len(name) for name in names), 2.9)
    height = 0.27 * len(found)
    figure = Figure(figsize=(4.8, height + 0.6))
    axes = placed(figure, left, 0.48, 4.8 - left - 0.85, height)
    for y, (_, p) in enumerate(found):
        axes.barh(y, p, color=BLUE if y == 0 else MEASURED, height=0.62)
        axes.annotate(chance(p), (p, y), (4, 0), textcoords="offset points", va="center", fontsize=8)
    rows(axes, names)
    axes.set_yticks(range(len(found)), labels=names)
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks(np.linspace(0, 1, 3), labels=["0 %", "50 %", "100 %"])
    axes.set_xlabel("probability")
    return figure


def clearest(diagnosis: Diagnosis, most: int = 6) -> list[tuple[str, str]]:
    """Trials and channels in which the effects explain most, in multiples of the noise; of the refitted model's errors
    where the verdict has no effect. Each channel at most twice."""
    gain = diagnosis.gap["multiple_refit"] ** 2
    if diagnosis.augmented.get("effects"):
        gain = gain - diagnosis.gap["multiple_effects"] ** 2
    ordered = diagnosis.gap.assign(gain=gain)
    ordered = ordered[np.isfinite(ordered["gain"].astype(float))].sort_values("gain", ascending=False, kind="stable")
    kept = ordered[ordered.groupby("channel").cumcount() < 2].head(most)
    return [(str(trial), str(channel)) for trial, channel in zip(kept["trial"], kept["channel"])]


@styled
def signature(diagnosis: Diagnosis, trial: str, channel: str) -> Figure:
    """The residual after the refit, the part of it that the effects explain, and below what remains with its noise."""
    frame = diagnosis.traces
    part = frame[(frame["trial"] == trial) & (frame["channel"] == channel)]
    if not len(part):
        return nothing("There is no time history.")
    gap = diagnosis.gap
    row = gap[(gap["trial"] == trial) & (gap["channel"] == channel)].iloc[0]
    scale = shown(channel, str(row["unit"]))
    t = part["t"].to_numpy(dtype=float)
    residual = (part["measured"] - part["refit"]).to_numpy(dtype=float) * scale.factor
    explained = (part["effects"] - part["refit"]).to_numpy(dtype=float) * scale.factor
    remains = residual - explained
    noise = float(row["noise"]) * scale.factor
    figure = Figure(figsize=_CELL)
    said = f"{text(trial)}: {number(row['multiple_refit'], 2)} × noise"
    line = spaced(t, residual)
    sampled, residual, remains = t[line], residual[line], remains[line]
    kept = thinned(sampled, residual)
    if not diagnosis.augmented.get("effects"):
        axes = placed(figure, 0.72, 0.44, 3.93, 1.9)
        axes.axhspan(-2 * noise, 2 * noise, color=FAINT, linewidth=0)
        axes.axhline(0, color=GREY, linewidth=0.7)
        axes.plot(sampled[kept], residual[kept], color=INK, linewidth=0.9)
        few_ticks(axes, 6, 4)
        axes.set_ylabel(text(scale.label, 24))
        axes.set_xlabel("t (s)")
        axes.set_title(said, loc="right", pad=3, color=INK)
        return figure
    upper = placed(figure, 0.72, 1.06, 3.93, 1.28)
    lower = placed(figure, 0.72, 0.44, 3.93, 0.52, sharex=upper)
    upper.axhline(0, color=GREY, linewidth=0.7)
    upper.plot(sampled[kept], residual[kept], color=MEASURED, linewidth=2.4)
    kept = thinned(t, explained)
    upper.plot(t[kept], explained[kept], color=BLUE, linewidth=1.2)
    lower.axhspan(-2 * noise, 2 * noise, color=FAINT, linewidth=0)
    lower.axhline(0, color=GREY, linewidth=0.7)
    kept = thinned(sampled, remains)
    lower.plot(sampled[kept], remains[kept], color=INK, linewidth=0.7)
    size = 1.08 * max(float(np.nanmax(np.abs(remains))), 2.4 * noise, 1e-12)
    lower.set_ylim(-size, size)
    few_ticks(upper, 6, 4)
    lower.set_yticks([-_round(size), 0, _round(size)])
    upper.tick_params(labelbottom=False)
    upper.set_ylabel(text(scale.label, 24))
    lower.set_ylabel("remains")
    lower.set_xlabel("t (s)")
    for axes in (upper, lower):
        axes.yaxis.set_label_coords(-0.148, 0.5)
    remaining = number(row["multiple_effects"], 2)
    upper.set_title(f"{said}, remains {remaining}", loc="right", pad=3, color=INK)
    return figure


def _round(size: float) -> float:
    """A round number a little below a size, for the one tick of a small axis."""
    step = 10.0 ** math.floor(math.log10(size))
    return float(max((k for k in (1, 2, 5) if k * step <= size), default=1) * step)


def pairs(diagnosis: Diagnosis, most: int = _MOST_EFFECTS) -> tuple[list[str], dict[tuple[str, str], float]]:
    """Effects that are compared with each other, and the noncentrality of each of these pairs."""
    found = {
        (effect.name, other): value
        for effect in diagnosis.effects
        for other, value in effect.confusable.items()
        if math.isfinite(value)
    }
    compared = {name for pair in found for name in pair}
    return [effect.name for effect in diagnosis.effects if effect.name in compared][:most], found


@styled
def confusion(diagnosis: Diagnosis) -> Figure:
    """Pairwise noncentrality of the leading effects in colours: pale pairs are easily taken for each other."""
    names, found = pairs(diagnosis)
    if len(names) < 2:
        return nothing("There are fewer than two effects to compare.")
    known = titles(diagnosis)
    labels = [text(known.get(name, name), 34) for name in names]
    ahead = [name for name in names if any(pair[0] == name for pair in found)]
    left = 0.2 + 0.066 * max(len(label) for label in labels)
    side, high = 0.5 * len(names), 0.3 * len(ahead)
    figure = Figure(figsize=(left + side + 0.1, high + 0.45))
    axes = placed(figure, left, 0.1, side, high)
    for y, name in enumerate(ahead):
        for x, other in enumerate(names):
            value = found.get((name, other), math.nan)
            if not math.isfinite(value):
                continue
            shade = float(np.clip(math.log10(max(value, 1.0)) / 4.0, 0.0, 1.0))
            axes.add_patch(_patch(x, y, colormaps["Blues"](0.02 + 0.85 * shade)))
            colour = "white" if shade > 0.62 else INK
            axes.text(x, y, number(value, 2), ha="center", va="center", fontsize=7.4, color=colour)
            if value < NEAR:
                axes.add_patch(_patch(x, y, "none", VERMILLION))
    axes.set_xlim(-0.5, len(names) - 0.5)
    axes.set_ylim(len(ahead) - 0.5, -0.5)
    numbered = [f"{names.index(name) + 1}  {labels[names.index(name)]}" for name in ahead]
    axes.set_yticks(range(len(ahead)), labels=numbered)
    axes.set_xticks(range(len(names)), labels=[str(k + 1) for k in range(len(names))])
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return figure


def _patch(x: int, y: int, face: Any, edge: Any = "white") -> Rectangle:
    return Rectangle((x - 0.47, y - 0.45), 0.94, 0.9, facecolor=face, edgecolor=edge, linewidth=1.4)
