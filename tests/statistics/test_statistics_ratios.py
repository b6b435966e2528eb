"""Fieller's interval of a ratio."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatruth.statistics.ratios import ratio_interval


def test_at_its_ends_the_t_test_just_rejects() -> None:
    above, below = np.array([1.0, 1.4, 0.7, 1.1]), np.array([2.0, 2.2, 1.9, 2.4])
    for end in ratio_interval(above, below):
        left = above - end * below
        t = left.mean() / (left.std(ddof=1) / 2.0)
        assert abs(t) == pytest.approx(3.1824463)  # Student's t at 0.975 with 3 degrees of freedom


def test_pairs_without_spread_give_the_ratio() -> None:
    assert ratio_interval(np.full(3, 1.0), np.full(3, 4.0)) == (pytest.approx(0.25), pytest.approx(0.25))


@pytest.mark.parametrize(
    ("above", "below"),
    [([1.0, 1.0], [-1.0, 1.1]), ([1.0], [2.0]), ([1.0, math.inf, 1.0], [1.0, 1.0, 1.0])],
)
def test_what_does_not_bound_a_ratio_gives_the_whole_line(above: list[float], below: list[float]) -> None:
    assert ratio_interval(np.array(above), np.array(below)) == (-math.inf, math.inf)


def test_it_covers_as_often_as_it_says() -> None:
    """Six correlated pairs, a denominator of three standard deviations of its mean: binomial error 0.5 %."""
    rng = np.random.default_rng(5)
    runs, hits = 2000, 0
    for _ in range(runs):
        shared = rng.normal(size=6)
        below = 3.0 / math.sqrt(6.0) + 0.8 * shared + 0.6 * rng.normal(size=6)
        above = 0.7 * 3.0 / math.sqrt(6.0) + 0.5 * shared + 0.3 * rng.normal(size=6)
        low, high = ratio_interval(above, below)
        hits += low <= 0.7 <= high
    # Samples that leave the whole line cover always, so that it can only cover more often.
    assert 0.94 < hits / runs < 0.99
