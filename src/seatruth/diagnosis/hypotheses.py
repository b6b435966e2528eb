"""Which hypotheses are fitted: every effect by its linearized likelihood, the leaders in full, then sets of them.

The search begins with the model alone, with and without discrepancy. At the fit with discrepancy every run is near its
record, so that effects can be compared there by one linearization. Each hypothesis is then fitted with discrepancy, and
from there without.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import NoisePrior, Sizes, first_sizes, log_prior, maximise, noise_prior

Key = tuple[str, ...]
Say = Callable[[str, int, int], None]


@dataclass
class Search:
    """Every fitted hypothesis by its effects, in alphabetical order, and whether discrepancy stands beside them."""

    problem: Problem
    known: NoisePrior
    fits: dict[tuple[Key, bool], Fit] = field(default_factory=dict)
    screened: dict[Key, float] = field(default_factory=dict)
    """Linearized evidence of sets, whether fitted or not."""
    failed: dict[Key, str] = field(default_factory=dict)
    """Hypotheses that were set aside, with the reason."""
    interrupted: bool = False

    @property
    def null(self) -> Fit:
        """The model alone, as it fits best."""
        return max((f for (key, _), f in self.fits.items() if not key), key=lambda f: f.evidence)

    def best(self, effects: Sequence[str]) -> Fit | None:
        """The better of a set's fits with and without discrepancy; None where neither was fitted."""
        key = tuple(sorted(effects))
        fits = [self.fits[key, on] for on in (False, True) if (key, on) in self.fits]
        return max(fits, key=lambda f: f.evidence) if fits else None

    def sets(self) -> list[Key]:
        """Fitted sets, the one of highest evidence first."""
        keys = {key for key, _ in self.fits}
        return sorted(keys, key=lambda key: (-self._evidence(key), key))

    def _evidence(self, key: Key) -> float:
        found = self.best(key)
        return -math.inf if found is None else found.evidence

    def evidence(self, key: Key) -> float:
        """Evidence of a set: of its fit, else linearized; -inf where neither is known."""
        return self._evidence(key) if self.best(key) is not None else self.screened.get(key, -math.inf)


def search(problem: Problem, say: Say, done: Callable[[Search], None] = lambda found: None) -> Search:
    """Fits hypotheses. `say` gets what is done next, how many fits are done, and how many are expected.

    `done` is called after each fit. An interrupt after the model alone is fitted ends the search with what there is.
    """
    settings = problem.settings
    found = Search(problem, noise_prior(problem))
    expected = 2 + settings.singles + (settings.most_effects - 1) * settings.leaders * settings.additions
    say("the model alone", 0, expected)
    _fit_null(found)
    done(found)
    try:
        count = 0
        for name in _screen(found, found.null)[: settings.singles]:
            count += 1
            say(f"effect {name}", count, expected)
            _fit_both(found, (name,), found.null)
            done(found)
        for size in range(2, settings.most_effects + 1):
            leaders = [key for key in found.sets() if len(key) == size - 1][: settings.leaders]
            for leader in leaders:
                at = found.best(leader)
                assert at is not None
                for name in _screen(found, at)[: settings.additions]:
                    count += 1
                    key = tuple(sorted((*leader, name)))
                    if found.screened[key] < at.evidence + settings.worth_fitting or found.best(key) is not None:
                        continue
                    say(f"effects {' and '.join(key)}", count, expected)
                    _fit_both(found, key, at)
                    done(found)
    except KeyboardInterrupt:
        found.interrupted = True
    return found


def _fit_null(found: Search) -> None:
    problem = found.problem
    sizes = first_sizes(problem, found.known)
    start = problem.start
    if problem.discrepancy is not None:
        with_discrepancy = _fit(found, (), True, start, sizes)
        if with_discrepancy is not None:
            start, sizes = with_discrepancy.point, with_discrepancy.sizes
    _fit(found, (), False, start, sizes)
    if start is not problem.start:
        _fit(found, (), False, problem.start, first_sizes(problem, found.known))
    if not any(not key for key, _ in found.fits):
        raise np.linalg.LinAlgError("the model alone could not be fitted")


def _fit_both(found: Search, key: Key, near: Fit) -> None:
    """Fits a set with discrepancy, and from there without."""
    start, sizes = _start(found, key, near), near.sizes
    if found.problem.discrepancy is not None:
        got = _fit(found, key, True, start, sizes.with_discrepancy())
        if got is not None:
            start, sizes = got.point, got.sizes
    _fit(found, key, False, start, sizes)


def _fit(found: Search, key: Key, discrepancy: bool, start: Point, sizes: Sizes) -> Fit | None:
    """Fits one hypothesis, and keeps the better of its fits; what cannot be fitted is set aside with its reason."""
    rival = max((f.evidence for f in found.fits.values()), default=-math.inf) if key else -math.inf
    try:
        got = fit(found.problem, key, start, sizes, found.known, discrepancy=discrepancy, rival=rival)
    except np.linalg.LinAlgError as trouble:
        found.failed.setdefault(key, str(trouble))
        return None
    if not math.isfinite(got.evidence):
        found.failed.setdefault(key, "its likelihood is not finite")
        return None
    known = found.fits.get((key, discrepancy))
    if known is None or got.evidence > known.evidence:
        found.fits[key, discrepancy] = got
    return got


def _screen(found: Search, at: Fit) -> list[str]:
    """Effects that are not in a fit, in the order of the linearized evidence of it with each of them."""
    problem, settings = found.problem, found.problem.settings
    others = [name for name in problem.effects if name not in at.effects]
    likelihood = Likelihood(problem, problem.linearize(at.point, (*at.effects, *others)))
    channels = sorted({series.channel for series in problem.series})
    bare = at.sizes.without_discrepancy()
    scores: dict[str, float] = {}
    for name in others:
        key = (*at.effects, name)

        def value(sizes: Sizes, key: Key = key) -> float:
            return likelihood.evidence(sizes, key) + log_prior(settings, sizes, found.known)

        if at.discrepancy:
            _, score = maximise(value, at.sizes, settings, channels=channels, noise=False, sweeps=1)
        else:
            score = value(at.sizes)
        score = max(score, value(bare))
        for start in _finite_starts(problem, name):
            score = max(score, _score_from(found, at, key, name, start, bare))
        scores[name] = score
        found.screened[tuple(sorted(key))] = score
    return sorted(scores, key=lambda name: (-scores[name], name))


def _finite_starts(problem: Problem, name: str) -> list[Array]:
    """Finite values from which an effect is tried that has no slope at its null, or whose direction is open."""
    effect = problem.effects[name]
    return [
        np.array([float(start[q.name]) for q in effect.parameters])
        for start in effect.starting_points(problem.study.model)
    ]


def _moved_to(problem: Problem, point: Point, name: str, values: Array) -> Point:
    shared = point.shared.copy()
    columns = problem.columns[name]
    shared[columns] = np.clip(values, problem.low[columns], problem.high[columns])
    return Point(shared, point.initial, point.forces)


def _score_from(found: Search, at: Fit, key: Key, name: str, values: Array, bare: Sizes) -> float:
    """Linearized evidence of a set about a finite start of one of its effects."""
    problem = found.problem
    there = problem.linearize(_moved_to(problem, at.point, name, values), key)
    if not np.isfinite(there.errors).all():
        return -math.inf
    likelihood = Likelihood(problem, there)
    return max(
        likelihood.evidence(sizes, key) + log_prior(problem.settings, sizes, found.known) for sizes in (at.sizes, bare)
    )


def _start(found: Search, key: Key, near: Fit) -> Point:
    """The point of a near fit, with each further effect at the best of its finite starts and its null."""
    problem, point = found.problem, near.point
    bare = near.sizes.without_discrepancy()
    for name in key:
        if name in near.effects:
            continue
        options = [problem.mean[problem.columns[name]], *_finite_starts(problem, name)]
        if len(options) > 1:
            scored = [(_score_from(found, near, key, name, values, bare), -k) for k, values in enumerate(options)]
            values = options[-max(scored)[1]]
            point = _moved_to(problem, point, name, values)
    return point
