"""Costs whose errors are linear in the parameters: their sums of squares in one product, and their regressions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.base import Block
from seatruth.costs.noise import Noise
from seatruth.costs.parameter_space import ParameterSpace

Function = Callable[[Array], Array]
SAME = 1e-9
"""Relative change of an exact derivative below which it counts as constant (chosen here [S]: far above rounding)."""
SAME_BY_DIFFERENCES = 1e-6
"""The same for a derivative by central differences, whose own error is about 1e-8 (chosen here [S])."""
_MAX_ITERATIONS = 20
"""Iterations of the weights of the equations; they converge in a few (chosen here [S])."""


@dataclass(frozen=True)
class Linear:
    """Weighted errors e = b + A x of several equations, each by its triangle R: |e|^2 = |R (x, 1)|^2.

    `triangles` (D, K + 1, K + 1).
    """

    triangles: Array

    @staticmethod
    def of(errors: Function, derivatives: Function, space: ParameterSpace, same: float = SAME) -> Linear | None:
        """From weighted errors (N, D) and their derivatives (N, D, K); None where they are not linear in x."""
        start = space.start
        A = derivatives(start)
        if not np.isfinite(A).all() or any(_changed(A, derivatives(x), same).any() for x in _elsewhere(space)):
            return None
        b = errors(start) - A @ start
        if not np.isfinite(b).all():
            return None
        K = len(start)
        triangles = np.zeros((A.shape[1], K + 1, K + 1))
        for equation in range(A.shape[1]):
            found = np.linalg.qr(np.column_stack([A[:, equation], b[:, equation]]), mode="r")
            triangles[equation, : len(found)] = found
        return Linear(triangles)

    @staticmethod
    def culprits(derivatives: Function, space: ParameterSpace, same: float = SAME) -> list[str]:
        """Free parameters to fix so that the others enter linearly: few, chosen greedily."""
        A = derivatives(space.start)
        K = len(space.free)
        nonlinear = np.zeros((K, K), dtype=np.bool_)  # changing j changes the derivative by k
        for j in range(K):
            for x in _elsewhere(space):
                moved = space.start
                moved[j] = x[j]
                nonlinear[j] |= _changed(A, derivatives(moved), same)
        nonlinear |= nonlinear.T
        chosen: list[int] = np.flatnonzero(np.diag(nonlinear)).tolist()
        nonlinear[chosen], nonlinear[:, chosen] = False, False
        while nonlinear.any():
            chosen.append(int(nonlinear.sum(axis=0).argmax()))
            nonlinear[chosen], nonlinear[:, chosen] = False, False
        return [space.free_names[k] for k in sorted(chosen)]

    def squares(self, X: Array) -> Array:
        """Sums of squares (P, D) of candidates (P, K)."""
        ends = np.concatenate([X, np.ones((len(X), 1))], axis=1)
        found = np.empty((len(X), len(self.triangles)))
        for equation, triangle in enumerate(self.triangles):
            part = ends @ triangle.T
            found[:, equation] = np.einsum("pk,pk->p", part, part)
        return found


def blocks_of(
    names: Sequence[str], errors: Function, derivatives: Function, space: ParameterSpace, noise: Noise
) -> tuple[Block, ...]:
    """One regression per equation, from weighted errors and derivatives that are linear in x.

    The noise of each equation and the least-squares solution of all of them are iterated in turn. A constant regressor
    becomes the intercept.
    """
    start = space.start
    A, b = -derivatives(start), errors(start)
    target = b + A @ start
    weights = noise.weights
    used = [np.flatnonzero(weights[:, k]) for k in range(len(names))]
    scale = np.ones(len(names))
    for _ in range(_MAX_ITERATIONS):
        rows = np.concatenate([A[rows, k] / scale[k] for k, rows in enumerate(used)])
        right = np.concatenate([target[rows, k] / scale[k] for k, rows in enumerate(used)])
        size = np.linalg.norm(rows, axis=0)
        size[size == 0] = 1.0
        x = np.linalg.lstsq(rows / size, right, rcond=None)[0] / size
        rest = [target[rows, k] - A[rows, k] @ x for k, rows in enumerate(used)]
        # The floor of the noise is one in these units: errors are weighted with 1 / floor.
        found = np.sqrt([1.0 + np.mean(part**2) for part in rest])
        if np.abs(found - scale).max() <= 1e-6 * scale.max():
            break
        scale = found
    blocks = []
    for k, (name, rows) in enumerate(zip(names, used)):
        own = weights[rows, k]
        regressors = A[rows, k] / own[:, None]
        columns = np.flatnonzero((regressors != 0).any(axis=0))
        blocks.append(_block(name, target[rows, k] / own, regressors[:, columns], columns, own / scale[k]))
    return tuple(blocks)


def _block(name: str, target: Array, regressors: Array, columns: NDArray[np.intp], weights: Array) -> Block:
    """A block in which a constant regressor is the intercept, scaled so that its coefficient is one."""
    constant = np.flatnonzero(np.ptp(regressors, axis=0) <= 1e-12 * np.abs(regressors).max(axis=0, initial=0.0))
    if constant.size != 1:
        return Block(name, target, regressors, columns, weights)
    one = int(constant[0])
    unit = float(regressors[0, one])
    others = np.arange(len(columns)) != one
    return Block(
        name,
        target / unit,
        regressors[:, others] / unit,
        columns[others],
        weights * abs(unit),
        intercept=True,
        intercept_index=int(columns[one]),
    )


def _changed(A: Array, B: Array, limit: float) -> NDArray[np.bool_]:
    """Which columns (K,) of derivatives (N, D, K) differ, each against its own size."""
    size = np.maximum(np.abs(A).max(axis=0, initial=0.0), np.abs(B).max(axis=0, initial=0.0))
    with np.errstate(invalid="ignore"):
        return np.asarray(~(np.abs(A - B) <= limit * size).all(axis=(0, 1)))


def _elsewhere(space: ParameterSpace) -> list[Array]:
    """Two other candidates, all parameters moved, inside the bounds."""
    start = space.start
    found = []
    for seed in (1, 2):
        parts = np.random.default_rng(seed).uniform(0.1, 0.5, len(start))
        moved = start + parts * np.where(start != 0, np.abs(start), 1.0)
        for k, parameter in enumerate(space.free):
            if np.isfinite(parameter.min) and np.isfinite(parameter.max):
                moved[k] = parameter.min + (0.2 + parts[k]) * (parameter.max - parameter.min)
            moved[k] = min(max(moved[k], parameter.min), parameter.max)
        found.append(moved)
    return found
