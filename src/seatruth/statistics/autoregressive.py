"""Residuals that remember: autoregressive models of their series, and what they leave of the number of samples.

The misfit of a real model is strongly coloured, and standard errors that take it for white noise come out several
times too small. Here each series of residuals (one channel of one trial) gets an autoregressive model, fitted by
Burg's method with the order that the corrected Akaike criterion picks (Burg 1975; Hurvich and Tsai 1989).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from seatruth.arrays import Array

_HIGHEST = 12
"""Highest order tried."""
_FEWEST = 12
"""Samples below which a series is taken as white."""
_LARGEST_MEMORY = 0.9999
"""Largest sum of the coefficients: a series that never forgets has no long-run variance."""


@dataclass(frozen=True)
class Colour:
    """r_k = sum_j coefficients[j] r_(k-1-j) + innovation, of standard deviation `sd`."""

    coefficients: Array
    sd: float
    variance: float
    """Of the series itself."""

    @property
    def long_run(self) -> float:
        """Long-run variance: variance times the sum of all autocorrelations."""
        memory = min(float(self.coefficients.sum()), _LARGEST_MEMORY)
        return (self.sd / (1.0 - memory)) ** 2

    def effective(self, n: int) -> float:
        """Independent samples that n of these are worth, between 1 and n."""
        if n == 0 or self.long_run <= 0.0 or self.variance <= 0.0:
            return float(n)
        return float(min(n, max(1.0, n * self.variance / self.long_run)))

    def spread_back(self, columns: Array) -> Array:
        """L' columns (n, K), where L L' is the covariance of n samples: filtered backwards in time."""
        denominator = np.concatenate([[1.0], -self.coefficients])
        return np.asarray(lfilter([self.sd], denominator, columns[::-1], axis=0)[::-1])


def colour_of(residuals: Array, ordered: bool = True) -> Colour:
    """The autoregressive model of one series (n,); white where it is not `ordered` in time."""
    series = np.asarray(residuals, dtype=np.float64)
    variance = float(np.mean(series**2)) if series.size else 0.0
    white = Colour(np.zeros(0), math.sqrt(variance), variance)
    if series.size < _FEWEST or variance == 0.0 or not ordered:
        return white
    best, best_score = white, _score(variance, series.size, 0)
    forward, backward, coefficients, power = series[1:].copy(), series[:-1].copy(), np.zeros(0), variance
    for order in range(1, min(_HIGHEST, series.size // 4) + 1):
        both = float(forward @ forward + backward @ backward)
        if both <= 0.0:
            break
        reflection = 2.0 * float(forward @ backward) / both
        fixed = abs(reflection) > 1.0 - 1e-9  # a series that repeats itself exactly, such as a constant error
        if fixed:
            reflection = math.copysign(_LARGEST_MEMORY, reflection)
        coefficients = np.append(coefficients - reflection * coefficients[::-1], reflection)
        power *= 1.0 - reflection**2
        score = _score(power, series.size, order)
        if score < best_score:
            best, best_score = Colour(coefficients, math.sqrt(power), variance), score
        if fixed:
            break
        forward, backward = (forward - reflection * backward)[1:], (backward - reflection * forward)[:-1]
    return best


def autocorrelation(residuals: Array) -> float:
    """Correlation of each sample with the next; NaN where there are too few."""
    series = np.asarray(residuals, dtype=np.float64)
    square = float(series @ series)
    return float(series[1:] @ series[:-1]) / square if series.size > 2 and square > 0 else math.nan


def _score(power: float, n: int, order: int) -> float:
    """Corrected Akaike criterion of a model of this order."""
    free = order + 1
    return n * math.log(power) + 2.0 * free + 2.0 * free * (free + 1) / max(1.0, n - free - 1)
