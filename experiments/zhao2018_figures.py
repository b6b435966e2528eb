"""Pictures of the experiment on Zhao, Xie and Qiao 2018."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS
from zhao2018_sensors import DEGREE, IDLE

from seatruth.trials import Trial

WAYS = {
    "tank": ("tank's values", COLOURS[1], ":"),
    "channels": ("channel by channel", COLOURS[3], "--"),
    "all at once": ("all at once", COLOURS[0], "-"),
}
SHOWN = (("u", 1.0, "speed u (m/s)"), ("r", 1 / DEGREE, "yaw rate (deg/s)"), ("theta", 1 / DEGREE, "pitch (deg)"))


def validation(run: str, found: Mapping[str, Mapping[str, Sequence[float]]]) -> Any:
    """A run that was not fitted: what was measured and three open loops, and their errors."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, 2, figsize=(9, 6.2), sharex=True, layout="constrained")
    t = np.array(found["measured"]["t"])
    for row, (name, factor, label) in enumerate(SHOWN):
        measured = factor * np.array(found["measured"][name])
        axes[row, 0].plot(t, measured, color="0.7", lw=3, label="measured (synthetic)")
        for way, (text, colour, style) in WAYS.items():
            y = factor * np.array(found[way][name])
            axes[row, 0].plot(t, y, color=colour, ls=style, lw=1.2, label=text)
            axes[row, 1].plot(t, y - measured, color=colour, ls=style, lw=1.0, label=text)
        axes[row, 0].set_ylabel(label)
        axes[row, 1].set_ylabel(f"error of {label}")
    for axis in axes.flat:
        axis.grid(True, alpha=0.3)
    for axis in axes[-1]:
        axis.set_xlabel("time (s)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    figure.suptitle(f"Open loop on a run that was not fitted ({run}, synthetic)", fontsize=10)
    return figure


def ratios(table: pd.DataFrame) -> Any:
    """Root mean square error over bound, parameter by parameter; rows parameters, columns ways."""
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(9.5, 4.8), layout="constrained")
    at = np.arange(len(table))
    kinds = (
        ("own data", "channel on data of its own", COLOURS[2], "^"),
        ("channel by channel", "channel by channel, full chain", COLOURS[3], "s"),
        ("all at once", "all at once, full chain", COLOURS[0], "o"),
    )
    for name, label, colour, marker in kinds:
        axis.plot(at, table[name], marker, color=colour, ms=6, label=label)
    axis.axhline(1.0, color="0.3", lw=1)
    axis.axhline(1.2, color="0.3", ls="--", lw=1, label="1.2")
    axis.set(yscale="log", ylabel="rms error / Cramer-Rao bound (1)")
    axis.set_yticks([0.5, 1, 2, 5, 10], ["0.5", "1", "2", "5", "10"])
    axis.set_xticks(at, list(table.index), rotation=60)
    axis.set_title("How close to the bound (synthetic, maximum likelihood by damped Newton)", fontsize=10)
    axis.grid(True, axis="y", alpha=0.3)
    axis.legend(fontsize=8)
    return figure


def lateral(facts: Mapping[str, Mapping[str, Mapping[str, float]]], free: Sequence[str]) -> Any:
    """Relative bounds of the lateral parameters, a panel each vehicle."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4.5), sharey=True, layout="constrained")
    markers = "osD^"
    for axis, (vehicle, cases) in zip(axes, facts.items()):
        shown = [name for name in cases if "free" not in name]
        for k, name in enumerate(shown):
            y = [cases[name].get(q, np.nan) for q in free]
            axis.plot(range(len(free)), y, markers[k], color=COLOURS[(0, 2, 1, 3)[k]], ms=6, label=name)
        axis.axhline(100.0, color="0.3", ls="--", lw=1)
        axis.set(yscale="log", title=f"set {vehicle}")
        axis.set_xticks(range(len(free)), list(free), rotation=60)
        axis.grid(True, axis="y", alpha=0.3)
    axes[0].set_ylabel("Cramer-Rao bound (% of the parameter)")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=8)
    figure.suptitle("Lateral channel: what 60 s of 15 deg square-wave rudder tell (synthetic)", fontsize=10)
    return figure


def weave(trial: Trial, waypoints: tuple[float, float]) -> Any:
    """The closed-loop run: track, fins, depth."""
    import matplotlib.pyplot as plt

    leg, offset = waypoints
    figure, axes = plt.subplots(3, 1, figsize=(8, 7), layout="constrained")
    x, y = trial.outputs["x"], trial.outputs["y"]
    axes[0].plot(x, y, color=COLOURS[0], label="track")
    marks = leg * np.arange(1, int(x.max() // leg) + 2)
    axes[0].plot(marks, offset * (-1.0) ** np.arange(len(marks)), "o", color=COLOURS[3], label="waypoints")
    axes[0].set(
        xlabel="north (m)", ylabel="east (m)", title="Waypoints left and right, speed and depth changing (synthetic)"
    )
    axes[1].plot(trial.t, trial.inputs["delta"] / DEGREE, color=COLOURS[0], label="rudder")
    axes[1].plot(trial.t, trial.inputs["delta_s"] / DEGREE, color=COLOURS[3], ls="--", label="stern planes")
    axes[1].set(xlabel="time (s)", ylabel="fin angle (deg)")
    axes[2].plot(trial.t, trial.outputs["z"], color=COLOURS[0], label="depth (m)")
    axes[2].plot(trial.t, trial.outputs["u"], color=COLOURS[2], ls="--", label="speed (m/s)")
    axes[2].set(xlabel="time (s)", ylabel="depth (m), speed (m/s)")
    for axis in axes:
        axis.grid(True, alpha=0.3)
        axis.legend(fontsize=8, loc="upper right")
    return figure


def preparation(log: Trial, ready: Trial, truth: Trial) -> Any:
    """What the logger wrote and what the chain made of it."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(10, 6), layout="constrained")
    t = log.t[IDLE:] - log.t[IDLE]
    axes[0, 0].plot(t, log.outputs["v"][IDLE:], ".", ms=2, color=COLOURS[1], label="log, at the Doppler log")
    axes[0, 0].plot(ready.t, ready.outputs["v"], color=COLOURS[0], lw=1, label="prepared, at the origin")
    axes[0, 0].set(ylabel="sway v (m/s)", ylim=(-1.0, 1.0))
    axes[0, 1].plot(t, -log.outputs["r"][IDLE:], ".", ms=2, color=COLOURS[1], label="log, sign changed")
    axes[0, 1].plot(ready.t, ready.outputs["r"] / DEGREE, color=COLOURS[0], lw=1, label="prepared")
    axes[0, 1].set(ylabel="yaw rate (deg/s)", ylim=(-45.0, 45.0))
    axes[1, 0].plot(t, log.outputs["z_x"][IDLE:], "x", ms=4, color=COLOURS[2], label="tracker")
    axes[1, 0].plot(t, log.outputs["z_ins"][IDLE:], ".", ms=1, color=COLOURS[3], label="inertial")
    axes[1, 0].plot(t, log.outputs["depth"][IDLE:], ".", ms=1.5, color=COLOURS[1], label="pressure gauge")
    axes[1, 0].plot(ready.t, ready.outputs["z"], color=COLOURS[0], lw=1.2, label="fused")
    axes[1, 0].set(ylabel="depth (m)", ylim=(5.0, -2.0))
    error = ready.outputs["z"] - np.interp(ready.t, truth.t, truth.outputs["z"])
    axes[1, 1].plot(ready.t, 1e3 * error, color=COLOURS[0], lw=1, label="fused less true")
    axes[1, 1].fill_between(
        ready.t, -2e3 * ready.outputs["z_sd"], 2e3 * ready.outputs["z_sd"], color="0.85", label="2 standard deviations"
    )
    axes[1, 1].set(ylabel="depth error (mm)")
    for axis in axes.flat:
        axis.set_xlabel("time (s)")
        axis.grid(True, alpha=0.3)
        axis.legend(fontsize=7, loc="lower left")
    figure.suptitle("Preparation of a log (synthetic)", fontsize=10)
    return figure
