"""Figures of the score page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from seatruth.report.figures.style import BLUE, CYCLE, DASHES, FAINT, GREY, INK, MEASURED, VERMILLION, styled
from withheld.intervals import BINS, reliability, wilson
from withheld.measures import ONE, Pair, groups, of_kind, top

STRATA = ("<9", "9-25", "25-100", "100-400", ">400")
MARKS = "osD^vPX"
EDGE = (-1.0, 1.2)
"""Closures outside sit on the edge."""


@styled
def strata_figure(pairs: Mapping[str, Sequence[Pair]]) -> Figure:
    """Share of right first candidates by stratum, one effect, each program a mark with a Wilson interval."""
    figure = Figure(figsize=(6.8, 3.6), layout="constrained")
    axes = figure.add_subplot()
    present = [name for name in STRATA if any(groups(of_kind(of, ONE), "stratum").get(name) for of in pairs.values())]
    sizes = {}
    for k, (name, of) in enumerate(pairs.items()):
        by = groups(of_kind(of, ONE), "stratum")
        for j, stratum in enumerate(present):
            own = by.get(stratum, [])
            if not own:
                continue
            sizes[stratum] = len(own)
            hits = sum(top(pair, 1) for pair in own)
            low, high = wilson(hits, len(own))
            at, share = j + 0.8 / len(pairs) * (k - (len(pairs) - 1) / 2), hits / len(own)
            axes.errorbar(
                [at], [share], yerr=[[share - low], [high - share]], color=CYCLE[k % len(CYCLE)], marker=MARKS[k % 7],
                markersize=6 if k == 0 else 4.5, elinewidth=1.6 if k == 0 else 0.8, capsize=2, linestyle="none",
            )  # fmt: skip
        axes.plot([], [], color=CYCLE[k % len(CYCLE)], marker=MARKS[k % 7], linestyle="none", label=name)
    axes.set_xticks(range(len(present)), labels=[f"{name}\n{sizes[name]} cases" for name in present])
    axes.set_xlabel("lambda of the cause (squared standard deviations)")
    axes.set_ylabel("share with the right cause first")
    axes.set_ylim(-0.03, 1.03)
    axes.set_xlim(-0.6, len(present) - 0.4)
    axes.grid(False, axis="x")
    for j in range(1, len(present)):
        axes.axvline(j - 0.5, color=FAINT)
    figure.legend(loc="outside right upper")
    return figure


@styled
def confusion_figure(found: Mapping[tuple[str, str], int]) -> Figure:
    """Counts, truth down and first candidate across; the share of the row shades the cell, right ones are framed."""
    last = ("none", "unknown", "two")

    def sorted_names(names: set[str]) -> list[str]:
        return sorted(names, key=lambda name: (last.index(name) if name in last else -1, name))

    truths, said = sorted_names({t for t, _ in found}), sorted_names({s for _, s in found})
    counts = np.array([[found.get((t, s), 0) for s in said] for t in truths], dtype=float)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    figure = Figure(figsize=(2.0 + 0.25 * len(said), 1.8 + 0.215 * len(truths)), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1.6, aspect="auto")
    axes.set_xticks(range(len(said)), labels=said, rotation=90)
    axes.set_yticks(range(len(truths)), labels=[f"{t} ({sum(row):.0f})" for t, row in zip(truths, counts, strict=True)])
    axes.set_xticks(np.arange(len(said) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(truths) + 1) - 0.5, minor=True)
    axes.grid(False)
    axes.grid(True, which="minor", color=FAINT, linewidth=0.5)
    axes.tick_params(length=0, which="both")
    for j, row in enumerate(counts):
        for k, count in enumerate(row):
            right = truths[j] == said[k]
            if right:
                axes.add_patch(Rectangle((k - 0.5, j - 0.5), 1, 1, fill=False, edgecolor=INK, linewidth=1.1))
            if count:
                axes.text(
                    k, j, f"{count:.0f}", ha="center", va="center", color=INK, weight="bold" if right else "normal"
                )
    axes.set_xlabel("first candidate")
    axes.set_ylabel("truth (cases)")
    return figure


@styled
def reliability_figure(said: Mapping[str, Sequence[tuple[float, bool]]], first: str) -> Figure:
    """Stated probability against the share that was right; the first program stands out, with intervals and band."""
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8)
    for k, (name, pairs) in enumerate(said.items()):
        x, y, n = zip(*reliability(pairs), strict=True)
        color, mark = CYCLE[k % len(CYCLE)], MARKS[k % 7]
        if name != first:
            axes.plot(x, y, color=color, linestyle=DASHES[k % len(DASHES)], marker=mark, linewidth=0.7, markersize=4,
                      label=name, alpha=0.8)  # fmt: skip
            continue
        _chance(axes, pairs)
        ends = [wilson(round(share * count), count) for share, count in zip(y, n, strict=True)]
        bars = np.array([[s - low, high - s] for s, (low, high) in zip(y, ends, strict=True)]).T
        axes.errorbar(x, y, yerr=bars, color=color, marker=mark, linewidth=1.6, elinewidth=1.0, capsize=2.5, label=name,
                      zorder=4)  # fmt: skip
        for at, share, count in zip(x, y, n, strict=True):
            axes.annotate(str(count), (at, share), (5, 4), textcoords="offset points", zorder=5)
    axes.set_xlim(-0.03, 1.04)
    axes.set_ylim(-0.03, 1.03)
    axes.set_xlabel("stated probability of the first candidate")
    axes.set_ylabel("share that was right")
    figure.legend(loc="outside right upper")
    return figure


def _chance(axes: Axes, pairs: Sequence[tuple[float, bool]]) -> None:
    """In each bin the range of shares that perfect probabilities would show with as many cases."""
    rng = np.random.default_rng(0)
    p = np.array([p for p, _ in pairs])
    at = np.minimum(BINS - 1, (p * BINS).astype(int))
    for k in np.unique(at):
        own = p[at == k]
        low, high = np.percentile((rng.random((4000, len(own))) < own).mean(axis=1), (2.5, 97.5))
        axes.add_patch(
            Rectangle((k / BINS, low), 1 / BINS, high - low, color=MEASURED, alpha=0.3, linewidth=0, zorder=0)
        )


@styled
def kept_figure(rows: Sequence[tuple[float, float, float, float, bool]]) -> Figure:
    """Stated closure with its interval against the oracle's, each a case; values outside sit on the edge."""
    figure = Figure(figsize=(5.6, 3.8), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(EDGE, EDGE, color=GREY, linewidth=0.8)
    axes.axhline(0, color=GREY, linewidth=0.5)
    for right, color, mark, text in (
        (True, BLUE, "o", "cause named first"),
        (False, VERMILLION, "X", "another answer"),
    ):
        axes.plot([], [], color=color, marker=mark, linestyle="none", label=text)
        for value, low, high, oracle, own in rows:
            if own != right:
                continue
            x, y = (float(np.clip(v, *EDGE)) for v in (oracle, value))
            if np.isfinite(low) and np.isfinite(high):
                axes.plot([x, x], np.clip([low, high], *EDGE), color=color, linewidth=0.8, alpha=0.6)
            axes.plot([x], [y], color=color, marker=mark, markersize=5)
    axes.set_xlim(0, 1.05)
    axes.set_ylim(EDGE[0] - 0.05, EDGE[1] + 0.05)
    axes.set_xlabel("closure of the oracle (share of the gap)")
    axes.set_ylabel("closure that was stated (share)")
    figure.legend(loc="outside right upper")
    return figure
