"""Triangular systems, without the checks that would take longer than the systems."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpotri

from seatruth.arrays import Array


def forward(factor: Array, right: Array) -> Array:
    """Solution of a lower triangular system."""
    return np.asarray(solve_triangular(factor, right, lower=True, check_finite=False))


def backward(factor: Array, right: Array) -> Array:
    """Solution of the system of a transposed lower triangular matrix."""
    return np.asarray(solve_triangular(factor, right, lower=True, trans=1, check_finite=False))


def inverse(factor: Array) -> Array:
    """Inverse of the matrix with this lower Cholesky factor."""
    if not len(factor):
        return np.zeros((0, 0))
    # The transposed array, in the order that the routine reads, is the upper factor.
    upper, _ = dpotri(factor.T, lower=0)
    return np.asarray(np.triu(upper) + np.triu(upper, 1).T)
