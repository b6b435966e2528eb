"""The figure of a multi-start: where its searches ended."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from seatruth.report.figures.style import CYCLE, GREY, few_ticks, log_axis, nothing, placed, styled
from seatruth.report.view import View, view

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

_MARKERS = ("o", "s", "^", "D", "v", "P")
_SMALLEST = 1e-3
"""Cost above the best that stands at the foot of the axis: far below what data can tell, which is about 2."""
_DECADES = 12.0


@styled
def waterfall(estimate: Estimate | View) -> Figure:
    """The cost at the end of each start above the best, in rising order; a step is an optimum."""
    data = view(estimate)
    table = data.starts[np.isfinite(data.starts["cost"])].sort_values(by="cost", kind="stable")
    if len(table) < 2:
        return nothing("Fewer than two starts ended with a cost.")
    cost = table["cost"].to_numpy(dtype=float)
    above = np.maximum(cost - cost[0], _SMALLEST)
    top = min(max(float(above.max()) * 3.0, 10.0), _SMALLEST * 10.0**_DECADES)
    figure = Figure(figsize=(4.8, 2.6))
    axes = placed(figure, 0.78, 0.48, 3.84, 1.72)
    few_ticks(axes, 6, 4)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    log_axis(axes, "y", _SMALLEST / 2.0, top)
    place = np.arange(1, len(table) + 1)
    axes.plot(place, np.minimum(above, top), color=GREY, linewidth=0.8, zorder=2)
    handles = []
    optimum = table["optimum"].to_numpy(dtype=int)
    last = len(_MARKERS)
    for number in np.unique(np.minimum(optimum, last)):
        here = np.minimum(optimum, last) == number
        style: dict[str, Any] = {
            "color": CYCLE[number - 1],
            "marker": _MARKERS[number - 1],
            "linestyle": "",
            "markersize": 5,
        }
        axes.plot(place[here], np.minimum(above[here], top), zorder=3, clip_on=False, **style)
        more = f"{number} and higher" if number == last and optimum.max() > last else str(number)
        handles.append(Line2D([], [], label=more, **style))
    axes.set_xlim(0.5, len(table) + 0.5)
    axes.set_xlabel("starts, the best first")
    axes.set_ylabel("cost above the best")
    figure.legend(
        handles=handles, loc="upper left", ncols=6, columnspacing=1.0, handletextpad=0.1, borderaxespad=0.2,
        title="optimum", title_fontsize=8.0, alignment="left",
    )  # fmt: skip
    return figure
