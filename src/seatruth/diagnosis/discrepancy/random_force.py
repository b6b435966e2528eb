"""What a model lacks in ways that no effect describes, as a random force in each equation.

Where something unnamed acts, named effects are asked for beside it: the accelerations that are missing are taken as
independent normal values at the knots of each trial, as large in each equation as the trials make most probable. They
become part of the noise. A named effect must then explain more than such a force would, and the intervals of its
parameters hold what the model lacks as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.discrepancy.score_test import Probes
from seatruth.diagnosis.noise import NoiseFloor

LADDER = (0.0, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Sizes of the missing acceleration, as parts of what is usual in its equation."""
_SWEEPS = 3
_WORTH = 3.0
"""Log-evidence by which a missing force must be better than none."""


@dataclass(frozen=True)
class _Part:
    """One trial: rows (n,), orthonormal directions (n, k) that missing forces move, and the factors on them (k,)."""

    rows: Indices
    directions: Array
    factors: Array


@dataclass(frozen=True)
class DiscrepantFloor(NoiseFloor):
    """A noise floor with missing forces; `sizes` by equation, as parts of what is usual there."""

    sizes: tuple[tuple[str, float], ...]
    parts: tuple[_Part, ...]

    def whiten(self, columns: Array) -> Array:
        """(M, ...) -> (M, ...): by the noise, and then by the missing forces, which tie the channels of a trial."""
        found = super().whiten(columns)
        with np.errstate(invalid="ignore", over="ignore"):
            for part in self.parts:
                own = found[part.rows]
                weights = part.factors.reshape((-1,) + (1,) * (own.ndim - 1))
                found[part.rows] = own + np.tensordot(
                    part.directions, weights * np.tensordot(part.directions.T, own, axes=1), axes=1
                )
        return found


def discrepant(probes: Probes) -> DiscrepantFloor | None:
    """The floor with the missing forces that the trials make most probable beside the fit that was probed; None where
    that is none at all.
    """
    labels = [place.label for place in probes.model.places if place.state and place.label in probes.screens]
    if not labels:
        return None
    B = np.concatenate([probes.blocks[label] * probes.scales[label] for label in labels], axis=1)
    equation = np.concatenate([np.full(probes.blocks[label].shape[1], k) for k, label in enumerate(labels)])
    sizes = _sizes(probes, B, equation, len(labels))
    if not sizes.any():
        return None
    B = B * sizes[equation]
    problem, parts = probes.problem, []
    for number in range(len(problem.trials)):
        rows = np.flatnonzero(problem.trial_of == number)
        own = B[rows]
        own = own[:, np.abs(own).max(axis=0, initial=0.0) > 0.0]
        if own.size:
            directions, values, _ = np.linalg.svd(own, full_matrices=False)
            parts.append(_Part(rows, directions, 1.0 / np.sqrt(1.0 + values**2) - 1.0))
    floor = probes.floor
    told = tuple((label, float(size)) for label, size in zip(labels, sizes))
    return DiscrepantFloor(floor.series, floor.channels, floor.of, told, tuple(parts))


def _sizes(probes: Probes, B: Array, equation: Indices, count: int) -> Array:
    """The most probable sizes (count,), found one equation after the other."""
    at, problem = probes.at, probes.problem
    A = at.linear.slopes
    H = A.T @ A + np.diag(1.0 / problem.sd[at.active] ** 2)
    cross = A.T @ B
    solved = cho_solve(cho_factor(H), cross)
    information = B.T @ B - cross.T @ solved
    pull = A.T @ at.linear.errors + (at.x[at.active] - problem.mean[at.active]) / problem.sd[at.active] ** 2
    slope = -(B.T @ at.linear.errors - solved.T @ pull)

    def evidence(sizes: Sequence[float]) -> float:
        root = np.asarray(sizes)[equation]
        S = np.eye(len(root)) + information * np.outer(root, root)
        b = slope * root
        factor = cho_factor(S)
        return float(0.5 * b @ cho_solve(factor, b) - np.log(np.diag(factor[0])).sum())

    sizes = [0.0] * count
    for _ in range(_SWEEPS):
        before = list(sizes)
        for k in range(count):
            gains = [evidence([*sizes[:k], size, *sizes[k + 1 :]]) for size in LADDER]
            best = int(np.argmax(gains))
            sizes[k] = LADDER[best] if gains[best] > gains[0] + _WORTH else 0.0
        if sizes == before:
            break
    return np.array(sizes)
