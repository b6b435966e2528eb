"""What an effect's evidence is worth when not even the order of its magnitude is known.

A typical magnitude says how large an effect may be; most are smaller, some larger, and by how much nobody knows. So the
prior of an effect's magnitude is normal with a deviation of the typical one (times `prior_width`), or of four times, a
quarter, ... of it, each as probable as the other. A single wide prior would over-penalise weak effects, a single narrow
one strong ones.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from seatruth.arrays import Array, Indices

_MOST_COMBINED = 3
"""Effects at once for which all combinations of scales are averaged; more would take 4^n evaluations."""


def scale_gain(information: Array, pull: Array, sd: Array, groups: Sequence[Indices], scales: Sequence[float]) -> float:
    """Rise of the log-evidence (nats) when the magnitudes of each effect have a scale of their own.

    Args:
        information: (n, n), of the trials about the effects' parameters, everything else integrated out.
        pull: (n,), the same times their most probable distance from the prior means.
        sd: (n,), prior deviations at scale 1.
        groups: entries of each effect's magnitudes.
        scales: parts and multiples of the prior deviation, each as probable as the others.

    Example:
        >>> round(scale_gain(np.eye(1), np.array([0.1]), np.array([10.0]), [np.array([0])], (1.0, 0.1)), 2)
        1.4
    """
    if not groups or len(groups) > _MOST_COMBINED:
        return 0.0
    whole = _evidence(information, pull, sd)
    found = []
    for combination in itertools.product(scales, repeat=len(groups)):
        own = sd.copy()
        for entries, scale in zip(groups, combination):
            own[entries] *= scale
        found.append(_evidence(information, pull, own))
    top = max(found)
    return top + math.log(sum(math.exp(value - top) for value in found) / len(found)) - whole


def _evidence(information: Array, pull: Array, sd: Array) -> float:
    """Log-evidence over the null, up to nothing: of a normal likelihood under a normal prior."""
    values, vectors = np.linalg.eigh(np.eye(len(sd)) + information * np.outer(sd, sd))
    values = np.maximum(values, 1.0)
    along = vectors.T @ (pull * sd)
    return 0.5 * float((along**2 / values).sum()) - 0.5 * float(np.log(values).sum())
