"""Errors of trials left out: what the others predict of a trial, against what is there.

A fit to the other trials differs from the fit to all by one step, to first order (`marginal_likelihood.py`), and so do
its open-loop errors; nothing is fitted or simulated again, and no motion diverges on the way. A trial that goes beyond
the others, as the one hard turn among gentle zigzags, is off by what those leave open about the coefficients, with the
right effect as without it. That says nothing about the effect, and it would drown all that does: so what the others
leave open counts as noise of the prediction, up to three of its standard deviations. What lies beyond is no chance: the
model is wrong. Shapes: n samples of a trial, over all channels, k unknowns, I initial states.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit, without_discrepancy
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import Sizes, noise_shapes
from seatruth.diagnosis.unknowns import SharedStep
from seatruth.statistics.covariance_root import covariance_root

_AT_MOST = 3.0
"""Standard deviations up to which unknowns may lie elsewhere than the other trials say. [S] 1 of 370 lies beyond."""


@dataclass(frozen=True)
class Simulated:
    """A fit to all trials as it is simulated, without each trial's own forces; N samples of all trials."""

    fit: Fit
    errors: Array
    """Measured minus simulated (N,)."""
    slopes: Array
    """Their derivatives by the unknowns that the fit shares (N, k)."""
    starts: Array
    """Their derivatives by the initial states of the trials (N, I)."""

    @classmethod
    def of(cls, problem: Problem, fit: Fit, *, terms: bool = False) -> Simulated:
        """Simulates a fit without what is missing; with `terms` the free terms in its equations stay."""
        bare = without_discrepancy(problem, fit.point)
        point = Point(fit.point.shared, bare.initial, bare.forces) if terms else bare
        now = problem.linearize(point, fit.effects, discrepancy=terms)
        count = len(problem.initial_names)
        return cls(fit, now.errors, now.shared[:, fit.likelihood.columns], now.local[:, :count].copy())


def moved(problem: Problem, model: Simulated, name: str, deviation: Array) -> Array:
    """What an effect of a model moves the trials by (N,), in deviations of the noise, to first order.

    Less what other initial states do as well, since these are fitted to each trial.
    """
    effect, free = problem.effects[name], list(model.fit.likelihood.columns)
    rows, weight = np.zeros(problem.count), 1.0 / deviation[problem.channel_of]
    for column, q in zip(problem.columns[name], effect.parameters, strict=True):
        if q.name in effect.magnitudes and column in free:
            rows += model.slopes[:, free.index(column)] * (model.fit.point.shared[column] - effect.null[q.name])
    for trial in range(len(problem.trials)):
        here = problem.trial_of == trial
        starts, own = (model.starts[here].T * weight[here]).T, rows[here] * weight[here]
        rows[here] = own - starts @ np.linalg.lstsq(starts, own, rcond=None)[0]
    return rows


class PredictionErrors:
    """Errors of one trial in standard deviations of the noise, predicted from the others, by any model.

    One measure serves all models. With errors e in deviations of the noise, and b (n, k) a root, of orthogonal columns,
    of the covariance of what the others leave open, its square is the least (|e - b d|^2 + |d|^2) / n over d (k,)
    within 3 to either side: e' (1 + b b')^-1 e / n for all that is no farther, about 1 where only noise and that act.
    The initial state is fitted to the trial itself.
    """

    def __init__(
        self, problem: Problem, deviation: Array, left: int, others: Sequence[int], reference: Simulated
    ) -> None:
        """`deviation` (C,) of each channel's noise; `left` the trial; what `others` leave open is that of `reference`.

        Raises LinAlgError where the algebra fails.
        """
        self.problem = problem
        self._here = problem.trial_of == left
        self._others = list(others)
        self._weight = 1.0 / deviation[problem.channel_of[self._here]]
        self._worthless = self._error_of_none()
        self._starts = self._rows(reference.starts)
        self._curvature = self._starts.T @ self._starts + np.diag(1.0 / problem.initial_sd**2)
        step = self._step(reference)
        root = np.zeros((len(reference.fit.likelihood.columns), len(step.free)))
        root[np.isin(reference.fit.likelihood.columns, step.free)] = covariance_root(step.covariance)
        self._along, self._open, _ = np.linalg.svd(
            self._fitted(self._rows(reference.slopes) @ root), full_matrices=False
        )

    @property
    def left_open(self) -> float:
        """Root mean square of what the others leave open about the trial, in standard deviations of the noise."""
        return math.sqrt(float(np.sum(self._open**2)) / len(self._weight))

    def of(self, model: Simulated, channels: Sequence[int] | None = None) -> float:
        """Error of what a model predicts, of some channels or all; inf where the motion diverges, or the algebra fails.

        At most that of no prediction at all: to first order, a run that is about to diverge errs by anything.
        """
        try:
            step = self._step(model)
        except np.linalg.LinAlgError:
            return math.inf
        point = model.fit.point
        moved = self.problem.moved(point, step.shared, np.zeros_like(point.initial)).shared - point.shared
        with np.errstate(over="ignore", invalid="ignore"):  # of runs that diverge
            errors = self._rows(model.errors) + self._rows(model.slopes) @ moved[model.fit.likelihood.columns]
        size = self._size(errors, channels)
        return min(size, self._worthless) if math.isfinite(size) and channels is None else size

    def noise(self, best: Fit, channels: Sequence[int] | None = None) -> float:
        """What the best fit to all trials leaves of this one, freed of what fitting took from it.

        A fit to all takes the part 1 - (1 + b b')^-1 of a trial's noise into the coefficients; the expected square of
        the rest of white noise, measured as above, is the trace of (1 + b b')^-3 over n.
        """
        left = self._size(self._rows(self.problem.errors(best.point)), channels)
        lost = float(np.sum(1.0 - (1.0 + self._open**2) ** -3)) / len(self._weight)
        return left / math.sqrt(1.0 - lost) if lost < 1.0 else math.inf

    def _error_of_none(self) -> float:
        """Error of the mean of all trials in each channel, taken for what is left out."""
        problem = self.problem
        own = [problem.measured[problem.valid][problem.channel_of == c] for c in range(len(problem.outputs))]
        spread = np.array([np.std(values) if values.size else 0.0 for values in own])
        return math.sqrt(float(np.mean((spread[problem.channel_of[self._here]] * self._weight) ** 2)))

    def _step(self, model: Simulated) -> SharedStep:
        """From the fit to all trials to that to the others."""
        return model.fit.likelihood.shared_step(model.fit.sizes, model.fit.effects, self._others)

    def _rows(self, values: Array) -> Array:
        """What belongs to the trial, over the noise."""
        return np.asarray((values[self._here].T * self._weight).T)

    def _fitted(self, errors: Array) -> Array:
        """Errors (n, ...) less what another initial state explains of them."""
        return np.asarray(errors - self._starts @ np.linalg.solve(self._curvature, self._starts.T @ errors))

    def _size(self, errors: Array, channels: Sequence[int] | None = None) -> float:
        """Error of the trial; of some channels, the root mean square of what is left there, NaN where it has none."""
        if not np.isfinite(errors).all():
            return math.inf
        fitted = self._fitted(errors)
        along = self._along.T @ fitted
        taken = np.clip(along * self._open / (1.0 + self._open**2), -_AT_MOST, _AT_MOST)
        left = fitted - self._along @ (self._open * taken)
        if channels is not None:
            own = left[np.isin(self.problem.channel_of[self._here], channels)]
            return math.sqrt(float(np.mean(own**2))) if own.size else math.nan
        return math.sqrt(float(left @ left + taken @ taken) / len(fitted))


def noise_deviation(problem: Problem, sizes: Sizes) -> Array:
    """Standard deviation of each channel's noise, white and slow together (C,)."""
    shapes = noise_shapes(problem.settings)
    return np.array([math.exp(w) * math.sqrt(shapes[k].correlation(0.0)) for w, k in zip(sizes.white, sizes.shape)])
