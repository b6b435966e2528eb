"""What an effect's evidence is worth when not even the order of its magnitude is known.

A typical magnitude says how large an effect may be; most are smaller, some larger, and by how much nobody knows. So the
prior of an effect's magnitude is normal with a deviation of the typical one (times `prior_width`), or of four times, a
quarter, ... of it, each as probable as the other. A single wide prior would over-penalise weak effects, a single narrow
one strong ones. Where magnitudes are the squares of what is unknown so, as that of a wave's height, these factors are
squares too.

Many parameters have their null at a bound: a delay, a play, a rate limit are not negative. Where the trials ask for a
value beyond it, the normal approximation credits the effect with values that it cannot have. So each evidence is that
of the prior within the bounds: the share of the posterior that lies between them, over the share of the prior.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from scipy.special import log_ndtr, logsumexp

from seatruth.arrays import Array, Flags, Indices

_MOST_COMBINED = 3
"""Effects at once for which all combinations of scales are averaged; more would take 4^n evaluations."""


def scale_gain(
    information: Array,
    pull: Array,
    sd: Array,
    groups: Sequence[Indices],
    scales: Sequence[float],
    low: Array | None = None,
    high: Array | None = None,
    held: Flags | None = None,
    powers: Sequence[int] | None = None,
) -> float:
    """Rise of the log-evidence (nats) when each effect's magnitudes have a scale of their own and keep to their bounds.

    Args:
        information: (n, n), of the trials about the effects' parameters, everything else integrated out.
        pull: (n,), the same times their most probable distance from the prior means.
        sd: (n,), prior deviations at scale 1.
        groups: entries of each effect's magnitudes.
        scales: parts and multiples of the prior deviation, each as probable as the others.
        low: (n,), lower bounds less the prior means; none where None.
        high: (n,), upper bounds less the prior means.
        held: (n,), which parameters the evidence that rises holds at their prior means; none where None.
        powers: of the scales in each effect's magnitudes, 2 where these are squares; all 1 where None.

    Example:
        >>> round(scale_gain(np.eye(1), np.array([0.1]), np.array([10.0]), [np.array([0])], (1.0, 0.1)), 2)
        1.4
    """
    if not groups:
        return 0.0
    low = np.full(len(sd), -math.inf) if low is None else low
    high = np.full(len(sd), math.inf) if high is None else high
    free = np.ones(len(sd), dtype=np.bool_) if held is None else ~held
    whole = _evidence(information[np.ix_(free, free)], pull[free], sd[None, free])[0]
    if len(groups) > _MOST_COMBINED:
        return float(
            (_evidence(information, pull, sd[None]) + _within(information, pull, sd[None], low, high))[0] - whole
        )
    combinations = np.array(list(itertools.product(scales, repeat=len(groups))))
    own = np.repeat(sd[None], len(combinations), axis=0)
    for k, entries in enumerate(groups):
        own[:, entries] *= combinations[:, k, None] ** (1 if powers is None else powers[k])
    found = _evidence(information, pull, own) + _within(information, pull, own, low, high)
    return float(logsumexp(found) - math.log(len(found)) - whole)


def _evidence(information: Array, pull: Array, sd: Array) -> Array:
    """Log-evidence (m,) over the null, up to nothing: of a normal likelihood under normal priors of sd (m, n)."""
    values, vectors = np.linalg.eigh(np.eye(sd.shape[1]) + information * sd[:, :, None] * sd[:, None, :])
    values = np.maximum(values, 1.0)
    along = (vectors.transpose(0, 2, 1) @ (pull * sd)[:, :, None])[:, :, 0]
    return np.asarray(0.5 * (along**2 / values - np.log(values)).sum(axis=1))


def _within(information: Array, pull: Array, sd: Array, low: Array, high: Array) -> Array:
    """Log share (m,) of the posterior between the bounds less that of the prior, parameter by parameter."""
    bounded = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    if not bounded.size:
        return np.zeros(len(sd))
    scaled = np.linalg.inv(np.eye(sd.shape[1]) + information * sd[:, :, None] * sd[:, None, :])
    mean = (scaled @ (pull * sd)[:, :, None])[:, bounded, 0]
    deviation = np.sqrt(np.maximum(scaled[:, bounded, bounded], 1e-300))
    ends = low[bounded] / sd[:, bounded], high[bounded] / sd[:, bounded]
    inside = _log_between((ends[0] - mean) / deviation, (ends[1] - mean) / deviation)
    return np.asarray((inside - _log_between(*ends)).sum(axis=1))


def _log_between(low: Array, high: Array) -> Array:
    """Logarithm of the normal probability between two values each, exact in both tails."""
    flipped = low > 0.0
    a, b = np.where(flipped, -high, low), np.where(flipped, -low, high)
    upper, lower = log_ndtr(b), log_ndtr(a)
    with np.errstate(divide="ignore"):
        return np.asarray(upper + np.log1p(-np.exp(np.minimum(lower - upper, 0.0))))
