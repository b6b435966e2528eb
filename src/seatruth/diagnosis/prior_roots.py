"""Square roots of the prior covariances of all unknowns, given the sizes of what the model's structure lacks.

Terms and forces of one equation lean on those of another where a side force acts off the origin. Forces of a trial
forget over a few knots: they are taken in what each knot adds to those before it, independent in time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import PAIRS, Sizes

_RIDGE = 1e-9
"""Relative ridge on correlation matrices: rounding."""


@dataclass(frozen=True)
class LocalRoot:
    """A square root of the prior covariance of a trial's own unknowns: initial states, then forces by equation.

    Of forces it is one matrix between equations, the same for what each knot adds.
    """

    initial: Array
    """(I,)."""
    equations: Array
    """(E, E); (0, 0) where no forces are missing."""
    knots: int

    @property
    def size(self) -> int:
        """How many unknowns a trial has, L."""
        return len(self.initial) + len(self.equations) * self.knots

    def times(self, columns: Array, *, transposed: bool = False) -> Array:
        """The root, or the transposed one, times columns (T, L, n)."""
        found, count = np.empty_like(columns), len(self.initial)
        found[:, :count] = self.initial[:, None] * columns[:, :count]
        if len(self.equations):
            by = self.equations.T if transposed else self.equations
            forces = np.ascontiguousarray(columns[:, count:]).reshape(len(columns), len(by), -1)
            found[:, count:] = (by @ forces).reshape(len(columns), -1, columns.shape[2])
        return found


class PriorRoots:
    """Square roots of prior covariances of a problem's unknowns, as sizes have them."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        knot = np.arange(problem.settings.knots)
        memory = np.exp(-np.abs(knot[:, None] - knot) / problem.settings.force_memory)
        self.time: Array = np.linalg.cholesky(memory + _RIDGE * np.eye(len(knot)))
        """Of one force over the knots (K, K)."""
        order = problem.equations
        self.pairs = [(order.index(a), order.index(b)) for a, b in PAIRS if a in order and b in order]
        """Equations whose missing forces are correlated, by `Sizes.coupling`."""

    def shared(self, sizes: Sizes, effects: Sequence[str], held: Sequence[int]) -> tuple[Indices, Array]:
        """The shared unknowns (k,) that a hypothesis frees, but for those that are held, and the root (k, k)."""
        problem, still = self._problem, set(held)
        first = [int(k) for k in problem.coefficients if int(k) not in still]
        middle = [int(k) for k in problem.terms] if np.isfinite(sizes.terms).any() else []
        own = [int(k) for name in effects for k in problem.columns[name] if int(k) not in still]
        free = np.array([*first, *middle, *own], dtype=np.intp)
        root = np.diag(problem.sd[free])
        for name in effects:
            if name in problem.prior_correlation:
                kept = [k for k, column in enumerate(problem.columns[name]) if int(column) not in still]
                rows = np.flatnonzero(np.isin(free, problem.columns[name][kept]))
                root[np.ix_(rows, rows)] = root[np.ix_(rows, rows)] @ self.between_trials(name, kept)
        for (equations, _), rows in zip(problem.term_groups, self.term_rows(sizes, held)):
            root[rows[:, :, None], rows[:, None, :]] = self.equations(sizes.terms, sizes.coupling, equations)
        return free, root

    def between_trials(self, name: str, kept: Sequence[int]) -> Array:
        """Root of the prior correlation (n, n) of these parameters of an effect with values for each trial."""
        correlation = self._problem.prior_correlation[name][np.ix_(kept, kept)]
        return np.asarray(np.linalg.cholesky(correlation + _RIDGE * np.eye(len(kept))))

    def term_rows(self, sizes: Sizes, held: Sequence[int]) -> list[Indices]:
        """Where each group of terms, (members, equations), is among those unknowns; none without terms."""
        if self._problem.discrepancy is None or not np.isfinite(sizes.terms).any():
            return []
        before = sum(int(k) not in held for k in self._problem.coefficients)
        return [before + members for _, members in self._problem.term_groups]

    def local(self, sizes: Sizes, *, forces: bool) -> LocalRoot:
        """Of a trial's own unknowns, or of its initial states alone where no `forces` take part."""
        lacking = forces and bool(np.isfinite(sizes.forces).any())
        between = self.equations(sizes.forces, sizes.coupling) if lacking else np.zeros((0, 0))
        return LocalRoot(self._problem.initial_sd, between, self._problem.settings.knots)

    def equations(self, log_sizes: Array, coupling: Array, which: Indices | None = None) -> Array:
        """Of missing accelerations (E, E) between all equations, or between these ones."""
        correlation = (1.0 + _RIDGE) * np.eye(len(log_sizes))
        for (a, b), value in zip(self.pairs, coupling):
            correlation[a, b] = correlation[b, a] = value
        size = np.where(np.isfinite(log_sizes), np.exp(log_sizes), 0.0) * self._problem.usual
        if which is not None:
            correlation, size = correlation[np.ix_(which, which)], size[which]
        return np.asarray(size[:, None] * np.linalg.cholesky(correlation))

    def over_knots(self, local: Array, matrix: Array) -> Array:
        """Columns (n, I + E K), or (n, I), with those of the forces times a matrix (K, K)."""
        count = len(self._problem.initial_names)
        forces = local[:, count:].reshape(len(local), -1, len(matrix)) @ matrix
        return np.concatenate([local[:, :count], forces.reshape(len(local), -1)], axis=1)

    def added(self, local: Array) -> Array:
        """Values (n, I + E K) of own unknowns, or (n, I), with forces by what each knot adds to those before it."""
        return self.over_knots(local, np.asarray(np.linalg.inv(self.time).T))

    def energy(self, sizes: Sizes, effects: Sequence[str], point: Point, held: Sequence[int]) -> float:
        """Squared distance of a point from the prior means, in deviations of the priors."""
        problem, (free, root) = self._problem, self.shared(sizes, effects, held)
        total = _squared(root, point.shared[free] - problem.mean[free])
        # What is held at a bound pays for its value too: else a step would seem to fall by what it no longer counts.
        still = list(held)
        total += float((((point.shared[still] - problem.mean[still]) / problem.sd[still]) ** 2).sum())
        total += float((((point.initial - problem.initial_mean) / problem.initial_sd) ** 2).sum())
        if np.isfinite(sizes.forces).any():
            own = np.concatenate([point.initial, point.forces.reshape(len(point.forces), -1)], axis=1)
            added = self.added(own)[:, point.initial.shape[1] :].reshape(point.forces.shape).transpose(1, 0, 2)
            between = self.equations(sizes.forces, sizes.coupling)
            total += _squared(between, added.reshape(len(between), -1))
        return total


def _squared(root: Array, values: Array) -> float:
    """Sum of squared distances of columns from zero in a normal prior with this square root of its covariance.

    Each row is taken in its own prior deviation. Coefficients in newton metres, of 1e9, and a gain of 1 stand in one
    root: in their own units its small rows would pass for rounding, and those unknowns would be free.
    """
    if not values.size:
        return 0.0
    sd = np.linalg.norm(root, axis=1)
    free = sd > 0.0  # what is known to be none stays none
    scaled = np.linalg.lstsq(root[free] / sd[free, None], (values[free].T / sd[free]).T, rcond=1e-10)[0]
    return float((scaled * scaled).sum())
