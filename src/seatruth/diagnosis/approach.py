"""Points from which a fit begins: nearer to the record, or as far as steps under given sizes lead."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import Sizes, noise_shapes
from seatruth.diagnosis.steps import Step, likelihood_at, step
from seatruth.trials.prepare.outliers import MAD_TO_SD

_CLOSE = 3.0
"""Median error, in noise deviations, from which a channel's noise is no longer inflated."""
_NO_NEARER = 0.03
"""Mean fall of the logarithm of the channels' errors below which a fit is as near its record as it comes. [S]"""
_HELD_STEPS = 12
"""Most steps that are taken before sizes are set anew, where these are `held`. [S]"""
LEAST_RISE = 1.0
"""nats that steps or new sizes must bring, or leave ahead of a point, for it to be sought again. [S]"""


def approached(problem: Problem, effects: tuple[str, ...], point: Point, sizes: Sizes) -> tuple[Point, Sizes]:
    """A point nearer to the record, where errors are many times the noise, and the noise inflated to what is left.

    Each channel's noise is set to a part of its median error, anew at each step: what strays most weighs least, and
    the weights come to those of the noise as the errors fall. It ends where they fall no more.
    """
    distance = _distances(problem, problem.errors(point), sizes)
    taken: Step | None = None
    for _ in range(problem.settings.fit_steps):
        if not np.isfinite(distance).all() or (distance <= _CLOSE).all():
            break
        inflated = replace(sizes, white=sizes.white + np.log(np.maximum(1.0, distance / _CLOSE)))
        at = problem.linearize(point, effects, discrepancy=sizes.discrepancy)
        likelihood = likelihood_at(problem, at, inflated, effects)
        taken = step(problem, at, inflated, likelihood, taken)
        del at, likelihood
        nearer = _distances(problem, problem.errors(taken.point), sizes)
        progress = float(np.sum(np.log(np.maximum(distance, 1.0)) - np.log(np.maximum(nearer, 1.0))))
        if progress > 0.0:
            point, distance = taken.point, nearer
        if progress < _NO_NEARER * len(distance):
            if not problem.lent:
                break
            problem.renew()
    left = np.where(np.isfinite(distance), distance * MAD_TO_SD, 1.0)
    return point, replace(sizes, white=sizes.white + np.log(np.maximum(1.0, left)))


def stepped_under(problem: Problem, effects: tuple[str, ...], point: Point, sizes: Sizes, discrepancy: bool) -> Point:
    """Where steps under these sizes lead from a point.

    Sizes are set for the linear optimum. Where an effect takes the place of large forces there, the size of these falls
    to nothing at once, and where runs bend no step leads to it: the point keeps its forces, at any price.
    """
    taken: Step | None = None
    for _ in range(_HELD_STEPS):
        at = problem.linearize(point, effects, discrepancy=discrepancy)
        if not np.isfinite(at.errors).all() or (taken is not None and taken.fall < LEAST_RISE):
            break
        taken = step(problem, at, sizes, likelihood_at(problem, at, sizes, effects), taken)
        point = taken.point
    return point


def _distances(problem: Problem, errors: Array, sizes: Sizes) -> Array:
    """Median error of each channel in its noise deviations (C,); inf where the model diverges, 0 where unseen.

    White and slow part together: a fit that begins at the optimum of another one is near its record.
    """
    shapes = noise_shapes(problem.settings)
    found = np.zeros(len(problem.outputs))
    for c in range(len(found)):
        own = np.abs(errors[problem.channel_of == c])
        deviation = math.exp(float(sizes.white[c])) * math.sqrt(shapes[sizes.shape[c]].correlation(0.0))
        found[c] = float(np.median(own)) / deviation if own.size else 0.0
    return found if np.isfinite(errors).all() else np.full_like(found, math.inf)
