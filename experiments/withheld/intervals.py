"""Intervals of shares and of medians, calibration."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Z = 1.959964
DRAWS = 2000
BINS = 10


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927); (0, 1) of nothing."""
    if of == 0:
        return 0.0, 1.0
    p, z2 = hits / of, Z * Z
    middle = (p + z2 / (2 * of)) / (1 + z2 / of)
    half = Z / (1 + z2 / of) * math.sqrt(p * (1 - p) / of + z2 / (4 * of * of))
    # Rounding must not push an end past the share itself.
    return min(p, max(0.0, middle - half)), max(p, min(1.0, middle + half))


def bootstrap(values: Sequence[Any], what: Callable[[Sequence[Any]], float], seed: int = 0) -> tuple[float, float]:
    """95 % percentile interval of a statistic over resampled cases."""
    if len(values) < 2:
        return math.nan, math.nan
    rng = np.random.default_rng(seed)
    found = [what([values[k] for k in rng.integers(len(values), size=len(values))]) for _ in range(DRAWS)]
    low, high = np.nanpercentile(found, (2.5, 97.5))
    return float(low), float(high)


def calibration_error(pairs: Sequence[tuple[float, bool]], bins: int = BINS) -> float:
    """Expected calibration error of (stated probability, right or not): mean gap over bins, weighted by cases.

    It is no smaller than chance makes it: `by_chance` says how large that is for the same probabilities.
    """
    if not pairs:
        return math.nan
    stated, right = _columns(pairs)
    return float(_gaps(stated[None], right[None], bins)[0])


def calibration_interval(pairs: Sequence[tuple[float, bool]], bins: int = BINS, seed: int = 0) -> tuple[float, float]:
    """95 % basic bootstrap interval of the calibration error over cases.

    Resampled cases scatter about the sample's own gaps, which adds as much as chance had added: the basic interval
    turns that round, the percentile one would count it twice.
    """
    if len(pairs) < 2:
        return math.nan, math.nan
    stated, right = _columns(pairs)
    drawn = np.random.default_rng(seed).integers(len(stated), size=(DRAWS, len(stated)))
    value = calibration_error(pairs, bins)
    low, high = np.percentile(_gaps(stated[drawn], right[drawn], bins), (2.5, 97.5))
    return max(0.0, float(2 * value - high)), max(value, float(2 * value - low))


def by_chance(stated: Sequence[float], bins: int = BINS, seed: int = 0) -> Array:
    """Calibration errors (DRAWS,) of a forecaster whose probabilities, these, mean exactly what they say."""
    p = np.tile(np.array(stated, dtype=np.float64), (DRAWS, 1))
    return _gaps(p, (np.random.default_rng(seed).random(p.shape) < p).astype(np.float64), bins)


def _columns(pairs: Sequence[tuple[float, bool]]) -> tuple[Array, Array]:
    return np.array([p for p, _ in pairs]), np.array([float(right) for _, right in pairs])


def _bins(stated: Array, bins: int) -> NDArray[np.intp]:
    return np.minimum(bins - 1, (stated * bins).astype(np.intp))


def _gaps(stated: Array, right: Array, bins: int) -> Array:
    """Calibration errors of many samples at once, (samples, cases) -> (samples,)."""
    rows, n = stated.shape
    at = (_bins(stated, bins) + bins * np.arange(rows)[:, None]).ravel()
    gap = np.bincount(at, (stated - right).ravel(), rows * bins)
    return np.asarray(np.abs(gap).reshape(rows, bins).sum(axis=1) / n)


def reliability(pairs: Sequence[tuple[float, bool]], bins: int = BINS) -> list[tuple[float, float, int]]:
    """Of each bin that is not empty: mean stated probability, share that was right, cases."""
    if not pairs:
        return []
    stated, right = _columns(pairs)
    at = _bins(stated, bins)
    return [
        (float(stated[at == k].mean()), float(right[at == k].mean()), int((at == k).sum()))
        for k in range(bins)
        if (at == k).any()
    ]
