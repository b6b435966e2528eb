"""The marginal likelihood of a hypothesis: effects compete with noise and with model discrepancy on equal terms.

Around a point the errors of all channels are, to first order,

    e = J_a a + J_q q + J_d d + J_f f + J_0 x_0 + noise,

normal in everything: coefficients a and effect parameters q under their priors, discrepancy terms d and each trial's
own forces f of sizes that the trials decide, initial states x_0 as good as unknown, noise white plus slow in each
channel. The unknowns are integrated out in closed form, by elimination on Gram matrices of whitened columns: first each
trial's own unknowns, then the shared ones. What is left depends on the sizes alone, which are then maximised:
restricted maximum likelihood (Patterson and Thompson 1971). Every trial's part stays apart until the last sum, so that
the density of a trial left out costs nothing more.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dtrsm

from seatruth.arrays import Array, Flags
from seatruth.diagnosis.gram_matrices import GramMatrices
from seatruth.diagnosis.prior_roots import LocalRoot, PriorRoots
from seatruth.diagnosis.problem import Linearization, Point, Problem
from seatruth.diagnosis.shared_likelihood import SharedLikelihood
from seatruth.diagnosis.sizes import Sizes
from seatruth.diagnosis.triangular import backward, forward, inverse
from seatruth.diagnosis.unknowns import Posterior, Solution

_BOUNDS = 10
"""Times that unknowns are held at bounds in one step. [S] Two or three are usual."""
_SLACK = 1e-9
"""Part of the range between bounds by which a step crosses them: rounding."""


@dataclass(frozen=True)
class _Reduced:
    """Each trial's own unknowns integrated out: Gram matrices (T, 1 + S', 1 + S') and log-likelihood parts (T,)."""

    grams: Array
    base: Array
    factors: Array
    halves: Array


class Likelihood(SharedLikelihood):
    """Marginal likelihoods of hypotheses at one linearization; its columns are those of the effects in it.

    Terms and forces take part where it has their derivatives. `keep` (N,) says which errors count; all where None.
    `held` are shared unknowns that stay where the point has them, though the hypothesis has them.
    """

    def __init__(
        self, problem: Problem, at: Linearization, keep: Flags | None = None, held: Sequence[int] = ()
    ) -> None:
        columns, priors = problem.active(at.effects, discrepancy=at.discrepancy), PriorRoots(problem)
        # Gram matrices are taken with errors at the prior means of everything that is not held.
        super().__init__(problem, columns, priors, (problem.mean - at.point.shared)[columns], held)
        self.point = at.point
        own_columns = priors.over_knots(at.local, priors.time)
        self._locals = at.local.shape[1]
        self.grams = GramMatrices(problem, at.errors, at.shared[:, columns], own_columns, keep)
        self._last_gram: tuple[tuple[bytes, tuple[int, ...]], Array, Array] | None = None
        self._last_reduced: tuple[bytes, _Reduced] | None = None
        self._local_offset = priors.added(problem.local_offset(at.point)[:, : self._locals])

    def held_at_bounds(self, sizes: Sizes, effects: Sequence[str]) -> tuple[int, ...]:
        """Shared unknowns that stand at a bound, where the trials ask for a value beyond it.

        Free, such a value would be credited with what it cannot explain, and everything else, noise included, would be
        set as if it did. Of effects, those count whose null is the bound: a delay, a play, a slowness are not negative.
        """
        problem, at = self.problem, self.point.shared
        own = np.array([int(k) for name in effects for k in problem.columns[name]], dtype=np.intp)
        own = np.concatenate([problem.coefficients, own[at[own] == problem.mean[own]]])
        low, high = at[own] <= problem.low[own], at[own] >= problem.high[own]
        if not (low | high).any():
            return ()
        step = self.solve(sizes, effects).shared[own]
        return tuple(own[(low & (step < 0.0)) | (high & (step > 0.0))].tolist())

    def holding(self, held: Sequence[int]) -> Likelihood:
        """The same with these shared unknowns held where the point has them; what is whitened serves both."""
        found = copy.copy(self)
        offset = (self.problem.mean - self.point.shared)[self.columns]
        super(Likelihood, found).__init__(self.problem, self.columns, self.priors, offset, held)
        found._last_gram = found._last_reduced = None
        return found

    def bounded(self, sizes: Sizes, effects: Sequence[str]) -> Likelihood:
        """The same with every unknown held at the bound that its most probable step would cross. For `solve` alone.

        What is held changes the step of all others, which may then cross bounds in turn.
        """
        problem, at, found = self.problem, self.point.shared, self
        for _ in range(_BOUNDS):
            to = at + found.solve(sizes, effects).shared
            slack = _SLACK * (problem.high - problem.low)
            crossed = np.flatnonzero((to < problem.low - slack) | (to > problem.high + slack))
            crossed = np.array([k for k in crossed if int(k) in self.place and int(k) not in found.held], dtype=np.intp)
            if not crossed.size:
                break
            tighter = copy.copy(found)
            tighter.held = (*found.held, *crossed.tolist())
            tighter._offset = found._offset.copy()
            tighter._offset[[self.place[int(k)] for k in crossed]] = (np.clip(to, problem.low, problem.high) - at)[
                crossed
            ]
            tighter._last_gram = tighter._last_reduced = None
            found = tighter
        return found

    def elsewhere(self, point: Point, errors: Array) -> Likelihood:
        """The same at another point, with its errors (N,), nothing held. The derivatives are taken to be the same."""
        found = copy.copy(self)
        offset = (self.problem.mean - point.shared)[self.columns]
        super(Likelihood, found).__init__(self.problem, self.columns, self.priors, offset)
        found.point = point
        found.grams, found._last_gram, found._last_reduced = self.grams.with_errors(errors), None, None
        found._local_offset = self.priors.added(self.problem.local_offset(point)[:, : self._locals])
        return found

    def without_priors_pull(self, errors: Array) -> Likelihood:
        """The same with other errors (N,), which no prior draws anywhere. For `solve` alone."""
        found = copy.copy(self)
        found.grams, found._last_gram, found._last_reduced = self.grams.with_errors(errors), None, None
        found._offset, found._local_offset = np.zeros_like(self._offset), np.zeros_like(self._local_offset)
        return found

    def damped(self, damping: float) -> Likelihood:
        """The same with every prior drawn towards the point: its steps are Levenberg and Marquardt's.

        To each squared distance from the prior mean comes `damping` times the squared distance from the point, in the
        same metric. What the trials determine is hardly held back, what only the priors hold is. For `solve` alone: it
        is no likelihood of anything.
        """
        drawn = copy.copy(self)
        drawn._offset, drawn._local_offset = self._offset / (1.0 + damping), self._local_offset / (1.0 + damping)
        drawn._tightness = 1.0 / math.sqrt(1.0 + damping)
        drawn._last_gram = drawn._last_reduced = None
        return drawn

    # What the trials say

    def solve(self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None = None) -> Solution:
        """The most probable step from the point. Raises LinAlgError where the algebra fails."""
        step, own = self._most_probable(sizes, effects, trials)
        scaled = self._scaled_local(self._reduce(sizes), own)
        local = self.priors.over_knots(self._local_place(sizes, scaled), self.priors.time.T)
        return Solution(step.shared, step.free, step.covariance, local)

    def posterior(self, sizes: Sizes, effects: Sequence[str]) -> Posterior:
        """What is known of all unknowns. Raises LinAlgError where the algebra fails."""
        gram, _, at, root = self._summed(sizes, effects, None)
        reduced = self._reduce(sizes)
        factor: Array = np.asarray(np.linalg.cholesky(np.eye(len(at)) + root.T @ gram[np.ix_(1 + at, 1 + at)] @ root))
        covariance = inverse(factor)
        shared = -covariance @ (root.T @ gram[1 + at, 0])
        own = np.zeros(len(self.columns))
        own[at] = root @ shared
        local = self._scaled_local(reduced, own)
        inverses = np.zeros_like(reduced.factors)
        lean = np.zeros((len(local), local.shape[1], len(at)))
        for trial, one in enumerate(reduced.factors):
            inverses[trial] = inverse(one)
            lean[trial] = backward(one, reduced.halves[trial][:, 1 + at] @ root)
        place = np.ones((len(local), self.grams.size))
        place[:, 1 : 1 + len(self.columns)] = self._offset + own
        place[:, 1 + len(self.columns) :] = self._local_place(sizes, local)
        return Posterior(
            shared, local, covariance, inverses, lean, place, at, root, factor, reduced.factors, reduced.halves
        )

    def _scaled_local(self, reduced: _Reduced, own: Array) -> Array:
        """Mean of each trial's own unknowns (T, L) in deviations of their priors, the shared ones at (S',)."""
        right = -(reduced.halves @ np.concatenate([[1.0], own]))
        return np.asarray([backward(factor, one) for factor, one in zip(reduced.factors, right)]).reshape(right.shape)

    def _local_place(self, sizes: Sizes, scaled: Array) -> Array:
        """Distances from the point of all of each trial's own unknowns, forces by what each knot adds."""
        place = self._local_offset.copy()
        # What is known to be none goes to none.
        place[:, : scaled.shape[1]] += self.local_root(sizes).times(scaled[:, :, None])[:, :, 0]
        return place

    def local_covariance(self, sizes: Sizes, trial: int) -> Array:
        """Posterior covariance (L, L) of one trial's own unknowns, the shared ones held."""
        factor, root = self._reduce(sizes).factors[trial], self.local_root(sizes)
        half = forward(factor, root.times(np.eye(root.size)[None])[0].T)
        half = self.priors.over_knots(half, self.priors.time.T)
        return np.asarray(half.T @ half)

    def quadratic(self, sizes: Sizes) -> Array:
        """Gram matrix (1 + S', 1 + S') of [errors, columns] with initial states integrated out, errors at the point.

        Without priors of the shared unknowns.
        """
        offset, local = self._offset, self._local_offset
        try:
            self._offset, self._local_offset = np.zeros_like(offset), np.zeros_like(local)
            self._last_gram = self._last_reduced = None
            return np.asarray(self._reduce(sizes).grams.sum(axis=0))
        finally:
            self._offset, self._local_offset = offset, local
            self._last_gram = self._last_reduced = None

    # Priors

    def local_root(self, sizes: Sizes) -> LocalRoot:
        """A square root of the prior covariance of a trial's own unknowns, or of its initial states alone."""
        root = self.priors.local(sizes, forces=self._locals > len(self.problem.initial_names))
        return LocalRoot(self._tightness * root.initial, self._tightness * root.equations, root.knots)

    # Elimination

    def whole(self, sizes: Sizes) -> tuple[Array, Array]:
        """Gram matrices (T, m, m) of all channels, errors at the prior means, and the noise's log-likelihood (T,)."""
        key = sizes.white.tobytes(), sizes.shape
        if self._last_gram is not None and self._last_gram[0] == key:
            return self._last_gram[1], self._last_gram[2]
        total, base = self.grams.weighted(sizes)
        shift = np.ones((len(total), self.grams.size, 1))
        shift[:, 1 : 1 + len(self.columns), 0] = self._offset
        shift[:, 1 + len(self.columns) :, 0] = self._local_offset
        column = (total @ shift)[:, :, 0]
        total[:, 0, 0] = np.einsum("ti,ti->t", shift[:, :, 0], column)
        total[:, 0, 1:] = total[:, 1:, 0] = column[:, 1:]
        self._last_gram = key, total, base
        return total, base

    def integrated(self, sizes: Sizes) -> tuple[Array, Array]:
        """See the base. Raises LinAlgError where the algebra fails."""
        reduced = self._reduce(sizes)
        return reduced.grams, reduced.base

    def _reduce(self, sizes: Sizes) -> _Reduced:
        key = sizes.without_terms
        if self._last_reduced is not None and self._last_reduced[0] == key:
            return self._last_reduced[1]
        total, base = self.whole(sizes)
        n = 1 + len(self.columns)
        root = self.local_root(sizes)
        end = n + root.size
        rooted = root.times(total[:, n:end, :end], transposed=True)
        inner = root.times(rooted[:, :, n:].transpose(0, 2, 1), transposed=True)
        diagonal = np.arange(inner.shape[1])
        inner[:, diagonal, diagonal] += 1.0
        factors: Array = np.asarray(np.linalg.cholesky(inner), dtype=np.float64)
        # From the right, transposed: so the routine reads arrays in rows as they are.
        halves = np.zeros((len(total), root.size, n))
        if root.size:
            halves[:] = [dtrsm(1.0, f.T, right[:, :n].T, side=1).T for f, right in zip(factors, rooted)]
        grams = total[:, :n, :n] - halves.transpose(0, 2, 1) @ halves
        base = base - np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
        found = _Reduced(grams, base, factors, halves)
        self._last_reduced = key, found
        return found
