"""Bayesian comparison of two methods on the same blocks, with a region of practical equivalence (ROPE).

Source: Benavoli, Corani, Demsar and Zaffalon (2017), "Time for a change: a tutorial for comparing multiple classifiers
through Bayesian analysis", JMLR 18(77). Unlike a p-value, the result can say that two methods are alike.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seatruth.arrays import Array

_STRENGTH = 0.5
"""Weight of the prior's one observation, of no difference: the paper's choice."""
_SAMPLES = 5000
"""Samples of the posterior: a probability is then known to 0.007. Chosen here [S]."""


class Posterior(NamedTuple):
    """Probabilities that the first method is lower in practice, that both are alike, and that the second is lower."""

    lower: float
    alike: float
    higher: float


def signed_rank_posterior(differences: Array, rope: float, *, samples: int = _SAMPLES, seed: int = 0) -> Posterior:
    """The Bayesian signed-rank test: the posterior of the sign of the median difference of two methods.

    The weights of the blocks have a Dirichlet process as prior (Ferguson 1973), with one observation of no difference.
    For each sample of the weights, the mean of two differences that are drawn by them is below -rope, within the rope,
    or above it, with some probability; the likeliest of the three gets the sample.

    Args:
        differences: (n,), first minus second, one a block; may be 0, not NaN.
        rope: half the width of the region of practical equivalence, in units of the differences.
        samples: number of samples of the posterior.
        seed: seed of the samples.

    Example:
        >>> import numpy as np
        >>> signed_rank_posterior(np.full(20, -1.0), 0.1).lower
        1.0
        >>> signed_rank_posterior(np.full(20, 0.01), 0.1).alike
        1.0
    """
    z = np.append(0.0, np.asarray(differences, dtype=float))
    sums = z[:, None] + z[None, :]
    lower, higher = (sums < -2.0 * rope).astype(np.float32), (sums > 2.0 * rope).astype(np.float32)
    rng = np.random.default_rng(seed)
    weights = rng.gamma(np.append(_STRENGTH, np.ones(len(z) - 1)), size=(samples, len(z))).astype(np.float32)
    weights /= weights.sum(axis=1, keepdims=True)
    below = np.einsum("sn,sn->s", weights @ lower, weights)
    above = np.einsum("sn,sn->s", weights @ higher, weights)
    winner = np.argmax([below, 1.0 - below - above, above], axis=0)
    return Posterior(*(float((winner == k).mean()) for k in range(3)))
