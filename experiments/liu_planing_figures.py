"""Pictures of the experiment on Liu, Yue and Yu."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS

MARKERS = "os^Dv*"
LOOK = {"M1": (COLOURS[3], "--"), "M2": (COLOURS[0], "-")}


def formulas(table: pd.DataFrame, fits: Mapping[str, Mapping[str, Sequence[float]]], titles: Mapping[str, str]) -> Any:
    """The synthetic table and both fits with their prediction intervals, a panel for each draft and voltage."""
    import matplotlib.pyplot as plt

    groups = list(table.groupby(["voltage", "draft"], sort=True))
    figure, axes = plt.subplots(2, 3, figsize=(10, 6), sharex=True, sharey=True, layout="constrained")
    for axis, ((voltage, draft), rows) in zip(axes.flat, groups, strict=True):
        places = rows.index.to_numpy()
        for name, (colour, style) in LOOK.items():
            value, half = (np.array(fits[name][key])[places] for key in ("value", "half"))
            axis.plot(rows.rudder, value, color=colour, ls=style, label=f"{name}, {titles[name]}, fitted")
            axis.fill_between(rows.rudder, value - half, value + half, color=colour, alpha=0.13, lw=0)
        axis.plot(rows.rudder, rows.diameter, "o", color=COLOURS[7], ms=5, label="table (synthetic)")
        axis.set_title(f"{voltage} V, draft {draft} m", fontsize=9)
        axis.grid(True, alpha=0.3)
    for axis in axes[:, 0]:
        axis.set_ylabel("turning diameter (lengths)")
    for axis in axes[1]:
        axis.set_xlabel("rudder angle (deg)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    title = "Synthetic turns; bands: 95 % prediction intervals"
    figure.legend(handles, labels, loc="outside upper center", ncols=3, fontsize=8, title=title)
    return figure


def solvers(rows: pd.DataFrame, reached: float) -> Any:
    """How far above the best mean squared error each run ended."""
    import matplotlib.pyplot as plt

    costs = list(dict.fromkeys(rows["cost"]))
    names = list(dict.fromkeys(rows.dropna(subset=["above best"])["solver"]))
    figure, axis = plt.subplots(figsize=(9, 4.8), layout="constrained")
    for k, cost in enumerate(costs):
        for place, name in enumerate(names):
            part = rows[(rows["cost"] == cost) & (rows["solver"] == name)]["above best"].dropna()
            at = np.full(len(part), place + 0.16 * (k - 0.5 * (len(costs) - 1)))
            label = cost if place == 0 else ""
            axis.plot(at, part.clip(lower=1e-12), MARKERS[k], color=COLOURS[(0, 5, 3, 1)[k]], ms=5, label=label, ls="")
    axis.axhline(reached, color="0.3", ls="--", lw=1, label="counts as reached")
    axis.set(yscale="log", ylabel="mean squared error over the best, less 1 (1)", ylim=(3e-13, None))
    axis.set_xticks(range(len(names)), [name.replace("_", " ") for name in names], rotation=40, ha="right")
    axis.set_title("Where each run ended (synthetic table); $10^{-12}$ or less stands at $10^{-12}$", fontsize=10)
    axis.grid(True, axis="y", alpha=0.3)
    axis.legend(fontsize=8, ncols=2)
    return figure


def preference(power: pd.DataFrame, coverage: pd.DataFrame) -> Any:
    """What cross-validation says on many tables of known truth, and how often prediction intervals hold."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    ways = (("folds", "folds", "o"), ("conditions", "conditions left out", "s"))
    for truth, colour in (("M1", COLOURS[3]), ("M2", COLOURS[0])):
        rows = power[power.truth == truth]
        for way, label, marker in ways:
            fill = colour if way == "folds" else "none"
            gap, p = rows[f"{way}: M2 less M1"], rows[f"{way}: p"].clip(lower=1e-6)
            left.plot(gap, p, marker, color=colour, markerfacecolor=fill, ms=4, label=f"truth {truth}, {label}")
    left.axhline(0.05, color="0.3", ls="--", lw=1)
    left.axvline(0.0, color="0.3", lw=0.8)
    left.set_yscale("log")
    left.set_xlabel("squared error left out, M2 less M1 (lengths$^2$)")
    left.set_ylabel("p of the paired test (1)")
    left.set_title("Which formula? Synthetic tables of known truth", fontsize=10)
    left.legend(fontsize=7)
    for k, (kind, label, shift) in enumerate(((True, "draft was fitted", -0.12), (False, "draft left out", 0.12))):
        rows = coverage[coverage.fitted == kind]
        drafts = sorted(rows.draft.unique())
        for name, part in rows.groupby("formula"):
            share = 100.0 * part.set_index("draft")["sum"] / part.set_index("draft")["count"]
            at = np.arange(len(drafts)) + shift + (0.05 if name == "M2" else -0.05)
            colour = LOOK[str(name)][0]
            fill = colour if kind else "none"
            values = share[drafts].to_numpy()
            right.plot(at, values, MARKERS[k], color=colour, markerfacecolor=fill, label=f"{name}, {label}")
    right.axhline(95.0, color="0.3", ls="--", lw=1)
    right.set_xticks(range(len(drafts)), [f"{draft:g}" for draft in drafts])
    right.set_xlabel("draft (m)")
    right.set_ylabel("new measurements inside (%)")
    right.set_title("95 % prediction intervals", fontsize=10)
    right.legend(fontsize=7)
    for axis in (left, right):
        axis.grid(True, alpha=0.3)
    return figure


def circles(table: pd.DataFrame, fits: Mapping[str, Mapping[str, Any]], best: Mapping[str, str]) -> Any:
    """Measured turning circles of the Esso Osaka model and the formula that predicts runs left out best."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), sharey=True, layout="constrained")
    for axis, figure_name in zip(axes, ("tactical", "steady"), strict=True):
        found, grid = fits[figure_name][best[figure_name]], fits[figure_name]["grid"]
        for side, label, colour, marker in ((1.0, "starboard", COLOURS[0], "o"), (-1.0, "port", COLOURS[3], "s")):
            rows = table[table.side == side]
            for revolutions, part in rows.groupby("revolutions"):
                fill = colour if revolutions == 10 else "none"
                name = f"{label}, {revolutions:.0f} rev/s"
                axis.plot(part.rudder, part[figure_name], marker, color=colour, markerfacecolor=fill, label=name)
            here = np.array(grid["side"]) == side
            rudder, value, half = (np.array(part)[here] for part in (grid["rudder"], found["value"], found["half"]))
            axis.plot(rudder, value, color=colour, ls="-" if side > 0 else "--")
            axis.fill_between(rudder, value - half, value + half, color=colour, alpha=0.1, lw=0)
        axis.set_title(f'{figure_name} diameter; line: formula "{best[figure_name]}"', fontsize=10)
        axis.set_xlabel("rudder angle (deg)")
        axis.grid(True, alpha=0.3)
        axis.set_ylim(0, 6.6)
        axis.set_xticks([20, 25, 30, 35])
    axes[0].set_ylabel("diameter (ship lengths)")
    axes[0].legend(fontsize=8)
    figure.suptitle(
        "Esso Osaka 3 m model, measured (Osaka University 2020); bands: 95 % prediction intervals", fontsize=10
    )
    return figure
