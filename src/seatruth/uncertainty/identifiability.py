"""What the data cannot tell apart, in words: singular value decomposition of the scaled derivatives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.models.parameter import Parameter
from seatruth.uncertainty.covariance import Covariance

_MOST_WEAK = 6
_NAMED = 0.99
"""Length of the part of a combination, itself of length 1, that lies in those named already."""
_IN_IT = 0.25
"""Part of the largest coefficient from which a parameter is named in a combination."""
_NOT_AT_ALL = 1e3
"""Standard error along a combination, in scales, from which the data say nothing of it."""
_CANCELS = 0.02
"""Part of the largest share in the outputs' change from which a parameter is named in such a combination."""
_POOR = 0.5
"""Standard error along a combination, in scales, from which it is called weak."""
_TIED = 0.98
"""Correlation from which two parameters trade off."""
_UNTOLD = 0.5
"""Standard error over value from which a parameter is weakly identified."""
_TIED_UNTOLD = 0.1
"""The same for a parameter that is tied to another: their common error is no longer a detail."""
_PRIOR_LED = 0.8
"""Standard error over the prior's from which the value is the prior's rather than the data's."""


def scale_of(parameter: Parameter) -> float:
    """How far a parameter might reasonably be off: its prior, half its bounds, or its own size."""
    if parameter.prior is not None:
        return parameter.prior.sd
    width = 0.5 * (parameter.max - parameter.min)
    if math.isfinite(width):
        return width
    return abs(parameter.value) or 1.0


def identifiability(
    data_jacobian: Array, parameters: Sequence[Parameter], inflation: float = 1.0, named: Array | None = None
) -> dict[str, Any]:
    """Singular values of the data's derivatives in scales, their condition, and the weak combinations with words.

    data_jacobian (M, K) are the derivatives of residuals over noise by the parameters, without priors. `inflation` is
    how many times larger standard errors are than under white noise. A combination's `ratio` is its standard error in
    scales: 1 says that the data narrow it no further than the bounds or priors do. Combinations inside the span of
    `named` (d, K), steps that are known to change nothing, are not listed again.
    """
    scales = np.array([scale_of(parameter) for parameter in parameters])
    if not len(parameters):
        return {"singular_values": [], "condition": math.nan, "weak": []}
    scaled = np.nan_to_num(data_jacobian * scales)
    _, values, vectors = np.linalg.svd(scaled, full_matrices=False)
    if len(values) < len(parameters):
        values = np.concatenate([values, np.zeros(len(parameters) - len(values))])
        vectors = np.linalg.svd(np.linalg.qr(scaled, mode="r"), full_matrices=True)[2]
    lengths = np.linalg.norm(scaled, axis=0)
    largest = float(values.max())
    condition = largest / float(values.min()) if values.min() > 0 else math.inf
    weak: list[dict[str, Any]] = []
    for k in np.argsort(values):
        ratio = inflation / float(values[k]) if values[k] > 0 else math.inf
        if ratio < _POOR or len(weak) == _MOST_WEAK:
            break
        if _inside(vectors[k], named, scales):
            continue
        weak.append(_combination(vectors[k], parameters, ratio, lengths))
    return {"singular_values": values.tolist(), "condition": condition, "weak": weak}


def _inside(vector: Array, named: Array | None, scales: Array) -> bool:
    if named is None or not len(named):
        return False
    basis = np.linalg.qr((named / scales).T)[0]
    return float(np.linalg.norm(basis.T @ vector)) > _NAMED


def _combination(vector: Array, parameters: Sequence[Parameter], ratio: float, lengths: Array) -> dict[str, Any]:
    largest = int(np.abs(vector).argmax())
    vector = vector / vector[largest]
    part, least = np.abs(vector), _IN_IT
    if ratio > _NOT_AT_ALL and lengths[largest] > 0:
        # What changes nothing cancels: whatever moves the outputs against the others is in it, however little it moves.
        part, least = part * lengths / float((part * lengths).max()), _CANCELS
    order = [int(k) for k in np.argsort(-np.abs(vector)) if part[k] >= least]
    names = [parameters[k].name for k in order]
    combination = {parameters[k].name: float(vector[k]) for k in order}
    said = "not at all" if ratio > _NOT_AT_ALL else f"only to {_percent(ratio)} of the range that was thought possible"
    if len(names) == 1:
        sentence = f"{names[0]} is hardly seen by these trials: they fix it {said}."
    else:
        listing = f"{', '.join(names[:-1])} and {names[-1]}"
        sentence = f"{listing} trade off: these trials fix their common direction {said}."
    return {"combination": combination, "ratio": ratio, "sentence": sentence}


def trade_offs(found: Covariance, parameters: Sequence[Parameter]) -> list[dict[str, Any]]:
    """Pairs whose estimates are nearly one: named even where both are known well against their ranges."""
    correlation = found.correlation
    pairs = []
    for a in range(len(parameters)):
        for b in range(a):
            rho = float(correlation[a, b])
            if math.isfinite(rho) and abs(rho) > _TIED:
                pairs.append((abs(rho), a, b, rho))
    listed = []
    for _, a, b, rho in sorted(pairs, reverse=True)[:_MOST_WEAK]:
        one, two = parameters[b].name, parameters[a].name
        listed.append(
            {
                "combination": {one: 1.0, two: -math.copysign(1.0, rho)},
                "ratio": abs(rho),
                "sentence": f"{one} and {two} trade off: their estimates are correlated by {rho:+.3f}, so a change of "
                "one is made up by the other.",
            }
        )
    return listed


def verdict(parameter: Parameter, value: float, stderr: float, at_bound: bool, unseen: bool, tied: bool) -> str:
    """One word on a parameter: identified, weak, not identifiable, at bound, from prior."""
    if at_bound:
        return "at bound"
    if unseen or not math.isfinite(stderr):
        return "not identifiable"
    if parameter.prior is not None and stderr > _PRIOR_LED * parameter.prior.sd:
        return "from prior"
    if stderr > scale_of(parameter):
        return "not identifiable"
    null = abs(value) if value else scale_of(parameter)
    return "weak" if stderr > (_TIED_UNTOLD if tied else _UNTOLD) * null else "identified"


def tied(found: Covariance) -> NDArray[np.bool_]:
    """Which parameters are correlated with another beyond telling apart, (K,)."""
    correlation = np.abs(np.nan_to_num(found.correlation))
    np.fill_diagonal(correlation, 0.0)
    return np.asarray((correlation > _TIED).any(axis=1)) if correlation.size else np.zeros(0, dtype=np.bool_)


def _percent(ratio: float) -> str:
    return f"{100.0 * ratio:.0f} %" if ratio < 10 else f"{ratio:.0f} times"
