"""Which of several named effects help on trials that were left out.

Beside something unnamed an effect can take up a part of that for a while. What it takes up so in one trial does not
help to predict another. So each trial in turn is left out, and of each effect is asked how much more probable the trial
is with it than without, everything else fitted to the other trials. About each fit the model is taken as linear.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import ttest_1samp

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.problem import GapProblem

_CHANCE = 0.05
"""Probability with which an effect without use may seem to help (one-sided t-test over trials)."""


def lasting(found: Search, effects: tuple[str, ...]) -> tuple[str, ...]:
    """The effects that help on trials left out, beside those that do too; the worst goes first."""
    kept = tuple(sorted(effects))
    while kept:
        whole = _fitted(found, kept, found.base.x)
        with_all = predictive(found.problem, whole)
        gains = {}
        for name in kept:
            rest = _fitted(found, tuple(other for other in kept if other != name), whole.x)
            gains[name] = with_all - predictive(found.problem, rest)
        bad = {name: float(gain.sum()) for name, gain in gains.items() if not _helps(gain)}
        if not bad:
            break
        worst = min(bad, key=lambda name: bad[name])
        kept = tuple(name for name in kept if name != worst)
    return kept


def _helps(gain: Array) -> bool:
    if len(gain) < 2 or not float(gain.sum()) > 0.0:
        return False
    return bool(ttest_1samp(gain, 0.0, alternative="greater").pvalue < _CHANCE)


def _fitted(found: Search, key: tuple[str, ...], near: Array) -> Fit:
    if key not in found.fits:
        found.fits[key] = fit(found.problem, key, found.floor, near)
    return found.fits[key]


def predictive(problem: GapProblem, at: Fit) -> Array:
    """Log-probability (trials,) of each trial given all others, up to what is the same for every hypothesis."""
    whole = _evidence(problem, at, np.ones(problem.rows, dtype=bool))
    return np.array([whole - _evidence(problem, at, problem.trial_of != k) for k in range(len(problem.trials))])


def _evidence(problem: GapProblem, at: Fit, rows: Array) -> float:
    """Log marginal likelihood of these rows, the model linear about a fit."""
    A, e = at.linear.slopes[rows], at.linear.errors[rows]
    sd = problem.sd[at.active]
    moved = (at.x[at.active] - problem.mean[at.active]) / sd
    H = (A.T @ A) * np.outer(sd, sd) + np.eye(len(sd))
    slope = (A.T @ e) * sd + moved
    factor = cho_factor(H)
    fall = 0.5 * float(slope @ cho_solve(factor, slope))
    return fall - 0.5 * float(e @ e + moved @ moved) - float(np.log(np.diag(factor[0])).sum())
