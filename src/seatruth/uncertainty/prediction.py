"""How far the next measurement may lie from what a fitted formula says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from seatruth.arrays import Array
from seatruth.costs.formula import FormulaCost
from seatruth.trials.trial import Trial
from seatruth.uncertainty.covariance import pressed

_BLIND = 1e-10
"""Part of a row's derivative that may lie where the fitted rows see nothing; beyond it the interval is infinite."""


@dataclass(frozen=True)
class Prediction:
    """A formula on the rows of one table, each (n,): its value, half the interval of the mean, and of a measurement."""

    value: Array
    mean: Array
    """Half the confidence interval of the formula's own value."""
    half: Array
    """Half the prediction interval: that of one more measurement at these inputs."""


def prediction_intervals(
    cost: FormulaCost, x: Array, trials: Sequence[Trial] | None = None, *, level: float = 0.95
) -> list[Prediction]:
    """Predictions at a fit `x` on tables (those of the cost where None), to first order in the parameters.

    The noise has the size of the residuals, with the degrees of freedom that the parameters leave; it is taken as
    independent from row to row, and as equal (or as the study's weights say). Parameters on a bound count as fixed.
    Scales that cancel do no harm: only what the fitted rows fix enters. What the formula leaves out and the rows share
    (another hull, another sea) is not in it: leave-one-out errors show that.
    """
    residuals, J = cost.residuals(x), cost.jacobian(x)
    if not (np.isfinite(residuals).all() and np.isfinite(J).all()):
        return [_unknown(y[:, 0]) for y in cost.predict(x, trials)]
    free = ~pressed(x, cost.bounds, J.T @ residuals)
    size = np.linalg.norm(J[:, free], axis=0)
    size[size == 0] = 1.0
    _, values, vectors = np.linalg.svd(J[:, free] / size, full_matrices=False)
    seen = values > 1e-9 * max(float(values.max(initial=0.0)), 1e-300)
    freedom = max(1, len(residuals) - int(seen.sum()))
    variance = float(residuals @ residuals) / freedom
    quantile = float(student.ppf(0.5 + 0.5 * level, freedom))
    sigma = next(iter(cost.sigma.values()))
    found = []
    for trial, y in zip(cost.trials if trials is None else trials, cost.predict(x, trials)):
        slopes = cost.slopes(x, trial)[:, free] / size
        along = slopes @ vectors[seen].T
        lost = np.linalg.norm(slopes - along @ vectors[seen], axis=1) > _BLIND + 1e-6 * np.linalg.norm(slopes, axis=1)
        spread = ((along / values[seen]) ** 2).sum(axis=1) * variance
        noise = variance * (sigma / cost.weight_of(trial)) ** 2
        mean = np.where(lost, np.inf, quantile * np.sqrt(spread))
        found.append(Prediction(y[:, 0], mean, np.where(lost, np.inf, quantile * np.sqrt(spread + noise))))
    return found


def _unknown(value: Array) -> Prediction:
    """A prediction without derivatives: it has no interval."""
    return Prediction(value, np.full(len(value), np.inf), np.full(len(value), np.inf))
