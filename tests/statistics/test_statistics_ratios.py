"""Interval of the ratio of two sums over pairs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import t

from seatruth.statistics.ratios import ratio_interval


def test_equal_denominators_give_the_t_interval_of_a_mean() -> None:
    above = np.array([1.0, 1.4, 0.7, 1.1])
    low, high = ratio_interval(above, np.full(4, 2.0))
    reach = t.ppf(0.975, 3) * above.std(ddof=1) / 2.0
    assert (low, high) == (pytest.approx((above.mean() - reach) / 2.0), pytest.approx((above.mean() + reach) / 2.0))


def test_pairs_of_one_ratio_give_it_though_their_sizes_differ() -> None:
    below = np.array([38.0, 42.0, 4.7, 21.5])
    assert ratio_interval(0.25 * below, below) == (pytest.approx(0.25), pytest.approx(0.25))


def test_trials_whose_gaps_differ_bound_what_all_of_them_show() -> None:
    """A boat's gap shrank to a tenth in each of four trials, whose gaps are 38, 42, 5 and 22 times the noise."""
    refit, left = np.array([39.1, 42.9, 5.7, 22.5]), np.array([2.8, 2.7, 1.4, 2.7])
    low, high = ratio_interval(refit - left, refit - 1.0)
    assert 0.85 < low < 0.946 < high < 1.0


@pytest.mark.parametrize(
    ("above", "below"),
    [
        ([1.0, 1.0], [-1.1, 1.0]),
        ([1.0], [2.0]),
        ([1.0, math.inf, 1.0], [1.0, 1.0, 1.0]),
        ([1.0, 0.0], [2.0, -0.1]),
        ([1.0, 0.0], [2.0, 0.0]),
    ],
)
def test_what_does_not_bound_a_ratio_gives_the_whole_line(above: list[float], below: list[float]) -> None:
    assert ratio_interval(np.array(above), np.array(below)) == (-math.inf, math.inf)


@pytest.mark.parametrize("count", [2, 4, 8])
@pytest.mark.parametrize(
    ("sizes", "errors", "ratio"), [(0.3, 0.1, 0.7), (0.8, 0.4, 0.7), (1.2, 0.3, 0.7), (0.8, 0.4, 0.0)]
)
def test_it_covers_as_often_as_it_says(count: int, sizes: float, errors: float, ratio: float) -> None:
    """Pairs of log-normal sizes and errors: binomial error 0.9 %. In many pairs the skew of the errors costs 2 %."""
    rng = np.random.default_rng(5)
    runs, hits = 600, 0
    for _ in range(runs):
        below = np.exp(sizes * rng.normal(size=count))
        left = (1.0 - ratio) * below * np.exp(errors * rng.normal(size=count) - 0.5 * errors**2)
        low, high = ratio_interval(below - left, below)
        hits += low <= ratio <= high
    assert 0.9 < hits / runs < 0.995
