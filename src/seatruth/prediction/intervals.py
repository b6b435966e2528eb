"""From the figures of many drawn ships to an interval, and to what holds it: the trials or the priors.

Where the figures of the fitted trials miss their predictions by more than the draws let expect, the model lacks
something that none of its parameters holds. The usual size of these misses, as a part of the figure, is then the
model's own error: every interval gets it as well, as an independent relative error. A factor would not do: many good
trials make the parameters' part as narrow as one likes, and the model no better. What the trials do not show at all,
the error of the model's form in a manoeuvre that goes beyond them, is added as it is usual (`FORM_ERROR`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy

from seatruth.arrays import Array
from seatruth.prediction.parameter_draws import ParameterDraws

FORM_ERROR = 0.035
"""Relative error (standard deviation) of figures of a manoeuvre beyond the trials, by the model's form.

Chosen in `experiments/turn_coverage.py`, where zigzags of 20 deg are fitted by a model ten of whose coefficients are
off by 10 %: of the figures of the 35 deg turn 93 % lie inside with it, and 95 % on fresh ships (44 and 33 % without). A
few are off by much more, for which 6 % would be needed."""
_FEW = 20
"""Draws below which quantiles mean nothing. Chosen here [S]."""
_FEW_FIGURES = 5
"""Measured figures below which their misses say nothing of the size of the next one. Chosen here [S]."""
_MEDIAN_SQUARE = 0.4549
"""Median of the square of a standard normal variable."""
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


def model_error(measured: pd.DataFrame, level: float) -> float:
    """The model's own relative error (standard deviation), from the rows of the fitted trials (`measured_rows`).

    It is what the misses have beyond the parameters' part and the resolution of the record; 0 where they have no more,
    or where there are too few. By medians, so that one odd figure is not all.
    """
    fitted = measured[(measured.role == "fit") & np.isfinite(measured.measured) & np.isfinite(measured.predicted)]
    half = 0.5 * (fitted.upper - fitted.lower)
    size = fitted.predicted.abs()
    known = np.isfinite(half) & (size > 0)
    if int(known.sum()) < _FEW_FIGURES:
        return 0.0
    misses = ((fitted.measured - fitted.predicted) / size)[known]
    sd = (half[known] + fitted.resolution[known]) / _normal(level) / size[known]
    return math.sqrt(max(0.0, float((misses**2).median()) / _MEDIAN_SQUARE - float((sd**2).median())))


def widened(frame: pd.DataFrame, center: str, error: float, level: float) -> pd.DataFrame:
    """The table with the relative `error` (standard deviation) in its intervals, and the resolution if it has one."""
    if not len(frame):
        return frame
    middle = frame[center].where(np.isfinite(frame[center]), 0.5 * (frame.lower + frame.upper))
    extra = _normal(level) * error * middle.abs()
    late = frame.resolution if "resolution" in frame else 0.0
    low = middle - ((frame.lower - middle) ** 2 + extra**2) ** 0.5
    high = middle + ((frame.upper - middle) ** 2 + extra**2) ** 0.5
    # An interval that does not hold the middle (the draws' figures lie to one side of it) keeps its own ends.
    lower = low.where(frame.lower <= middle, frame.lower - extra)
    upper = high.where(frame.upper >= middle, frame.upper + extra)
    return frame.assign(lower=lower - late, upper=upper + late)


def _normal(level: float) -> float:
    """Half the width of the interval of a standard normal variable."""
    return float(scipy.special.ndtri(0.5 + 0.5 * level))


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
