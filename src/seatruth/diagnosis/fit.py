"""Fits under priors, and how much the data speak for one hypothesis over another.

A fit is the most probable x of a hypothesis (Gauss-Newton with Levenberg-Marquardt damping on whitened residuals and
priors). Its evidence is Laplace's approximation of the marginal likelihood,

    log p(data | hypothesis) = -1/2 |e|^2 - 1/2 |(x - mean)/sd|^2 - 1/2 log det(I + P G) + constant,

with G = A'A of the whitened derivatives A and P the priors' covariance: what each hypothesis could have explained
counts against it. Of effects P is averaged over scales (`scales.py`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.evidence import of_posterior, scale_gain
from seatruth.diagnosis.noise import NoiseFloor
from seatruth.diagnosis.problem import GapProblem, Linear

_STEPS = 25
_TRIED = 3
"""Steps after which a fit may be broken off,"""
_HOPE = 10.0
"""if so many times its last fall would not bring it"""
_BEHIND = 60.0
"""to within so much of the rival's cost."""
_FIRST_DAMPING = 1e-3
_SETTLED = 0.03
"""Expected fall of the cost below which a fit has settled."""
_AHEAD = 0.1
"""Part of a step at which its bend is looked at."""
_BEND = 1.5
"""Second-order part of a step, in multiples of the first, up to which it is taken."""
_STUCK = 1e3
"""Damping from which a fit that finds no better point has not settled but is stuck."""
_LARGEST = 1e12
"""Whitened derivative from which a run is about to diverge: nothing can be built on such a fit."""


@dataclass(frozen=True)
class Fit:
    """The most probable x of a hypothesis; `cost` is minus its log-posterior up to a constant of the problem."""

    effects: tuple[str, ...]
    x: Array
    active: Indices
    cost: float
    evidence: float
    linear: Linear
    covariance: Array
    """Of the active entries, (n, n)."""
    settled: bool

    @property
    def misfit(self) -> float:
        """Sum of squares of the whitened errors."""
        return float(self.linear.errors @ self.linear.errors)

    def stderr(self, problem: GapProblem) -> Array:
        """Posterior deviation of every entry of x (K,); 0 for what the hypothesis holds fixed."""
        found = np.zeros(problem.size)
        found[self.active] = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return found


def fit(
    problem: GapProblem,
    effects: Sequence[str],
    floor: NoiseFloor,
    x: Array,
    *,
    steps: int = _STEPS,
    free: Indices | None = None,
    without: int | None = None,
    rival: float = np.inf,
    settled_at: float = _SETTLED,
) -> Fit:
    """Fits a hypothesis from x; what it does not free stands at the start of the problem.

    `free` names the columns instead of the hypothesis (the initial states alone, say). `without` leaves the data of
    one trial out, by its number. A fit that cannot come near the cost of a `rival` any more is broken off; one whose
    cost falls by less than `settled_at` has settled.
    """
    active = problem.active(effects) if free is None else free
    base = problem.start
    now = base.copy()
    now[active] = np.clip(x[active], problem.low[active], problem.high[active])
    weight = 1.0 / problem.sd[active] ** 2
    mean = problem.mean[active]
    linear = problem.linear(now, floor, active, without)
    if not np.isfinite(linear.errors).all():
        now = base.copy()
        linear = problem.linear(now, floor, active, without)
    cost = _cost(linear.errors, now[active], mean, weight)
    damping, settled = _FIRST_DAMPING, False
    for number in range(steps):
        if not np.isfinite(cost):
            break
        A = linear.slopes
        if not np.abs(A).max(initial=0.0) < _LARGEST:
            break
        G = A.T @ A + np.diag(weight)
        slope = A.T @ linear.errors + weight * (now[active] - mean)
        moved = False
        # What presses against a bound stays there; the others move as if it were fixed.
        low, high = problem.low[active], problem.high[active]
        free_now = ~(((now[active] <= low) & (slope > 0)) | ((now[active] >= high) & (slope < 0)))
        at = np.ix_(free_now, free_now)
        while damping < 1e9:
            solve = _solver(G[at] + damping * np.diag(weight[free_now]))
            step = np.zeros(len(active))
            step[free_now] = solve(-slope[free_now])
            if -float(slope @ step) < settled_at:
                break
            # Along a valley that bends the step is bent with it; where it bends too much, nothing is foretold by that.
            bend = _bend(problem, floor, now, active, linear, step, without)
            bent = np.zeros(len(active))
            bent[free_now] = solve(-bend[free_now])
            if float(bent @ (weight * bent)) <= _BEND**2 * float(step @ (weight * step)):
                step = step + 0.5 * bent
            trial = now.copy()
            trial[active] = np.clip(now[active] + step, problem.low[active], problem.high[active])
            errors = problem.whitened(trial, floor, active, without)
            found = _cost(errors, trial[active], mean, weight)
            if found < cost:
                moved = True
                break
            damping = max(6.0 * damping, 1e-4)
        if not moved:
            settled = damping < _STUCK
            break
        hopeless = number >= _TRIED and found - _HOPE * (cost - found) > rival + _BEHIND
        fall, now, cost = cost - found, trial, found
        # How well the linear model foretold the fall says how far the next step may go (Nielsen 1999).
        foretold = -float(slope @ step) - 0.5 * float(step @ G @ step)
        ratio = fall / foretold if foretold > 0.0 else 0.0
        damping = min(max(damping * max(1.0 / 5.0, 1.0 - (2.0 * ratio - 1.0) ** 3), 1e-9), 1e3)
        linear = problem.linear(now, floor, active, without)
        if fall < settled_at:
            settled = True
            break
        if hopeless:
            break
    return _fit(problem, tuple(effects), now, active, linear, settled)


def _fit(
    problem: GapProblem, effects: tuple[str, ...], x: Array, active: Indices, linear: Linear, settled: bool
) -> Fit:
    sd, mean = problem.sd[active], problem.mean[active]
    cost = _cost(linear.errors, x[active], mean, 1.0 / sd**2)
    if not np.isfinite(cost) or not np.abs(linear.slopes).max(initial=0.0) < _LARGEST:
        size = len(active)
        return Fit(effects, x, active, np.inf, -np.inf, linear, np.full((size, size), np.nan), False)
    A = linear.slopes
    scaled = np.eye(len(active)) + (A.T @ A) * np.outer(sd, sd)
    values, vectors = np.linalg.eigh(scaled)
    values = np.maximum(values, 1.0)
    covariance = (vectors / values) @ vectors.T * np.outer(sd, sd)
    evidence = -cost - 0.5 * float(np.log(values).sum()) + _scaled(problem, effects, x, active, covariance)
    return Fit(effects, x, active, cost, evidence, linear, covariance, settled)


def _scaled(problem: GapProblem, effects: Sequence[str], x: Array, active: Indices, covariance: Array) -> float:
    """What the unknown order of the effects' magnitudes adds to the log-evidence."""
    columns = [problem.columns[name] for name in effects]
    if not columns:
        return 0.0
    own = np.concatenate(columns)
    at = np.searchsorted(active, own)
    ends = np.cumsum([0, *(len(one) for one in columns)])
    groups = [np.arange(a, b, dtype=np.intp) for a, b in itertools.pairwise(ends)]
    return of_posterior(covariance[np.ix_(at, at)], x[own] - problem.mean[own], problem.sd[own], groups)


def _cost(errors: Array, x: Array, mean: Array, weight: Array) -> float:
    if not np.isfinite(errors).all():
        return np.inf
    return 0.5 * float(errors @ errors) + 0.5 * float(((x - mean) ** 2 * weight).sum())


def _bend(
    problem: GapProblem, floor: NoiseFloor, x: Array, active: Indices, linear: Linear, step: Array, without: int | None
) -> Array:
    """What the second derivative of the errors along a step adds to the slope (n,), by one more simulation; zero where
    that diverges."""
    ahead = x.copy()
    ahead[active] += _AHEAD * step
    errors = problem.whitened(ahead, floor, active, without)
    with np.errstate(invalid="ignore", over="ignore"):
        second = (errors - linear.errors - _AHEAD * (linear.slopes @ step)) * (2.0 / _AHEAD**2)
        found = linear.slopes.T @ second
    return np.asarray(found if np.isfinite(found).all() else np.zeros(len(active)))


def _solver(matrix: Array) -> Callable[[Array], Array]:
    try:
        factor = cho_factor(matrix)
    except np.linalg.LinAlgError:
        return lambda right: np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-14)[0])
    return lambda right: np.asarray(cho_solve(factor, right))


@dataclass(frozen=True)
class Screen:
    """What columns that are not in a fit would add to it, everything that it frees projected out.

    `information` (n, n) and `slope` (n,) are of the candidate columns; `sd` (n,) their priors' deviations.
    """

    information: Array
    slope: Array
    sd: Array
    columns: Mapping[str, Indices] = field(default_factory=dict)

    def gain(self, *names: str) -> float:
        """Rise of the log-evidence by freeing these candidates together, to first order."""
        at = np.concatenate([self.columns[name] for name in names])
        sd = self.sd[at]
        S = self.information[np.ix_(at, at)] * np.outer(sd, sd) + np.eye(len(at))
        b = self.slope[at] * sd
        values, vectors = np.linalg.eigh(S)
        along = vectors.T @ b
        return 0.5 * float((along**2 / values).sum()) - 0.5 * float(np.log(values).sum())

    def evidence(self, *names: str) -> float:
        """The same where not even the order of the candidates' magnitudes is known."""
        own = [self.columns[name] for name in names]
        at = np.concatenate(own)
        ends = np.cumsum([0, *(len(one) for one in own)])
        groups = [np.arange(a, b, dtype=np.intp) for a, b in itertools.pairwise(ends)]
        return self.gain(*names) + scale_gain(self.information[np.ix_(at, at)], self.slope[at], self.sd[at], groups)

    def score(self, name: str) -> float:
        """Efficient score statistic of a candidate: chi-square with as many degrees of freedom as it has columns."""
        at = self.columns[name]
        return float(self.slope[at] @ np.linalg.pinv(self.information[np.ix_(at, at)], hermitian=True) @ self.slope[at])


def screen(found: Fit, problem: GapProblem, candidates: Mapping[str, Array], sds: Mapping[str, Array]) -> Screen:
    """Candidate columns by name, whitened (rows, n_c), at a fit; `sds` their priors' deviations (n_c,)."""
    A = found.linear.slopes
    H = A.T @ A + np.diag(1.0 / problem.sd[found.active] ** 2)
    C = np.concatenate([candidates[name] for name in candidates], axis=1) if candidates else np.zeros((len(A), 0))
    # Beyond this a column's square overflows; such a candidate makes the run diverge and is worth nothing here.
    C[:, ~(np.abs(C).max(axis=0, initial=0.0) < _LARGEST)] = 0.0
    cross = A.T @ C
    solved = cho_solve(cho_factor(H), cross)
    information = C.T @ C - cross.T @ solved
    # The fit's own slope is zero at its optimum; what is left of it (a bound, few steps) is projected as well.
    own = (
        A.T @ found.linear.errors + (found.x[found.active] - problem.mean[found.active]) / problem.sd[found.active] ** 2
    )
    slope = -(C.T @ found.linear.errors - solved.T @ own)
    columns: dict[str, Indices] = {}
    at = 0
    for name, block in candidates.items():
        columns[name] = np.arange(at, at + block.shape[1], dtype=np.intp)
        at += block.shape[1]
    sd = np.concatenate([sds[name] for name in candidates]) if candidates else np.zeros(0)
    return Screen(0.5 * (information + information.T), slope, sd, columns)


def effect_screen(
    found: Fit, problem: GapProblem, floor: NoiseFloor, starts: Mapping[str, Array] | None = None
) -> Screen:
    """The effects that a fit does not free. `starts` adds pseudo-candidates "name@k": whitened changes (rows,) of the
    errors from the null to a finite starting point, for effects that have no slope at their null."""
    free = set(found.effects)
    slopes = problem.whole(found.x, floor)
    blocks = {n: slopes[:, c] for n, c in problem.columns.items() if n not in free}
    sds = {n: problem.sd[c] for n, c in problem.columns.items() if n not in free}
    for name, change in (starts or {}).items():
        if name.partition("@")[0] not in free:
            blocks[name], sds[name] = change[:, None], np.ones(1)
    return screen(found, problem, blocks, sds)
