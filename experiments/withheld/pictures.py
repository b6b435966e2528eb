"""Figures of the score page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from seatruth.report.figures.style import BLUE, CYCLE, DASHES, FAINT, GREY, INK, styled
from withheld.intervals import reliability, wilson
from withheld.measures import Pair, groups, of_kind, top

STRATA = ("<9", "9-25", "25-100", "100-400", ">400")
MARKS = "osD^vPX"


@styled
def strata_figure(pairs: Mapping[str, Sequence[Pair]]) -> Figure:
    """Share of right first candidates by stratum, one effect, each program a line with Wilson intervals."""
    figure = Figure(figsize=(6.4, 3.2), layout="constrained")
    axes = figure.add_subplot()
    present = [
        name for name in STRATA if any(groups(of_kind(of, "single"), "stratum").get(name) for of in pairs.values())
    ]
    for k, (name, of) in enumerate(pairs.items()):
        by = groups(of_kind(of, "single"), "stratum")
        at, share, low, high = [], [], [], []
        for j, stratum in enumerate(present):
            own = by.get(stratum, [])
            if own:
                hits = sum(top(pair, 1) for pair in own)
                ends = wilson(hits, len(own))
                at.append(j + 0.07 * (k - len(pairs) / 2))
                share.append(hits / len(own))
                low.append(share[-1] - ends[0])
                high.append(ends[1] - share[-1])
        axes.errorbar(
            at, share, yerr=np.array([low, high]), label=name, color=CYCLE[k % len(CYCLE)], marker=MARKS[k % 7],
            markersize=4, linestyle=DASHES[k % len(DASHES)], elinewidth=0.7, capsize=2,
        )  # fmt: skip
    axes.set_xticks(range(len(present)), labels=present)
    axes.set_xlabel("lambda of the cause (squared standard deviations)")
    axes.set_ylabel("share with the right cause first")
    axes.set_ylim(-0.03, 1.03)
    figure.legend(loc="outside right upper")
    return figure


@styled
def confusion_figure(found: Mapping[tuple[str, str], int]) -> Figure:
    """Counts, truth down and first candidate across; the share of the row shades the cell."""
    last = ("none", "unknown", "two")
    truths = sorted({t for t, _ in found}, key=lambda name: (name in last, name))
    said = sorted({s for _, s in found} | set(truths), key=lambda name: (name in last, name))
    counts = np.array([[found.get((t, s), 0) for s in said] for t in truths], dtype=float)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    figure = Figure(figsize=(2.2 + 0.27 * len(said), 1.9 + 0.24 * len(truths)), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1.4, aspect="auto")
    axes.set_xticks(range(len(said)), labels=said, rotation=90)
    axes.set_yticks(range(len(truths)), labels=truths)
    axes.grid(False)
    axes.tick_params(length=0)
    for j, row in enumerate(counts):
        for k, count in enumerate(row):
            if count:
                right = truths[j] == said[k]
                axes.text(
                    k, j, f"{count:.0f}", ha="center", va="center", color=INK, weight="bold" if right else "normal"
                )
    axes.set_xlabel("first candidate")
    axes.set_ylabel("truth")
    return figure


@styled
def reliability_figure(said: Mapping[str, Sequence[tuple[float, bool]]], first: str) -> Figure:
    """Stated probability against the share that was right; the first program stands out."""
    figure = Figure(figsize=(5.6, 3.6), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8)
    for k, (name, pairs) in enumerate(said.items()):
        rows = reliability(pairs)
        own = name == first
        x, y, n = zip(*rows, strict=True)
        axes.plot(x, y, color=CYCLE[k % len(CYCLE)], linestyle=DASHES[k % len(DASHES)], linewidth=1.6 if own else 0.8)
        axes.scatter(
            x, y, s=[10 + 60 * c / len(pairs) for c in n], color=CYCLE[k % len(CYCLE)], marker=MARKS[k % 7], label=name,
            zorder=3,
        )  # fmt: skip
    axes.set_xlim(-0.03, 1.03)
    axes.set_ylim(-0.03, 1.03)
    axes.set_xlabel("stated probability of the first candidate")
    axes.set_ylabel("share that was right")
    figure.legend(loc="outside right upper")
    return figure


@styled
def kept_figure(rows: Sequence[tuple[float, Mapping[str, Any]]]) -> Figure:
    """Stated closure with its interval against the oracle's, each a case; values outside -1 to 1.2 sit on the edge."""
    figure = Figure(figsize=(4.6, 3.6), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([-1, 1], [-1, 1], color=GREY, linewidth=0.8)
    axes.axhline(0, color=FAINT)
    for oracle, own in rows:
        x, y, low, high = (float(np.clip(v, -1, 1.2)) for v in (oracle, own["value"], own["lower"], own["upper"]))
        axes.plot([x, x], [low, high], color=BLUE, linewidth=0.7, alpha=0.6)
        axes.plot([x], [y], color=BLUE, marker="o", markersize=3.5)
    axes.set_xlabel("closure of the oracle")
    axes.set_ylabel("closure that was stated")
    return figure
