"""Pictures of the Slocum glider's record and of the speed on dives left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS

from seatruth.trials import Trial


def record(casts: Sequence[Trial], suspect: Sequence[str]) -> Any:
    """What was measured: sinking speed and speed through the water of every cast, against pressure."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(11, 4.5), layout="constrained", sharey=True)
    seen = set()
    for cast in casts:
        kind = "set aside" if cast.name in suspect else cast.name.split()[0] + "s"
        colour = {"dives": COLOURS[0], "climbs": COLOURS[1], "set aside": COLOURS[3]}[kind]
        label = kind if kind not in seen else None
        seen.add(kind)
        P = np.asarray(cast.inputs["P"]) / 1e5
        axes[0].plot(np.asarray(cast.inputs["rho"]), P, color=colour, lw=0.8, label=label)
        axes[1].plot(np.asarray(cast.outputs["sink"]), P, color=colour, lw=0.8)
        axes[2].plot(np.asarray(cast.outputs["U"]), P, color=colour, lw=0.8)
    for axis, text in zip(axes, ("density (kg/m$^3$)", "sinking speed (m/s)", "speed of the water, measured (m/s)")):
        axis.set_xlabel(text)
        axis.grid(True, alpha=0.3)
    axes[0].set_xticks([1005.0, 1005.5, 1006.0, 1006.5, 1007.0])
    axes[0].ticklabel_format(useOffset=False)
    axes[0].invert_yaxis()
    axes[0].set_ylabel("pressure (bar)")
    axes[0].legend(fontsize=8)
    figure.suptitle("Slocum glider, Baltic 2016: rows of 10 s")
    return figure


def left_out(rows: Sequence[Mapping[str, Any]], main: str, suspect: Sequence[str]) -> Any:
    """Measured and predicted speed of the dives left out: by depth, dive by dive, and rms errors by way."""
    import matplotlib.pyplot as plt

    table: Any = pd.DataFrame(rows)
    good = table[~table.dive.isin(suspect)]
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.6), layout="constrained", width_ratios=(1, 1.1, 0.8))
    own = good[good.way == main]
    axes[0].plot(own.U, own.P / 1e5, ".", color="0.45", ms=3, label="measured, 17 dives")
    for k, (_, part) in enumerate(own.groupby("dive")):
        axes[0].plot(part.predicted, part.P / 1e5, color=COLOURS[0], lw=0.8, label=None if k else "predicted, left out")
    odd = table[(table.way == main) & table.dive.isin(suspect)]
    if len(odd):
        axes[0].plot(odd.U, odd.P / 1e5, "x", color=COLOURS[3], ms=4, label="measured, set aside")
        axes[0].plot(odd.predicted, odd.P / 1e5, color=COLOURS[3], lw=0.8, label="predicted for it")
    axes[0].invert_yaxis()
    axes[0].set(
        xlabel="speed of the water (m/s)", ylabel="pressure (bar)", xlim=(0.14, 0.52), title="Slocum dives left out"
    )
    axes[0].legend(fontsize=7, loc="lower right")
    means = own.groupby("dive")[["U", "predicted"]].mean()
    other = good[good.way == "published, mass from depth"].groupby("dive").predicted.mean()
    at = np.arange(len(means))
    axes[1].plot(at, means.U, "o", color="0.3", label="measured")
    axes[1].plot(at, means.predicted, "s-", color=COLOURS[0], ms=4, label="predicted, fitted to other casts")
    axes[1].plot(at, other, "^--", color=COLOURS[1], ms=4, label="predicted, published constants")
    axes[1].set_xticks(at, [name.split()[1] for name in means.index], fontsize=7)
    axes[1].set(xlabel="cast", ylabel="mean speed of the dive (m/s)", ylim=(0.28, 0.33), title="Dive by dive")
    axes[1].legend(fontsize=7)
    errors = (good.assign(square=(good.predicted - good.U) ** 2).groupby("way", sort=False).square.mean()) ** 0.5
    at = np.arange(len(errors))
    colours = [COLOURS[0] if way == main else COLOURS[1] if "published" in way else COLOURS[5] for way in errors.index]
    axes[2].barh(at, 1e3 * errors, color=colours)
    for k, value in enumerate(1e3 * errors):
        cut = value > 18.0
        axes[2].text(
            19.8 if cut else value + 0.2, k, f"{value:.1f}" + (" (bar cut)" if cut else ""),
            va="center", ha="right" if cut else "left", fontsize=7,
        )  # fmt: skip
    axes[2].set_yticks(at, list(errors.index), fontsize=7)
    axes[2].set(xlabel="rms error of the speed (mm/s)", xlim=(0, 20))
    axes[2].invert_yaxis()
    for axis in axes:
        axis.grid(True, alpha=0.3)
    return figure
