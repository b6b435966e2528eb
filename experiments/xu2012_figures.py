"""Pictures of the experiment on Xu, Zou et al. 2012."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS

from seatruth.trials import Trial

MARKERS = "osD^vPX*"


def trial(run: Trial) -> Any:
    """The published zigzag."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(4, 1, figsize=(7.5, 8), sharex=True, layout="constrained")
    axes[0].plot(run.t, np.degrees(run.inputs["delta_s"]), color=COLOURS[3], ls="--", label="stern plane")
    axes[0].plot(run.t, np.degrees(run.outputs["theta"]), color=COLOURS[0], label="pitch")
    axes[0].set_ylabel("angle (deg)")
    axes[0].legend(loc="lower left", fontsize=8)
    for axis, name, factor, label in (
        (axes[1], "w", 1.0, "heave w (m/s)"),
        (axes[2], "q", 180.0 / np.pi, "pitch rate q (deg/s)"),
        (axes[3], "z", 1.0, "depth (m)"),
    ):
        axis.plot(run.t, factor * run.outputs[name], color=COLOURS[0])
        axis.set_ylabel(label)
    axes[3].invert_yaxis()
    axes[3].set_xlabel("time (s)")
    axes[0].set_title("Zigzag from rest, 120 N, 5 deg fin (synthetic)")
    for axis in axes:
        axis.grid(True, alpha=0.3)
    return figure


def forms(errors: pd.DataFrame) -> Any:
    """Errors of the three forms; errors in per cent by coefficient."""
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(9, 4.5), layout="constrained")
    at = np.arange(len(errors))
    for k, (form, colour) in enumerate(zip(("euler", "central", "trapezoid"), (COLOURS[3], COLOURS[1], COLOURS[0]))):
        axis.plot(at, errors[form].abs().clip(lower=1e-3), MARKERS[k], color=colour, label=form)
    axis.axhline(1.5, color="0.3", ls="--", lw=1, label="1.5 %")
    axis.set(yscale="log", ylabel="|error| (%)", title="Separate LS-SVM regressions, no noise")
    axis.set_xticks(at, list(errors.index), rotation=60)
    axis.grid(True, axis="y", alpha=0.3)
    axis.legend(fontsize=8)
    return figure


def link(
    sense: Mapping[str, Mapping[str, float]], errors: Mapping[str, pd.Series], names: Sequence[str], kept: float
) -> Any:
    """Low sensitivity, large error."""
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(7.5, 5), layout="constrained")
    for k, (run, colour) in enumerate(zip(errors, (COLOURS[0], COLOURS[1]))):
        S = np.array([sense[run][name] for name in names])
        size = errors[run][list(names)].abs().to_numpy(dtype=float)
        fill = colour if k == 0 else "none"
        axis.plot(S, size, MARKERS[k], color=colour, markerfacecolor=fill, label=f"fin {run}")
        if k == 0:
            for name, s, e in zip(names, S, size):
                axis.annotate(name, (s, e), xytext=(5, 4), textcoords="offset points", fontsize=8)
    axis.axvline(kept, color="0.3", ls="--", lw=1, label=f"{100 * kept:g} %: kept in the reduced model")
    axis.set(xscale="log", yscale="log", xlabel="sensitivity S (1)", ylabel="|error| (%)")
    axis.margins(x=0.08)
    axis.set_title("Sensitivity and identification error (trapezoid, no noise)")
    axis.grid(True, which="major", alpha=0.3)
    axis.legend(fontsize=8)
    return figure


def reduced(run: Trial, runs: Mapping[str, Mapping[str, Sequence[float]]]) -> Any:
    """Pitch and depth of the identified models, and how far they are from the plant."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(10, 6), sharex=True, layout="constrained")
    for row, (name, factor, unit) in enumerate((("theta", 180.0 / np.pi, "deg"), ("z", 1.0, "m"))):
        title = "pitch" if name == "theta" else "depth"
        truth = factor * run.outputs[name]
        axes[row, 0].plot(run.t, truth, color="0.5", lw=3, label="plant")
        styles = ((COLOURS[0], "-"), (COLOURS[3], "--"))
        for kind, (colour, style) in zip(("full, identified", "reduced, identified"), styles):
            y = factor * np.array(runs[kind][name])
            axes[row, 0].plot(run.t, y, color=colour, ls=style, label=kind)
            axes[row, 1].plot(run.t, y - truth, color=colour, ls=style, label=kind)
        axes[row, 0].set_ylabel(f"{title} ({unit})")
        axes[row, 1].set_ylabel(f"{title} error ({unit})")
        for axis in axes[row]:
            axis.grid(True, alpha=0.3)
    axes[1, 0].invert_yaxis()
    for axis in axes[1]:
        axis.set_xlabel("time (s)")
    axes[0, 0].legend(fontsize=8)
    return figure


def excitation(bounds: pd.DataFrame, fins: Sequence[float], names: Sequence[str]) -> Any:
    """Cramer-Rao bounds (per cent) against the fin's angle; names with the largest bound at 5 deg are in colour."""
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(7.5, 5), layout="constrained")
    columns = [f"{fin:g} deg, 120 s" for fin in fins]
    order = bounds.loc[list(names), "5 deg, 120 s"].sort_values(ascending=False)
    weak = list(order.index[:6])
    for name in order.index[6:]:
        axis.plot(fins, bounds.loc[name, columns], color="0.75", lw=1)
    axis.plot([], [], color="0.75", lw=1, label="the others")
    for k, name in enumerate(weak):
        colour = (*COLOURS[:6], COLOURS[7])[k]
        axis.plot(fins, bounds.loc[name, columns], marker=MARKERS[k], color=colour, label=name)
    axis.axhline(100.0, color="0.3", ls="--", lw=1, label="as large as the coefficient")
    axis.set(xscale="log", yscale="log", xlabel="stern plane angle, and pitch at reversal (deg)")
    axis.set_xticks(fins, [f"{fin:g}" for fin in fins])
    axis.minorticks_off()
    axis.set_ylabel("Cramer-Rao bound (% of the coefficient)")
    axis.set_title("What more fin would identify (same noise)")
    axis.grid(True, which="major", alpha=0.3)
    axis.legend(fontsize=8, ncols=2)
    return figure


def noise(table: pd.DataFrame, names: Sequence[str]) -> Any:
    """Mean and standard deviation of the errors over seeds, a panel each level."""
    import matplotlib.pyplot as plt

    levels = list(dict.fromkeys(table.index.get_level_values("level")))
    size = (9, 2.2 * len(levels))
    figure, axes = plt.subplots(len(levels), 1, figsize=size, sharex=True, squeeze=False, layout="constrained")
    at = np.arange(len(names))
    for axis, level in zip(axes[:, 0], levels):
        rows = table.loc[level].loc[list(names)]
        ways = (("ls_svm", "LS-SVM, trapezoid", COLOURS[3]), ("trajectory", "trajectory, least squares", COLOURS[0]))
        for k, (way, label, colour) in enumerate(ways):
            axis.errorbar(
                at + 0.24 * k - 0.12,
                rows[f"{way} mean, %"],
                rows[f"{way} std, %"],
                fmt=MARKERS[k],
                ms=4,
                capsize=3,
                color=colour,
                label=label,
            )
        bound = rows["crlb, %"]
        axis.vlines(at + 0.3, -bound, bound, color="0.4", lw=1, label="+- Cramer-Rao bound")
        axis.axhline(0.0, color="0.3", lw=0.8)
        axis.set_yscale("symlog", linthresh=1.0)
        axis.set_ylabel("error (%)")
        axis.set_title(f"noise {100 * level:g} % of the largest departure", fontsize=9)
        axis.grid(True, axis="y", alpha=0.3)
    axes[-1, 0].set_xticks(at, list(names), rotation=60)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, fontsize=8)
    return figure
