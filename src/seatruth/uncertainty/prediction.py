"""Confidence and prediction intervals of a fitted formula."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from seatruth.arrays import Array
from seatruth.costs.formula import FormulaCost
from seatruth.trials.trial import Trial
from seatruth.uncertainty.covariance import active_bounds

_NULL_SPACE_LENGTH = 1e-10
"""Length of a row's scaled derivative that may lie in the null space of the fitted rows, by rounding; above it (and
above 1e-6 of the derivative's own length) the interval is infinite. Chosen here [S]."""
_RANK_TOLERANCE = 1e-9
"""Singular value over the largest below which the fitted rows do not determine a direction. Chosen here [S]."""


@dataclass(frozen=True)
class Prediction:
    """A formula on the n rows of one table, in the output's unit.

    Attributes:
        value: (n,), the formula's value.
        mean_half_width: (n,), half the confidence interval of the formula's value.
        half_width: (n,), half the prediction interval, that of one more measurement at these inputs.
    """

    value: Array
    mean_half_width: Array
    half_width: Array


def prediction_intervals(
    cost: FormulaCost, x: Array, trials: Sequence[Trial] | None = None, *, level: float = 0.95
) -> list[Prediction]:
    """Predictions with intervals, to first order in the parameters.

    The noise has the size of the residuals, with the degrees of freedom that the parameters leave. It is taken as
    independent from row to row, and as equal (or weighted as the study says). Parameters on an active bound count as
    fixed. Scales that cancel do no harm. An error of the formula that all rows share (another hull, another sea) is
    not in the intervals: leave-one-out errors show it.

    Args:
        cost: A formula's cost.
        x: (K,), the estimate.
        trials: Tables to predict; those of the cost where None.
        level: Confidence of the intervals.

    Returns:
        One Prediction a table. Intervals are infinite where the fitted rows do not determine the value.
    """
    residuals, J = cost.residuals(x), cost.jacobian(x)
    if not (np.isfinite(residuals).all() and np.isfinite(J).all()):
        return [_without_interval(y[:, 0]) for y in cost.predict(x, trials)]
    free = ~active_bounds(x, cost.bounds, J.T @ residuals)
    size = np.linalg.norm(J[:, free], axis=0)
    size[size == 0] = 1.0
    _, values, vectors = np.linalg.svd(J[:, free] / size, full_matrices=False)
    determined = values > _RANK_TOLERANCE * max(float(values.max(initial=0.0)), 1e-300)
    freedom = max(1, len(residuals) - int(determined.sum()))
    variance = float(residuals @ residuals) / freedom
    quantile = float(scipy.special.stdtrit(freedom, 0.5 + 0.5 * level))
    sigma = next(iter(cost.sigma.values()))
    predictions = []
    for trial, y in zip(cost.trials if trials is None else trials, cost.predict(x, trials)):
        slopes = cost.slopes(x, trial)[:, free] / size
        along = slopes @ vectors[determined].T
        outside = np.linalg.norm(slopes - along @ vectors[determined], axis=1)
        lost = outside > _NULL_SPACE_LENGTH + 1e-6 * np.linalg.norm(slopes, axis=1)
        spread = ((along / values[determined]) ** 2).sum(axis=1) * variance
        noise = variance * (sigma / cost.weight_of(trial)) ** 2
        mean = np.where(lost, np.inf, quantile * np.sqrt(spread))
        predictions.append(Prediction(y[:, 0], mean, np.where(lost, np.inf, quantile * np.sqrt(spread + noise))))
    return predictions


def _without_interval(value: Array) -> Prediction:
    """A prediction without derivatives."""
    return Prediction(value, np.full(len(value), np.inf), np.full(len(value), np.inf))
