"""What is known of all unknowns of a hypothesis after the trials, to first order about a point."""

from __future__ import annotations

from dataclasses import dataclass

from seatruth.arrays import Array, Indices


@dataclass(frozen=True)
class SharedStep:
    """The most probable step of the shared unknowns from a point, and what is known of them after the trials."""

    shared: Array
    """Step of the shared unknowns (S,)."""
    free: Indices
    """The shared unknowns (k,) that the hypothesis frees."""
    covariance: Array
    """Their posterior covariance (k, k)."""


@dataclass(frozen=True)
class Solution(SharedStep):
    """The most probable step from a point of all unknowns."""

    local: Array
    """Step of each trial's own unknowns (T, L)."""


@dataclass(frozen=True)
class Posterior:
    """What is known of all unknowns after the trials, in deviations of their priors: k shared ones, L of each trial."""

    shared: Array
    """Mean of the shared ones (k,)."""
    local: Array
    """Mean of each trial's own (T, L)."""
    shared_covariance: Array
    """(k, k)."""
    local_covariance: Array
    """Of each trial's own beside known shared ones (T, L, L)."""
    lean: Array
    """By how much each trial's own fall where the shared ones rise (T, L, k)."""
    place: Array
    """Mean of [1, distance of every column's unknown from the point] (T, m)."""
    at: Indices
    """The columns (k,) of the shared ones."""
    root: Array
    """A square root (k, k) of their prior covariance."""
    factor: Array
    """The Cholesky factor (k, k) of the inverse of `shared_covariance`."""
    factors: Array
    """Those of the inverses of `local_covariance` (T, L, L)."""
    halves: Array
    """The factors' inverses times the Gram matrix of each trial's own columns with [errors, shared] (T, L, 1 + S')."""
