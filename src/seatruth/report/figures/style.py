"""How figures look: one light style, colours that colour-blind readers and black-and-white prints keep apart."""

from __future__ import annotations

import functools
import io
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from seatruth.report.numbers import tick

BLUE, VERMILLION, GREEN, ORANGE, PURPLE = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7"
INK, GREY, MEASURED, FAINT = "#1a1a1a", "#666666", "#a6a6a6", "#e3e3e3"
"""The colours of Okabe and Ito (2008), and greys."""

CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, INK)
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)), (0, (3, 3)), (0, (8, 2)))

_STEPS = (1, 2, 2.5, 5, 10)

VERDICTS: dict[str, tuple[str, str]] = {
    "identified": (BLUE, "o"),
    "weak": (ORANGE, "s"),
    "not identifiable": (VERMILLION, "X"),
    "at bound": (PURPLE, "^"),
    "from prior": (GREY, "D"),
    "doubtful": (INK, "P"),
}
"""Colour and marker of each verdict."""

_STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "Helvetica", "sans-serif"],
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.titley": 1.0,
    "axes.labelsize": 8.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 6),
    "axes.unicode_minus": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "path.simplify": True,
    "path.simplify_threshold": 0.15,
    "text.usetex": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "seatruth",
    "svg.image_inline": True,
}

NAME = 28
"""Letters of a name that figures have room for."""

P = ParamSpec("P")
R = TypeVar("R")


@functools.cache
def _defaults() -> dict[str, Any]:
    """matplotlib's defaults of everything that shows, so that a user's own settings do not change a report."""
    kept = ("backend", "interactive", "toolbar", "webagg", "tk.", "keymap", "date.", "docstring", "timezone")
    return {key: value for key, value in matplotlib.rcParamsDefault.items() if not key.startswith(kept)}


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Runs a function in the style of the report; matplotlib's own settings are as before afterwards.

    Its figure shows itself in a notebook, without pyplot and without `%matplotlib inline`.
    """

    @functools.wraps(function)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        settings: Any = _defaults() | _STYLE
        with matplotlib.rc_context(rc=settings):
            made = function(*args, **kwargs)
        if isinstance(made, Figure):
            # A notebook asks an object for this method; matplotlib gives its figures none.
            made._repr_png_ = functools.partial(_png, made)  # type: ignore[attr-defined]  # Figure has no such
        return made

    return inside


def _png(figure: Figure) -> bytes:
    """The picture as a notebook shows it."""
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()


def text(name: Any, most: int = NAME) -> str:
    """A name as figures may show it: no mathematics in it, and not longer than there is room for."""
    clean = " ".join(str(name).split())
    short = clean if len(clean) <= most else f"{clean[: most - 1]}…"
    return short.replace("$", r"\$")


def distinct(names: Iterable[Any], most: int = NAME) -> dict[str, str]:
    """Each name as figures may show it (`text`), no two alike.

    Where two names begin alike and would be cut to the same, the middle is left out and not the end: solvers of a sweep
    differ in the values of their options, which come last. Where that is not enough, the names stay whole.
    """
    shown = {str(name): text(name, most) for name in names}
    for head in (most // 4, 1, None):
        twice = {short for short, times in Counter(shown.values()).items() if times > 1}
        for name, short in shown.items():
            if short in twice:
                clean = text(name, len(name))
                shown[name] = clean if head is None else f"{clean[:head]}…{clean[len(clean) - most + head + 1 :]}"
    return shown


def nothing(message: str) -> Figure:
    """A figure that says why there is nothing to see."""
    figure = Figure(figsize=(4.8, 0.8))
    figure.text(0.5, 0.5, message, ha="center", va="center", color=GREY)
    return figure


def placed(figure: Figure, left: float, bottom: float, width: float, height: float, **kwargs: Any) -> Axes:
    """Axes at a place given in inches, so that panels beside each other line up whatever their labels."""
    across, up = figure.get_size_inches()
    return figure.add_axes((left / across, bottom / up, width / across, height / up), **kwargs)


def label_width(names: Sequence[str], least: float = 0.5) -> float:
    """Inches that the longest of some tick labels takes."""
    return max(least, 0.18 + 0.073 * max((min(len(name), NAME) for name in names), default=0))


def rows(axes: Axes, names: Sequence[str]) -> None:
    """Names down the left edge, the first on top."""
    axes.set_yticks(range(len(names)), labels=[text(name) for name in names])
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    for y in range(len(names)):
        axes.axhline(y, color=FAINT, linewidth=0.6, zorder=0)


def few_ticks(axes: Axes, x: int = 5, y: int = 4) -> None:
    """At most so many intervals on each axis."""
    axes.xaxis.set_major_locator(MaxNLocator(x, steps=_STEPS))
    axes.yaxis.set_major_locator(MaxNLocator(y, steps=_STEPS))


def log_axis(axes: Axes, which: str, low: float, high: float) -> None:
    """A logarithmic axis whose ticks are plain numbers (0.5, 1, 2, 5, 10)."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    (axes.set_xlim if which == "x" else axes.set_ylim)(low, high)
    decades = math.log10(high / low)
    subs = (1.0, 2.0, 5.0) if decades < 2.2 else (1.0, 3.0) if decades < 3.5 else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: tick(value)))
    axis.set_minor_formatter(NullFormatter())
    axis.set_minor_locator(LogLocator(subs=(), numticks=8))


def zoomable(axes: Axes, link: str = "") -> None:
    """Lets a reader of the page zoom linear axes whose limits are final. Axes of one `link` share their abscissa."""
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    axes.set_gid(f"zoom {x0:.9g} {x1:.9g} {y0:.9g} {y1:.9g}|{link}")


def trace(name: str) -> str:
    """The `gid` of a line that a reader of the page may hide with all others of this name."""
    return f"trace {name}"


def spaced(t: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Samples (n,) of a line through y: those that are known, and the unknown ones (NaN) that make a gap.

    A channel that is sampled less often than its trial's clock has NaN between any two samples, and a line with them
    would show nothing. A gap is wider than one and a half of its usual steps.
    """
    known = np.isfinite(y)
    at = np.flatnonzero(known)
    if at.size < 2 or at.size == y.size:
        return np.ones(y.size, dtype=bool)
    step = np.diff(t[at])
    between = np.clip(np.searchsorted(at, np.arange(y.size)) - 1, 0, step.size - 1)
    inside = (np.arange(y.size) > at[0]) & (np.arange(y.size) < at[-1])
    wide = step[between] > 1.5 * float(np.median(step))
    return np.asarray(known | ~inside | wide, dtype=np.bool_)


def thinned(t: NDArray[np.float64], y: NDArray[np.float64], buckets: int = 180) -> NDArray[np.intp]:
    """Samples of y (n,) to draw: of each of `buckets` stretches of time its first, lowest, highest and last.

    So every peak is drawn that a line through all samples would show. The last sample before a gap (NaN), the first of
    it and the first after it are kept, so that gaps stay gaps.
    """
    n = len(y)
    if n <= 4 * buckets:
        return np.arange(n)
    span = float(t[-1] - t[0])
    bucket = (
        np.minimum(((t - t[0]) / span * buckets).astype(np.intp), buckets - 1) if span > 0 else np.zeros(n, np.intp)
    )
    known = np.isfinite(y)
    edge = np.flatnonzero(known[1:] != known[:-1])
    keep = [np.array([0, n - 1], dtype=np.intp), edge, edge + 1]
    index = np.flatnonzero(known)
    if index.size:
        order = index[np.lexsort((y[index], bucket[index]))]
        first = np.flatnonzero(np.diff(bucket[order], prepend=-1))
        last = np.append(first[1:], order.size) - 1
        change = np.flatnonzero(np.diff(bucket[index], prepend=-1))
        keep += [order[first], order[last], index[change], index[np.append(change[1:], index.size) - 1]]
    return np.unique(np.concatenate(keep))
