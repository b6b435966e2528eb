"""Practical identifiability: which parameters, and which combinations of them, the data determine, in words.

It rests on the singular value decomposition of the derivatives, each parameter scaled by how far it might plausibly be
off.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.models.parameter import Parameter
from seatruth.text import listed
from seatruth.uncertainty.covariance import Covariance

# All limits here are chosen here [S]: they decide which words a report uses, no number depends on them.
_MAX_LISTED = 6
"""Combinations and pairs that are listed at most."""
_COVERED = 0.99
"""Length of the part of a unit combination inside the span of known directions from which it is not listed again."""
_MEMBER = 0.25
"""Part of the largest coefficient from which a parameter is named in a combination."""
_UNDETERMINED = 1e3
"""Standard error along a combination, in plausible ranges, from which the data say nothing about it."""
_CANCELLING_MEMBER = 1e-3
"""Part of the largest share in the outputs' change from which a parameter is named in an undetermined combination."""
_WEAK_COMBINATION = 0.5
"""Standard error along a combination, in plausible ranges, from which it is called weak."""
_STRONG_CORRELATION = 0.98
"""Correlation of two estimates from which they are said to trade off."""
_WEAK = 0.5
"""Standard error over value from which a parameter is weakly identified."""
_WEAK_IF_CORRELATED = 0.1
"""The same for a parameter that is strongly correlated with another: their common error then matters earlier."""
_FROM_PRIOR = 0.8
"""Standard error over the prior's from which the value comes from the prior rather than from the data ..."""
_NEAR_PRIOR = 2.0
"""... as long as it lies within so many of the prior's standard deviations: what the data moved further is weak."""
_IN_WORDS = {
    "doubtful": "doubtful, as what to look at first says",
    "weak": "only weakly identified",
    "not identifiable": "not identifiable from these trials",
    "at bound": "at a bound",
    "from prior": "known from the prior rather than from the data",
}


def plausible_range(parameter: Parameter) -> float:
    """How far a parameter might plausibly be off, in its unit.

    The prior's standard deviation, or half the distance of the bounds, or the parameter's own size (1 where it is 0).
    """
    if parameter.prior is not None:
        return parameter.prior.sd
    width = 0.5 * (parameter.max - parameter.min)
    if math.isfinite(width):
        return width
    return abs(parameter.value) or 1.0


def identifiability(
    data_jacobian: Array,
    parameters: Sequence[Parameter],
    inflation: float = 1.0,
    known_directions: Array | None = None,
) -> dict[str, Any]:
    """Singular values, condition number and weak combinations of parameters.

    Args:
        data_jacobian: (M, K), derivatives of residuals over noise by the parameters, without priors.
        parameters: The K parameters.
        inflation: How many times larger standard errors are than under white noise.
        known_directions: (d, K), steps that are known to change nothing; combinations in their span are not listed.

    Returns:
        `singular_values` (K) of the derivatives by plausible ranges; `condition`, largest over smallest; `weak`, a list
        with `combination` (parameter -> coefficient), `ratio` (its standard error in plausible ranges: at 1 the data
        narrow it no further than bounds or priors do) and `sentence`.
    """
    scales = np.array([plausible_range(parameter) for parameter in parameters])
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
        if ratio < _WEAK_COMBINATION or len(weak) == _MAX_LISTED:
            break
        if _is_covered(vectors[k], known_directions, scales):
            continue
        weak.append(_combination(vectors[k], parameters, ratio, lengths))
    return {"singular_values": values.tolist(), "condition": condition, "weak": weak}


def without(jacobian: Array, columns: Sequence[int]) -> Array:
    """The derivatives without the part that changes of some other columns can compensate."""
    if not columns:
        return jacobian
    others = jacobian[:, list(columns)]
    size = np.linalg.norm(others, axis=0)
    q, r = np.linalg.qr(others[:, size > 0] / size[size > 0])
    kept = np.abs(np.diag(r)) > 1e-10
    q = q[:, kept]
    return np.asarray(jacobian - q @ (q.T @ jacobian))


def _is_covered(vector: Array, directions: Array | None, scales: Array) -> bool:
    """Whether a unit combination lies in the span of these directions."""
    if directions is None or not len(directions):
        return False
    basis = np.linalg.qr((directions / scales).T)[0]
    return float(np.linalg.norm(basis.T @ vector)) > _COVERED


def _combination(vector: Array, parameters: Sequence[Parameter], ratio: float, lengths: Array) -> dict[str, Any]:
    largest = int(np.abs(vector).argmax())
    vector = vector / vector[largest]
    share, least = np.abs(vector), _MEMBER
    if ratio > _UNDETERMINED and lengths[largest] > 0:
        # The effects of an undetermined combination's members cancel. Each that moves the outputs belongs to it,
        # however small its coefficient.
        share, least = share * lengths / float((share * lengths).max()), _CANCELLING_MEMBER
    order = [int(k) for k in np.argsort(-np.abs(vector)) if share[k] >= least]
    names = [parameters[k].name for k in order]
    combination = {parameters[k].name: float(vector[k]) for k in order}
    what = names[0] if len(names) == 1 else "their common direction"
    if ratio > _UNDETERMINED:
        sentence = f"these trials do not determine {what}."
    else:
        own = "its prior or bounds do" if len(names) == 1 else "their priors or bounds do"
        sentence = f"these trials alone leave {what} uncertain by {_times(ratio)} what {own}."
    if len(names) == 1:
        sentence = sentence[0].upper() + sentence[1:]
    else:
        sentence = f"{', '.join(names[:-1])} and {names[-1]} trade off: {sentence}"
    return {"combination": combination, "ratio": ratio, "sentence": sentence}


def correlated_pairs(uncertainty: Covariance, parameters: Sequence[Parameter]) -> list[dict[str, Any]]:
    """Pairs of parameters whose estimates are strongly correlated, the strongest first, as `identifiability` lists weak
    combinations. They are listed even where both are known well compared with their plausible ranges.
    """
    correlation = uncertainty.correlation
    pairs = []
    for a in range(len(parameters)):
        for b in range(a):
            rho = float(correlation[a, b])
            if math.isfinite(rho) and abs(rho) > _STRONG_CORRELATION:
                pairs.append((abs(rho), a, b, rho))
    listed = []
    for _, a, b, rho in sorted(pairs, reverse=True)[:_MAX_LISTED]:
        first, second = parameters[b].name, parameters[a].name
        listed.append(
            {
                "combination": {first: 1.0, second: -math.copysign(1.0, rho)},
                "ratio": abs(rho),
                "sentence": f"{first} and {second} trade off: their estimates are correlated by {rho:+.3f}, so a "
                "change of one makes up for a change of the other.",
            }
        )
    return listed


def verdict(
    parameter: Parameter,
    value: float,
    stderr: float,
    at_bound: bool,
    unidentifiable: bool,
    correlated: bool,
    doubted: bool = False,
) -> str:
    """One word on a parameter: identified, weak, not identifiable, at bound, from prior, doubtful.

    Args:
        parameter: Its bounds and prior.
        value: Its estimate.
        stderr: Its standard error.
        at_bound: Whether it lies on a bound.
        unidentifiable: Whether the data do not determine it.
        correlated: Whether it is strongly correlated with another (`strongly_correlated`).
        doubted: Whether a finding says that the value may be wrong, whatever its standard error.
    """
    if at_bound:
        return "at bound"
    if unidentifiable or not math.isfinite(stderr):
        return "not identifiable"
    prior = parameter.prior
    wide = prior is not None and stderr > _FROM_PRIOR * prior.sd
    if prior is not None and wide and abs(value - prior.mean) <= _NEAR_PRIOR * prior.sd:
        return "from prior"
    if stderr > plausible_range(parameter) and not wide:
        return "not identifiable"
    if doubted:
        return "doubtful"
    if wide:
        return "weak"
    size = abs(value) if value else plausible_range(parameter)
    return "weak" if stderr > (_WEAK_IF_CORRELATED if correlated else _WEAK) * size else "identified"


def verdicts_in_words(verdicts: Mapping[str, str]) -> str:
    """How many parameters are known, and which are not, from their verdicts by name.

    Example:
        >>> verdicts_in_words({"K": "identified", "T": "weak"})
        '1 of 2 free parameters is identified; T is only weakly identified.'
    """
    known, all_ = sum(one == "identified" for one in verdicts.values()), len(verdicts)
    if known == all_:
        return {0: "", 1: "The parameter is identified."}.get(known, f"All {known} free parameters are identified.")
    parts = [f"{known} of {all_} free parameter{'s' * (all_ != 1)} {'is' if known == 1 else 'are'} identified"]
    for verdict, words in _IN_WORDS.items():
        names = [name for name, one in verdicts.items() if one == verdict]
        if names:
            parts.append(f"{listed(names)} {'is' if len(names) == 1 else 'are'} {words}")
    return "; ".join(parts) + "."


def strongly_correlated(uncertainty: Covariance) -> NDArray[np.bool_]:
    """Which parameters (K,) have an estimate that is strongly correlated with another's."""
    correlation = np.abs(np.nan_to_num(uncertainty.correlation))
    np.fill_diagonal(correlation, 0.0)
    if not correlation.size:
        return np.zeros(0, dtype=np.bool_)
    return np.asarray((correlation > _STRONG_CORRELATION).any(axis=1))


def _times(ratio: float) -> str:
    return f"{100.0 * ratio:.0f} % of" if ratio < 10 else f"{ratio:.0f} times"
