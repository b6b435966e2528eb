"""Where the searches of a multi-start begin: the study's start, then points spread over the region of random starts."""

from __future__ import annotations

import math

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Cost
from seatruth.optimizers.coordinates import Coordinates

_STREAM = 20
"""Tells the random numbers of starts from those of a solver with the same seed (chosen here [S])."""
_REDRAWS = 10
"""How often a start that cannot be evaluated is drawn again (chosen here [S])."""


def starting_points(cost: Cost, count: int, seed: int = 0) -> Array:
    """Starts (count, K) in the parameters' units; the first is the one that the parameters' values state.

    The others are a scrambled Sobol sequence (Sobol 1967, scrambled as by Owen 1998) over each parameter's region of
    starts: its `start`, else its bounds, else two standard deviations of its prior. Fewer starts of the same seed are
    the first of more. A point at which the cost is not finite is drawn again.

    Args:
        cost: what is minimised.
        count: number of starts, 1 or more.
        seed: seed of the sequence.

    Example:
        >>> import seatruth.sample
        >>> from seatruth.costs import cost_of
        >>> from seatruth.optimizers import starting_points
        >>> cost = cost_of(seatruth.sample.load())
        >>> starting_points(cost, 3, seed=1).shape == (3, len(cost.parameters))
        True
    """
    coordinates = Coordinates(cost.parameters)
    start = np.clip(cost.start, *cost.bounds)[None]
    if count < 2:
        return start
    from scipy.stats import qmc  # takes long to load, and few searches have many starts

    rng = np.random.default_rng([seed, _STREAM])
    # Sobol points are balanced in numbers that are powers of two; the first of them are the same whatever the number.
    fractions = qmc.Sobol(coordinates.dimension, rng=rng).random_base2(math.ceil(math.log2(count)))[: count - 1]
    low, high = coordinates.region_lower, coordinates.region_upper
    points = coordinates.x_of(low + fractions * (high - low))
    for k in range(len(points)):
        again = np.random.default_rng([seed, _STREAM, k])  # of its own, so that other starts do not depend on it
        for _ in range(_REDRAWS):
            if np.isfinite(cost.values(points[k][None])[0]):
                break
            points[k] = coordinates.x_of(coordinates.sample(again, 1))[0]
    return np.vstack([start, points])
