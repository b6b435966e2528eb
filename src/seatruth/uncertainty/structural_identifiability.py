"""Structural identifiability: directions in which no data of this kind can determine the parameters.

Either scales cancel (a product or a ratio alone counts), or only a sum counts. A direction must do nothing at several
points at once. Exponents w with J(x) diag(x) w = 0 at every point are multiplicative (x_k -> x_k f^w_k changes
nothing); steps n with J(x) n = 0 at every point are additive. Each is then tried with a large step on the predictions
themselves before it is reported.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.study_cost import StudyCost
from seatruth.models.parameter import Parameter
from seatruth.text import listed
from seatruth.uncertainty.identifiability import plausible_range

# Without a source these are chosen here [S].
_POINTS = 3
"""Points at which a direction must do nothing; one could be a coincidence, two must remain if one diverges."""
_SPREAD = 0.2
"""Relative distance of these points from the estimate."""
_NULL = 1e-9
"""Singular value over the largest below which a direction does nothing; rounding leaves 1e-12 at most."""
_DENOMINATOR = 12
"""Exponents and steps are multiples of 1/12: the powers and factors that stand in formulas."""
_ROUNDING = 1e-5
"""Largest distance of an exponent from such a multiple."""
_FACTOR = 1.5
"""Factor of the large step with which a direction is tried."""


def unidentifiable_directions(cost: StudyCost, x: Array) -> list[dict[str, Any]]:
    """Directions along which the predictions do not change at all.

    Where the derivatives at `x` have full rank, the list is empty and nothing else is computed.

    Args:
        cost: The cost of a study.
        x: (K,), the estimate.

    Returns:
        A list with `combination` (parameter -> exponent or step), `ratio` (inf), `sentence`, `kind` ("scale" or "sum")
        and `step` (K,), the direction at `x`.
    """
    parameters = [k for k, name in enumerate(cost.names) if name not in cost.nuisances]
    rows = np.concatenate([group.rows for group in cost.residual_blocks if group.kind == "data"])
    if not parameters or not len(rows) or not _null_space(_derivatives(cost, x, rows, parameters)).size:
        return []
    points = _nearby_points(cost, x, parameters)
    derivatives = [_derivatives(cost, point, rows, parameters) for point in points]
    usable = [k for k, J in enumerate(derivatives) if np.isfinite(J).all()]
    if len(usable) < 2:
        return []
    multiplicative = np.vstack([derivatives[k] * points[k][parameters] for k in usable])
    additive = np.vstack([derivatives[k] for k in usable])
    names = [cost.names[k] for k in parameters]
    base = points[usable[0]]
    reference = cost.predict(base)
    directions = []
    for kind, stacked in (("scale", multiplicative), ("sum", additive)):
        for vector in _simple_basis(_null_space(stacked)):
            members = np.flatnonzero(vector)
            if len(members) < 2:
                continue
            moved = base.copy()
            step = np.zeros(len(x))
            if kind == "scale":
                moved[parameters] *= _FACTOR**vector
                step[parameters] = x[parameters] * vector
            else:
                moved[parameters] += vector * np.abs(moved[parameters][members]).max()
                step[parameters] = vector
            if not _equal(reference, cost.predict(moved)):
                continue
            combination = {names[k]: float(vector[k]) for k in members}
            held = held_by_priors(combination, cost.parameters)
            sentence = _scale_sentence(combination, held) if kind == "scale" else _sum_sentence(combination, held)
            directions.append(
                {"combination": combination, "ratio": math.inf, "sentence": sentence, "kind": kind, "step": step}
            )
    return directions


def _derivatives(cost: StudyCost, x: Array, rows: NDArray[np.intp], parameters: Sequence[int]) -> Array:
    return np.asarray(cost.jacobian(x)[rows][:, list(parameters)])


def _nearby_points(cost: StudyCost, x: Array, parameters: Sequence[int]) -> list[Array]:
    """Points around x, inside the bounds, at which no parameter is zero."""
    rng = np.random.default_rng(0)
    low, high = cost.bounds
    scale = np.array([plausible_range(parameter) for parameter in cost.parameters])
    inward = np.where(x - low <= high - x, 1.0, -1.0)
    base = np.where(np.abs(x) < 1e-3 * scale, x + 0.1 * scale * inward, x)
    points = []
    for _ in range(_POINTS):
        point = x.copy()
        near = base * (1.0 + _SPREAD * rng.uniform(-1.0, 1.0, len(x)))
        point[list(parameters)] = np.clip(near, low, high)[list(parameters)]
        points.append(point)
    return points


def _null_space(A: Array) -> Array:
    """Basis (d, K) of the null space of A (M, K). Columns that are zero are left out: they have no partner."""
    size = np.linalg.norm(A, axis=0)
    nonzero = np.flatnonzero(size > 0)
    if not np.isfinite(A).all() or not len(nonzero):
        return np.zeros((0, A.shape[1]))
    # The triangular factor has the same right singular vectors, and its left ones are small (K, not M squared).
    triangle = np.linalg.qr(A[:, nonzero] / size[nonzero], mode="r")
    _, values, vectors = np.linalg.svd(triangle, full_matrices=True)
    values = np.concatenate([values, np.zeros(len(nonzero) - len(values))])
    null = vectors[values < _NULL * values.max()]
    basis = np.zeros((len(null), A.shape[1]))
    basis[:, nonzero] = null / size[nonzero]
    return basis


def _simple_basis(basis: Array) -> list[Array]:
    """Directions with few and simple numbers that span the same space, by elimination; others are dropped."""
    rows = basis / np.abs(basis).max(axis=1, keepdims=True) if len(basis) else basis
    rows = rows.copy()
    for k in range(len(rows)):
        pivot = int(np.abs(rows[k]).argmax())
        rows[k] /= rows[k, pivot]
        for other in range(len(rows)):
            if other != k:
                rows[other] -= rows[other, pivot] * rows[k]
    simple = []
    for row in rows:
        row = row / np.abs(row).max()
        rounded = np.round(_DENOMINATOR * row) / _DENOMINATOR
        if np.abs(rounded - row).max() < _ROUNDING:
            simple.append(rounded * (1.0 if rounded[np.flatnonzero(rounded)[0]] > 0 else -1.0))
    return simple


def _equal(first: Sequence[Array], second: Sequence[Array]) -> bool:
    """Whether two sets of predictions are the same up to rounding."""
    for a, b in zip(first, second):
        size = float(np.nanmax(np.abs(a), initial=0.0))
        if not np.allclose(a, b, rtol=1e-6, atol=1e-7 * size, equal_nan=True):
            return False
    return True


def held_by_priors(names: Collection[str], parameters: Iterable[Parameter]) -> bool:
    """Whether one of these parameters has a prior, which then determines what no data of this kind do.

    Example:
        >>> from seatruth.models import Parameter
        >>> from seatruth.models.parameter import Prior
        >>> known, free = Parameter("m", 220.0, "kg", prior=Prior(220.0, 6.0)), Parameter("I", 90.0, "kg m2")
        >>> held_by_priors(["m", "I"], [known, free]), held_by_priors(["I"], [known, free])
        (True, False)
    """
    return any(parameter.prior is not None for parameter in parameters if parameter.name in names)


def _scale_sentence(exponents: dict[str, float], held: bool) -> str:
    seen = f": only {_ratio(exponents)} can be seen" if len(exponents) == 2 else ""
    no_data = "No data of this kind determine that factor: "
    no_data += "priors alone do." if held else "fix one of them."
    if len(set(exponents.values())) == 1:
        seen = seen or ": only their ratios can be seen"
        return (
            f"Scales cancel: {listed(list(exponents))} can be multiplied by one factor and nothing changes{seen}. "
            f"{no_data}"
        )
    up = [_with_power(name, power) for name, power in exponents.items() if power > 0]
    down = [_with_power(name, -power) for name, power in exponents.items() if power < 0]
    return (
        f"Scales cancel: {listed(up)} can be multiplied by a factor and {listed(down)} divided by it, and nothing "
        f"changes{seen}. {no_data}"
    )


def _sum_sentence(steps: dict[str, float], held: bool) -> str:
    seen = f": only {_difference(steps)} can be seen" if len(steps) == 2 else ""
    up = [_with_factor(name, size) for name, size in steps.items() if size > 0]
    down = [_with_factor(name, -size) for name, size in steps.items() if size < 0]
    if not down:
        do = "Priors alone hold them." if held else "Fix one of them."
        return f"{listed(up)} can grow together and nothing changes{seen}. {do}"
    return (
        f"Only a sum counts: {listed(up)} can grow while {listed(down)} shrink{'s' if len(down) == 1 else ''} as "
        f"much, and nothing changes{seen}. No data of this kind distinguish them: "
        f"{'priors alone do.' if held else 'fix one of them.'}"
    )


def _ratio(exponents: dict[str, float]) -> str:
    """What does not change where two parameters are multiplied by powers of one factor: "K * T", "a / b^2"."""
    (a, p), (b, q) = exponents.items()
    power = abs(p / q)
    return f"{a} {'*' if p * q < 0 else '/'} {b}{'' if power == 1.0 else f'^{power:.3g}'}"


def _difference(steps: dict[str, float]) -> str:
    """What does not change where two parameters change by multiples of one step: "a + b", "c - 2 d"."""
    (a, p), (b, q) = steps.items()
    factor = abs(p / q)
    return f"{a} {'+' if p * q < 0 else '-'} {'' if factor == 1.0 else f'{factor:.3g} '}{b}"


def _with_power(name: str, power: float) -> str:
    return name if power == 1.0 else f"{name} (to the power {1 / power:.3g})"


def _with_factor(name: str, size: float) -> str:
    return name if size == 1.0 else f"{name} ({size:.3g} times)"
