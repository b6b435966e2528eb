"""What an effect's evidence is worth when not even the order of its magnitude is known.

A typical magnitude says how large an effect may be; most are smaller, and by how much nobody knows. So the prior of an
effect's parameters is normal with a deviation of the typical one (`WIDER`), or of a half, a quarter, ... of it, each as
probable as the other. A single wide normal would ask of a weak cause what only a strong one can pay.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from seatruth.arrays import Array, Indices

SCALES = tuple(0.5**k for k in range(6))
"""Parts of the prior deviation: down to a thirtieth."""
_MOST = 3
"""Effects at once for which all combinations are looked at."""


def scale_gain(information: Array, pull: Array, sd: Array, groups: Sequence[Indices]) -> float:
    """Rise of the log-evidence when each group of entries (one effect) has a scale of its own instead of `sd` alone.

    `information` (n, n) is of the data about these entries, all nuisances taken out, and `pull` (n,) the same times
    their most probable values by the data alone, from their nulls; `sd` (n,) are deviations of the priors.
    """
    if not groups or len(groups) > _MOST:
        return 0.0
    whole = _evidence(information, pull, sd)
    found = []
    for scales in itertools.product(SCALES, repeat=len(groups)):
        own = sd.copy()
        for entries, scale in zip(groups, scales):
            own[entries] *= scale
        found.append(_evidence(information, pull, own))
    top = max(found)
    return top + math.log(sum(math.exp(value - top) for value in found) / len(found)) - whole


def of_posterior(covariance: Array, moved: Array, sd: Array, groups: Sequence[Indices]) -> float:
    """The same from a posterior under `sd`: its covariance (n, n), and how far from the null it lies (n,)."""
    precision = np.linalg.pinv(covariance / np.outer(sd, sd), hermitian=True)
    values, vectors = np.linalg.eigh(0.5 * (precision + precision.T))
    # What the data add to the priors cannot be negative.
    information = (vectors * np.maximum(values - 1.0, 0.0)) @ vectors.T
    return scale_gain(information, precision @ (moved / sd), np.ones(len(sd)), groups)


def _evidence(information: Array, pull: Array, sd: Array) -> float:
    """Log-evidence over the null, up to nothing: of a normal likelihood under a normal prior."""
    values, vectors = np.linalg.eigh(np.eye(len(sd)) + information * np.outer(sd, sd))
    values = np.maximum(values, 1.0)
    along = vectors.T @ (pull * sd)
    return 0.5 * float((along**2 / values).sum()) - 0.5 * float(np.log(values).sum())
