"""What a comparison measures of an answer: intervals, bounds, the prediction of trials held out."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.comparison.problem import Run
from seatruth.comparison.realisation import CostCache, NoisyProblem
from seatruth.costs.study_cost import StudyCost
from seatruth.uncertainty.covariance import covariance
from seatruth.uncertainty.cross_validation import rms_errors

_AT_BOUND = 1e-6
"""Distance from a bound, over the range, below which a parameter is at the bound. Chosen here [S]."""


def bounds(costs: CostCache, problem: NoisyProblem, run: Run) -> Array:
    """Cramer-Rao bounds of the free parameters for white noise of the added size; NaN without a truth or a noise.

    They are those of the trajectory (or the formula) whatever cost is fitted: the information in the record, not the
    part of it that a method uses.
    """
    free = problem.study.free
    nothing = np.full(len(free), math.nan)
    if problem.truth is None or run.noise.level == 0:
        return nothing
    cost = costs.get(problem, run, "formula" if run.cost == "formula" else "trajectory")
    x = candidate(cost, problem.truth)
    residuals, jacobian = cost.residuals(x), cost.jacobian(x)
    if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
        return nothing
    return np.asarray(covariance(residuals, jacobian, cost.residual_blocks, white=True).crlb[: len(free)])


def candidate(cost: StudyCost, values: Mapping[str, float]) -> Array:
    """The candidate with these values, nuisances at their start."""
    x = cost.start.copy()
    for k, parameter in enumerate(cost.space.free):
        x[k] = values[parameter.name]
    return x


def open_loop_cost(costs: CostCache, problem: NoisyProblem, run: Run, cost: StudyCost, x: Array) -> float:
    """Cost of the trajectory at a regression's answer; NaN for the other kinds of cost."""
    if run.cost != "regression":
        return math.nan
    trajectory = costs.get(problem, run, "trajectory")
    there = candidate(trajectory, {q.name: float(v) for q, v in zip(cost.space.free, x)})
    return float(trajectory.values(there[None])[0])


def prediction_error(problem: NoisyProblem, cost: StudyCost, x: Array) -> float:
    """Root mean square error over the trials held out, of each output over its range, all outputs together."""
    trials = problem.holdout
    if not len(trials):
        return math.nan
    squares, count = 0.0, 0
    with np.errstate(over="ignore", invalid="ignore"):  # a prediction may diverge
        for trial, y in zip(trials, cost.predict(x, list(trials))):
            for name, error in rms_errors(problem.study, trial.outputs, y).items():
                squares += (error / problem.ranges[name]) ** 2 if name in problem.ranges else 0.0
                count += 1
    return math.sqrt(squares / count) if count and math.isfinite(squares) else math.inf if count else math.nan


def intervals(cost: StudyCost, x: Array) -> pd.DataFrame:
    """The free parameters with standard errors and 95 % intervals, NaN where there are none."""
    free = cost.space.free
    size = len(free)
    table = pd.DataFrame({"value": x[:size]}, index=pd.Index([q.name for q in free], name="parameter"))
    if not cost.noise_known:
        cost.reweight(x)
    residuals, jacobian = cost.residuals(x), cost.jacobian(x)
    stderr, half = np.full(size, math.nan), np.full(size, math.nan)
    if np.isfinite(residuals).all() and np.isfinite(jacobian).all():
        low, high = cost.bounds
        with np.errstate(invalid="ignore"):
            width = np.where(np.isfinite(high - low), high - low, np.inf)
            gradient = jacobian.T @ residuals
            below, above = x - low <= _AT_BOUND * width, high - x <= _AT_BOUND * width
        has_width = np.isfinite(width)
        fixed = has_width & ((below & (gradient > 0)) | (above & (gradient < 0)))
        uncertainty = covariance(residuals, jacobian, cost.residual_blocks, fixed)
        stderr, half = uncertainty.stderr[:size], uncertainty.half_width()[:size]
    with np.errstate(invalid="ignore"):
        return table.assign(stderr=stderr, lower=x[:size] - half, upper=x[:size] + half)
