"""What the named effects are worth on trials that took no part.

Each trial's part of the marginal likelihood stands apart (`marginal_likelihood.py`), so that the log predictive density
of a trial, given others, is the difference of two sums: log p(these and it) - log p(these). It is averaged over which
and how many others are given, from one to all: what all of them hardly leave open, one or two of them may. With none
given as well, the averages would sum to the marginal likelihood (Fong and Holmes 2020, Biometrika 107, 489); without,
no prior alone predicts anything. Where there is one trial, quarters of it are left out. How far the gap shrinks is
measured on the open-loop errors of each trial with coefficients and effects from all others (`prediction_errors.py`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy.special

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import ensure, without_forces
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.parts import Fold, Validation
from seatruth.diagnosis.posterior import causes_in, counted, log_prior
from seatruth.diagnosis.prediction_errors import PredictionErrors, Simulated, noise_deviation
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.reported_sizes import with_reported_sizes
from seatruth.diagnosis.sections import left_out_together
from seatruth.models.base import whole_name
from seatruth.statistics.ratios import ratio_interval

_BLOCKS = 4
"""Parts of a single trial that are left out in turn. [S] Fewer hold too little, more leave too little out."""
_EXACT = 8
"""Trials up to which all sets of them are taken."""
_ORDERS = 32
"""Random orders of more trials, in each of which every trial is predicted from those before it. [S]"""
_ENUMERATED = 6
"""Trials up to which the bootstrap is enumerated; 2000 draws above."""
_DRAWS = 2000
_CLEARLY = 3.0
"""nats by which discrepancy must raise the evidence to stand beside both: odds of 20."""
_Z = float(scipy.special.ndtri(0.975))
"""Standard deviations to either side that hold 95 % of a normal distribution."""
_MOST_REACH = 5.0
"""Logarithm of a factor from which nothing is known of it: beyond, the interval would overflow. [S]"""
_NO_GAP = 0.005
"""Mean error of the refitted model on trials left out, less the noise, in deviations of the noise, below which there is
no gap to explain. [S]"""


def predictive_gains(search: Search, name: str, key: Key) -> Array:
    """Log predictive density (nats) of each trial, with an effect less without it: (T,) or (blocks,).

    Averaged over the sets of others, of one trial or more, from which it is predicted; summed over their sizes.

    Both hypotheses stand at their own optimum with their own sizes, and both with discrepancy or both without: what is
    asked is what the effect adds, not whether forces of any kind would do as well. They have discrepancy only where
    it is clearly better: beside it the model without the effect follows almost any trial.
    """
    with_it, plain = search.best(key), search.fits.get((key, False))
    if with_it is None:
        return np.zeros(0)
    if plain is not None and plain.evidence > with_it.evidence - _CLEARLY:
        with_it = plain
    rest = tuple(n for n in key if n != name)
    without = ensure(search, rest, with_it) or search.best(rest)
    if without is None:
        return np.zeros(0)
    return _predictive(search.problem, with_it) - _predictive(search.problem, without)


def lower_bound(gains: Array, level: float) -> float:
    """One-sided bound (nats) of the sum of gains by a bootstrap over trials; NaN for none."""
    n = len(gains)
    if not n:
        return math.nan
    if n <= _ENUMERATED:
        draws = np.array(list(itertools.product(range(n), repeat=n)))
    else:
        draws = np.random.default_rng(0).integers(0, n, size=(_DRAWS, n))
    return float(np.quantile(gains[draws].sum(axis=1), level))


def surely_positive(gains: Array, level: float, *, meets_noise: bool) -> bool:
    """Whether the gains (T,) of trials left out, nats, are surely positive, one-sided at this level.

    By a bootstrap over trials, which asks of the models only that trials are alike. They are not where a few of them
    excite what an effect does. Where the model without it meets its noise, so that its densities can be trusted, odds
    decide as well: if the effect did not act, gains of ln(1 / level) or more would have a probability of `level` at
    most (Markov's inequality: their exponentials have a mean of 1 in each order of the trials). They must be reached
    without the trial that gains most.

    Example:
        >>> import numpy as np
        >>> few = np.array([8.0, -1.0, -1.5, 7.0, 2.0, 1.0, -1.0])
        >>> [surely_positive(few, 0.05, meets_noise=meets) for meets in (False, True)]
        [False, True]
        >>> surely_positive(np.array([14.0, -1.0, 1.0, 0.5]), 0.05, meets_noise=True)
        False
    """
    if not len(gains) or lower_bound(gains, level) > 0.0:
        return bool(len(gains))
    return meets_noise and float(gains.sum() - gains.max()) > -math.log(level)


def _predictive(problem: Problem, at: Fit) -> Array:
    """Log predictive density of each trial, or of each block of a single one, given others, as `predictive_gains`."""
    if len(problem.trials) > 1:
        groups = left_out_together(problem.trials)

        def of_trials(given: Sequence[int]) -> float:
            every = sorted(trial for number in given for trial in groups[number])
            return at.likelihood.log_likelihood(at.sizes, at.effects, every)

        return averaged_over_givens(len(groups), of_trials)
    edges = np.quantile(problem.time_of, np.linspace(0.0, 1.0, _BLOCKS + 1))
    block = np.clip(np.searchsorted(edges, problem.time_of, side="right") - 1, 0, _BLOCKS - 1)
    here = at.linearized(problem)

    def of_blocks(given: Sequence[int]) -> float:
        some = Likelihood(problem, here, keep=np.isin(block, list(given)), held=at.likelihood.held)
        return some.log_likelihood(at.sizes, at.effects)

    return averaged_over_givens(_BLOCKS, of_blocks)


def averaged_over_givens(count: int, density: Callable[[Sequence[int]], float]) -> Array:
    """Log predictive density (nats) of each of some parts of the data, given others: (count,).

    Part k gets the mean over the sets of each size of log p(set and k) - log p(set), summed over sizes from one to all
    others, over `count`. So the sum over parts is log p(all) less the mean of what one part has by itself.

    Args:
        count: number of parts, two or more.
        density: log density of a set of parts, given as ascending numbers.

    Example:
        >>> averaged_over_givens(2, lambda given: float(len(given) ** 2)).tolist()
        [1.5, 1.5]
    """
    known: dict[tuple[int, ...], float] = {}

    def log_p(given: frozenset[int]) -> float:
        key = tuple(sorted(given))
        if key not in known:
            known[key] = density(key)
        return known[key]

    found = np.zeros(count)
    if count <= _EXACT:
        for k in range(count):
            rest = [other for other in range(count) if other != k]
            for size in range(1, count):
                sets = [frozenset(chosen) for chosen in itertools.combinations(rest, size)]
                found[k] += float(np.mean([log_p(one | {k}) - log_p(one) for one in sets])) / count
        return found
    rng = np.random.default_rng(0)
    for _ in range(_ORDERS):
        order = rng.permutation(count).tolist()
        for place in range(1, count):
            before = frozenset(order[:place])
            found[order[place]] += (log_p(before | {order[place]}) - log_p(before)) / _ORDERS
    return found


def validate(
    search: Search, shown: Key, say: Callable[[str, int, int], None], *, beside: Key = (), own: bool = False
) -> Validation | None:
    """Predicts each trial from the others, without effects and with those of the answer; None for a single trial.

    Effects have the sizes that they have beside those of `beside`. What the others leave open of a trial is allowed to
    every model alike: also the size that an effect of the answer has in that trial alone. With `own`, only models with
    the effects are allowed that, and what it closes is theirs.
    """
    problem = search.problem
    if len(problem.trials) < 2:
        return None
    refit = Simulated.of(problem, without_forces(search, ()))
    named = Simulated.of(problem, with_reported_sizes(search, shown, search.beside(shown, beside))) if shown else refit
    control = Simulated.of(problem, search.fits.get(((), True), refit.fit), terms=True)
    forced = search.fits.get((shown, True)) if shown else None
    both = control if forced is None else Simulated.of(problem, forced, terms=True)
    # One measure for all: the noise of the refit alone would hold part of the gap, and make its errors look small.
    deviation = noise_deviation(problem, search.leader.sizes)
    groups = left_out_together(problem.trials)
    gains = np.zeros(len(groups))
    for name in shown:
        found = predictive_gains(search, name, shown)
        gains = gains + found if len(found) == len(groups) else gains
    folds = []
    for number, group in enumerate(groups):
        trials = [problem.trials[k] for k in group]
        title = trials[0].name if len(group) == 1 else whole_name(trials[0].name)
        say(f"trial {title} left out", number, len(groups))
        others = [k for k in range(len(problem.trials)) if k not in group]
        models = [named, refit, control, both]
        errors = [_errors_left_out(search, deviation, left, others, models) for left in group]
        if own:
            bare = [_errors_left_out(search, deviation, left, others, [refit, control]) for left in group]
            errors = [[now[0], *one[:2], *now[3:]] for now, one in zip(errors, bare)]
        of = np.sqrt(np.mean(np.square(errors), axis=0)).tolist()
        folds.append(
            Fold(
                title, _selected(search, others),
                error_refit=of[1], error_effects=of[0], error_discrepancy=of[2],
                error_both=math.nan if forced is None else of[3], error_noise=of[4], left_open=of[5],
                predictive_gain=float(gains[number]),
            )
        )  # fmt: skip
    return replace(summary(folds, problem.count), own_sizes=own)


def summary(folds: Sequence[Fold], samples: int) -> Validation:
    """The part of the gap that the effects explain on trials left out, with its interval over trials.

    The noise that the gap stands above is taken to be known as well as these `samples` tell its level, to 1/sqrt(2 N)
    of it. [S] Where the gap is a part of the noise that is much, and it is the same in all trials, whose scatter does
    not show it. In 36 opened cases of `experiments/withheld` (four test sets, 2026-11-26) the interval held the part
    that one who knows the cause closes 26 times without this, 34 times with it.
    """
    refit, named, control, noise = (
        np.array([_known(getattr(fold, f"error_{which}")) for fold in folds])
        for which in ("refit", "effects", "discrepancy", "noise")
    )
    gap = refit - noise
    value = _explained(refit - named, gap)
    low, high = ratio_interval(refit - named, gap) if math.isfinite(value) else (math.nan, math.nan)
    if math.isfinite(low) and math.isfinite(high):
        # The gap's factor is log-normal, so that the sign of what is explained does not depend on it.
        reach = min(_MOST_REACH, _Z * float(noise.sum() / gap.sum()) / math.sqrt(2.0 * samples))
        ends = sorted((value * math.exp(-reach), value * math.exp(reach)))
        low = value - math.hypot(value - low, value - ends[0])
        high = value + math.hypot(high - value, ends[1] - value)
    return Validation(tuple(folds), value, low, high, _explained(refit - control, gap))


def _known(error: float) -> float:
    return error if math.isfinite(error) else math.nan


def _explained(explained: Array, gap: Array) -> float:
    total, whole = float(explained.sum()), float(gap.sum())
    return total / whole if whole > _NO_GAP * len(gap) else math.nan


def _errors_left_out(
    search: Search, deviation: Array, left: int, others: Sequence[int], models: Sequence[Simulated]
) -> list[float]:
    """Errors of one trial predicted from others by some models, what is noise, and what the others leave open.

    What they leave open is that of the first model. All are infinite where the algebra fails.
    """
    try:
        errors = PredictionErrors(search.problem, deviation, left, others, models[0])
        return [*(errors.of(model) for model in models), errors.noise(search.leader), errors.left_open]
    except np.linalg.LinAlgError:
        return [math.inf] * (len(models) + 2)


def _selected(search: Search, trials: Sequence[int]) -> Key:
    """The hypothesis that these trials alone prefer."""
    settings, many = search.problem.settings, len(search.problem.effects)
    keys = list(search.fits)
    found = [search.fits[key] for key in keys]
    gains = np.array([fit.likelihood.evidence(fit.sizes, fit.effects, trials) - fit.price for fit in found])
    alone = [gain for (key, _), gain in zip(keys, gains) if not key]
    weight = counted(search, gains, keys, float(max(alone)))
    weight += [log_prior(causes_in(key, search.problem.effects), on, many, settings) for key, on in keys]
    return max(zip(weight.tolist(), gains.tolist(), (key for key, _ in keys)))[2]
