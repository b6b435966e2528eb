"""Figures of predictions: trials left out, the next trial, and the forces that the model's structure lacks."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from seatruth.diagnosis.parts import MissingForce
from seatruth.diagnosis.results import Diagnosis
from seatruth.report.diagnosis.figures_where import LABELS
from seatruth.report.figures.style import (
    BLUE,
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
    zoomable,
)
from seatruth.report.numbers import shown
from seatruth.report.text.diagnosis import NEAR

_FOLD = (
    ("error_refit", LABELS["refit"], ORANGE, "s"),
    ("error_discrepancy", "free terms (control)", PURPLE, "^"),
    ("error_effects", LABELS["effects"], BLUE, "o"),
)
_MOST_MENU = 12
_MOST_FORCES = 8
_MOTION = ("u", "r", "psi", "z", "theta")
"""Outputs whose expected course is drawn below the inputs of a suggested trial."""


@styled
def folds(diagnosis: Diagnosis) -> Figure:
    """Errors of each trial when it was left out, in multiples of the noise, and what noise alone leaves."""
    found = diagnosis.validation.folds if diagnosis.validation is not None else ()
    if not found:
        return nothing("No trial was left out.")
    values = [[float(getattr(fold, key)) for key, *_ in _FOLD] for fold in found]
    finite = [value for row in values for value in row if math.isfinite(value) and value > 0]
    if not finite:
        return nothing("The simulation diverged on every trial left out.")
    names = [fold.trial for fold in found]
    left, height = label_width(names), 0.3 * len(names)
    figure = Figure(figsize=(7.2, height + 0.95))
    axes = placed(figure, left, 0.48, 7.2 - left - 0.3, height)
    rows(axes, names)
    low = min(min(finite) / 1.3, 0.8)
    high = min(max(max(finite) * 1.3, 2.0), 1e4 * low)
    log_axis(axes, "x", low, high)
    for y, (row, fold) in enumerate(zip(values, found, strict=True)):
        if math.isfinite(fold.error_noise):
            axes.plot([fold.error_noise], [y], "|", color=INK, markersize=11, zorder=2, clip_on=False)
        for value, (key, _, colour, marker) in zip(row, _FOLD):
            if math.isnan(value):
                continue
            shape = marker if value <= high else ">"
            front = 4 if key == "error_effects" else 3
            axes.plot(
                [min(value, high)],
                [y],
                marker=shape,
                color=colour,
                markersize=6,
                markeredgecolor="white",
                zorder=front,
                clip_on=False,
            )
    axes.set_xlabel("error of the prediction / noise")
    shown_as = [*((label, c, m) for _, label, c, m in _FOLD), ("noise", INK, "|")]
    marks = [Line2D([], [], color=c, marker=m, linestyle="", label=label) for label, c, m in shown_as]
    figure.legend(handles=marks, loc="upper left", ncols=4, borderaxespad=0.2, columnspacing=1.2, handletextpad=0.2)
    return figure


@styled
def suggested(diagnosis: Diagnosis) -> Figure:
    """The suggested trial: its inputs over time, and the motion that the model expects of it."""
    new = diagnosis.next_trial
    if new is None or not new.t:
        return nothing("No trial is suggested.")
    t = np.asarray(new.t, dtype=float)
    drawn = [(name, np.asarray(values, dtype=float), BLUE) for name, values in new.inputs.items()]
    for name in _MOTION:
        if name in new.motion and len(drawn) < 4:
            drawn.append((name, np.asarray(new.motion[name], dtype=float), GREY))
    height, gap = 0.62, 0.3  # names stand above their panels: beside one of this height a long one has no room
    track = "x" in new.motion and "y" in new.motion
    width = 4.0 if track else 6.2
    figure = Figure(figsize=(7.2, (height + gap) * len(drawn) + 0.5))
    total = float(figure.get_size_inches()[1])
    for k, (name, values, colour) in enumerate(drawn):
        scale = shown(name, new.units.get(name, ""))
        axes = placed(figure, 0.55, total - (k + 1) * (height + gap), width - 0.4, height)
        kept = thinned(t, values)
        axes.plot(t[kept], values[kept] * scale.factor, color=colour, linewidth=1.2)
        few_ticks(axes, 6, 3)
        zoomable(axes, "t")
        axes.set_title(text(scale.label, 44), loc="left", pad=3.0, fontsize="medium")
        if k < len(drawn) - 1:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("t (s)")
    if track:
        axes = placed(figure, 4.85, 0.48, 2.2, total - 0.6)
        axes.plot(new.motion["y"], new.motion["x"], color=GREY, linewidth=1.2)
        axes.plot([new.motion["y"][0]], [new.motion["x"][0]], marker="o", color=INK, markersize=4)
        axes.set_aspect("equal", adjustable="datalim")
        few_ticks(axes, 3, 4)
        axes.set_xlabel("y (m)")
        axes.set_ylabel("x (m)")
    return figure


@styled
def menu(diagnosis: Diagnosis) -> Figure:
    """Distance of the most probable cause from the nearest other, in standard deviations, by trial of the menu."""
    new = diagnosis.next_trial
    if new is None or not new.menu:
        return nothing("There is no menu of trials.")
    options = new.menu[:_MOST_MENU]
    names = [text(entry.manoeuvre, 44) for entry in options]
    left = 0.2 + 0.066 * max(len(name) for name in names)
    height = 0.22 * len(options)
    figure = Figure(figsize=(7.2, height + 0.6))
    axes = placed(figure, left, 0.46, 7.2 - left - 0.3, height)
    sizes = [math.sqrt(max(entry.noncentrality, 0.0)) for entry in options]
    now = math.sqrt(max(new.noncentrality_now, 0.0))
    colours = [GREEN if entry.manoeuvre == new.manoeuvre else MEASURED for entry in options]
    axes.barh(range(len(options)), sizes, color=colours, height=0.62)
    rows(axes, names)
    axes.set_yticks(range(len(options)), labels=names)
    axes.axvline(now, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    axes.axvline(math.sqrt(NEAR), color=VERMILLION, linewidth=1.0, linestyle=(0, (1, 1.5)))
    finite = [size for size in (*sizes, now) if math.isfinite(size)]
    axes.set_xlim(0.0, max([*finite, 4.0]) * 1.08)
    axes.set_xlabel("distance of the leading cause from the nearest other (SD)")
    return figure


def largest_forces(diagnosis: Diagnosis) -> list[MissingForce]:
    """The missing forces of the equation in which the model lacks most, one per trial."""
    missing = diagnosis.discrepancy
    if missing is None:
        return []
    order = sorted(missing.sizes, key=lambda name: -missing.sizes[name])
    for equation in order:
        found = [force for force in missing.forces if force.equation == equation and force.t]
        if found:
            return found
    return []


@styled
def missing_forces(diagnosis: Diagnosis) -> Figure:
    """The missing acceleration in the equation that lacks most, over the time of each trial (95 % bands)."""
    series = largest_forces(diagnosis)[:_MOST_FORCES]
    if not series:
        return nothing("No missing force was estimated.")
    across = 2
    down = math.ceil(len(series) / across)
    figure = Figure(figsize=(7.2, 1.55 * down))
    scale = shown(series[0].equation, series[0].unit)
    ends = [np.abs(np.array(force.value)) + 1.96 * np.array(force.stderr) for force in series]
    finite = np.concatenate(ends)
    finite = finite[np.isfinite(finite)]
    reach = max(1.06 * scale.factor * float(finite.max()) if finite.size else 1.0, 1e-12)
    for k, force in enumerate(series):
        axes = placed(figure, 3.6 * (k % across) + 0.72, 1.55 * (down - 1 - k // across) + 0.42, 2.7, 0.86)
        t = np.array(force.t, dtype=float)
        value, error = (np.array(part, dtype=float) * scale.factor for part in (force.value, force.stderr))
        axes.fill_between(t, value - 1.96 * error, value + 1.96 * error, color="#cfe2f0", linewidth=0)
        axes.plot(t, value, color=BLUE, linewidth=1.2)
        axes.axhline(0, color=GREY, linewidth=0.7)
        axes.set_ylim(-reach, reach)
        few_ticks(axes, 5, 3)
        zoomable(axes)
        axes.set_xlabel("t (s)")
        if k % across == 0:
            axes.set_ylabel(text(scale.unit, 16))
        axes.set_title(text(force.trial), loc="right", pad=3, color=INK)
    return figure
