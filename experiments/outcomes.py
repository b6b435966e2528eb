"""The picture of attacks: of the inputs that each got, how many ended in which way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from common import COLOURS

_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": COLOURS[0]},
    {"color": COLOURS[1]},
    {"color": COLOURS[7], "hatch": "///", "edgecolor": "white", "linewidth": 0.0},
)
"""Of the ways to end, in their order. Dark, light and hatched: a print without colours keeps them apart."""
_ROOM = 4.5
"""Per cent of a bar below which its number has no room in it."""


def picture(names: Sequence[str], ends: Mapping[str, Sequence[int]], title: str) -> Any:
    """Bars of shares, one for each attack; `ends` gives by way to end how many inputs of each attack did so.

    The last way is the one that must not be: its numbers stand beside the bars.
    """
    import matplotlib.pyplot as plt

    counts = np.array(list(ends.values()), dtype=float)
    whole = counts.sum(axis=0)
    shares = 100.0 * counts / np.maximum(whole, 1.0)
    y = np.arange(len(names))
    figure, axes = plt.subplots(figsize=(8.0, 0.27 * len(names) + 1.3), layout="constrained")
    left = np.zeros(len(names))
    for row, share, way, look in zip(counts, shares, ends, _LOOKS, strict=True):
        axes.barh(y, share, 0.72, left=left, label=way, **look)
        inside = "white" if look["color"] != COLOURS[1] else "black"
        for k in (int(place) for place in np.flatnonzero(share >= _ROOM)):
            axes.text(left[k] + share[k] / 2, k, f"{row[k]:,.0f}", ha="center", va="center", fontsize=7, color=inside)
        left = left + share
    for at, bad in enumerate(counts[-1]):
        axes.text(101.5, at, f"{bad:,.0f}", va="center", fontsize=8, weight="bold" if bad else "normal")
    axes.text(101.5, -1.0, list(ends)[-1], va="center", fontsize=8)
    axes.set_yticks(y, [f"{name} ({n:,.0f})" for name, n in zip(names, whole)], fontsize=8)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xlim(0.0, 100.0)
    axes.set_xlabel("share of the inputs (%); in brackets: inputs, in the bars: how many ended so", fontsize=9)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.legend(loc="outside upper center", ncols=len(ends), fontsize=8, frameon=False, title=title, title_fontsize=9)
    return figure
