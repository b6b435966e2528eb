"""Effects that a fit lacks, compared by one linearization: which of them are worth a fit, and where each begins."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import HOPE, Key, Search
from seatruth.diagnosis.hypothesis_fits import PARTS
from seatruth.diagnosis.initial_guess import moved_to, started, starting
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.posterior import SENSOR
from seatruth.diagnosis.problem import Linearization, Point, Problem
from seatruth.diagnosis.sensor_channels import sensor_channels
from seatruth.diagnosis.size_search import with_shape
from seatruth.diagnosis.sizes import Sizes, log_prior, proposed_shapes
from seatruth.diagnosis.steps import linear_errors, objective
from seatruth.diagnosis.wave_search import wave_starts
from seatruth.effects.causes import is_within
from seatruth.effects.each_trial import EachTrial

_MAGNITUDES = (1.0, 2.5)
"""Magnitudes from which such an effect is tried, over its typical one: that, and the deviation of its prior."""

_WHOLE = 0.25
"""Part of the way to its whole from which an effect that acts wholly or not at all is fitted. [S] Half of what its fit
must reach: what is linearized falls short."""


_MORE = 0.5
"""nats by which an effect must promise more from its start than at its null, and than the fit without it, to be
linearized there in full. [S] Half of what makes a larger set worth fitting."""
_STEP = 1e-4
"""Step of a difference, over the deviation of a prior: differences of doubles keep eight digits by it."""


def screen(found: Search, at: Fit) -> list[str]:
    """Effects that are not in a fit, in the order of the linearized evidence of it with each of them."""
    problem, settings = found.problem, found.problem.settings
    others = [name for name, effect in problem.effects.items() if name not in at.effects and not effect.each_trial]
    how = "with" if at.discrepancy else "without"
    beside_it = f"{found.scope} beside {'+'.join(at.effects)}"
    name = f"screen {how} discrepancy over {settings.knots} knots, {beside_it}"
    stored = found.store.get(name)
    if stored is not None:
        for other, (plain, loose, start) in stored.items():
            if start:
                found.starts[other] = np.array(start)
            found.screened[tuple(sorted((*at.effects, other))), False] = float(plain)
            found.screened[tuple(sorted((*at.effects, other))), True] = float(loose)
        return _ranked(found, at, others)
    here = problem.linearize(at.point, (*at.effects, *others), discrepancy=at.discrepancy)
    likelihood = Likelihood(problem, here)
    bare = at.sizes.without_discrepancy()
    shrunk = [at.sizes.shrunk(part) for part in PARTS] if at.discrepancy else []
    # Size by size, since what takes time does not depend on the effect.
    loose_scores = dict.fromkeys(others, -math.inf)
    for sizes in shrunk:
        for other in others:
            value = _judged(found, likelihood, here, sizes, (*at.effects, other)) - at.price
            loose_scores[other] = max(loose_scores[other], value)
    plain_scores = {other: _judged(found, likelihood, here, bare, (*at.effects, other)) for other in others}
    whole = {other for other in others if _may_be_whole(found, at, likelihood, [bare, at.sizes], other)}
    del here, likelihood  # as large as what is linearized next
    alone = _alone(found, at, others)
    known = {other: found.starts[other] for other in others if other in found.starts}
    begun = known | _ordered_starts(found, at, [other for other in others if other not in known])
    promised = _promised(found, at, {other: chosen[0] for other, chosen in begun.items()}, bare)
    scores: dict[str, tuple[float, float, list[list[float]]]] = {}
    for other in others:
        key, loose, plain = (*at.effects, other), loose_scores[other], plain_scores[other]
        if other in begun:
            chosen, from_there = begun[other], promised.get(other)
            if from_there is None or max(from_there) > max(plain, loose, at.evidence) + _MORE:
                from_there = _score_from(found, at, key, other, chosen[0], bare)
            # Where it has no slope at its null, what is linearized there says nothing of it.
            if problem.effects[other].starts or max(from_there) > max(plain, loose):
                found.starts[other] = chosen
            plain, loose = max(plain, from_there[0]), max(loose, from_there[1])
        plain = max(plain, alone.get(other, -math.inf))
        if other not in whole:
            plain = loose = -math.inf
        scores[other] = plain, loose, found.starts[other].tolist() if other in found.starts else []
        found.screened[tuple(sorted(key)), False] = plain
        found.screened[tuple(sorted(key)), True] = loose
    found.store.put(name, scores)
    return _ranked(found, at, others)


def _may_be_whole(found: Search, at: Fit, likelihood: Likelihood, sizes: Sequence[Sizes], name: str) -> bool:
    """Whether an effect beside a fit, if it acts wholly or not at all, may do so: where one linearized step leads it.

    Beside the model alone also where the whole effect, with everything else one step further, is better than none: runs
    of a vehicle whose orders are exchanged are far from the model's, where slopes at the null say nothing. Beside other
    effects it is asked for only if it was fitted alone: what acts wholly is seen first of all.
    """
    problem, key = found.problem, (*at.effects, name)
    if not problem.effects[name].wholly:
        return True
    if at.effects and found.best((name,)) is None:
        return False
    columns = problem.columns[name]
    steps = [likelihood.solve(one, key).shared[columns] for one in sizes]
    if any(problem.nearly_whole(name, likelihood.point.shared[columns] + step, _WHOLE) for step in steps):
        return True
    plain = found.fits.get(((), False))
    if at.effects or plain is None:
        return False
    whole = moved_to(problem, plain.point, name, np.array([q.value for q in problem.effects[name].parameters]))
    there = problem.linearize(whole, key, discrepancy=False)
    if not np.isfinite(there.errors).all():
        return False
    held = Likelihood(problem, there, held=columns.tolist())
    return held.evidence(plain.sizes, key) + log_prior(problem.settings, plain.sizes, found.known) > plain.evidence


def _alone(found: Search, at: Fit, others: Sequence[str]) -> dict[str, float]:
    """Linearized evidence of further effects where a set is fitted without discrepancy, with its noise.

    At a fit with discrepancy the noise is another: its shape may cost many nats where no force is missing. Where the
    set strays from its record without forces, its linearization promises anything. What has no slope at its null
    promises what it brought alone: of play of a rudder and a late log, 4 nats ahead of the log and forces, the play
    promised nothing beside that.
    """
    fit = found.fits.get((at.effects, False))
    if not at.discrepancy or fit is None or fit.evidence < at.evidence - HOPE:
        return {}
    promised, none = beside(found, fit, others), found.fits.get(((), False))
    if at.effects and none is not None:
        for name in others:
            own = found.fits.get(((name,), False))
            if own is not None and found.problem.effects[name].starts:
                promised[name] = max(promised.get(name, -math.inf), fit.evidence + own.evidence - none.evidence)
    return promised


def own_in_each_trial(found: Search, at: Fit) -> list[str]:
    """Effects of their own size in each trial whose linearized evidence is above that of all fits, highest first.

    Values of their own follow whatever differs between trials. They are asked for alone where they explain more than
    anything that is the same in all: those of several days may point anywhere, and have no part in common. Of a ferry
    in winds of 4 to 9 m/s all around the compass one that is the same in all trials explained nothing.
    """
    problem, effects = found.problem, found.problem.effects
    names = [name for name, effect in effects.items() if isinstance(effect, EachTrial)]
    if not names:
        return []
    scores = _alone(found, at, names)
    here = problem.linearize(at.point, (*at.effects, *names), discrepancy=at.discrepancy)
    likelihood = Likelihood(problem, here)
    for sizes in [at.sizes.shrunk(part) for part in PARTS] if at.discrepancy else [at.sizes]:
        for name in names:
            value = _judged(found, likelihood, here, sizes, (*at.effects, name)) - at.price
            scores[name] = max(scores.get(name, -math.inf), value)
    for name in names if not at.effects else ():
        if is_within(problem.effects[name].cause, SENSOR):  # what it explains by itself heats nothing beside it
            found.screened[(name,), at.discrepancy] = scores[name]
    least = found.leader.evidence + problem.settings.worth_fitting
    return sorted((name for name in names if scores[name] > least), key=lambda name: -scores[name])


def waves_beside(found: Search, at: Fit) -> list[str]:
    """Effects of waves that a fit lacks and whose linearized evidence beside it is above that of all fits.

    They are linearized where the spectrum of what the model alone leaves has them begin, if it shows a band: there with
    the amplitudes that fit best, since at their null frequency and direction have no slope but that of their priors.
    """
    problem, names = found.problem, []
    if not at.effects:
        found.waves = wave_starts(problem, at)
    for name, values in found.waves.items():
        if name in at.effects:
            continue
        key = tuple(sorted((*at.effects, name)))
        start = _with_amplitudes(found, at, key, name, values)
        found.starts.setdefault(name, start[None])
        scores = _score_from(found, at, key, name, start, at.sizes.without_discrepancy())
        for on, score in zip((False, True), scores):
            found.screened[key, on] = max(score, found.screened.get((key, on), -math.inf))
        if max(scores) > found.leader.evidence + problem.settings.worth_fitting:
            names.append(name)
    return names


def _with_amplitudes(found: Search, at: Fit, key: Key, name: str, values: Array) -> Array:
    """These values of an effect with the magnitudes that fit best beside them, its form held.

    The values themselves where the model diverges there, or the algebra fails: long runs may be about to diverge.
    """
    problem, columns = found.problem, found.problem.columns[name]
    form = [int(k) for k, q in zip(columns, problem.effects[name].parameters) if q.prior is not None]
    here = problem.linearize(started(problem, at, name, values), key, discrepancy=at.discrepancy)
    if not np.isfinite(here.errors).all():
        return values
    low, high = problem.low[columns], problem.high[columns]
    try:
        step = Likelihood(problem, here, held=form).solve(at.sizes, key).shared[columns]
    except np.linalg.LinAlgError:
        return values
    return np.asarray(np.clip(values + step, low, high))


def beside(found: Search, fit: Fit, others: Sequence[str]) -> dict[str, float]:
    """Linearized evidence of a fit with one more effect, of its own sizes; empty where the fit diverges."""
    problem = found.problem
    here = problem.linearize(fit.point, (*fit.effects, *others), discrepancy=fit.discrepancy)
    if not np.isfinite(here.errors).all():
        return {}
    likelihood = Likelihood(problem, here)
    return {other: _judged(found, likelihood, here, fit.sizes, (*fit.effects, other)) - fit.price for other in others}


def _judged(found: Search, likelihood: Likelihood, here: Linearization, sizes: Sizes, key: Key) -> float:
    """Linearized evidence (nats) of a set, the price of its discrepancy not counted.

    Where the last of its effects is an error of a sensor, also with less slow noise of that sensor, which without the
    effect may have taken its place: beside such noise of a torpedo's pitch rate a bias of 0.1 deg/s had 0.4 nats;
    fitted, 18.8.
    """
    problem = found.problem

    def value(sizes: Sizes) -> float:
        return likelihood.evidence(sizes, key) + log_prior(problem.settings, sizes, found.known)

    best = value(sizes)
    own = [c for c in sensor_channels(problem, key[-1]) if sizes.shape[c] != 0]
    if not own:
        return best
    try:
        step = likelihood.solve(sizes, key)
    except np.linalg.LinAlgError:
        return best
    proposed = proposed_shapes(problem, linear_errors(problem, here, step.shared, step.local), own)
    options = [with_shape(sizes, c, *one) for c in own for one in proposed.get(c, ()) if one[0] != sizes.shape[c]]
    return max([best, *(value(one) for one in options)])


def _ranked(found: Search, at: Fit, others: Sequence[str]) -> list[str]:
    return sorted(others, key=lambda name: (-found.expected(tuple(sorted((*at.effects, name)))), name))


def _finite_starts(problem: Problem, name: str) -> list[Array]:
    """Finite values from which an effect is tried: one without a slope at its null, or with a direction."""
    effect = problem.effects[name]
    if not (effect.starts or (effect.direction and problem.few_runs is None)):
        return []  # of a black box, each of the directions would cost runs, and the slope at the null leads there too
    mean = problem.mean[problem.columns[name]]
    directions = [
        np.array([float(start[q.name]) for q in effect.parameters])
        for start in effect.starting_points(problem.study.model, list(problem.trials))
    ]
    parts = (1.0,) if effect.starts else _MAGNITUDES
    return [mean + part * (values - mean) for part in parts for values in directions]


def _ordered_starts(found: Search, at: Fit, names: Sequence[str]) -> dict[str, Array]:
    """The finite starts (k, n) of effects, of each the one first that leaves least once everything else is refitted.

    The derivatives by everything else are those of the fit: each start costs one simulation. Directions are tried
    beside discrepancy only: without it, the slope at the null leads there. Others are tried without it, where the runs
    do not stray: beside it, forces have taken their part.
    """
    problem, plain = found.problem, found.fits.get((at.effects, False))
    still = plain if plain is not None and plain.evidence > at.evidence - HOPE else at
    begin, ordered = dict[bool, Callable[[str, Array], Point]](), dict[str, Array]()
    near: Likelihood | None = None
    for name in names:
        starts, directed = _finite_starts(problem, name), not problem.effects[name].starts
        if not starts or (directed and not at.discrepancy):
            continue
        fit, options = at if directed else still, list[tuple[float, Array]]()
        if directed not in begin:
            begin[directed] = starting(problem, fit)
        for values in starts:
            point = begin[directed](name, values)
            errors = problem.errors(point)
            if directed:
                # Its force stands in the place of missing ones: what is left of them decides, and no refit is needed.
                options.append((-objective(problem, point, errors, fit.sizes, fit.effects, fit.likelihood), values))
            elif np.isfinite(errors).all():
                # With what is left of the missing forces once the effect has taken its part.
                near = near or Likelihood(problem, fit.linearized(problem))
                options.append((near.elsewhere(point, errors).log_likelihood(fit.sizes, fit.effects), values))
        if options:
            ordered[name] = np.array([values for _, values in sorted(options, key=lambda option: -option[0])])
    return ordered


def _promised(found: Search, at: Fit, starts: Mapping[str, Array], bare: Sizes) -> dict[str, tuple[float, float]]:
    """What a fit with each effect promises from its start, without and with discrepancy: a few simulations of each.

    The larger of two linearizations that take everything else from the fit: on the way from nothing to the start, by
    what the errors change, and about the start, by differences in the effect's own parameters. Empty for a black box,
    each of whose runs counts.
    """
    problem = found.problem
    if problem.few_runs is not None or not starts:
        return {}
    near, begin = at.linearized(problem), starting(problem, at)
    towards, knots = near.shared.copy(order="F"), near.local[:, len(problem.initial_names) :]

    def scores(likelihood: Likelihood, name: str) -> tuple[float, float]:
        prior, key = partial(log_prior, problem.settings, known=found.known), (*at.effects, name)
        with_forces = likelihood.evidence(at.sizes, key) + prior(at.sizes) - at.price if at.discrepancy else -math.inf
        return likelihood.evidence(bare, key) + prior(bare), with_forces

    promised = dict.fromkeys(starts, (-math.inf, -math.inf))
    reached = []
    for name, values in starts.items():
        there, columns = begin(name, values), problem.columns[name]
        errors, away = problem.errors(there), there.shared[columns] - at.point.shared[columns]
        if not np.isfinite(errors).all() or not away.any():
            continue
        about = near.shared.copy(order="F")
        about[:, columns] = _slopes(problem, there, columns, errors)
        own = Linearization(there, (*at.effects, name), at.discrepancy, errors, about, near.local)
        promised[name] = scores(Likelihood(problem, own), name)
        change = errors - near.errors
        if at.discrepancy:  # less what the forces that give way to it change
            moved = (there.forces - at.point.forces).reshape(len(problem.trials), -1)
            change -= np.einsum("nk,nk->n", knots, moved[problem.trial_of])
        furthest = int(np.argmax(np.abs(away) / problem.sd[columns]))
        towards[:, columns[furthest]] = change / away[furthest]
        reached.append(name)
    likelihood = Likelihood(problem, replace(near, effects=(*at.effects, *reached), shared=towards))
    for name in reached:
        plain, loose = zip(promised[name], scores(likelihood, name))
        promised[name] = max(plain), max(loose)
    return promised


def _slopes(problem: Problem, point: Point, columns: Indices, errors: Array) -> Array:
    """Derivatives (N, n) of the errors at a point by these shared unknowns, by differences; zero where runs diverge."""
    found = np.zeros((len(errors), len(columns)))
    for n, k in enumerate(columns):
        shared, step = point.shared.copy(), _STEP * problem.sd[k]
        step = -step if shared[k] + step > problem.high[k] else step
        shared[k] += step
        found[:, n] = (problem.errors(Point(shared, point.initial, point.forces)) - errors) / step
    found[:, ~np.isfinite(found).all(axis=0)] = 0.0
    return found


def _score_from(found: Search, at: Fit, key: Key, name: str, values: Array, bare: Sizes) -> tuple[float, float]:
    """Linearized evidence of a set about a finite start of one of its effects, without and with discrepancy."""
    problem = found.problem
    there = problem.linearize(started(problem, at, name, values), key, discrepancy=at.discrepancy)
    if not np.isfinite(there.errors).all():
        return -math.inf, -math.inf
    likelihood = Likelihood(problem, there)

    def value(sizes: Sizes) -> float:
        return likelihood.evidence(sizes, key) + log_prior(problem.settings, sizes, found.known)

    return value(bare), value(at.sizes) - at.price if at.discrepancy else -math.inf
