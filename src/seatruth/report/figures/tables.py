"""Figure of a fitted formula: measured against computed, with prediction intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from seatruth.report.figures.style import BLUE, CYCLE, FAINT, GREY, INK, few_ticks, nothing, placed, styled, text
from seatruth.report.view import View, view

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

_MARKERS = "os^Dv*"


@styled
def measured_against_computed(estimate: Estimate | View) -> Figure:
    """Measured over computed values of a formula's tables; grey bars are 95 % prediction intervals.

    Rows without a measurement have only their bar.
    """
    data = view(estimate)
    frames = {name: data.trace(name, data.channels_of(name)[0]) for name in data.trial_names}
    frames = {name: frame[np.isfinite(frame["fitted"])] for name, frame in frames.items()}
    if not any(len(frame) for frame in frames.values()):
        return nothing("No rows have a computed value.")
    figure = Figure(figsize=(4.8, 4.3))
    axes = placed(figure, 0.72, 0.5, 3.9, 3.6)
    for k, (name, frame) in enumerate(frames.items()):
        if "lower" in frame:
            known = np.isfinite(frame["lower"]) & np.isfinite(frame["upper"])
            axes.vlines(frame["fitted"][known], frame["lower"][known], frame["upper"][known], color=FAINT, linewidth=3)
        label = text(name, 20) if len(frames) <= len(_MARKERS) else ""
        axes.plot(
            frame["fitted"],
            frame["measured"],
            _MARKERS[k % len(_MARKERS)],
            color=CYCLE[k % len(CYCLE)] if len(frames) > 1 else BLUE,
            markersize=4,
            label=label,
        )
    values = np.concatenate([frame[c].to_numpy() for frame in frames.values() for c in ("measured", "fitted")])
    ends = [float(np.nanmin(values)), float(np.nanmax(values))]
    axes.plot(ends, ends, color=INK, linewidth=0.8, zorder=1)
    few_ticks(axes, 6, 6)
    channel = data.channel(next(iter(data.series))[1])
    axes.set_xlabel(f"computed {text(channel.label, 24)}")
    axes.set_ylabel(f"measured {text(channel.label, 24)}")
    if 1 < len(frames) <= len(_MARKERS):
        axes.legend(loc="upper left", labelcolor=GREY)
    return figure
