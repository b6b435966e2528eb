"""How the marginal likelihood changes with the sizes of noise and discrepancy: slopes, and average information.

With R the noise's covariance, X the derivatives by unknowns u of prior covariance P, the errors are normal with
V = R + X P X'. The slope by a size is, by Fisher's identity, what the posterior expects of the complete data's: for
noise the squared errors that are left, for a size of discrepancy the squares of what is missing. The average of the
observed and the expected information is a quadratic form of working variates (dV/ds) V^-1 e, which costs no more than
as many further errors (Gilmour, Thompson and Cullis 1995, Biometrics 51, 1440).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.prior_roots import LocalRoot
from seatruth.diagnosis.sizes import Sizes
from seatruth.diagnosis.triangular import forward
from seatruth.diagnosis.unknowns import Posterior


@dataclass(frozen=True)
class _Change:
    """What one size of discrepancy changes: L^-1 (dQ/ds) L^-T of equations' covariance Q = L L', of terms, of forces.

    One matrix for each group of terms, None where nothing changes.
    """

    terms: list[Array] | None
    forces: Array | None


def slopes(likelihood: Likelihood, sizes: Sizes, effects: Sequence[str], *, noise: bool) -> tuple[Array, Array]:
    """Slopes (n,) of the log-likelihood by `sizes.vector`, and its average information (n, n).

    Zero for the white noise, unless `noise`, and for sizes that are none. Raises LinAlgError where the algebra fails.
    """
    known = likelihood.posterior(sizes, effects)
    C, T, n = len(sizes.white), len(known.local), len(sizes.vector)
    changes = {k: change for k, change in enumerate(_changes(likelihood, sizes), C) if change is not None}
    slope, squares = np.zeros(n), np.zeros((n, n))
    # Right-hand sides by shared and by each trial's own unknowns, of the working variates.
    shared, local = np.zeros((len(known.shared), n)), np.zeros((T, known.local.shape[1], n))
    # What each trial's own unknowns vary by because the shared ones do.
    by_shared = known.lean.reshape(known.local.size, len(known.at)).T
    leans = forward(known.factor, by_shared).T.reshape(known.lean.shape)
    rows = likelihood.priors.term_rows(sizes, likelihood.held)
    moments = _moments(likelihood, known, leans, rows)
    for k, change in changes.items():
        shared[:, k], local[:, :, k] = _variate(likelihood, known, change, rows)
        slope[k] = _expected(change, moments)
    total, _ = likelihood.whole(sizes)
    root, first = likelihood.local_root(sizes), 1 + len(likelihood.columns)
    end = first + root.size
    raw = np.zeros((T, total.shape[1], n))
    raw[:, 1 + known.at] = known.root @ shared
    raw[:, first:end] = root.times(local)
    weighed = total @ raw
    squares += np.einsum("tmi,tmj->ij", raw, weighed)
    if noise:
        spread = _covariance(known, leans, root, first)
        for c in np.flatnonzero(likelihood.grams.counts.any(axis=0)):
            gram, _ = likelihood.grams.of(int(c), sizes.shape[c])
            scale = math.exp(-2.0 * float(sizes.white[c]))
            there = scale * (gram @ known.place[:, :, None])[:, :, 0]
            left = float((known.place * there).sum())
            slope[c] = left + scale * float(np.vdot(gram, spread)) - float(likelihood.grams.counts[:, c].sum())
            cross = -2.0 * np.einsum("tm,tmi->i", there, raw)
            squares[c], squares[:, c] = cross, cross
            squares[c, c] = 4.0 * left
            weighed[:, :, c] = -2.0 * there
    on_shared = known.root.T @ weighed[:, 1 + known.at].sum(axis=0)
    on_local = root.times(weighed[:, first:end], transposed=True)
    return slope, 0.5 * (squares - _explained(known, on_shared, on_local))


def _changes(likelihood: Likelihood, sizes: Sizes) -> list[_Change | None]:
    """What each size of terms, of forces, and each coupling changes; None for sizes that are none."""
    problem, E = likelihood.problem, len(sizes.terms)
    # Correlations alone: the change by a size, in deviations of its prior, does not depend on the sizes.
    unit = -np.log(problem.usual)
    with_terms, with_forces = np.isfinite(sizes.terms), np.isfinite(sizes.forces)
    every, all_equations = likelihood.priors.equations(unit, sizes.coupling), list(range(E))
    groups = []
    if with_terms.any():
        members = [equations for equations, _ in problem.term_groups]
        groups = [(list(one), likelihood.priors.equations(unit, sizes.coupling, one)) for one in members]
    found: list[_Change | None] = []
    for e in range(E):
        of_terms = [_by_size(root, equations, e) for equations, root in groups]
        found.append(_Change(of_terms, None) if with_terms[e] else None)
    found += [_Change(None, _by_size(every, all_equations, e)) if with_forces[e] else None for e in range(E)]
    for pair, value in zip(likelihood.priors.pairs, sizes.coupling):
        of_terms = [_by_coupling(root, equations, pair, value) for equations, root in groups]
        forced = _by_coupling(every, all_equations, pair, value) if with_forces.any() else None
        found.append(_Change(of_terms or None, forced) if of_terms or forced is not None else None)
    return found


def _by_size(root: Array, equations: list[int], e: int) -> Array:
    """The change by the logarithm of the size of equation e, from a correlation's root."""
    if e not in equations:
        return np.zeros_like(root)
    place = equations.index(e)
    half = np.outer(forward(root, np.eye(len(root)))[:, place], root[place])
    return np.asarray(half + half.T)


def _by_coupling(root: Array, equations: list[int], pair: tuple[int, int], value: float) -> Array:
    """The same, by Fisher's z of the correlation of a pair of equations."""
    if not set(pair) <= set(equations):
        return np.zeros_like(root)
    inverse = forward(root, np.eye(len(root)))
    half = np.outer(inverse[:, equations.index(pair[0])], inverse[:, equations.index(pair[1])])
    return np.asarray((1.0 - value**2) * (half + half.T))


def _moments(
    likelihood: Likelihood, known: Posterior, leans: Array, rows: list[Indices]
) -> tuple[list[tuple[int, Array]], tuple[int, Array]]:
    """How many vectors there are of what is missing, and the sum of their expected squares between equations.

    In deviations of their prior; for each group of terms, and for the forces of all trials and knots.
    """
    found = []
    for own in rows:
        squares = known.shared[own].T @ known.shared[own]
        found.append((len(own), squares + known.shared_covariance[own[:, :, None], own[:, None, :]].sum(axis=0)))
    count, knots = len(likelihood.problem.initial_names), likelihood.problem.settings.knots
    T, L = known.local.shape
    shape = T, (L - count) // knots, knots
    forces, leaning = known.local[:, count:].reshape(shape), leans[:, count:].reshape(*shape, leans.shape[2])
    spread = known.local_covariance[:, count:, count:].reshape(*shape, *shape[1:])
    squares = np.einsum("tak,tbk->ab", forces, forces) + np.einsum("takbk->ab", spread)
    by_equation = leaning.transpose(1, 0, 2, 3).reshape(shape[1], T * knots * leans.shape[2])
    return found, (T * knots, squares + by_equation @ by_equation.T)


def _expected(change: _Change, moments: tuple[list[tuple[int, Array]], tuple[int, Array]]) -> float:
    """The slope of the log-likelihood by a size of discrepancy."""
    of_terms, (number, squares) = moments
    total = 0.0
    if change.terms is not None:
        for matrix, (count, own) in zip(change.terms, of_terms, strict=True):
            total += 0.5 * (float((matrix * own).sum()) - count * float(np.trace(matrix)))
    if change.forces is not None:
        total += 0.5 * (float((change.forces * squares).sum()) - number * float(np.trace(change.forces)))
    return total


def _variate(likelihood: Likelihood, known: Posterior, change: _Change, rows: list[Indices]) -> tuple[Array, Array]:
    """The working variate of a size of discrepancy: by shared unknowns (k,), and by each trial's own (T, L)."""
    shared, local = np.zeros_like(known.shared), np.zeros_like(known.local)
    if change.terms is not None:
        for matrix, own in zip(change.terms, rows, strict=True):
            shared[own] = known.shared[own] @ matrix
    if change.forces is not None:
        count = len(likelihood.problem.initial_names)
        forces = known.local[:, count:].reshape(len(local), len(change.forces), -1)
        local[:, count:] = (change.forces @ forces).reshape(len(local), -1)
    return shared, local


def _covariance(known: Posterior, leans: Array, root: LocalRoot, first: int) -> Array:
    """Posterior covariance (T, m, m) of the unknowns of all columns, each in its own unit; 0 for the errors."""
    T, m = known.place.shape
    half = np.zeros((T, m, len(known.at)))
    half[:, 1 + known.at] = forward(known.factor, known.root.T).T
    half[:, first : first + root.size] = -root.times(leans)
    found = half @ half.transpose(0, 2, 1)
    own = root.times(root.times(known.local_covariance).transpose(0, 2, 1))
    found[:, first : first + root.size, first : first + root.size] += own
    return found


def _explained(known: Posterior, shared: Array, local: Array) -> Array:
    """What the unknowns explain of working variates, from right-hand sides (k, n) and (T, L, n): (n, n)."""
    left, total = shared.copy(), np.zeros((shared.shape[1],) * 2)
    for factor, halves, right in zip(known.factors, known.halves, local):
        own = forward(factor, right)
        total += own.T @ own
        left -= known.root.T @ (halves[:, 1 + known.at].T @ own)
    half = forward(known.factor, left)
    return np.asarray(total + half.T @ half)
