"""Pictures of the experiment on Chen, Yan and Wang 2011."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS

from seatruth.trials import Trial

MARKERS = "osD^vPX*<"
_DEG = 180.0 / np.pi


def trial(run: Trial, title: str) -> Any:
    """Elevator and motion of one run."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(4, 1, figsize=(7.5, 7.5), sharex=True, layout="constrained")
    axes[0].plot(run.t, _DEG * run.inputs["delta_s"], color=COLOURS[3], lw=1)
    axes[0].set_ylabel("elevator (deg)")
    axes[1].plot(run.t, _DEG * run.outputs["theta"], color=COLOURS[0])
    axes[1].set_ylabel("pitch (deg)")
    axes[2].plot(run.t, run.outputs["u"], color=COLOURS[0], label="forward u")
    axes[2].plot(run.t, run.outputs["w"], color=COLOURS[1], ls="--", label="down w")
    axes[2].set_ylabel("velocity (m/s)")
    axes[2].legend(fontsize=8)
    axes[3].plot(run.t, run.outputs["z"], color=COLOURS[0])
    axes[3].set_ylabel("depth (m)")
    axes[3].invert_yaxis()
    axes[3].set_xlabel("time (s)")
    axes[0].set_title(title)
    for axis in axes:
        axis.grid(True, alpha=0.3)
    return figure


def solvers(rows: pd.DataFrame, most: int) -> Any:
    """Excess over the best-known fit against the evaluations at which a run ended; a panel each noise level."""
    import matplotlib.pyplot as plt

    levels, names = list(dict.fromkeys(rows.level)), list(dict.fromkeys(rows.solver))
    figure, axes = plt.subplots(
        1, len(levels), figsize=(3.4 * len(levels) + 1, 4.4), sharey=True, squeeze=False, layout="constrained"
    )
    for axis, level in zip(axes[0], levels):
        for k, name in enumerate(names):
            group = rows[(rows.level == level) & (rows.solver == name)]
            colour = COLOURS[k % len(COLOURS)] if name != "newton" else "0.5"
            size = np.maximum(group.excess.to_numpy(dtype=float), 1e-3)
            axis.plot(group.evaluations, size, MARKERS[k], color=colour, ms=5, alpha=0.8, label=name)
        axis.axhline(0.01, color="0.3", ls="--", lw=1)
        axis.set(xscale="log", yscale="log", xlabel="evaluations", title=f"noise {100 * level:g} %")
        axis.set_xlim(200, 2.0 * most)
        axis.grid(True, alpha=0.3)
    axes[0, 0].set_ylabel("excess over best-known fit (chi-square)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8)
    return figure


def promise(bounds: Mapping[str, Mapping[str, float]], worst: Mapping[str, Sequence[float]], promised: float) -> Any:
    """Bounds at 3 % noise by parameter, and how the largest error of a record is distributed."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    names = list(next(iter(bounds.values())))
    at = np.arange(len(names))
    for k, (label, bound) in enumerate(bounds.items()):
        colour = COLOURS[(3, 1, 0)[k % 3]]
        left.plot(at, [bound[name] for name in names], MARKERS[k], color=colour, label=label)
        errors = np.sort(worst[label])
        share = 100.0 * np.arange(1, len(errors) + 1) / len(errors)
        right.step(errors, share, where="post", color=colour, ls=("-", "--", "-.")[k % 3], label=label)
    left.set(yscale="log", ylabel="Cramer-Rao bound (% of the parameter)", title="What the trial can tell at 3 % noise")
    left.set_xticks(at, names, rotation=60)
    left.axhline(promised / 2.8, color="0.3", ls=":", lw=1, label=f"{promised:g} % is 2.8 bounds")
    right.axvline(promised, color="0.3", ls="--", lw=1, label=f"{promised:g} %, as printed")
    right.set(xscale="log", xlabel="largest error of the 11 parameters (%)", ylabel="records (%)")
    right.set_title("Maximum likelihood, synthetic records at 3 % noise")
    for axis in (left, right):
        axis.grid(True, which="major", alpha=0.3)
        axis.legend(fontsize=8)
    return figure
