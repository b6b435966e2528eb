"""What no data of this kind can fix: parameters whose scales cancel, and those of which only a sum counts.

A direction is found from derivatives at several points at once. Of exponents w, those for which J(x) diag(x) w = 0 at
every point are multiplicative (x_k -> x_k f^w_k changes nothing), of steps n, those for which J(x) n = 0 at every point
are additive. Each is then tried with a large step on the predictions themselves before it is named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.study_cost import StudyCost
from seatruth.uncertainty.identifiability import scale_of

_POINTS = 3
_SPREAD = 0.2
_NULL = 1e-9
"""Singular value over the largest from which a direction does nothing; rounding leaves 1e-12 at most."""
_SIMPLE = 12
"""Exponents are multiples of 1 / this: powers that stand in formulas."""
_FACTOR = 1.5


def degeneracies(cost: StudyCost, x: Array) -> list[dict[str, Any]]:
    """Directions along which the predictions do not change at all: combination, ratio (inf), sentence, kind, step.

    `kind` is "scale" (combination: exponents) or "sum" (combination: steps), `step` (K,) the direction at `x`. Empty
    where the derivatives at `x` have full rank, which is all that it costs then.
    """
    own = [k for k, name in enumerate(cost.names) if name not in cost.nuisances]
    rows = np.concatenate([group.rows for group in cost.residual_blocks if group.kind == "data"])
    if not own or not len(rows) or not _null(_slopes(cost, x, rows, own)).size:
        return []
    points = _points(cost, x, own)
    slopes = [_slopes(cost, point, rows, own) for point in points]
    usable = [k for k, J in enumerate(slopes) if np.isfinite(J).all()]
    if len(usable) < 2:
        return []
    scales = np.vstack([slopes[k] * points[k][own] for k in usable])
    sums = np.vstack([slopes[k] for k in usable])
    names = [cost.names[k] for k in own]
    reference = cost.predict(points[usable[0]])
    found = []
    for kind, stacked in (("scale", scales), ("sum", sums)):
        for vector in _simple(_null(stacked)):
            used = np.flatnonzero(vector)
            if len(used) < 2:
                continue
            moved = points[usable[0]].copy()
            step = np.zeros(len(x))
            if kind == "scale":
                moved[own] *= _FACTOR**vector
                step[own] = x[own] * vector
            else:
                moved[own] += vector * np.abs(moved[own][used]).max()
                step[own] = vector
            if not _same(reference, cost.predict(moved)):
                continue
            combination = {names[k]: float(vector[k]) for k in used}
            sentence = _scale_words(combination) if kind == "scale" else _sum_words(combination)
            found.append(
                {"combination": combination, "ratio": math.inf, "sentence": sentence, "kind": kind, "step": step}
            )
    return found


def _slopes(cost: StudyCost, x: Array, rows: NDArray[np.intp], own: Sequence[int]) -> Array:
    return np.asarray(cost.jacobian(x)[rows][:, list(own)])


def _points(cost: StudyCost, x: Array, own: Sequence[int]) -> list[Array]:
    """Points around x, inside the bounds, at which no parameter is zero."""
    rng = np.random.default_rng(0)
    low, high = cost.bounds
    scale = np.array([scale_of(parameter) for parameter in cost.parameters])
    towards = np.where(x - low <= high - x, 1.0, -1.0)
    base = np.where(np.abs(x) < 1e-3 * scale, x + 0.1 * scale * towards, x)
    found = []
    for _ in range(_POINTS):
        point = x.copy()
        near = base * (1.0 + _SPREAD * rng.uniform(-1.0, 1.0, len(x)))
        point[list(own)] = np.clip(near, low, high)[list(own)]
        found.append(point)
    return found


def _null(A: Array) -> Array:
    """Basis (d, K) of the directions that A (M, K) does not see; columns that are zero are another matter."""
    size = np.linalg.norm(A, axis=0)
    seen = np.flatnonzero(size > 0)
    if not np.isfinite(A).all() or not len(seen):
        return np.zeros((0, A.shape[1]))
    # Of the triangle alone: all right singular vectors are wanted, and none of the left ones (samples squared).
    triangle = np.linalg.qr(A[:, seen] / size[seen], mode="r")
    _, values, vectors = np.linalg.svd(triangle, full_matrices=True)
    values = np.concatenate([values, np.zeros(len(seen) - len(values))])
    basis = vectors[values < _NULL * values.max()]
    found = np.zeros((len(basis), A.shape[1]))
    found[:, seen] = basis / size[seen]
    return found


def _simple(basis: Array) -> list[Array]:
    """The same space spanned by directions with as few and as simple numbers as elimination gives."""
    rows = basis / np.abs(basis).max(axis=1, keepdims=True) if len(basis) else basis
    rows = rows.copy()
    done: list[int] = []
    for k in range(len(rows)):
        pivot = int(np.abs(rows[k]).argmax())
        rows[k] /= rows[k, pivot]
        for other in range(len(rows)):
            if other != k:
                rows[other] -= rows[other, pivot] * rows[k]
        done.append(pivot)
    found = []
    for row in rows:
        row = row / np.abs(row).max()
        tidy = np.round(_SIMPLE * row) / _SIMPLE
        if np.abs(tidy - row).max() < 1e-5:
            found.append(tidy * (1.0 if tidy[np.flatnonzero(tidy)[0]] > 0 else -1.0))
    return found


def _same(one: Sequence[Array], other: Sequence[Array]) -> bool:
    for a, b in zip(one, other):
        size = float(np.nanmax(np.abs(a), initial=0.0))
        if not np.allclose(a, b, rtol=1e-6, atol=1e-7 * size, equal_nan=True):
            return False
    return True


def _scale_words(powers: dict[str, float]) -> str:
    if len(set(powers.values())) == 1:
        return (
            f"Scales cancel: {_listed(list(powers))} can be multiplied by one factor and nothing changes. No data "
            "of this kind tell that factor: fix one of them."
        )
    up = [_power(name, power) for name, power in powers.items() if power > 0]
    down = [_power(name, -power) for name, power in powers.items() if power < 0]
    return (
        f"Scales cancel: {_listed(up)} can be multiplied by a factor and {_listed(down)} divided by it, and nothing "
        "changes. No data of this kind tell that factor: fix one of them."
    )


def _sum_words(steps: dict[str, float]) -> str:
    up = [_times(name, size) for name, size in steps.items() if size > 0]
    down = [_times(name, -size) for name, size in steps.items() if size < 0]
    if not down:
        return f"{_listed(up)} can grow together and nothing changes: fix one of them."
    return (
        f"Only a sum counts: {_listed(up)} can grow while {_listed(down)} shrink{'s' if len(down) == 1 else ''} as "
        "much, and nothing changes. No data of this kind tell them apart: fix one of them."
    )


def _power(name: str, power: float) -> str:
    return name if power == 1.0 else f"{name} (to the power {1 / power:.3g})"


def _times(name: str, size: float) -> str:
    return name if size == 1.0 else f"{name} ({size:.3g} times)"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
