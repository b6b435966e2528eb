"""Square root of a covariance of unknowns whose units differ by orders of magnitude."""

from __future__ import annotations

import numpy as np

from seatruth.arrays import Array


def covariance_root(covariance: Array, flattest: float = 0.0) -> Array:
    """A root (n, n): its product with its own transpose is the covariance (n, n).

    It is that of the correlation, each row in its own deviation: an eigenvalue is known to 1e-16 of the largest, and
    beside a coefficient of 1e8 N m the variance of a rudder's gain would be rounding. Eigenvalues of the correlation
    below `flattest` are raised to it. Unknowns without variance have rows of zeros.

    Example:
        >>> import numpy as np
        >>> root = covariance_root(np.diag([1e16, 0.0, 1e-6]))
        >>> np.diag(root @ root.T).tolist()
        [1e+16, 0.0, 1e-06]
    """
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where(sd > 0.0, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    return np.asarray(sd[:, None] * vectors * np.sqrt(np.maximum(values, flattest)))
