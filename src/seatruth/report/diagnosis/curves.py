"""Figures of the causes: answers, signatures, pairs, trials left out, the next trial, what has no name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from seatruth.diagnosis.results import Diagnosis
from seatruth.report.diagnosis.words import NEAR, chance, in_titles, titles
from seatruth.report.figures.style import (
    BLUE,
    CYCLE,
    FAINT,
    GREEN,
    GREY,
    INK,
    MEASURED,
    ORANGE,
    PURPLE,
    VERMILLION,
    few_ticks,
    label_width,
    log_axis,
    nothing,
    placed,
    rows,
    styled,
    text,
    thinned,
)
from seatruth.report.numbers import number, shown

_WIDE = 4.8
_CELL = (4.8, 2.6)
_LEAST = 0.001
MOST_ANSWERS = 8
MOST_APART = 8


@styled
def answers(diagnosis: Diagnosis) -> Figure:
    """Probabilities of the leading answers as bars."""
    found = [c for c in diagnosis.candidates if c["probability"] >= _LEAST][:MOST_ANSWERS]
    if not found:
        return nothing("No answer.")
    names = [text(in_titles(diagnosis, c["effects"]), 52) for c in found]
    left = min(0.2 + 0.064 * max(len(name) for name in names), 3.6)
    height = 0.27 * len(found)
    figure = Figure(figsize=(7.2, height + 0.6))
    axes = placed(figure, left, 0.48, 7.2 - left - 0.9, height)
    for y, candidate in enumerate(found):
        p = float(candidate["probability"])
        axes.barh(y, p, color=BLUE if y == 0 else MEASURED, height=0.62)
        axes.annotate(chance(p), (p, y), (4, 0), textcoords="offset points", va="center", fontsize=8)
    rows(axes, names)
    axes.set_yticks(range(len(found)), labels=names)
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks(np.linspace(0, 1, 6), labels=[f"{k} %" for k in range(0, 101, 20)])
    axes.set_xlabel("probability")
    return figure


def telling(diagnosis: Diagnosis, most: int = 6) -> list[tuple[str, str]]:
    """Trials and channels in which the effects explain most, in multiples of the noise; of the refitted model's errors
    where no effect is in. Each channel at most twice."""
    key = "multiple_refit"
    ranked = sorted(
        (row for row in diagnosis.gap if math.isfinite(row[key])),
        key=lambda row: -(row[key] ** 2 - (row["multiple_effect"] ** 2 if diagnosis.augmented["effects"] else 0.0)),
    )
    found: list[tuple[str, str]] = []
    for row in ranked:
        if sum(channel == row["channel"] for _, channel in found) < 2:
            found.append((str(row["trial"]), str(row["channel"])))
        if len(found) == most:
            break
    return found


@styled
def signature(diagnosis: Diagnosis, trial: str, channel: str) -> Figure:
    """The residual after refitting, the part of it that the effects explain, and below what remains with its noise."""
    frame = diagnosis.traces
    part = frame[(frame["trial"] == trial) & (frame["channel"] == channel)]
    if not len(part):
        return nothing("No time history.")
    row = next(r for r in diagnosis.gap if r["trial"] == trial and r["channel"] == channel)
    scale = shown(channel, row["unit"])
    t = part["t"].to_numpy(dtype=float)
    residual = (part["measured"] - part["refit"]).to_numpy(dtype=float) * scale.factor
    explained = (part["effect"] - part["refit"]).to_numpy(dtype=float) * scale.factor
    remains = residual - explained
    noise = float(row["noise"]) * scale.factor
    figure = Figure(figsize=_CELL)
    said = f"{text(trial)}: {number(row['multiple_refit'], 2)} × noise"
    kept = thinned(t, residual)
    if not diagnosis.augmented["effects"]:
        axes = placed(figure, 0.72, 0.44, 3.93, 1.9)
        axes.axhspan(-2 * noise, 2 * noise, color=FAINT, linewidth=0)
        axes.axhline(0, color=GREY, linewidth=0.7)
        axes.plot(t[kept], residual[kept], color=INK, linewidth=0.9)
        few_ticks(axes, 6, 4)
        axes.set_ylabel(text(scale.label, 24))
        axes.set_xlabel("t (s)")
        axes.set_title(said, loc="right", pad=3, color=INK)
        return figure
    upper = placed(figure, 0.72, 1.06, 3.93, 1.28)
    lower = placed(figure, 0.72, 0.44, 3.93, 0.52, sharex=upper)
    upper.axhline(0, color=GREY, linewidth=0.7)
    upper.plot(t[kept], residual[kept], color=MEASURED, linewidth=2.4)
    kept = thinned(t, explained)
    upper.plot(t[kept], explained[kept], color=BLUE, linewidth=1.2)
    lower.axhspan(-2 * noise, 2 * noise, color=FAINT, linewidth=0)
    lower.axhline(0, color=GREY, linewidth=0.7)
    kept = thinned(t, remains)
    lower.plot(t[kept], remains[kept], color=INK, linewidth=0.7)
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
    remaining = number(row["multiple_effect"], 2)
    upper.set_title(f"{said}, remains {remaining}", loc="right", pad=3, color=INK)
    return figure


def _round(size: float) -> float:
    """A round number a little below a size, for the one tick of a small axis."""
    step = 10.0 ** math.floor(math.log10(size))
    return float(max((k for k in (1, 2, 5) if k * step <= size), default=1) * step)


def pairs(diagnosis: Diagnosis, most: int = MOST_APART) -> tuple[list[str], dict[tuple[str, str], float]]:
    """Effects that are compared with each other, and the lambda by which the first is told from the second."""
    found: dict[tuple[str, str], float] = {}
    for row in diagnosis.which:
        for other, value in row["apart"].items():
            found[str(row["name"]), str(other)] = float(value)
    names = [str(row["name"]) for row in diagnosis.which if any(row["name"] in pair for pair in found)]
    return names[:most], found


@styled
def apart(diagnosis: Diagnosis) -> Figure:
    """Pairwise lambda of the leading effects as a table in colours: pale pairs are easily taken for each other."""
    names, found = pairs(diagnosis)
    if len(names) < 2:
        return nothing("Fewer than two effects to tell apart.")
    known = titles(diagnosis)
    labels = [text(known.get(name, name), 34) for name in names]
    ahead = [name for name in names if any(pair[0] == name for pair in found)]
    left = 0.2 + 0.066 * max(len(label) for label in labels)
    cell = 0.5
    side, high = cell * len(names), 0.3 * len(ahead)
    figure = Figure(figsize=(left + side + 0.1, high + 0.45))
    axes = placed(figure, left, 0.1, side, high)
    for y, one in enumerate(ahead):
        for x, other in enumerate(names):
            value = found.get((one, other), math.nan)
            if not math.isfinite(value):
                continue
            shade = float(np.clip(math.log10(max(value, 1.0)) / 4.0, 0.0, 1.0))
            axes.add_patch(_patch(x, y, colormaps["Blues"](0.02 + 0.85 * shade)))
            axes.text(
                x, y, number(value, 2), ha="center", va="center", fontsize=7.4, color="white" if shade > 0.62 else INK
            )
            if value < NEAR:
                axes.add_patch(_patch(x, y, "none", VERMILLION))
    axes.set_xlim(-0.5, len(names) - 0.5)
    axes.set_ylim(len(ahead) - 0.5, -0.5)
    axes.set_yticks(range(len(ahead)), labels=[f"{names.index(one) + 1}  {labels[names.index(one)]}" for one in ahead])
    axes.set_xticks(range(len(names)), labels=[str(k + 1) for k in range(len(names))])
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return figure


def _patch(x: int, y: int, face: Any, edge: Any = "white") -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.47, y - 0.45), 0.94, 0.9, facecolor=face, edgecolor=edge, linewidth=1.4)


_FOLD = (
    ("before", "as believed", VERMILLION, "d"),
    ("refit", "refitted", ORANGE, "s"),
    ("flexible", "flexible control", PURPLE, "^"),
    ("effect", "with effects", BLUE, "o"),
)


@styled
def folds(diagnosis: Diagnosis) -> Figure:
    """Errors of each trial when it took no part, in multiples of the noise."""
    found = (diagnosis.how_far or {}).get("folds") or []
    if not found:
        return nothing("No trial was left out.")
    names = [str(fold["trial"]) for fold in found]
    finite = [f[key] for f in found for key, *_ in _FOLD if math.isfinite(f[key]) and f[key] > 0]
    if not finite:
        return nothing("The simulation diverged on every trial left out.")
    left, height = label_width(names), 0.3 * len(names)
    figure = Figure(figsize=(7.2, height + 0.95))
    axes = placed(figure, left, 0.48, 7.2 - left - 0.3, height)
    rows(axes, names)
    low = min(min(finite) / 1.3, 0.8)
    high = min(max(max(finite) * 1.3, 2.0), 1e4 * low)
    log_axis(axes, "x", low, high)
    axes.axvspan(low, 1.0, color=FAINT, linewidth=0, zorder=0)
    axes.axvline(1.0, color=INK, linewidth=1.0, zorder=1)
    for y, fold in enumerate(found):
        for key, _, colour, marker in _FOLD:
            value = float(fold[key])
            if math.isnan(value):
                continue
            inside = value <= high
            axes.plot([min(value, high)], [y], marker=marker if inside else ">", color=colour, markersize=6,
                      markeredgecolor="white", zorder=4 if key == "effect" else 3, clip_on=False)  # fmt: skip
    axes.set_xlabel("error of the prediction / noise")
    marks = [Line2D([], [], color=c, marker=m, linestyle="", label=label) for _, label, c, m in _FOLD]
    figure.legend(handles=marks, loc="upper left", ncols=4, borderaxespad=0.2, columnspacing=1.2, handletextpad=0.2)
    return figure


@styled
def next_inputs(diagnosis: Diagnosis) -> Figure:
    """The suggested trial: its inputs over time, and the motion that the model expects of it."""
    new = diagnosis.next_trial
    if new is None:
        return nothing("No trial is suggested.")
    t = np.asarray(new["t"], dtype=float)
    drawn: list[tuple[str, Any, str]] = [(name, np.asarray(v, dtype=float), BLUE) for name, v in new["inputs"].items()]
    units = dict(new.get("units") or {})
    motion = new.get("motion") or {}
    for name in ("u", "r", "psi", "z", "theta"):
        if name in motion and len(drawn) < 4:
            drawn.append((name, np.asarray(motion[name], dtype=float), GREY))
    height = 0.62
    track = "x" in motion and "y" in motion
    width = 4.0 if track else 6.2
    figure = Figure(figsize=(7.2, height * len(drawn) + 0.16 * len(drawn) + 0.5))
    total = float(figure.get_size_inches()[1])
    for k, (name, values, colour) in enumerate(drawn):
        scale = shown(name, units.get(name, ""))
        axes = placed(figure, 0.75, total - 0.1 - (k + 1) * height - k * 0.16, width - 0.6, height)
        kept = thinned(t, values)
        axes.plot(t[kept], values[kept] * scale.factor, color=colour, linewidth=1.2)
        few_ticks(axes, 6, 3)
        axes.set_ylabel(text(scale.label, 16))
        axes.yaxis.set_label_coords(-0.15 * 4.0 / width, 0.5)
        if k < len(drawn) - 1:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("t (s)")
    if track:
        axes = placed(figure, 4.85, 0.48, 2.2, total - 0.6)
        axes.plot(motion["y"], motion["x"], color=GREY, linewidth=1.2)
        axes.plot([motion["y"][0]], [motion["x"][0]], marker="o", color=INK, markersize=4)
        axes.set_aspect("equal", adjustable="datalim")
        few_ticks(axes, 3, 4)
        axes.set_xlabel("y (m)")
        axes.set_ylabel("x (m)")
    return figure


@styled
def menu(diagnosis: Diagnosis, most: int = 12) -> Figure:
    """How well each manoeuvre of the menu would tell apart the two causes that are then hardest to tell apart."""
    new = diagnosis.next_trial
    if new is None:
        return nothing("No trial is suggested.")
    options = new["menu"][:most]
    names = [text(str(row["manoeuvre"]), 44) for row in options]
    left = 0.2 + 0.066 * max(len(name) for name in names)
    height = 0.22 * len(options)
    figure = Figure(figsize=(7.2, height + 0.6))
    axes = placed(figure, left, 0.46, 7.2 - left - 0.3, height)
    sizes = [math.sqrt(max(float(row["lambda"]), 0.0)) for row in options]
    now = math.sqrt(max(float(new["lambda_now"]), 0.0))
    axes.barh(range(len(options)), sizes, color=[GREEN, *[MEASURED] * (len(options) - 1)], height=0.62)
    rows(axes, names)
    axes.set_yticks(range(len(options)), labels=names)
    axes.axvline(now, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    axes.axvline(math.sqrt(NEAR), color=VERMILLION, linewidth=1.0, linestyle=(0, (1, 1.5)))
    axes.set_xlim(0.0, max([*sizes, now, 4.0]) * 1.08)
    axes.set_xlabel("least distance between surviving causes (standard deviations)")
    return figure


@styled
def unnamed(diagnosis: Diagnosis) -> Figure:
    """What something unnamed would have to add at the likeliest place, over the time of each trial (95 % bands)."""
    found: Mapping[str, Any] | None = diagnosis.unnamed
    series: Sequence[Mapping[str, Any]] = [s for s in (found or {}).get("in_time", []) if len(s["t"])]
    if found is None or not series:
        return nothing("Nothing unnamed was looked for.")
    across, shown_series = 2, series[:8]
    down = math.ceil(len(shown_series) / across)
    figure = Figure(figsize=(7.2, 1.55 * down))
    scale = shown(str(found["place"]), str(found["unit"]))
    ends = [np.abs(np.array(s["value"])) + 1.96 * np.array(s["stderr"]) for s in shown_series]
    reach = 1.06 * scale.factor * float(max(e.max() for e in ends))
    for k, one in enumerate(shown_series):
        axes = placed(figure, 3.6 * (k % across) + 0.72, 1.55 * (down - 1 - k // across) + 0.42, 2.7, 0.86)
        t = np.array(one["t"], dtype=float)
        value, error = (np.array(one[key], dtype=float) * scale.factor for key in ("value", "stderr"))
        axes.fill_between(t, value - 1.96 * error, value + 1.96 * error, color="#cfe2f0", linewidth=0)
        axes.plot(t, value, color=CYCLE[0], linewidth=1.2)
        axes.axhline(0, color=GREY, linewidth=0.7)
        axes.set_ylim(-reach, reach)
        few_ticks(axes, 5, 3)
        axes.set_xlabel("t (s)")
        if k % across == 0:
            axes.set_ylabel(text(scale.unit or str(found["unit"]), 16))
        axes.set_title(text(str(one["trial"])), loc="right", pad=3, color=INK)
    return figure
