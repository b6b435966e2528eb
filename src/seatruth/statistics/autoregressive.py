"""Autocorrelated residuals: autoregressive (AR) models and the effective sample size.

The residuals of a real model are strongly autocorrelated. Standard errors that assume white noise are then several
times too small. Here each residual series (one channel of one trial) gets an AR model, fitted by Burg's method; the
corrected Akaike criterion chooses the order.

Sources: Burg (1975), "Maximum entropy spectral analysis"; Hurvich and Tsai (1989), "Regression and time series model
selection in small samples", Biometrika 76.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from seatruth.arrays import Array

MAX_ORDER = 12
"""Highest order that is tried. Chosen here [S]: the criterion rarely picks more than 8 on residuals of trials."""
MIN_SAMPLES = 12
"""A shorter series is taken as white. Chosen here [S]: fewer samples do not determine a coefficient."""
MAX_COEFFICIENT_SUM = 0.9999
"""The sum of the coefficients is limited to this in the long-run variance, which is infinite at 1. Chosen here [S]: it
stands for a correlation over ten thousand samples, longer than any trial's."""
_MAX_REFLECTION = 1.0 - 1e-9
"""A larger reflection coefficient means that the series repeats itself exactly, up to rounding."""


@dataclass(frozen=True)
class AutoregressiveModel:
    """r[k] = sum over j of coefficients[j] r[k-1-j] + innovation[k].

    Attributes:
        coefficients: (order,), the latest sample first; empty for white noise.
        innovation_sd: Standard deviation of the innovation, in the unit of the series.
        variance: Variance of the series, in its unit squared.
    """

    coefficients: Array
    innovation_sd: float
    variance: float

    @property
    def long_run_variance(self) -> float:
        """Variance times the sum of all autocorrelations: what decides how slowly a mean converges."""
        total = min(float(self.coefficients.sum()), MAX_COEFFICIENT_SUM)
        return (self.innovation_sd / (1.0 - total)) ** 2

    def effective_samples(self, n: int) -> float:
        """Number of independent samples that carry as much information as n of these, between 1 and n."""
        if n == 0 or self.long_run_variance <= 0.0 or self.variance <= 0.0:
            return float(n)
        return float(min(n, max(1.0, n * self.variance / self.long_run_variance)))

    def multiply_by_factor_transpose(self, columns: Array) -> Array:
        """L' columns, where L L' is the covariance matrix of n samples: (n, K) -> (n, K).

        This is the AR filter run backwards in time, so the matrix is never built: the filter is a solution with the
        banded matrix of its coefficients (scipy.signal's own filter takes half a second to load, in every worker).
        """
        if not columns.size:
            return columns  # every parameter is held by a bound
        bands = np.repeat(np.concatenate([[1.0], -self.coefficients])[:, None], len(columns), axis=1)
        backwards = self.innovation_sd * columns[::-1]
        filtered, _ = scipy.linalg.lapack.dtbtrs(bands, backwards, uplo="L", diag="U")
        return np.asarray(filtered[::-1])

    def innovations(self, series: Array) -> Array:
        """Prediction errors (n,) of a series (n,); 0 for the first `order` samples, which have too short a past."""
        errors = series.copy()
        order = len(self.coefficients)
        for lag in range(1, order + 1):
            errors[lag:] -= self.coefficients[lag - 1] * series[:-lag]
        errors[:order] = 0.0
        return errors


WHITE = AutoregressiveModel(np.zeros(0), 1.0, 1.0)
"""White noise of unit variance."""


def fit_autoregressive(residuals: Array, ordered: bool = True) -> AutoregressiveModel:
    """Fits an AR model to one series by Burg's method.

    Args:
        residuals: (n,) with mean zero, in any unit, equally spaced in time.
        ordered: Whether neighbours in the series are neighbours in time; otherwise the model is white.

    Example:
        >>> import numpy as np
        >>> model = fit_autoregressive(np.random.default_rng(0).standard_normal(500))
        >>> bool(model.effective_samples(500) > 400)
        True
    """
    series = np.asarray(residuals, dtype=np.float64)
    variance = float(np.mean(series**2)) if series.size else 0.0
    best = AutoregressiveModel(np.zeros(0), math.sqrt(variance), variance)
    if series.size < MIN_SAMPLES or variance == 0.0 or not ordered:
        return best
    best_criterion = corrected_akaike(variance, series.size, 0)
    forward, backward, coefficients, power = series[1:].copy(), series[:-1].copy(), np.zeros(0), variance
    for order in range(1, min(MAX_ORDER, series.size // 4) + 1):
        energy = float(forward @ forward + backward @ backward)
        if energy <= 0.0:
            break
        reflection = 2.0 * float(forward @ backward) / energy
        exact = abs(reflection) > _MAX_REFLECTION  # such as a constant error
        if exact:
            reflection = math.copysign(MAX_COEFFICIENT_SUM, reflection)
        coefficients = np.append(coefficients - reflection * coefficients[::-1], reflection)
        power *= 1.0 - reflection**2
        criterion = corrected_akaike(power, series.size, order)
        if criterion < best_criterion:
            best, best_criterion = AutoregressiveModel(coefficients, math.sqrt(power), variance), criterion
        if exact:
            break
        forward, backward = (forward - reflection * backward)[1:], (backward - reflection * forward)[:-1]
    return best


def lag_one_autocorrelation(residuals: Array) -> float:
    """Correlation of each sample with the next of a series (n,); NaN for fewer than three samples or all zeros."""
    series = np.asarray(residuals, dtype=np.float64)
    energy = float(series @ series)
    return float(series[1:] @ series[:-1]) / energy if series.size > 2 and energy > 0 else math.nan


def corrected_akaike(innovation_variance: float, n: int, order: int) -> float:
    """Corrected Akaike criterion (AICc) of an AR model fitted to n samples; the smaller is the better."""
    free = order + 1
    return n * math.log(innovation_variance) + 2.0 * free + 2.0 * free * (free + 1) / max(1.0, n - free - 1)
