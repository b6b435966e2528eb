"""Marginal likelihoods with each trial's own unknowns integrated out, by Gram matrices of the shared columns.

How the effects compete on equal terms with noise and with what the model lacks: `marginal_likelihood.py`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_solve

from seatruth.arrays import Array, Flags, Indices
from seatruth.diagnosis.evidence import scale_gain
from seatruth.diagnosis.prior_roots import PriorRoots
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import Sizes
from seatruth.diagnosis.triangular import forward
from seatruth.diagnosis.unknowns import SharedStep

_LARGEST_SQUARE = 1e13
"""Sum of squared whitened errors at the prior means from which rounding (1e-16 of it) could decide between answers."""
_ROUNDED = 0.01
"""nats by which a sum of squares may come out negative: what one is wrong by that decides nothing."""
_ROUNDING = 1e-14
"""Part by which rounding may change an entry of a Gram matrix: 50 units in the last place, of thousands of summands. It
changed the evidence by 1e-5 nats at most in usual studies, and by millions where a tank's liquid made runs diverge."""
_LEAST_INFORMATION = 0.5
"""Least eigenvalue of information and prior together, over the prior's, below which rounding has made it negative."""


class SharedLikelihood(ABC):
    """The marginal likelihood of a hypothesis about a point, once each trial's own unknowns are integrated out.

    `columns` (S',) are those of the shared unknowns in it, `held` those of them that stay where the point has them.
    """

    def __init__(
        self, problem: Problem, columns: Indices, priors: PriorRoots, offset: Array, held: Sequence[int] = ()
    ) -> None:
        """`offset` (S',): prior means less the point's values; of what is held it counts in the charge alone."""
        self.problem, self.columns, self.priors, self.held = problem, columns, priors, tuple(held)
        self.place = {int(column): k for k, column in enumerate(columns)}
        self._offset = offset.copy()
        own = [self.place[k] for k in self.held]
        self._charge = 0.5 * float(((self._offset[own] / problem.sd[list(self.held)]) ** 2).sum())
        self._offset[own] = 0.0
        self._tightness = 1.0

    @abstractmethod
    def integrated(self, sizes: Sizes) -> tuple[Array, Array]:
        """Gram matrices (T, 1 + S', 1 + S') of errors and shared columns, and log-likelihood parts (T,).

        Errors are those at the prior means; each trial's own unknowns are integrated out.
        """

    def log_likelihood(self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None = None) -> float:
        """Log marginal likelihood (nats) of all trials, or of some; -inf where the algebra fails."""
        try:
            least, base, factor = self._least(sizes, effects, trials)
        except np.linalg.LinAlgError:
            return -math.inf
        return base - float(np.log(np.diag(factor)).sum()) - least

    def least(self, sizes: Sizes, effects: Sequence[str]) -> float:
        """The least value (nats) that the objective of a fit would take, were the model linear about the point.

        Raises LinAlgError where the algebra fails.
        """
        return self._least(sizes, effects, None)[0]

    def _least(self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None) -> tuple[float, float, Array]:
        """That value, the log-likelihood of noise and own unknowns, and the Cholesky factor of the shared ones."""
        gram, base, at, root = self._summed(sizes, effects, trials)
        if not 0.0 <= gram[0, 0] < _LARGEST_SQUARE:
            raise np.linalg.LinAlgError("rounding decides the sum of squares")
        factor: Array = np.asarray(
            np.linalg.cholesky(np.eye(len(at)) + root.T @ gram[np.ix_(1 + at, 1 + at)] @ root), dtype=np.float64
        )
        half = forward(factor, root.T @ gram[1 + at, 0])
        least = 0.5 * float(gram[0, 0] - half @ half)
        if least < -_ROUNDED:
            raise np.linalg.LinAlgError("rounding decides the sum of squares")
        return least + self._charge, base, factor

    def evidence(self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None = None) -> float:
        """The same, averaged over the unknown order of each effect's magnitude, within its bounds (`evidence.py`)."""
        value = self.log_likelihood(sizes, effects, trials)
        if not effects or not math.isfinite(value):
            return value
        try:
            information, pull, sd = self._known_information(sizes, effects, trials)
        except np.linalg.LinAlgError:
            return -math.inf
        groups, k = [], 0
        for name in effects:
            count = len(self.problem.columns[name])
            shapes = self.problem.effects[name].shape_priors
            magnitude = [j for j, q in enumerate(self.problem.effects[name].parameters) if q.name not in shapes]
            groups.append(np.array([k + j for j in magnitude], dtype=np.intp))
            k += count
        own = np.concatenate([self.problem.columns[name] for name in effects])
        low, high = (end[own] - self.problem.mean[own] for end in (self.problem.low, self.problem.high))
        held = np.isin(own, self.held)
        root = self._between_trials(effects, held)
        if root is not None:
            # Independent under the prior again; where an environment ends, no bound cuts it.
            information, pull = root.T @ information @ root, root.T @ pull
            mixed = (root != 0.0).sum(axis=1) > 1
            low, high = np.where(mixed, -math.inf, low), np.where(mixed, math.inf, high)
        powers = [self.problem.effects[name].power for name in effects]
        return value + scale_gain(information, pull, sd, groups, self.problem.settings.scales, low, high, held, powers)

    def _between_trials(self, effects: Sequence[str], held: Flags) -> Array | None:
        """Root (n, n) of the prior correlation of these effects' parameters; None where they are independent."""
        if not any(name in self.problem.prior_correlation for name in effects):
            return None
        found, first = np.eye(len(held)), 0
        for name in effects:
            count = len(self.problem.columns[name])
            if name in self.problem.prior_correlation:
                kept = np.flatnonzero(~held[first : first + count])
                found[np.ix_(first + kept, first + kept)] = self.priors.between_trials(name, kept.tolist())
            first += count
        return found

    def information(
        self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None = None
    ) -> tuple[Array, Array, Array]:
        """What the trials say of these effects, all else integrated out.

        Returns the information (n, n) on their parameters, its product with their most probable distance from their
        prior means (n,), and their prior deviations (n,).
        """
        return self._left_over(sizes, effects, trials)[1:]

    def _known_information(
        self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None
    ) -> tuple[Array, Array, Array]:
        """As `information`. Raises LinAlgError where rounding decides what is left once all else is integrated out.

        It does where long runs are about to diverge: their derivatives are many orders larger than what they tell.
        """
        whole, information, pull, sd = self._left_over(sizes, effects, trials)
        widest = max(self.problem.settings.scales) * sd
        values, vectors = np.linalg.eigh(np.eye(len(sd)) + information * np.outer(widest, widest))
        # To first order, what rounding of each entry of the whole changes of the evidence.
        distance = widest * (vectors @ (vectors.T @ (widest * pull) / np.maximum(values, 1.0)))
        reach = float(np.abs(distance) @ np.sqrt(np.diag(whole)[1:]))
        lost = not _ROUNDING * reach * (math.sqrt(whole[0, 0]) + 0.5 * reach) < _ROUNDED
        if lost or values.min() < _LEAST_INFORMATION:
            raise np.linalg.LinAlgError("rounding decides what the trials say of an effect")
        return information, pull, sd

    def _left_over(
        self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None
    ) -> tuple[Array, Array, Array, Array]:
        """The Gram matrix (1 + n, 1 + n) of errors and effects' parameters, and as `information`."""
        gram, _, at, root = self._summed(sizes, (), trials)
        own = np.array([self.place[int(c)] for name in effects for c in self.problem.columns[name]], dtype=np.intp)
        factor: Array = np.asarray(np.linalg.cholesky(np.eye(len(at)) + root.T @ gram[np.ix_(1 + at, 1 + at)] @ root))
        half = forward(factor, root.T @ gram[np.ix_(1 + at, np.concatenate([[0], 1 + own]))])
        whole = gram[np.ix_(np.concatenate([[0], 1 + own]), np.concatenate([[0], 1 + own]))]
        left = whole - half.T @ half
        return whole, left[1:, 1:], -left[1:, 0], self.problem.sd[self.columns[own]]

    def shared_step(self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None = None) -> SharedStep:
        """The most probable step of the shared unknowns from the point, by all trials or some.

        Raises LinAlgError where the algebra fails.
        """
        return self._most_probable(sizes, effects, trials)[0]

    def _most_probable(
        self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None
    ) -> tuple[SharedStep, Array]:
        """That step, and where it leads from the prior means (S',)."""
        gram, _, at, root = self._summed(sizes, effects, trials)
        factor: Array = np.asarray(np.linalg.cholesky(np.eye(len(at)) + root.T @ gram[np.ix_(1 + at, 1 + at)] @ root))
        own = np.zeros(len(self.columns))
        own[at] = -root @ cho_solve((factor, True), root.T @ gram[1 + at, 0], check_finite=False)
        if not np.isfinite(own).all():
            raise np.linalg.LinAlgError("the most probable step is not finite")
        shared = np.zeros(len(self.problem.unknowns))
        shared[self.columns] = self._offset + own
        half = forward(factor, root.T)
        return SharedStep(shared, self.columns[at], half.T @ half), own

    def shared_root(self, sizes: Sizes, effects: Sequence[str]) -> tuple[Indices, Array]:
        """Which columns (k,) a hypothesis frees, and a square root (k, k) of their prior covariance."""
        free, root = self.priors.shared(sizes, effects, self.held)
        return np.array([self.place[int(k)] for k in free], dtype=np.intp), self._tightness * root

    def energy(self, sizes: Sizes, effects: Sequence[str], point: Point) -> float:
        """Squared distance of a point from the prior means, in deviations of the priors."""
        return self.priors.energy(sizes, effects, point, self.held)

    def _summed(
        self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None
    ) -> tuple[Array, float, Indices, Array]:
        grams, base = self.integrated(sizes)
        which = slice(None) if trials is None else list(trials)
        at, root = self.shared_root(sizes, effects)
        return grams[which].sum(axis=0), float(base[which].sum()), at, root


class KeptLikelihood(SharedLikelihood):
    """What is kept of a likelihood at its optimum: it answers for the sizes that it was kept with, of any trials.

    Each trial's own columns, most of them, and those of each channel would take many times its memory, in every
    hypothesis that was fitted.
    """

    def __init__(self, of: SharedLikelihood, sizes: Sizes) -> None:
        super().__init__(of.problem, of.columns, of.priors, of._offset)
        self.held, self._charge = of.held, of._charge
        self._key, (self._grams, self._base) = sizes.without_terms, of.integrated(sizes)

    def integrated(self, sizes: Sizes) -> tuple[Array, Array]:
        """See the class. Raises ValueError where it is asked for other sizes."""
        if sizes.without_terms != self._key:
            raise ValueError("a likelihood that is kept answers for its own sizes alone")
        return self._grams, self._base
