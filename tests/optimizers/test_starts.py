"""The starts of a multi-start: the study's own first, then points that cover the region of starts."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.optimizers import Budget, minimise, starting_points
from seatruth.testing.problems import half_diverges, rosenbrock


def test_the_first_is_the_studys_own_and_fewer_are_the_first_of_more() -> None:
    cost = rosenbrock().cost
    few, many = starting_points(cost, 5, seed=1), starting_points(cost, 20, seed=1)
    assert np.array_equal(few, many[:5])
    assert np.array_equal(few[0], cost.start)
    assert np.array_equal(starting_points(cost, 1), cost.start[None])
    assert not np.array_equal(few[1:], starting_points(cost, 5, seed=2)[1:])


def test_they_cover_the_bounds() -> None:
    cost = rosenbrock().cost
    low, high = cost.bounds
    share = (starting_points(cost, 33, seed=1)[1:] - low) / (high - low)
    assert ((share >= 0) & (share <= 1)).all()
    # 32 Sobol points have 8 in each quarter of each coordinate.
    counts = [np.histogram(column, bins=4, range=(0, 1))[0].tolist() for column in share.T]
    assert counts == [[8, 8, 8, 8]] * share.shape[1]


def test_a_start_that_cannot_be_evaluated_is_drawn_again() -> None:
    cost = half_diverges().cost
    assert np.isfinite(cost.values(starting_points(cost, 30, seed=1))).all()


def test_a_search_begins_where_it_is_told() -> None:
    cost = rosenbrock().cost
    start = starting_points(cost, 2, seed=3)[1]
    outcome = minimise(cost, "least_squares", budget=Budget(evaluations=1), start=start)
    assert outcome.x == pytest.approx(start, rel=1e-12)
    with pytest.raises(BadInput, match="finite numbers"):
        minimise(cost, "least_squares", start=start[:-1])
