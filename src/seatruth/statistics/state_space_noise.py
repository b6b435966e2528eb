"""Measurement noise as white noise plus a bounded slow error, and exact whitening by it.

A position sensor's error has a white part and a slow part that returns to zero (multipath, filters): an
Ornstein-Uhlenbeck process of standard deviation `ratio` times the white one and correlation time `tau`,

    cov(e_i, e_j) = sd^2 (delta_ij + ratio^2 exp(-|t_i - t_j| / tau)).

Sampled, that is an ARMA(1,1) process, which no short autoregressive model describes. The Kalman filter of its state
whitens it exactly from the first sample on, in a number of operations linear in the samples, at any sampling times
(Anderson and Moore, Optimal Filtering, 1979, chapters 6 and 9).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from seatruth.arrays import Array


@dataclass(frozen=True)
class NoiseShape:
    """Noise up to its size: `ratio` is the slow part's standard deviation over the white one's, `tau` (s) its time.

    Example:
        >>> NoiseShape(1.0, 10.0).correlation(0.0)
        2.0
    """

    ratio: float = 0.0
    tau: float = 1.0

    def correlation(self, lag: float) -> float:
        """Covariance at a lag (s) over the white variance; at lag 0 the white part is included."""
        slow = float(self.ratio**2 * np.exp(-abs(lag) / self.tau))
        return 1.0 + slow if lag == 0.0 else slow


def whiten(columns: Array, t: Array, shape: NoiseShape, begins: tuple[int, ...] = ()) -> tuple[Array, float]:
    """Whitens one series, or some one after the other, by noise whose white part has standard deviation 1.

    Args:
        columns: (n,) or (n, k): values at the times, one column a quantity. In Fortran's order it is fastest.
        t: (n,) times in s, increasing within a series.
        shape: what the noise is like.
        begins: rows at which a further series begins, whose slow error has nothing to do with that before it.

    Returns:
        The whitened columns, of the shape given, and the logarithm of the determinant of the noise's covariance.

    Example:
        >>> values, log_determinant = whiten(np.ones(3), np.arange(3.0), NoiseShape())
        >>> values.tolist(), log_determinant
        ([1.0, 1.0, 1.0], 0.0)
    """
    if shape.ratio == 0.0 or not len(t):
        return columns.copy(), 0.0
    variance, gain, fade = _filter(np.ascontiguousarray(t, dtype=np.float64).tobytes(), shape, begins)
    series = np.ascontiguousarray(columns[None] if columns.ndim == 1 else columns.T)
    found = _predictions(series, gain, fade)
    np.subtract(series, found, out=found)
    found *= 1.0 / np.sqrt(variance)
    return (found[0] if columns.ndim == 1 else found.T), float(np.log(variance).sum())


def joined(series: Sequence[tuple[Array, Array]]) -> tuple[Array, Array, tuple[int, ...]]:
    """Series of values and times, one after the other: values, times, and rows at which a further one begins.

    Example:
        >>> values, t, begins = joined([(np.ones(2), np.arange(2.0)), (np.ones(3), np.arange(3.0))])
        >>> t.tolist(), begins
        ([0.0, 1.0, 0.0, 1.0, 2.0], (2,))
    """
    if not series:
        return np.zeros(0), np.zeros(0), ()
    ends = np.cumsum([len(t) for _, t in series])
    return np.concatenate([one for one, _ in series]), np.concatenate([t for _, t in series]), tuple(ends[:-1].tolist())


@lru_cache(maxsize=4096)
def _filter(times: bytes, shape: NoiseShape, begins: tuple[int, ...]) -> tuple[Array, Array, Array]:
    """Variance of each sample given those before it (n,), gain (n,), and decay to the next sample (n,)."""
    t = np.frombuffer(times)
    n = len(t)
    fade = np.exp(-np.maximum(np.diff(t), 0.0) / shape.tau)
    fade[[row - 1 for row in begins]] = 0.0
    power = shape.ratio**2
    variance, gain = np.empty(n), np.empty(n)
    state = power
    for k in range(n):
        variance[k] = state + 1.0
        gain[k] = state / variance[k]
        if k < n - 1:
            state = fade[k] ** 2 * state / variance[k] + power * (1.0 - fade[k] ** 2)
    return variance, gain, np.append(fade, 0.0)


def _predictions(series: Array, gain: Array, fade: Array) -> Array:
    """What each sample's past predicts of it: (k, n), as `series`.

    x_{j+1} = fade_j (1 - gain_j) x_j + fade_j gain_j y_j from x_0 = 0: a triangular system with one band.
    """
    bands = np.ones((2, len(gain)))
    bands[1, :-1] = fade[:-1] * (gain[:-1] - 1.0)
    right = np.zeros(series.shape)
    np.multiply((fade * gain)[:-1], series[:, :-1], out=right[:, 1:])
    # In LAPACK's order of columns the transposed one is solved in place.
    found, _ = scipy.linalg.lapack.dtbtrs(bands, right.T, uplo="L", diag="U", overwrite_b=1)
    return np.asarray(found).T
