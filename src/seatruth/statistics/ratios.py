"""Interval of a ratio of two means."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import stdtrit

from seatruth.arrays import Array


def ratio_interval(above: Array, below: Array, level: float = 0.95) -> tuple[float, float]:
    """Interval of mean(above) / mean(below) over pairs, after Fieller.

    It holds each ratio r for which the mean of above - r below does not differ from 0 in a t-test. Where the mean
    below the line itself does not differ from 0, no ratio is excluded on at least one side, and the interval is
    the whole line: the pairs do not say how large the ratio is.

    Args:
        above: (n,) numerators.
        below: (n,) denominators of the same pairs.
        level: coverage.

    Returns:
        Lower and upper end; infinite where the pairs do not bound the ratio, as one pair never does.

    Source:
        E. C. Fieller, Some problems in interval estimation, J. R. Stat. Soc. B 16 (1954), 175-185.

    Example:
        >>> low, high = ratio_interval(np.array([1.0, 1.2, 0.8]), np.array([2.0, 2.1, 1.9]))
        >>> round(low, 2), round(high, 2)
        (0.29, 0.67)
    """
    n = len(above)
    if n < 2 or not (np.isfinite(above).all() and np.isfinite(below).all()):
        return -math.inf, math.inf
    factor = float(stdtrit(n - 1, 0.5 + 0.5 * level)) ** 2 / n
    spread = np.cov(above, below)
    a = float(below.mean()) ** 2 - factor * spread[1, 1]
    half_b = float(above.mean() * below.mean()) - factor * spread[0, 1]
    c = float(above.mean()) ** 2 - factor * spread[0, 0]
    if a <= 0.0:
        return -math.inf, math.inf
    root = math.sqrt(max(half_b**2 - a * c, 0.0))
    return float((half_b - root) / a), float((half_b + root) / a)
