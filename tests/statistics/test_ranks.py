"""Rank tests against SciPy, and against numbers that are known without the code."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import PermutationMethod, false_discovery_control, wilcoxon

from seatruth.statistics.ranks import (
    benjamini_hochberg_adjusted,
    friedman_p,
    holm_adjusted,
    indistinguishable_groups,
    mean_ranks,
    rank_biserial,
    signed_rank_p,
)


@pytest.mark.parametrize("seed", range(4))
def test_signed_ranks_are_exact_with_ties(seed: int) -> None:
    rng = np.random.default_rng(seed)
    differences = rng.integers(-4, 6, 9).astype(float)
    differences = differences[differences != 0]
    wanted = wilcoxon(differences, method=PermutationMethod(n_resamples=np.inf)).pvalue
    assert signed_rank_p(differences) == pytest.approx(wanted, rel=1e-9)
    plain = rng.standard_normal(12)
    assert signed_rank_p(plain) == pytest.approx(wilcoxon(plain, method="exact").pvalue, rel=1e-9)
    many = rng.standard_normal(80) + 0.3
    assert signed_rank_p(many) == pytest.approx(wilcoxon(many, method="exact").pvalue, abs=0.01)


def test_effect_size_is_the_simple_difference_of_rank_sums() -> None:
    """Kerby's formula: favourable less unfavourable rank sum, over their total."""
    assert rank_biserial(np.array([1.0, -2.0, 3.0, 4.0])) == pytest.approx((1 + 3 + 4 - 2) / 10)
    assert rank_biserial(np.array([2.0, 2.0, -2.0])) == pytest.approx(1 / 3)


def test_friedman_needs_blocks_and_differences() -> None:
    assert friedman_p(np.ones((5, 3))) == 1.0
    assert friedman_p(np.array([[1.0, 2.0, 3.0]])) == 1.0
    # Ten blocks in the same order: chi-square = 20 with 2 degrees of freedom, p = exp(-10).
    assert friedman_p(np.tile([1.0, 2.0, 3.0], (10, 1))) == pytest.approx(np.exp(-10.0))


def test_holm_steps_down_and_stays_in_order() -> None:
    assert holm_adjusted(np.array([0.04, 0.01, 0.03, 0.005])).tolist() == pytest.approx([0.06, 0.03, 0.06, 0.02])
    assert holm_adjusted(np.array([0.9, 0.8])).tolist() == [1.0, 1.0]
    assert holm_adjusted(np.zeros(0)).tolist() == []


@pytest.mark.parametrize("count", [0, 1, 2, 40])
def test_benjamini_hochberg_agrees_with_scipy(count: int) -> None:
    p = np.random.default_rng(count).uniform(size=count) ** 2
    p[::3] = p[0] if count else 0.0  # ties
    wanted = false_discovery_control(p) if count else p
    assert benjamini_hochberg_adjusted(p) == pytest.approx(wanted, rel=1e-14)
    assert benjamini_hochberg_adjusted(np.array([0.9, 0.8])).tolist() == [0.9, 0.9]


def test_mean_ranks_share_ties() -> None:
    assert mean_ranks(np.array([[0.1, 0.2, 0.2], [3.0, 1.0, 2.0]])).tolist() == [2.0, 1.75, 2.25]


def test_groups_are_the_largest_runs_of_neighbours() -> None:
    different = {frozenset("ac"), frozenset("ad"), frozenset("bd")}

    def groups(names: str) -> tuple[tuple[str, ...], ...]:
        return indistinguishable_groups(list(names), lambda one, two: frozenset((one, two)) in different)

    assert groups("abcd") == (("a", "b"), ("b", "c"), ("c", "d"))
    assert groups("ab") == (("a", "b"),)
    assert groups("ad") == ()
    assert indistinguishable_groups(list("abc"), lambda one, two: False) == (("a", "b", "c"),)
