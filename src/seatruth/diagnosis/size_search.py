"""The most probable sizes of noise and discrepancy: Newton steps by average information, and shapes on their grid."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Protocol

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.size_slopes import slopes
from seatruth.diagnosis.sizes import (
    NoisePrior,
    Sizes,
    least_white,
    log_prior,
    log_prior_slopes,
    noise_shapes,
    price_of_sizes,
)
from seatruth.statistics.state_space_noise import joined, whiten

_REACH = 2.0
"""Longest step in logarithms of sizes and in Fisher's z. [S] A factor of 7; average information is good for less."""
_DAMPINGS = (0.0, 1.0, 10.0, 100.0)
"""Dampings (Marquardt 1963) of a step that are tried until one rises. [S]"""
_FLAT = 1e-3
"""nats, information of a size on which nothing depends: too little to hold back any other."""
_STEPS = 3
"""Most steps of all sizes before shapes are tried. [S] Two are usual."""
_NEARLY = 3.0
"""nats by which a proposed shape may be behind: setting its white deviation may bring as much. [S]"""
_SWEPT = 0.1
"""nats that a sweep must bring for another one. [S] A tenth of what could change an answer."""
_DONE = 0.1 * _SWEPT
"""nats that a step of all sizes must bring for another one, and a channel's shape to be tried in the next sweep. [S]"""
_JUDGED = 3
"""Most sweeps when a set is judged by one linearization. [S]"""
_BEHIND = 50.0
"""nats by which noise of another shape may be worse for a channel's residuals alone, and be better once all unknowns
have moved. [S] Of 4613 shapes that were tried for an AUV with ten channels, the worst such one was 48 behind."""
_TRIED = 2
"""Shapes of a channel that are tried, those first that are best for its residuals. [S] Of 800 times that a channel of
two AUVs was asked, one of its ten neighbours was better 56 times: the first each time."""
_ROUNDING = 1e-9
"""nats within which two values of the objective are the same."""


class Objective(Protocol):
    """What sizes are chosen by."""

    def __call__(self, sizes: Sizes) -> float:
        """Its value (nats); -inf where the algebra fails."""

    def slopes(self, sizes: Sizes, *, noise: bool) -> tuple[Array, Array]:
        """Slopes (n,) by `sizes.vector` and information (n, n), those by white noise only if `noise`.

        Raises LinAlgError where the algebra fails.
        """

    def least(self, sizes: Sizes) -> Array:
        """The least that each entry of `sizes.vector` can be (n,)."""

    def outlook(self, sizes: Sizes, c: int) -> Callable[[int, float], float]:
        """What noise of a shape and a log white deviation is worth (nats) to a channel's residuals, all unknowns held.

        Up to a constant. Raises LinAlgError where the algebra fails.
        """


class OfSizes:
    """The marginal likelihood and the prior density of the sizes, at one linearization."""

    def __init__(self, likelihood: Likelihood, effects: Sequence[str], known: NoisePrior) -> None:
        self._likelihood, self._effects, self._known = likelihood, tuple(effects), known
        self._settings = likelihood.problem.settings
        self._place: tuple[Sizes, Array] | None = None

    def __call__(self, sizes: Sizes) -> float:
        """See `Objective`."""
        return self._likelihood.log_likelihood(sizes, self._effects) + log_prior(self._settings, sizes, self._known)

    def slopes(self, sizes: Sizes, *, noise: bool) -> tuple[Array, Array]:
        """See `Objective`."""
        slope, information = slopes(self._likelihood, sizes, self._effects, noise=noise)
        by_prior, of_prior = log_prior_slopes(self._settings, sizes, self._known)
        return slope + by_prior, information + np.diag(of_prior)

    def least(self, sizes: Sizes) -> Array:
        """See `Objective`."""
        found = np.full(len(sizes.vector), -math.inf)
        for c, value in least_white(self._known).items():
            found[c] = value
        return found

    def outlook(self, sizes: Sizes, c: int) -> Callable[[int, float], float]:
        """See `Objective`."""
        if self._place is None or self._place[0] is not sizes:  # channel after channel is asked for
            self._place = sizes, self._likelihood.posterior(sizes, self._effects).place
        left, t, begins = joined(self._likelihood.grams.residuals(c, self._place[1]))
        shapes = noise_shapes(self._settings)

        @cache
        def whitened(shape: int) -> tuple[float, float]:
            white, log_determinant = whiten(left, t, shapes[shape], begins)
            return float(white @ white), log_determinant

        def worth(shape: int, log_white: float) -> float:
            squares, log_determinant = whitened(shape)
            value = log_prior(self._settings, with_shape(sizes, c, shape, log_white), self._known)
            return value - 0.5 * (squares * math.exp(-2.0 * log_white) + log_determinant) - len(t) * log_white

        return worth


def maximise(
    objective: Objective,
    sizes: Sizes,
    settings: Settings,
    *,
    channels: Sequence[int],
    noise: bool = True,
    shapes: bool = True,
    sweeps: int = 2,
    proposals: Mapping[int, Sequence[tuple[int, float]]] | None = None,
) -> tuple[Sizes, float]:
    """The best sizes and the objective there: all sizes at once, and shapes of noise to neighbours on their grid.

    `channels` are those that were recorded; `proposals` are shapes with the logarithm of their white deviation that
    are tried first (`proposed_shapes`).
    """
    best, value = sizes, objective(sizes)
    for c, options in (proposals or {}).items():
        found = [with_shape(best, c, shape, white) for shape, white in options if shape != best.shape[c]]
        if found:
            values = [objective(one) for one in found]
            top = int(np.argmax(values))
            # What is near may be better once its white deviation has been set.
            if values[top] > value - _NEARLY:
                tried, reached = _climb(objective, found[top], values[top], np.array([c]), 1)
                best, value = (tried, reached) if reached > value else (best, value)
    moving, resting = _moving(best, channels, noise=noise), set[int]()
    for _ in range(sweeps):
        before, rested = value, resting
        best, value = _climb(objective, best, value, moving, _STEPS)
        resting = set()
        for c in channels if noise and shapes else ():
            last = value
            if c not in rested:
                best, value = _reshape(objective, best, value, c, settings)
            if value < last + _DONE:
                resting.add(c)
        if value < before + _SWEPT:
            break
    return best, value


def best_evidence(likelihood: Likelihood, effects: Sequence[str], known: NoisePrior, sizes: Sizes) -> float:
    """Evidence (nats) of a set at one linearization with its best sizes, found from these.

    Infinite where the algebra fails: what cannot be judged so is not to be left out for it.
    """
    problem = likelihood.problem
    channels = sorted({series.channel for series in problem.series})
    best, value = maximise(
        OfSizes(likelihood, effects, known), sizes, problem.settings, channels=channels, sweeps=_JUDGED
    )
    if not math.isfinite(value):
        return math.inf
    return value - price_of_sizes(lambda one: likelihood.log_likelihood(one, effects), best, problem.settings)


def _moving(sizes: Sizes, channels: Sequence[int], *, noise: bool) -> Indices:
    """Which entries of `sizes.vector` are moved: white noise, and sizes of what is missing where there is any."""
    found = list(channels) if noise else []
    if sizes.discrepancy:
        first = len(sizes.white)
        found += [first + int(k) for k in np.flatnonzero(np.isfinite(sizes.vector[first:]))]
    return np.array(found, dtype=np.intp)


def _climb(objective: Objective, best: Sizes, value: float, moving: Indices, steps: int) -> tuple[Sizes, float]:
    """Damped Newton steps of these entries by average information, as long as they bring something."""
    noise = bool((moving < len(best.white)).any())
    for _ in range(steps if len(moving) else 0):
        try:
            slope, information = objective.slopes(best, noise=noise)
        except np.linalg.LinAlgError:
            return best, value
        here, least = best.vector, objective.least(best)
        free = moving[(here[moving] > least[moving]) | (slope[moving] > 0.0)]
        before = value
        own = information[np.ix_(free, free)]
        for damping in _DAMPINGS:
            step = np.zeros(len(here))
            step[free] = np.linalg.solve(own + np.diag(damping * np.diag(own) + _FLAT), slope[free])
            if 0.5 * float(step @ slope) < _ROUNDING:
                break
            there = best.at(np.maximum(here + np.clip(step, -_REACH, _REACH), least))
            found = objective(there)
            if found > value:
                best, value = there, found
                break
        if value < before + _DONE:
            break
    return best, value


def with_shape(sizes: Sizes, c: int, shape: int, log_white: float) -> Sizes:
    """Sizes with another shape and white deviation of one channel's noise."""
    white = sizes.white.copy()
    white[c] = log_white
    return replace(sizes, white=white, shape=(*sizes.shape[:c], shape, *sizes.shape[c + 1 :]))


def _reshape(objective: Objective, best: Sizes, value: float, c: int, settings: Settings) -> tuple[Sizes, float]:
    """The first neighbouring shape of one channel's noise that is better, at the same white or the same total size.

    Those that its residuals like best come first.
    """
    shapes = noise_shapes(settings)
    ratios, times, now = len(settings.noise_ratios), len(settings.noise_times), best.shape[c]
    if now == 0:
        options = [1 + r * times + t for r in (1, 3) for t in (1, 3) if r < ratios and t < times]
    else:
        r, t = divmod(now - 1, times)
        near = ((r, t + 1), (r, t - 1), (r + 1, t), (r - 1, t))
        options = [1 + i * times + j for i, j in near if 0 <= i < ratios and 0 <= j < times] + [0]
    white = float(best.white[c])
    try:
        outlook = objective.outlook(best, c)
    except np.linalg.LinAlgError:
        return best, value
    tried = list[tuple[float, int, float]]()
    for option in options:
        total = 0.5 * math.log(shapes[now].correlation(0.0) / shapes[option].correlation(0.0))
        tried += [(outlook(option, white + shift), option, white + shift) for shift in (0.0, total)]
    least = outlook(now, white) - _BEHIND
    for worth, option, log_white in sorted(tried, reverse=True)[:_TRIED]:
        if worth > least:
            trial = with_shape(best, c, option, log_white)
            found = objective(trial)
            if found > value + _ROUNDING:
                return trial, found
    return best, value
