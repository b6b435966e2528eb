"""The marginal likelihood of a hypothesis: effects compete with noise and with model discrepancy on equal terms.

Around a point the errors of all channels are, to first order,

    e = J_coefficients a + J_effects q + J_terms d + J_local f + noise,

normal in everything: coefficients a and effect parameters q under their priors, discrepancy terms d and each trial's own
forces f of sizes that the trials decide, initial states as good as unknown, noise white plus slow in each channel. The
unknowns are integrated out in closed form (Gaussian elimination on Gram matrices of whitened columns); the sizes
are those that maximise what is left, times their priors: restricted maximum likelihood (Patterson and Thompson 1971),
type-II maximum likelihood.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import cho_solve

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.linear_problem import KNOTS, Linearization, Problem
from seatruth.statistics.state_space_noise import NoiseShape, whiten

RATIOS = (0.3, 0.6, 1.0, 1.7, 3.0, 6.0)
TIMES = (1.0, 3.0, 10.0, 30.0, 60.0)
SHAPES: tuple[NoiseShape, ...] = (NoiseShape(), *(NoiseShape(r, t) for r in RATIOS for t in TIMES))
PAIRS = (("v", "r"), ("w", "q"), ("v", "p"), ("v_z", "omega_y"), ("v_y", "omega_z"))
FORCE_MEMORY = 1.5
SMALLEST = 1e-4


@dataclass(frozen=True)
class Sizes:
    """Sizes of noise and discrepancy.

    `white` (C,) log of the white standard deviations, `shape` (C,) numbers of `SHAPES`; `terms` and `forces` (E,) logs
    of the discrepancy as a part of the usual acceleration, -inf for none; `coupling` of pairs of equations, -1 to 1.
    """

    white: Array
    shape: tuple[int, ...]
    terms: Array
    forces: Array
    coupling: Array


class Grams:
    """Gram matrices of the whitened columns of a linearization: [errors, shared, local], by trial and channel."""

    def __init__(self, problem: Problem, at: Linearization, shared: Indices) -> None:
        self.problem, self.at, self.kept = problem, at, shared
        self._known: dict[tuple[int, int], tuple[Array, Array]] = {}
        T, C = len(problem.trials), len(problem.outputs)
        self.counts = np.zeros((T, C))
        self.columns: dict[tuple[int, int], tuple[Array, Array]] = {}
        for one in problem.series:
            block = np.concatenate([at.errors[one.rows, None], at.shared[np.ix_(one.rows, shared)], at.local[one.rows]], axis=1)
            self.columns[one.trial, one.channel] = (block, one.t)
            self.counts[one.trial, one.channel] = len(one.rows)
        self.size = 1 + len(shared) + problem.local_size
        self.per_channel = self.counts.sum(axis=0)

    def of(self, channel: int, shape: int) -> tuple[Array, Array]:
        """(T, m, m) Gram matrices of one channel under one shape of noise, and log-determinants (T,)."""
        key = channel, shape
        if key not in self._known:
            T = len(self.problem.trials)
            grams, logs = np.zeros((T, self.size, self.size)), np.zeros(T)
            for (trial, which), (block, t) in self.columns.items():
                if which == channel:
                    white, logs[trial] = whiten(block, t, SHAPES[shape])
                    grams[trial] = white.T @ white
            self._known[key] = grams, logs
        return self._known[key]


@dataclass(frozen=True)
class Solution:
    """What the marginal likelihood of one hypothesis gives at some sizes, linearized."""

    log_likelihood: float
    shared: Array
    """Most probable step of all shared unknowns (S,)."""
    local: Array
    """(T, L)."""
    covariance: Array
    """Posterior covariance (k, k) of the free shared unknowns `free`."""
    free: Indices
    """Columns (k,) among the shared ones."""


class Likelihood:
    """Marginal likelihoods at one linearization. `effects` are those whose columns any hypothesis may free."""

    def __init__(self, problem: Problem, at: Linearization, effects: Sequence[str], trials: Sequence[int] | None = None) -> None:
        self.problem, self.at = problem, at
        own = [c for name in effects for c in problem.columns[name]]
        self.shared = np.array([*problem.coefficients, *problem.terms, *own], dtype=np.intp)
        self.grams = Grams(problem, at, self.shared)
        self.place = {int(c): k for k, c in enumerate(self.shared)}
        self.E = len(problem.equations)
        self.pairs = [
            (problem.equations.index(a), problem.equations.index(b)) for a, b in PAIRS if a in problem.equations and b in problem.equations
        ]
        x = at.point.x[problem.shared[self.shared]]
        self.offset = problem.mean[problem.shared[self.shared]] - x
        self.offset[len(problem.coefficients) : len(problem.coefficients) + len(problem.terms)] *= 1.0
        self.prior_sd = problem.sd[problem.shared[self.shared]]
        self.local_offset = problem.local_mean(at.point)
        self.trials = list(range(len(problem.trials))) if trials is None else list(trials)
        k = np.arange(KNOTS)
        corr = np.exp(-np.abs(k[:, None] - k) / FORCE_MEMORY)
        self.time_root = np.linalg.cholesky(corr + 1e-9 * np.eye(KNOTS))
        self._whole: tuple[tuple[object, ...], Array, float] | None = None

    def _equation_root(self, log_sizes: Array, coupling: Array) -> Array:
        """Cholesky factor (E, E) of the covariance of missing accelerations between equations."""
        d = np.where(np.isfinite(log_sizes), np.exp(log_sizes), 0.0) * self.problem.usual
        C = np.eye(self.E)
        for (a, b), value in zip(self.pairs, coupling):
            C[a, b] = C[b, a] = value
        return d[:, None] * np.linalg.cholesky(C + 1e-9 * np.eye(self.E)) if self.E else np.zeros((0, 0))

    def _gram(self, sizes: Sizes) -> tuple[Array, float]:
        """(T, m, m) whitened Gram of all columns with the errors shifted to the prior means, and the noise's log-likelihood part."""
        key = (sizes.white.tobytes(), sizes.shape)
        if self._whole is not None and self._whole[0] == key:
            return self._whole[1], self._whole[2]
        total, log_noise = np.zeros((len(self.problem.trials), self.grams.size, self.grams.size)), 0.0
        for c, shape in enumerate(sizes.shape):
            if self.grams.per_channel[c]:
                grams, logs = self.grams.of(c, shape)
                total += grams * math.exp(-2.0 * sizes.white[c])
                for t in self.trials:
                    log_noise += 0.5 * float(logs[t]) + self.grams.counts[t, c] * float(sizes.white[c])
        # errors at the prior means: e + J offset
        T = total.shape[0]
        shift = np.zeros((T, self.grams.size, 1))
        shift[:, 0] = 1.0
        S = len(self.shared)
        shift[:, 1 : 1 + S, 0] = self.offset
        shift[:, 1 + S :, 0] = self.local_offset
        column = (total @ shift)[:, :, 0]
        square = np.einsum("ti,ti->t", shift[:, :, 0], column)
        total = total.copy()
        total[:, 0, :] = column
        total[:, :, 0] = column
        total[:, 0, 0] = square
        self._whole = (key, total, log_noise)
        return total, log_noise

    def reduced(self, sizes: Sizes) -> tuple[Array, float, tuple[Array, ...]]:
        """The Gram (1 + S, 1 + S) after the local unknowns are integrated out, summed over trials, and the log-likelihood of noise."""
        total, log_noise = self._gram(sizes)
        S, problem = len(self.shared), self.problem
        count = problem.initial_columns.shape[1]
        root = np.zeros((problem.local_size, problem.local_size))
        if self.E:
            # forces are laid out equation by equation: kron(equations, knots)
            root[count:, count:] = np.kron(self._equation_root(sizes.forces, sizes.coupling), self.time_root)
        sd0 = problem.initial_sd()
        T = len(total)
        roots = np.broadcast_to(root, (T, *root.shape)).copy()
        for j in range(count):
            roots[:, j, j] = sd0[:, j]
        rootsT = roots.transpose(0, 2, 1)
        G_ll = rootsT @ total[:, 1 + S :, 1 + S :] @ roots
        G_ls = rootsT @ total[:, 1 + S :, : 1 + S]
        A = G_ll + np.eye(problem.local_size)
        factor = np.linalg.cholesky(A)
        half = np.linalg.solve(factor, G_ls)
        left = total[:, : 1 + S, : 1 + S] - half.transpose(0, 2, 1) @ half
        logdet = 2.0 * np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
        trials = self.trials
        summed = left[trials].sum(axis=0)
        return summed, -log_noise - 0.5 * float(logdet[trials].sum()), (roots, factor, half)

    def shared_root(self, sizes: Sizes, effects: Sequence[str], scale: float = 1.0) -> tuple[Indices, Array]:
        """Columns that a hypothesis frees (k,) among `shared`, and the root (k, k) of their prior covariance."""
        problem = self.problem
        n, m = len(problem.coefficients), len(problem.terms)
        own = [self.place[int(c)] for name in effects for c in problem.columns[name]]
        on = self.E > 0 and bool(np.isfinite(sizes.terms).any())
        at = np.array([*range(n), *(range(n, n + m) if on else ()), *own], dtype=np.intp)
        root = np.diag(self.prior_sd[at])
        for k in range(len(own)):
            root[len(at) - 1 - k, len(at) - 1 - k] *= scale
        if on:
            equation = self._equation_root(sizes.terms, sizes.coupling)
            block = np.zeros((m, m))
            texts = [t.text for t in problem.discrepancy.terms] if problem.discrepancy else []
            for i in range(m):
                for j in range(m):
                    if texts[i] == texts[j]:
                        block[i, j] = equation[problem.term_equation[i], problem.term_equation[j]]
            root[n : n + m, n : n + m] = block
        return at, root

    def log_likelihood(self, sizes: Sizes, effects: Sequence[str]) -> float:
        """Of the trials under a hypothesis, at these sizes, the unknowns integrated out."""
        try:
            gram, base, _ = self.reduced(sizes)
            at, root = self.shared_root(sizes, effects)
            A = np.eye(len(at)) + root.T @ gram[np.ix_(1 + at, 1 + at)] @ root
            factor = np.linalg.cholesky(A)
            half = np.linalg.solve(factor, root.T @ gram[1 + at, 0])
        except np.linalg.LinAlgError:
            return -math.inf
        total = self.grams.counts[self.trials].sum()
        return base - float(np.log(np.diag(factor)).sum()) - 0.5 * float(gram[0, 0] - half @ half) - 0.5 * total * math.log(2 * math.pi)

    def solve(self, sizes: Sizes, effects: Sequence[str]) -> Solution:
        """The most probable step from the point, and the posterior covariance."""
        gram, _, (roots, factor, half) = self.reduced(sizes)
        at, root = self.shared_root(sizes, effects)
        A = np.eye(len(at)) + root.T @ gram[np.ix_(1 + at, 1 + at)] @ root
        L = np.linalg.cholesky(A)
        xi = -cho_solve((L, True), root.T @ gram[1 + at, 0])
        move = root @ xi
        shared = np.zeros(len(self.shared))
        shared[at] = move
        step = self.offset.copy()
        free = np.zeros(len(self.shared), dtype=bool)
        free[at] = True
        step = np.where(free, self.offset + shared, self.offset)
        # local: roots (I + G)^-1 applied to -(G_le + G_ls move)
        vector = np.concatenate([[1.0], shared])
        right = -(half @ vector)
        local = np.linalg.solve(factor.transpose(0, 2, 1), right[:, :, None])[:, :, 0]
        local = (roots @ local[:, :, None])[:, :, 0] + self.local_offset
        full = np.zeros(len(self.problem.shared))
        full[self.shared] = step
        half_root = np.linalg.solve(L, root.T)
        return Solution(self.log_likelihood(sizes, effects), full, local, half_root.T @ half_root, self.shared[at])


def log_prior(problem: Problem, sizes: Sizes, stated: Mapping[int, float], least: Mapping[int, float]) -> float:
    """Logarithm of the prior density of sizes, up to a constant."""
    found = 0.0
    for c, log_white in enumerate(sizes.white):
        if c in stated:
            found -= 0.5 * ((log_white - math.log(stated[c])) / 0.15) ** 2
        if c in least and log_white < math.log(least[c]):
            found -= 1e6 * (math.log(least[c]) - log_white)
        found += math.log(0.5) if sizes.shape[c] == 0 else math.log(0.5 / (len(SHAPES) - 1))
    for values in (sizes.terms, sizes.forces):
        for v in values:
            if np.isfinite(v):
                found -= 50.0 * (max(v - math.log(1.0), 0.0) ** 2 + max(math.log(SMALLEST) - v, 0.0) ** 2)
    for c in sizes.coupling:
        found += math.log(max(1.0 - float(c) ** 2, 1e-12))
    return found


def maximised(
    f: Callable[[Sizes], float], sizes: Sizes, channels: Sequence[int], discrepancy: bool, sweeps: int = 3, noise: bool = True
) -> tuple[Sizes, float]:
    """Coordinate ascent over sizes: parabolic steps in logs, shapes to neighbours of the grid."""
    best, value = sizes, f(sizes)
    step = {("white", c): 0.2 for c in channels}
    for sweep in range(sweeps):
        before = value
        if noise:
            for c in channels:
                best, value = _along(f, best, value, lambda v, s, c=c: _set(s, "white", c, v), float(best.white[c]), 0.15 if sweep else 0.4)
                best, value = _shape(f, best, value, c)
        if discrepancy:
            for part in ("terms", "forces"):
                for e in range(len(best.terms)):
                    here = float(getattr(best, part)[e])
                    best, value = _along(f, best, value, lambda v, s, part=part, e=e: _set(s, part, e, v), here, 0.4 if sweep else 1.2)
            for k in range(len(best.coupling)):
                here = math.atanh(float(best.coupling[k]))
                best, value = _along(f, best, value, lambda v, s, k=k: _set(s, "coupling", k, math.tanh(v)), here, 0.4)
        if value < before + 0.1:
            break
    return best, value


def _set(sizes: Sizes, part: str, k: int, value: float) -> Sizes:
    new = getattr(sizes, part).copy()
    new[k] = value
    return replace(sizes, **{part: new})


def _along(f: Callable[[Sizes], float], best: Sizes, value: float, at: Callable[[float, Sizes], Sizes], here: float, h: float) -> tuple[Sizes, float]:
    left, right = at(here - h, best), at(here + h, best)
    a, b = f(left), f(right)
    top = max((value, best), (a, left), (b, right), key=lambda e: e[0])
    curvature = a + b - 2.0 * value
    if curvature < 0.0:
        move = 0.5 * h * (a - b) / curvature
        if abs(move) < 3.0 * h:
            mid = at(here + move, best)
            c = f(mid)
            if c > top[0]:
                top = (c, mid)
    return top[1], top[0]


def _shape(f: Callable[[Sizes], float], best: Sizes, value: float, c: int) -> tuple[Sizes, float]:
    now = best.shape[c]
    n = len(TIMES)
    if now == 0:
        options = [1 + r * n + t for r in (1, 3) for t in (1, 3)]
    else:
        r, t = divmod(now - 1, n)
        options = [1 + (r + dr) * n + (t + dt) for dr, dt in ((0, 1), (0, -1), (1, 0), (-1, 0)) if 0 <= r + dr < len(RATIOS) and 0 <= t + dt < n]
        options.append(0)
    for option in options:
        shape = list(best.shape)
        shape[c] = option
        white = best.white.copy()
        old, new = SHAPES[best.shape[c]], SHAPES[option]
        for keep in (True, False):
            w = white.copy()
            if not keep:
                w[c] += 0.5 * math.log((1 + old.ratio**2) / (1 + new.ratio**2))
            trial = replace(best, shape=tuple(shape), white=w)
            found = f(trial)
            if found > value + 1e-9:
                best, value = trial, found
                break
    return best, value
