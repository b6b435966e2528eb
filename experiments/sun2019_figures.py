"""Pictures of the experiment on Sun, Wang and Sang 2019."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS

MARKERS = "osD^vPX*"
WORST = 1e4
"""Per cent; bounds above it are drawn there."""


def runs(found: Mapping[str, Any], current: Mapping[str, float]) -> Any:
    """Sawtooth from the side, spirals from above, in still water and in the current."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(10, 7.5), layout="constrained")
    speed = f"current {current['current_north']:g} m/s north, {current['current_east']:g} m/s east"
    for water, colour, style in (("still", COLOURS[0], "-"), ("current", COLOURS[3], "--")):
        saw = found[f"sawtooth, {water}"]
        label = "still water" if water == "still" else speed
        axes[0, 0].plot(saw["x"], saw["z"], color=colour, ls=style, label=label)
        axes[0, 1].plot(np.array(saw["t"]) / 60, np.degrees(saw["theta"]), color=colour, ls=style, label=label)
        for name, run in found.items():
            if name.startswith("spiral") and name.endswith(water):
                place = int(name.split()[1].rstrip(",")) // 10 - 1
                axes[1, 0 if water == "still" else 1].plot(
                    run["y"], run["x"], color=COLOURS[(0, 1, 2)[place]], label=f"rudder {10 * (place + 1)} deg"
                )
    axes[0, 0].set(xlabel="north (m)", ylabel="depth (m)", ylim=(210, -55), title="Sawtooth")
    axes[0, 1].set(
        xlabel="time (min)", ylabel="pitch (deg)", ylim=(-35, 52), title="The current does not show in the pitch"
    )
    axes[1, 0].set(xlabel="east (m)", ylabel="north (m)", title="Spirals, still water")
    axes[1, 1].set(xlabel="east (m)", ylabel="north (m)", title="Spirals, in the current")
    for axis in axes[1]:
        axis.set_aspect("equal", adjustable="datalim")
    for axis in axes.flat:
        axis.grid(True, alpha=0.3)
        axis.legend(fontsize=7)
    figure.suptitle("Petrel-II glider (synthetic)")
    return figure


def controls(glides: pd.DataFrame, turns: pd.DataFrame, closed: Callable[[float, float], Mapping[str, float]]) -> Any:
    """Glide angle, L/D, speed and turning radius against the controls: closed form (lines) and simulated (markers)."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(10, 7.5), layout="constrained")
    for k, (net, part) in enumerate(glides.groupby(glides.m_b.abs())):
        for sign, style in ((1.0, "-"), (-1.0, "--")):
            own = part[part.m_b * sign > 0]
            alphas = np.radians(np.geomspace(0.8, 8.0, 80))
            line = pd.DataFrame([closed(sign * float(alpha), sign * float(net)) for alpha in alphas])
            name = f"{sign * net:+.1f} kg"
            for axis, y, simulated, factor in (
                (axes[0, 0], line.glide, own["simulated glide"], 180 / np.pi),
                (axes[0, 1], line["L/D"].abs(), own["simulated L/D"].abs(), 1.0),
                (axes[1, 0], line.V, own["simulated V"], 1.0),
            ):
                axis.plot(1e3 * line.x_p, factor * y, color=COLOURS[k], ls=style, lw=1, label=f"closed form, {name}")
                axis.plot(
                    1e3 * own.x_p, factor * simulated, MARKERS[k], color=COLOURS[k], ms=4, label=f"simulated, {name}"
                )
    for axis, label in zip(axes.flat, ("glide angle (deg)", "L/D (1)", "speed (m/s)")):
        axis.set(xlabel="sliding mass (mm forward)", ylabel=label)
        axis.grid(True, alpha=0.3)
    axes[0, 0].set_ylim(-60, 145)
    axes[0, 0].set_yticks(range(-60, 61, 20))
    axes[0, 0].legend(
        fontsize=6.5, ncols=2, loc="upper center", title="m_b > 0 dives, m_b < 0 climbs", title_fontsize=7
    )
    axis, angle = axes[1, 1], np.degrees(turns.rudder)
    axis.plot(angle, turns["simulated radius"], "o-", color=COLOURS[0], label="simulated (6 degrees of freedom)")
    axis.plot(angle, turns["closed, DNV rudder"], "--", color=COLOURS[1], label="closed form, DNV rudder 0.0057 m$^2$")
    axis.plot(angle, turns["closed, drawn rudder"], ":", color=COLOURS[3], label="closed form, rudder 0.012 m$^2$")
    axis.set(xlabel="rudder (deg)", ylabel="turning radius (m)", yscale="log")
    axis.set_yticks([3, 5, 10, 20, 30, 50, 100], ["3", "5", "10", "20", "30", "50", "100"])
    axis.set_yticks([], minor=True)
    axis.grid(True, alpha=0.3)
    axis.legend(fontsize=7)
    figure.suptitle("Steady glide and turn against the controls (synthetic)")
    return figure


def bounds(columns: Mapping[str, Mapping[str, float]], order: Sequence[str]) -> Any:
    """Bounds in per cent by runs and sensors; with and without the added masses."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 1, figsize=(10, 8), layout="constrained", sharex=True)
    at = np.arange(len(order))
    for axis, added in zip(axes, (False, True)):
        size = len(columns) // 6  # three sets of runs, each with and without the added masses
        kept = {name: column for name, column in columns.items() if ("added" in name) == added}
        for k, (name, column) in enumerate(kept.items()):
            values = np.array([np.nan if q not in column else float(column[q] or np.inf) for q in order])
            values = np.where(np.isnan(values), np.nan, np.minimum(values, WORST))
            label = name.replace(", added masses free", "")
            axis.plot(
                at + 0.06 * (k - 4), values, MARKERS[k // size], color=COLOURS[(0, 3, 2)[k % size]], ms=5, label=label
            )
        axis.axhline(100, color="0.5", ls=":", lw=1)
        axis.set(yscale="log", ylabel="Cramer-Rao bound (%)", ylim=(0.05, 2e6 if axis is axes[0] else 2 * WORST))
        axis.set_title("added masses free too" if added else "added masses known")
        axis.grid(True, axis="y", alpha=0.3)
    axes[1].set_xticks(at, list(order), rotation=60)
    axes[0].legend(fontsize=6, ncols=3, loc="upper left")
    figure.suptitle(f"What the runs can tell (synthetic; at {WORST:g} %: that or more)")
    return figure


def noise(summary: pd.DataFrame) -> Any:
    """Errors over their bound and coverage by coefficient and noise level."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 1, figsize=(9, 6), layout="constrained", sharex=True)
    levels = summary.index.get_level_values(0).unique()
    names = list(summary.loc[levels[0]].index)
    at = np.arange(len(names))
    for k, level in enumerate(levels):
        part: Any = summary.loc[level].reindex(names)
        place = at + 0.15 * (k - 0.5 * (len(levels) - 1))
        axes[0].plot(place, part["rms error over crlb"], MARKERS[k], color=COLOURS[k], label=f"noise x {level:g}")
        axes[1].plot(place, 100 * part["covered"], MARKERS[k], color=COLOURS[k])
    axes[0].axhline(1.0, color="0.3", lw=1)
    axes[0].axhline(1.2, color="0.3", ls="--", lw=1)
    axes[0].set(ylabel="rms error / bound (1)", ylim=(0, 1.45))
    axes[1].axhspan(92, 98, color="0.9")
    axes[1].axhline(95, color="0.3", lw=1)
    axes[1].set(ylabel="95 % intervals that cover (%)", ylim=(None, 101))
    axes[1].set_xticks(at, names, rotation=60)
    for axis in axes:
        axis.grid(True, alpha=0.3)
    axes[0].legend(fontsize=8)
    figure.suptitle("Identification from sawteeth and spirals in an unknown current (synthetic)")
    return figure
