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
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_solve
from scipy.linalg.blas import dtrsm

from seatruth.arrays import Array, Flags, Indices
from seatruth.diagnosis.evidence import scale_gain
from seatruth.diagnosis.gram_matrices import GramMatrices
from seatruth.diagnosis.prior_roots import LocalRoot, PriorRoots
from seatruth.diagnosis.problem import Linearization, Point, Problem
from seatruth.diagnosis.sizes import Sizes
from seatruth.diagnosis.triangular import backward, forward, inverse
from seatruth.diagnosis.unknowns import Posterior, Solution

_LARGEST_SQUARE = 1e13
"""Sum of squared whitened errors at the prior means from which rounding (1e-16 of it) could decide between answers."""
_ROUNDED = 0.01
"""nats by which a sum of squares may come out negative: what one is wrong by that decides nothing."""
_ROUNDING = 1e-14
"""Part by which rounding may change an entry of a Gram matrix: 50 units in the last place, of thousands of summands. It
changed the evidence by 1e-5 nats at most in usual studies, and by millions where a tank's liquid made runs diverge."""
_LEAST_INFORMATION = 0.5
"""Least eigenvalue of information and prior together, over the prior's, below which rounding has made it negative."""
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


class Likelihood:
    """Marginal likelihoods of hypotheses at one linearization; its columns are those of the effects in it.

    Terms and forces take part where it has their derivatives. `keep` (N,) says which errors count; all where None.
    `held` are shared unknowns that stay where the point has them, though the hypothesis has them.
    """

    def __init__(
        self, problem: Problem, at: Linearization, keep: Flags | None = None, held: Sequence[int] = ()
    ) -> None:
        self.problem, self.point, self.errors, self.held = problem, at.point, at.errors, tuple(held)
        self._at: Linearization | None = at
        self.columns = problem.active(at.effects, discrepancy=at.discrepancy)
        self.place = {int(column): k for k, column in enumerate(self.columns)}
        self.priors = PriorRoots(problem)
        own_columns = self.priors.over_knots(at.local, self.priors.time)
        self._locals = at.local.shape[1]
        self.grams = GramMatrices(problem, at.errors, at.shared[:, self.columns], own_columns, keep)
        self._last_gram: tuple[tuple[bytes, tuple[int, ...]], Array, Array] | None = None
        self._last_reduced: tuple[bytes, _Reduced] | None = None
        # Gram matrices are taken with errors at the prior means of everything that is not held.
        self._offset = (problem.mean - at.point.shared)[self.columns]
        own = [self.place[k] for k in self.held]
        self._charge = 0.5 * float(((self._offset[own] / problem.sd[list(self.held)]) ** 2).sum())
        self._offset[own] = 0.0
        self._local_offset = self.priors.added(problem.local_offset(at.point)[:, : self._locals])
        self._tightness = 1.0

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

    def without_priors_pull(self, errors: Array) -> Likelihood:
        """The same with other errors (N,), which no prior draws anywhere. For `solve` alone."""
        if self._at is None:
            raise ValueError("a closed likelihood has no derivatives left")
        found = Likelihood(self.problem, replace(self._at, errors=errors), held=self.held)
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

    def close(self, sizes: Sizes) -> None:
        """Frees the memory of everything but these sizes' noise: nothing else can be asked for then."""
        self._at = None
        self.grams.close(sizes)
        self._last_gram = self._last_reduced = None

    # Evidence

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

    def solve(self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None = None) -> Solution:
        """The most probable step from the point. Raises LinAlgError where the algebra fails."""
        gram, _, at, root = self._summed(sizes, effects, trials)
        reduced = self._reduce(sizes)
        factor: Array = np.asarray(np.linalg.cholesky(np.eye(len(at)) + root.T @ gram[np.ix_(1 + at, 1 + at)] @ root))
        own = np.zeros(len(self.columns))
        own[at] = -root @ cho_solve((factor, True), root.T @ gram[1 + at, 0], check_finite=False)
        if not np.isfinite(own).all():
            raise np.linalg.LinAlgError("the most probable step is not finite")
        shared = np.zeros(len(self.problem.unknowns))
        shared[self.columns] = self._offset + own
        local = self.priors.over_knots(self._local_place(sizes, self._scaled_local(reduced, own)), self.priors.time.T)
        half = forward(factor, root.T)
        return Solution(shared, local, self.columns[at], half.T @ half)

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

    def shared_root(self, sizes: Sizes, effects: Sequence[str]) -> tuple[Indices, Array]:
        """Which columns (k,) a hypothesis frees, and a square root (k, k) of their prior covariance."""
        free, root = self.priors.shared(sizes, effects, self.held)
        return np.array([self.place[int(k)] for k in free], dtype=np.intp), self._tightness * root

    def local_root(self, sizes: Sizes) -> LocalRoot:
        """A square root of the prior covariance of a trial's own unknowns, or of its initial states alone."""
        root = self.priors.local(sizes, forces=self._locals > len(self.problem.initial_names))
        return LocalRoot(self._tightness * root.initial, self._tightness * root.equations, root.knots)

    def energy(self, sizes: Sizes, effects: Sequence[str], point: Point) -> float:
        """Squared distance of a point from the prior means, in deviations of the priors."""
        return self.priors.energy(sizes, effects, point, self.held)

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

    def _reduce(self, sizes: Sizes) -> _Reduced:
        key = b"".join((sizes.white.tobytes(), bytes(sizes.shape), sizes.forces.tobytes(), sizes.coupling.tobytes()))
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

    def _summed(
        self, sizes: Sizes, effects: Sequence[str], trials: Sequence[int] | None
    ) -> tuple[Array, float, Indices, Array]:
        reduced = self._reduce(sizes)
        which = slice(None) if trials is None else list(trials)
        at, root = self.shared_root(sizes, effects)
        return reduced.grams[which].sum(axis=0), float(reduced.base[which].sum()), at, root
