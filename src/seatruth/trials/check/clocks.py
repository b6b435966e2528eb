"""Clocks of two sensors against each other: an angle and its rate agree best when the offset is undone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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


@dataclass(frozen=True)
class _Compared:
    """Changes (m,) of a channel over windows that begin at `first` and end at `last`, s, and what they should be:
    those of the integral `total` (n,) of its rate at `t`. Offsets reach up to `most`; `step` is a sample's, s.
    """

    change: Array
    first: Array
    last: Array
    t: Array
    total: Array
    most: float
    step: float

    @property
    def power(self) -> float:
        return float(self.change @ self.change)

    def expected(self, lag: float) -> Array:
        at_last = np.interp(self.last - lag, self.t, self.total)
        return np.asarray(at_last - np.interp(self.first - lag, self.t, self.total), dtype=np.float64)

    def rest(self, lag: float) -> float:
        """Sum of squares that no multiple of what is expected explains."""
        shifted = self.expected(lag)
        power = float(shifted @ shifted)
        return max(self.power - (float(self.change @ shifted) ** 2 / power if power else 0.0), 0.0)

    def nearest(self) -> float | None:
        """The offset with the least rest; None where that is at the end of what is looked at."""
        lags = np.linspace(-self.most, self.most, _GRID)
        near = float(lags[int(np.argmin([self.rest(float(lag)) for lag in lags]))])
        width = float(lags[1] - lags[0])
        return None if abs(near) > self.most - 1.5 * width else _finer(self.rest, near, width)

    @property
    def least(self) -> float:
        """The least offset that is told, s."""
        return max(limits.MIN_LAG, limits.LAG_STEPS * self.step)


def clock_lag(t: Array, values: Array, rate: Array) -> Lag | None:
    """The offset of a channel (n,) against its rate (n,); None where they agree as well without one.

    Changes over windows are compared with a multiple of the integral of the rate over the same windows, shifted: a
    wrong scale or sign is another fault, and does not hide the offset.
    """
    compared = _compared(t, values, rate)
    best = None if compared is None else compared.nearest()
    if compared is None or best is None:
        return None
    change, step, power = compared.change, compared.step, compared.power
    found, without = compared.rest(best), compared.rest(0.0)
    if abs(best) < compared.least or found > limits.LAG_EXPLAINS * without:
        return None
    if found > limits.DISAGREEMENT**2 * power:
        return None  # two channels that agree at no offset have another fault
    shifted = compared.expected(best)
    scale = float(change @ shifted) / float(shifted @ shifted)
    if not _throughout(change - scale * compared.expected(0.0), change - scale * shifted):
        return None
    slope = scale * (compared.expected(best + 0.5 * step) - compared.expected(best - 0.5 * step)) / step
    error = float(np.sqrt(found / max(change.size - 2, 1) / float(slope @ slope))) if slope.any() else np.inf
    if abs(best) < limits.SIGNIFICANT * error:
        return None
    return Lag(best, error, float(np.sqrt(without / power)), float(np.sqrt(found / power)))


@dataclass(frozen=True)
class CommonLag:
    """Offsets (k,), s, by which a channel comes after the integral of its rate in each of k trials, much the same.

    `before`, `after`: as those of a `Lag`, the mean of the trials at no offset and at the mean one.
    """

    seconds: Array
    before: float
    after: float

    @property
    def mean(self) -> float:
        return float(self.seconds.mean())


def common_lag(records: Sequence[tuple[Array, Array, Array]]) -> CommonLag | None:
    """The offset that several trials have in common: each its times, a channel and its rate, all (n,).

    What short trials cannot say alone, since a filter or noise leaves more than a clean offset would, they say by the
    same offset in each: by chance it would lie anywhere within the reach. None where they do not.
    """
    every = [one for one in (_compared(*record) for record in records) if one is not None]
    found = [one.nearest() for one in every]
    lags = np.array([np.nan if lag is None else lag for lag in found])
    if lags.size < limits.LAG_TRIALS or not np.isfinite(lags).all():
        return None
    mean = float(lags.mean())
    if np.ptp(lags) > limits.LAG_SPREAD * abs(mean) or abs(mean) < max(one.least for one in every):
        return None
    powers = np.array([one.power for one in every])
    before = np.sqrt(np.array([one.rest(0.0) for one in every]) / powers)
    after = np.sqrt(np.array([one.rest(mean) for one in every]) / powers)
    if float(np.mean((after / before) ** 2)) > limits.LAG_TOGETHER or (after**2 > 1.0 - limits.AGREEMENT).any():
        return None
    return CommonLag(lags, float(before.mean()), float(after.mean()))


def _compared(t: Array, values: Array, rate: Array) -> _Compared | None:
    """A channel (n,) beside its rate (n,); None where too little of them is known."""
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
    if np.abs(rate).max(initial=0.0) > _WILD or not change[inside].any():
        return None  # no rate of a vehicle: its square would overflow; or an angle that stands still
    first, last = t[w.first][inside], t[w.last][inside]
    return _Compared(change[inside], first, last, t, integral(t, rate), most, own_step(t, values))


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
