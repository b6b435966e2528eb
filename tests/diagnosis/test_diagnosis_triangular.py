"""Triangular systems against those of numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seatruth.diagnosis.triangular import backward, forward, inverse


@given(size=st.integers(1, 12), seed=st.integers(0, 1000))
def test_they_solve_their_systems(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    square = rng.normal(size=(size, size))
    whole = square @ square.T + np.eye(size)
    factor, right = np.asarray(np.linalg.cholesky(whole), dtype=np.float64), rng.normal(size=(size, 3))
    np.testing.assert_allclose(factor @ forward(factor, right), right, atol=1e-8)
    np.testing.assert_allclose(factor.T @ backward(factor, right), right, atol=1e-8)
    found = inverse(factor)
    np.testing.assert_allclose(found @ whole, np.eye(size), atol=1e-6)
    np.testing.assert_array_equal(found, found.T)


@pytest.mark.parametrize("order", ["C", "F"])
def test_memory_may_lie_in_rows_or_columns(order: str) -> None:
    factor = np.asarray([[2.0, 0.0], [1.0, 3.0]], order=order)
    np.testing.assert_allclose(inverse(factor), np.linalg.inv(factor @ factor.T))


def test_nothing_has_an_inverse_of_no_size() -> None:
    assert inverse(np.zeros((0, 0))).shape == (0, 0)
