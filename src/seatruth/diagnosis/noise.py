"""The noise floor: for each channel an autoregressive model shared by all trials, and whitening by it.

The floor is fitted to what is left of the residuals after everything that could be meant has been taken out (the
model's coefficients, the initial states, every effect of the library): the residuals of the model alone contain the
gap itself. Burg's recursion runs over the series of all trials at once, the corrected Akaike criterion picks the order.
Whitening is exact from the first sample on: early samples use the predictors of lower order (Levinson's recursion), so
that whitened noise has unit variance everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.sparse import coo_array, csr_array

from seatruth.arrays import Array, Indices

HIGHEST_ORDER = 8
_LARGEST_REFLECTION = 0.9995
_FEWEST = 12
_WINDOWS = (101, 51, 25, 13)
_SAME_STEP = 0.2
"""Relative difference of sampling steps up to which series share one noise model."""


@dataclass(frozen=True)
class Series:
    """One channel of one trial without a pause: places `rows` (n,) in the residual vector, in the order of time."""

    trial: str
    channel: str
    rows: Indices
    t: Array
    step: float


@dataclass(frozen=True)
class ChannelNoise:
    """Autoregressive noise of one channel at one sampling step, by its reflection coefficients (order,)."""

    channel: str
    step: float
    sd: float
    """Standard deviation of the noise itself."""
    innovation: float
    """Standard deviation of what its own past does not foretell."""
    reflection: Array
    samples: int

    @property
    def predictor(self) -> Array:
        """Coefficients (order,) of the past samples, the latest first."""
        return _predictors(self.reflection)[-1] if len(self.reflection) else np.zeros(0)

    @property
    def effective(self) -> float:
        """Independent samples that the channel's samples are worth, between 1 and all of them."""
        memory = min(float(self.predictor.sum()), 0.9999)
        long_run = (self.innovation / (1.0 - memory)) ** 2
        if long_run <= 0.0:
            return float(self.samples)
        return float(min(self.samples, max(1.0, self.samples * self.sd**2 / long_run)))

    @property
    def memory(self) -> float:
        """Time in s over which the noise forgets, from the lag-one correlation; 0 for white noise."""
        first = float(self.reflection[0]) if len(self.reflection) else 0.0
        return -self.step / math.log(first) if 0.0 < first < 1.0 else 0.0

    def whiten(self, columns: Array) -> Array:
        """Series (n, ...) in the order of time to independent ones of unit variance: (n, ...)."""
        n = len(columns)
        to, of, values = self.filter(np.arange(n, dtype=np.intp))
        return np.asarray(csr_array(coo_array((values, (to, of)), shape=(n, n))) @ columns)

    def filter(self, rows: Indices) -> tuple[Indices, Indices, Array]:
        """What whitens a series that stands in these rows (n,): entries (to, of, value) of a matrix."""
        n, order = len(rows), len(self.reflection)
        begin = self._beginning[: min(n, order), : min(n, order)]
        to, of = np.tril_indices(len(begin))
        parts = [(rows[to], rows[of], begin[to, of])]
        # Later samples all have the last row's coefficients, over the samples before them.
        for lag, coefficient in enumerate(self._beginning[-1][::-1]):
            late = np.arange(order, n)
            parts.append((rows[late], rows[late - lag], np.full(len(late), coefficient / self.innovation)))
        found = [np.concatenate(entries) for entries in zip(*parts)]
        return found[0], found[1], found[2]

    @cached_property
    def _beginning(self) -> Array:
        """Rows (order + 1, order + 1) that whiten the first samples of a series, each from those before it.

        The last row is that of all later samples, times the innovation.
        """
        order = len(self.reflection)
        found = np.eye(order + 1)
        for k, predictor in enumerate(_predictors(self.reflection), 1):
            found[k, :k] = -predictor[::-1]
        later = np.cumprod((1.0 - self.reflection**2)[::-1])[::-1]
        found[:order] *= np.sqrt(later)[:, None] / self.innovation
        return found


def _predictors(reflection: Array) -> list[Array]:
    """Predictors of order 1, 2, ... that these reflection coefficients make."""
    found: list[Array] = []
    a = np.zeros(0)
    for k in reflection:
        a = np.append(a - k * a[::-1], k)
        found.append(a)
    return found


@dataclass(frozen=True)
class NoiseFloor:
    """The noise of every series; `whiten` makes residuals and derivatives of independent samples of unit variance."""

    series: tuple[Series, ...]
    channels: tuple[ChannelNoise, ...]
    of: tuple[int, ...]
    """Which of `channels` belongs to each series."""

    def whiten(self, columns: Array) -> Array:
        """(M, ...) -> (M, ...); rows that belong to no series stay as they are."""
        whole = np.asarray(columns, dtype=np.float64)
        # Of a simulation that diverged nothing is left to whiten.
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(self._whitener(len(whole)) @ whole)

    def _whitener(self, rows: int) -> csr_array:
        """(M, M): of each row the row itself and those before it in its series."""
        if rows not in self._whiteners:
            rest = np.ones(rows, dtype=bool)
            parts = []
            for series, number in zip(self.series, self.of):
                rest[series.rows] = False
                parts.append(self.channels[number].filter(series.rows))
            alone = np.flatnonzero(rest)
            parts.append((alone, alone, np.ones(len(alone))))
            to, of, values = (np.concatenate(entries) for entries in zip(*parts))
            self._whiteners[rows] = csr_array(coo_array((values, (to, of)), shape=(rows, rows)))
        return self._whiteners[rows]

    @cached_property
    def _whiteners(self) -> dict[int, csr_array]:
        return {}

    @property
    def sd(self) -> dict[str, float]:
        """Standard deviation of each channel's noise, over its sampling steps."""
        found: dict[str, list[tuple[int, float]]] = {}
        for channel in self.channels:
            found.setdefault(channel.channel, []).append((channel.samples, channel.sd))
        return {
            name: math.sqrt(sum(n * sd**2 for n, sd in parts) / sum(n for n, _ in parts))
            for name, parts in found.items()
        }


def noise_floor(
    series: Sequence[Series],
    residuals: Array,
    taken: float = 0.0,
    least: Mapping[str, float] | None = None,
    most: Mapping[str, float] | None = None,
) -> NoiseFloor:
    """The noise of residuals (M,). `taken` is the number of parameters that were fitted to them; `least` gives by
    channel a deviation below which no noise is believed (half a digit, say), `most` one above which what is slow in the
    residuals is no noise of that sensor: it is taken out before the noise is looked at.
    """
    total = sum(len(s.rows) for s in series)
    share = max(0.0, min(0.5, taken / max(1, total)))
    kinds: list[tuple[str, float]] = []
    of: list[int] = []
    for one in series:
        for number, (channel, step) in enumerate(kinds):
            if channel == one.channel and abs(step - one.step) <= _SAME_STEP * step:
                of.append(number)
                break
        else:
            of.append(len(kinds))
            kinds.append((one.channel, one.step))
    channels = []
    for number, (channel, step) in enumerate(kinds):
        parts = [residuals[s.rows] for s, n in zip(series, of) if n == number]
        floor = (least or {}).get(channel, 0.0)
        parts = _quick(parts, (most or {}).get(channel, math.inf))
        channels.append(_pooled(channel, step, parts, share, floor))
    return NoiseFloor(tuple(series), tuple(channels), tuple(of))


def _quick(parts: Sequence[Array], most: float) -> list[Array]:
    """The series less a running mean, of the longest window that brings their deviation under `most`."""
    found = list(parts)
    for window in _WINDOWS:
        count = sum(len(p) for p in found)
        if math.sqrt(sum(float(p @ p) for p in found) / max(1, count)) <= most:
            break
        found = [p - uniform_filter1d(p, min(window, len(p)), mode="nearest") for p in parts]
    return found


def white_floor(series: Sequence[Series], sizes: Mapping[str, float]) -> NoiseFloor:
    """White noise of stated deviations by channel: where every estimate begins."""
    names = sorted({one.channel for one in series})
    channels = []
    for name in names:
        own = [one for one in series if one.channel == name]
        count, step = sum(len(one.rows) for one in own), own[0].step
        channels.append(ChannelNoise(name, step, sizes[name], sizes[name], np.zeros(0), count))
    return NoiseFloor(tuple(series), tuple(channels), tuple(names.index(one.channel) for one in series))


def _pooled(channel: str, step: float, parts: Sequence[Array], share: float, floor: float) -> ChannelNoise:
    """Burg's recursion over several series at once."""
    count = sum(len(p) for p in parts)
    variance = sum(float(p @ p) for p in parts) / max(1, count) / (1.0 - share)
    variance = max(variance, floor**2, 1e-300)
    long = [p for p in parts if len(p) >= _FEWEST]
    reflections: list[float] = []
    power, best, best_power = variance, 0, variance
    best_score = _score(power, count, 0)
    forward, backward = [p[1:].copy() for p in long], [p[:-1].copy() for p in long]
    for order in range(1, HIGHEST_ORDER + 1):
        both = sum(float(f @ f + b @ b) for f, b in zip(forward, backward))
        if both <= 0.0 or count < 4 * order:
            break
        reflection = 2.0 * sum(float(f @ b) for f, b in zip(forward, backward)) / both
        reflection = max(-_LARGEST_REFLECTION, min(_LARGEST_REFLECTION, reflection))
        reflections.append(reflection)
        power *= 1.0 - reflection**2
        score = _score(power, count, order)
        if score < best_score:
            best, best_score, best_power = order, score, power
        forward, backward = (
            [(f - reflection * b)[1:] for f, b in zip(forward, backward)],
            [(b - reflection * f)[:-1] for f, b in zip(forward, backward)],
        )
    innovation = max(math.sqrt(best_power), floor)
    return ChannelNoise(channel, step, math.sqrt(variance), innovation, np.array(reflections[:best]), count)


def _score(power: float, n: int, order: int) -> float:
    """Corrected Akaike criterion of a model of this order."""
    free = order + 1
    return n * math.log(power) + 2.0 * free + 2.0 * free * (free + 1) / max(1.0, n - free - 1)
