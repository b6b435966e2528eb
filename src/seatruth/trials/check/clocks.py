"""Clocks of two sensors against each other: an angle and its rate agree best when the offset is undone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import integral, own_step, windows

_WILD = 1e6
"""rad/s, far beyond any vehicle's rate of turn."""
_GRID = 81
"""Offsets that are tried before the best is refined."""
_RESOLUTION = 1e-4
"""To what an offset is refined, s: a thousandth of the least that is reported."""


@dataclass(frozen=True)
class Lag:
    """By how many seconds a channel comes after the integral of its rate, with its standard error, s.

    `before`, `after`: root mean square of what the rate does not explain of the channel's changes, as a part of them,
    at no offset and at this one.
    """

    seconds: float
    error: float
    before: float
    after: float


def clock_lag(t: Array, values: Array, rate: Array) -> Lag | None:
    """The offset of a channel (n,) against its rate (n,); None where they agree as well without one.

    Changes over windows are compared with a multiple of the integral of the rate over the same windows, shifted: a
    wrong scale or sign is another fault, and does not hide the offset.
    """
    known = np.flatnonzero(np.isfinite(rate))
    if known.size < limits.FEW_SAMPLES:
        return None
    # A rate with a clock of its own begins later and ends earlier than the trial.
    whole = slice(known[0], known[-1] + 1)
    t, values, rate = t[whole], values[whole], rate[whole]
    w = windows(t, [rate], [values])
    if w is None:
        return None
    most = limits.MAX_LAG * float(t[-1] - t[0])
    inside = (t[w.first] - most >= t[0]) & (t[w.last] + most <= t[-1])
    change = w.change(values)
    inside &= np.abs(change) < np.pi
    if inside.sum() < limits.MIN_WINDOWS or not np.isfinite(rate).all():
        return None
    if np.abs(rate).max(initial=0.0) > _WILD:
        return None  # no rate of a vehicle: its square would overflow
    change, first, last = change[inside], t[w.first][inside], t[w.last][inside]
    total = integral(t, rate)

    def expected(lag: float) -> Array:
        return np.asarray(np.interp(last - lag, t, total) - np.interp(first - lag, t, total), dtype=np.float64)

    def rest(lag: float) -> float:
        shifted = expected(lag)
        power = float(shifted @ shifted)
        return float(change @ change) - (float(change @ shifted) ** 2 / power if power else 0.0)

    lags = np.linspace(-most, most, _GRID)
    near = float(lags[int(np.argmin([rest(float(lag)) for lag in lags]))])
    if abs(near) > most - 1.5 * (lags[1] - lags[0]):
        return None  # no minimum inside what is looked at
    best = _finer(rest, near, float(lags[1] - lags[0]))
    step = own_step(t, values)
    found, without = max(rest(best), 0.0), rest(0.0)
    power = float(change @ change)
    if abs(best) < max(limits.MIN_LAG, limits.LAG_STEPS * step) or found > limits.LAG_EXPLAINS * without:
        return None
    if found > limits.DISAGREEMENT**2 * power:
        return None  # two channels that agree at no offset have another fault
    shifted = expected(best)
    scale = float(change @ shifted) / float(shifted @ shifted)
    if not _throughout(change - scale * expected(0.0), change - scale * shifted):
        return None
    slope = scale * (expected(best + 0.5 * step) - expected(best - 0.5 * step)) / step
    error = float(np.sqrt(found / max(change.size - 2, 1) / float(slope @ slope))) if slope.any() else np.inf
    if abs(best) < limits.SIGNIFICANT * error:
        return None
    return Lag(best, error, float(np.sqrt(without / power)), float(np.sqrt(found / power)))


def _finer(rest: Callable[[float], float], near: float, reach: float) -> float:
    """The offset with the least rest within `reach` of `near`, by ever finer grids.

    scipy.optimize would need a third of the evaluations, but takes longer to load than a whole check takes.
    """
    while reach > _RESOLUTION:
        lags = near + reach * np.linspace(-1.0, 1.0, 9)
        near = float(lags[int(np.argmin([rest(float(lag)) for lag in lags]))])
        reach /= 4.0
    return near


def _throughout(without: Array, found: Array) -> bool:
    """Whether an offset explains the disagreement (m,) in both halves of the record, as that of two clocks does."""
    half = without.size // 2
    parts = ((without[:half], found[:half]), (without[half:], found[half:]))
    return all(float(b @ b) < limits.LAG_HALVES * float(a @ a) for a, b in parts)
