"""Intervals of shares and of medians, calibration."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

Z = 1.959964
DRAWS = 2000


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


def calibration_error(pairs: Sequence[tuple[float, bool]], bins: int = 10) -> float:
    """Expected calibration error of (stated probability, right or not): mean gap over bins, weighted by cases."""
    if not pairs:
        return math.nan
    return sum(n / len(pairs) * abs(stated - right) for stated, right, n in reliability(pairs, bins))


def reliability(pairs: Sequence[tuple[float, bool]], bins: int = 10) -> list[tuple[float, float, int]]:
    """Of each bin that is not empty: mean stated probability, share that was right, cases."""
    rows: list[list[tuple[float, bool]]] = [[] for _ in range(bins)]
    for stated, right in pairs:
        rows[min(bins - 1, int(stated * bins))].append((stated, right))
    return [
        (float(np.mean([p for p, _ in row])), float(np.mean([right for _, right in row])), len(row))
        for row in rows
        if row
    ]
