"""Paired tests on ranks: Wilcoxon's signed ranks, Friedman's test, effect sizes; corrections for many tests.

Sources: Demsar (2006), "Statistical comparisons of classifiers over multiple data sets", JMLR 7, for the choice of
tests; Kerby (2014), "The simple difference formula", for the matched rank-biserial correlation; Benjamini and Hochberg
(1995), "Controlling the false discovery rate", J. R. Stat. Soc. B 57, 289.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy

from seatruth.arrays import Array

_MAX_EXACT = 50
"""Differences up to which the exact distribution is counted. Beyond it, the normal approximation agrees with the exact
p-value to about 1 % (see the test)."""


def signed_rank_p(differences: Array) -> float:
    """Two-sided p-value of Wilcoxon's signed-rank test.

    Exact up to 50 differences, also with ties among their sizes (SciPy enumerates permutations for that, which takes
    half a second a test). Beyond, SciPy's normal approximation with corrections for continuity and ties.

    Args:
        differences: (n,), none of them 0.

    Example:
        >>> import numpy as np
        >>> signed_rank_p(np.array([1.0, 2.0, 3.0]))
        0.25
    """
    if differences.size > _MAX_EXACT:
        test: Any = scipy.stats.wilcoxon
        return float(test(differences, method="asymptotic", correction=True).pvalue)
    # Twice the midranks are whole numbers, so the distribution of their sum is counted term by term.
    doubled = np.rint(2 * scipy.stats.rankdata(np.abs(differences))).astype(int)
    probability = np.zeros(int(doubled.sum()) + 1)
    probability[0] = 1.0
    for rank in doubled:
        shifted = np.zeros_like(probability)
        shifted[rank:] = probability[: probability.size - rank]
        probability = 0.5 * (probability + shifted)
    observed = int(doubled[differences > 0].sum())
    return float(min(1.0, 2.0 * min(probability[: observed + 1].sum(), probability[observed:].sum())))


def rank_biserial(differences: Array) -> float:
    """Matched rank-biserial correlation of differences (n,), none of them 0: from -1 (all negative) to 1.

    Example:
        >>> import numpy as np
        >>> rank_biserial(np.array([-1.0, -2.0, -3.0]))
        -1.0
    """
    signed = scipy.stats.rankdata(np.abs(differences)) * np.sign(differences)
    return float(signed.sum() / np.abs(signed).sum())


def friedman_p(values: Array) -> float:
    """p-value of Friedman's test that k treatments are alike.

    Args:
        values: (blocks, k). With one block, or no difference in any block, the result is 1.
    """
    if len(values) < 2 or np.ptp(values, axis=1).max() == 0:
        return 1.0
    return float(scipy.stats.friedmanchisquare(*values.T).pvalue)


def holm_adjusted(p: Array) -> Array:
    """Holm's step-down adjusted p-values (n,) of p-values (n,), for a family-wise error rate.

    Example:
        >>> import numpy as np
        >>> holm_adjusted(np.array([0.01, 0.04, 0.03])).tolist()
        [0.03, 0.06, 0.06]
    """
    order = np.argsort(p, kind="stable")
    adjusted = np.empty(p.size)
    highest = 0.0
    for place, k in enumerate(order):
        highest = max(highest, min(1.0, (p.size - place) * p[k]))
        adjusted[k] = highest
    return adjusted


def benjamini_hochberg_adjusted(p: Array) -> Array:
    """Benjamini and Hochberg's adjusted p-values (n,) of p-values (n,), for a false discovery rate.

    As `scipy.stats.false_discovery_control`, whose module takes half a second to load.

    Example:
        >>> import numpy as np
        >>> benjamini_hochberg_adjusted(np.array([0.01, 0.04, 0.03])).tolist()
        [0.03, 0.04, 0.04]
    """
    order = np.argsort(p)[::-1]
    adjusted = np.empty(p.size)
    adjusted[order] = np.minimum.accumulate(p[order] * p.size / np.arange(p.size, 0, -1))
    return np.minimum(adjusted, 1.0)


def mean_ranks(values: Array) -> Array:
    """Mean rank (k,) of each treatment over the blocks of values (blocks, k); the smallest value has rank 1."""
    return np.asarray(np.apply_along_axis(scipy.stats.rankdata, 1, values).mean(axis=0))


def indistinguishable_groups(names: Sequence[str], differ: Callable[[str, str], bool]) -> tuple[tuple[str, ...], ...]:
    """Largest runs of neighbours in which no pair differs: the bars of a critical-difference diagram.

    Args:
        names: Treatments in the order of their mean ranks.
        differ: Whether a test distinguishes two of them.

    Returns:
        Groups of two or more, which may overlap.

    Example:
        >>> indistinguishable_groups(["a", "b", "c"], lambda one, two: {one, two} == {"a", "c"})
        (('a', 'b'), ('b', 'c'))
    """
    groups: list[tuple[int, int]] = []
    for first in range(len(names)):
        last = first
        while last + 1 < len(names) and not any(differ(names[k], names[last + 1]) for k in range(first, last + 1)):
            last += 1
        if last > first and not any(a <= first and last <= b for a, b in groups):
            groups.append((first, last))
    return tuple(tuple(names[a : b + 1]) for a, b in groups)
