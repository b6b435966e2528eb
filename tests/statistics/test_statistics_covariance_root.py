"""Roots of covariances whose unknowns have units of very different size."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.statistics.covariance_root import covariance_root


def test_the_root_gives_the_covariance_back_whatever_the_units() -> None:
    correlated = np.array([[1.0, 0.9, -0.3], [0.9, 1.0, 0.1], [-0.3, 0.1, 1.0]])
    units = np.array([2e8, 1e-4, 30.0])
    covariance = correlated * np.outer(units, units)
    root = covariance_root(covariance)
    assert (root @ root.T / np.outer(units, units)) == pytest.approx(correlated, abs=1e-12)


def test_what_is_known_has_no_part_and_what_is_flat_gets_the_least() -> None:
    one = np.array([[4.0, 0.0, 2.0], [0.0, 0.0, 0.0], [2.0, 0.0, 1.0]])
    root = covariance_root(one)
    assert root @ root.T == pytest.approx(one, abs=1e-7)
    assert not root[1].any()
    spread = covariance_root(one, 1e-2)
    assert np.linalg.eigvalsh(spread[::2] @ spread[::2].T).min() > 1e-3
