"""From the figures of many drawn ships to an interval, and to what holds it: the trials or the priors.

Where the figures of the fitted trials miss their predictions by more than the draws let expect, the model lacks
something that none of its parameters holds. All intervals are then wider by the usual size of those misses, in standard
deviations (as Birge 1932 widens the error of means that disagree; by the median, so that one odd figure is not all).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy

from seatruth.arrays import Array
from seatruth.prediction.parameter_draws import ParameterDraws

_FEW = 20
"""Draws below which quantiles mean nothing. Chosen here [S]."""
_FEW_FIGURES = 5
"""Measured figures below which their misses say nothing of the size of the next one. Chosen here [S]."""
_MEDIAN = 0.6745
"""Median size of a standard normal variable."""
_CONSTANT = 1e-9
"""Spread over size below which a figure is constant: rounding."""
_BY_TRIALS, _BY_PRIORS = 0.25, 0.75
"""Shares of the variance from priors up to which the trials hold a figure, and from which the priors do. [S]"""


@dataclass(frozen=True)
class Interval:
    """The interval of one figure over the draws, in the figure's unit.

    Attributes:
        lower, upper: quantiles; NaN where too few draws have the figure, -inf or inf where draws without it reach
            past the quantile.
        missing: share of the draws that do not have the figure (another one never comes round, or diverges).
        prior_share: part of its variance from directions of the parameters that the trials leave to the priors, as
            the fit weighs both; NaN where the figure does not vary.
    """

    lower: float
    upper: float
    missing: float
    prior_share: float

    @property
    def held_by(self) -> str:
        """ "trials", "priors", "both", or "" for a figure that does not vary or has no interval."""
        if math.isnan(self.prior_share):
            return ""
        if self.prior_share <= _BY_TRIALS:
            return "trials"
        return "priors" if self.prior_share >= _BY_PRIORS else "both"


def interval(values: Array, drawn: ParameterDraws, level: float) -> Interval:
    """The interval of a figure from its values (n,) of the draws, NaN where a draw has none.

    Draws without the figure are taken to lie beyond its larger end: a turn that does not come round is the widest.
    """
    known = np.isfinite(values)
    missing = 1.0 - float(known.mean()) if values.size else 1.0
    if np.count_nonzero(known) < _FEW:
        return Interval(math.nan, math.nan, missing, math.nan)
    tail = 0.5 * (1.0 - level)
    ends = np.where(known, np.abs(values), np.inf) * np.where(np.nanmedian(values) < 0, -1.0, 1.0)
    ends = np.where(known, values, ends)
    lower, upper = (float(np.quantile(ends, q, method="nearest")) for q in (tail, 1.0 - tail))
    return Interval(lower, upper, missing, prior_share(values, drawn))


def widening(measured: pd.DataFrame, level: float) -> float:
    """The factor, 1 or more, by which intervals must be wider, from the rows of the fitted trials (`measured_rows`)."""
    fitted = measured[(measured.role == "fit") & np.isfinite(measured.measured) & np.isfinite(measured.predicted)]
    half = 0.5 * (fitted.upper - fitted.lower)
    known = np.isfinite(half) & (half > _CONSTANT * fitted.predicted.abs())
    if int(known.sum()) < _FEW_FIGURES:
        return 1.0
    sd = half[known] / float(scipy.stats.norm.ppf(0.5 + 0.5 * level))
    misses = (fitted.measured - fitted.predicted)[known] / sd
    return max(1.0, float(np.median(np.abs(misses))) / _MEDIAN)


def widened(frame: pd.DataFrame, center: str, factor: float) -> pd.DataFrame:
    """The table with its intervals wider about the column `center`."""
    if factor == 1.0 or not len(frame):
        return frame
    middle = frame[center].where(np.isfinite(frame[center]), 0.5 * (frame.lower + frame.upper))
    return frame.assign(lower=middle + factor * (frame.lower - middle), upper=middle + factor * (frame.upper - middle))


def prior_share(values: Array, drawn: ParameterDraws) -> float:
    """How far a figure rests on priors, to first order: their part of its variance, as the fit weighs both.

    H^-1 = H^-1 (D + P) H^-1: D is the information of the trials by the noise that the fit takes them to have, P that
    of the priors. The part of P does not depend on how large the residuals turned out; else trials that fit badly
    would seem to hold more. The figure's slopes come from a regression on the draws.
    """
    known = np.isfinite(values)
    y = values[known]
    if y.size <= drawn.X.shape[1] + 1 or float(np.std(y)) <= _CONSTANT * max(1e-12, float(np.mean(np.abs(y)))):
        return math.nan
    X = drawn.X[known] - drawn.center
    scale = X.std(axis=0)
    used = scale > 0
    if not used.any():
        return math.nan
    columns = np.column_stack([np.ones(y.size), X[:, used] / scale[used]])
    slopes = np.linalg.lstsq(columns, y, rcond=None)[0][1:] / scale[used]
    own = np.ix_(used, used)
    whole, priors = (float(slopes @ part[own] @ slopes) for part in (drawn.weighed, drawn.priors))
    return min(1.0, max(0.0, priors / whole)) if whole > 0 else math.nan
