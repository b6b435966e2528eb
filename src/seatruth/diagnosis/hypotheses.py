"""Which hypotheses are fitted: every effect by its linearized likelihood, the leaders in full, then sets of them.

The search begins with the model alone, with and without discrepancy. At the fit with discrepancy every run is near its
record, so that effects can be compared there by one linearization. Each hypothesis is then fitted with discrepancy, and
from there without.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit, fit, fit_at, without_discrepancy
from seatruth.diagnosis.initial_guess import from_equation_error
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import NoisePrior, Sizes, first_sizes, log_prior, noise_prior
from seatruth.storage.checkpoint import Checkpoint

Key = tuple[str, ...]
_HOPE = 100.0
"""Log-evidence (nats) behind the best by which a set's linearized one may be wrong, or half of the gap. [S]"""
_PARTS = (1.0, 0.3, 0.1, 0.03, 0.01)
"""Parts of the discrepancy beside the model alone that may be left beside an effect, as linearized."""
_ROUNDS = 3
"""Times that a leading set is compared with its parts. [S]"""
_NESTED = 8.0
"""nats by which a set may be behind one that it contains: what a prior that is too wide costs."""
_LARGE = math.log(0.3)
"""Log size of discrepancy from which runs that stray are fitted."""
_SMALL = math.log(0.003)
"""Log size of discrepancy beside a set that explains the trials without it."""
Say = Callable[[str, int, int], None]


@dataclass
class Search:
    """Every fitted hypothesis by its effects, in alphabetical order, and whether discrepancy stands beside them."""

    problem: Problem
    known: NoisePrior
    fits: dict[tuple[Key, bool], Fit] = field(default_factory=dict)
    screened: dict[tuple[Key, bool], float] = field(default_factory=dict)
    """Linearized evidence of sets, whether fitted or not, without and with discrepancy."""
    starts: dict[str, Array] = field(default_factory=dict)
    """Finite values from which an effect is fitted, where they are better than its null."""
    failed: dict[Key, str] = field(default_factory=dict)
    """Hypotheses that were set aside, with the reason."""
    store: Checkpoint = field(default_factory=lambda: Checkpoint(None, ""))
    """Finished fits and screens, for a run that goes on."""
    rival: float = -math.inf
    """Evidence that a fit has to come near; it changes between fits that run at once, never beside them."""
    interrupted: bool = False

    @property
    def null(self) -> Fit:
        """The model alone, as it fits best."""
        return max((f for (key, _), f in self.fits.items() if not key), key=lambda f: f.evidence)

    def best(self, effects: Sequence[str]) -> Fit | None:
        """The better of a set's fits, discrepancy paying its penalty; None where neither was fitted."""
        key = tuple(sorted(effects))
        fits = [self.fits[key, on] for on in (False, True) if (key, on) in self.fits]
        return max(fits, key=self.worth) if fits else None

    def worth(self, fit: Fit) -> float:
        """Evidence of a fit, less the penalty where it has discrepancy."""
        return fit.evidence - (self.problem.settings.discrepancy_penalty if fit.discrepancy else 0.0)

    def sets(self) -> list[Key]:
        """Fitted sets, the one of highest evidence first."""
        keys = {key for key, _ in self.fits}
        return sorted(keys, key=lambda key: (-self._evidence(key), key))

    def _evidence(self, key: Key) -> float:
        found = self.best(key)
        return -math.inf if found is None else found.evidence

    def evidence(self, key: Key) -> float:
        """Evidence of a set: of its fit, else linearized; -inf where neither is known."""
        if self.best(key) is not None:
            return self._evidence(key)
        return max(self.screened.get((key, on), -math.inf) for on in (False, True))

    def expected(self, key: Key) -> float:
        """Linearized evidence of a set, less the penalty where it needs discrepancy."""
        penalty = self.problem.settings.discrepancy_penalty
        return max(self.screened.get((key, on), -math.inf) - (penalty if on else 0.0) for on in (False, True))


def search(problem: Problem, say: Say, store: Checkpoint | None = None, workers: int = 1) -> Search:
    """Fits hypotheses. `say` gets what is done next, how many sets are done, and how many are expected.

    Finished fits are kept in `store` and read from there. An interrupt after the model alone is fitted ends the search
    with what there is. Raises LinAlgError where the model alone cannot be fitted, or where no hypothesis can be
    simulated without discrepancy.
    """
    settings = problem.settings
    found = Search(problem, noise_prior(problem), store=Checkpoint(None, "") if store is None else store)
    expected = 2 + settings.singles + (settings.most_effects - 1) * settings.leaders * settings.additions
    say("the model alone", 0, expected)
    _fit_null(found)
    # With discrepancy the runs are near their records, where one linearization serves all effects.
    near = found.fits.get(((), True)) or found.null
    try:
        singles = _screen(found, near)[: settings.singles]
        # The leader first: what it reaches tells which of the others are hopeless.
        for batch in (singles[:1], singles[1:]):
            _fit_at_once(found, batch, near, say, expected, workers)
        count = len(singles)
        for size in range(2, settings.most_effects + 1):
            leaders = [key for key in found.sets() if len(key) == size - 1 and _leads(found, key)][: settings.leaders]
            for leader in leaders:
                at = found.best(leader)
                assert at is not None
                for name in _screen(found, at)[: settings.additions]:
                    count += 1
                    key = tuple(sorted((*leader, name)))
                    found.rival = max(f.evidence for f in found.fits.values())
                    if found.expected(key) < found.rival + settings.worth_fitting or found.best(key) is not None:
                        continue
                    say(f"effects {' and '.join(key)}", count, expected)
                    _fit_both(found, key, at)
        say("parts of the leading sets", expected, expected)
        _refit_parts(found)
    except KeyboardInterrupt:
        found.interrupted = True
    if all(on for _, on in found.fits):
        # With any forces whatever a model can be held near its record; without them there is nothing to report of it.
        raise np.linalg.LinAlgError("without forces that hold it near its record, the model diverges")
    return found


def _fit_at_once(found: Search, names: Sequence[str], near: Fit, say: Say, expected: int, workers: int) -> None:
    """Fits effects alone, several at once; each sees the same rival, whatever is finished first."""
    found.rival = max(f.evidence for f in found.fits.values())
    done = len({key for key, _ in found.fits if key})

    def run(number: int, name: str) -> None:
        say(f"effect {name}", done + number + 1, expected)
        _fit_both(found, (name,), near)

    try:
        if workers == 1 or len(names) < 2:
            for number, name in enumerate(names):
                run(number, name)
            return
        with ThreadPoolExecutor(workers, thread_name_prefix="diagnosis") as pool:
            jobs = [pool.submit(run, number, name) for number, name in enumerate(names)]
            try:
                for job in jobs:
                    job.result()
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
    finally:
        # In the order of their names, not of their ends: sums over them have the same digits with any workers.
        found.fits = dict(sorted(found.fits.items()))


def _refit_parts(found: Search) -> None:
    """Fits the parts of the leading sets again from where the sets ended, until no part takes the lead.

    A long run has many optima: what looks like the gain of an effect may be that of a better optimum of the model.
    """
    for round_ in range(_ROUNDS):
        leader = found.sets()[0]
        at = found.best(leader)
        assert at is not None
        for name in leader:
            rest = tuple(n for n in leader if n != name)
            point = _moved_to(found.problem, at.point, name, found.problem.mean[found.problem.columns[name]])
            _fit(found, rest, at.discrepancy, point, at.sizes, attempt=4 + round_)
        if leader:
            point = at.point
            for name in leader:
                point = _moved_to(found.problem, point, name, found.problem.mean[found.problem.columns[name]])
            _fit(found, (), at.discrepancy, point, at.sizes, attempt=4 + round_)
        if found.sets()[0] == leader:
            break


def _leads(found: Search, key: Key) -> bool:
    """Whether a set explains at least half of what the best one does: only such sets are worth extending."""
    null, best = found.null.evidence, max(f.evidence for f in found.fits.values())
    return found.evidence(key) >= null + 0.5 * (best - null)


def ensure(found: Search, key: Key, near: Fit) -> Fit | None:
    """The fit of a set with discrepancy as beside `near`, which holds its effects: fitted if it was not yet."""
    known = found.fits.get((key, near.discrepancy))
    if known is not None:
        return known
    point = near.point
    for name in near.effects:
        if name not in key:
            point = _moved_to(found.problem, point, name, found.problem.mean[found.problem.columns[name]])
    return _fit(found, key, near.discrepancy, point, near.sizes)


def _fit_null(found: Search) -> None:
    problem = found.problem
    sizes = first_sizes(problem, found.known)
    start = problem.start
    if problem.discrepancy is not None:
        loose = _fit(found, (), True, start, sizes)
        if loose is None or not loose.settled:
            guess = from_equation_error(problem)
            if guess is not None:
                again = _fit(found, (), True, guess, sizes.with_discrepancy(_LARGE), attempt=2)
                loose = again or loose
        if loose is not None:
            start, sizes = loose.point, loose.sizes
    # From where the study begins, and, where that leads nowhere, from the fit with discrepancy.
    plain = _fit(found, (), False, problem.start, first_sizes(problem, found.known))
    if start is not problem.start and (plain is None or not plain.settled):
        _fit(found, (), False, start, sizes, attempt=2)
    if not any(not key for key, _ in found.fits):
        raise np.linalg.LinAlgError("the model alone could not be fitted")


def _fit_both(found: Search, key: Key, near: Fit) -> None:
    """Fits a set with and without discrepancy, at least as well as the sets that it contains."""
    try:
        _fit_forward(found, key, near)
    except np.linalg.LinAlgError as trouble:
        found.failed.setdefault(key, str(trouble))
    for on in (False, True):
        parts = [found.fits.get((tuple(n for n in key if n != name), on)) for name in key]
        parent = max((p for p in parts if p is not None), key=lambda p: p.evidence, default=None)
        own = found.fits.get((key, on))
        # A set contains its parts at the null of the rest: where it is far behind, its search went astray.
        if parent is not None and own is not None and own.evidence < parent.evidence - _NESTED:
            _fit(found, key, on, parent.point, parent.sizes, attempt=3)


def _fit_forward(found: Search, key: Key, near: Fit) -> None:
    """Fits a set without discrepancy from where the near fit's linearization predicts it, and then with it."""
    problem = found.problem
    start = _start(found, key, near)
    best = found.rival
    at = problem.linearize(start, key)
    if not np.isfinite(at.errors).all():
        start = near.point
        at = problem.linearize(start, key)
    likelihood = Likelihood(problem, at)
    bare = near.sizes.without_discrepancy()
    expected = likelihood.evidence(bare, key) + log_prior(problem.settings, bare, found.known)
    plain = found.fits.get(((), False))
    gap = best - plain.evidence if plain is not None else 0.0
    got = None
    if not near.discrepancy or expected > best - max(_HOPE, gap / 2.0):
        got = _fit(found, key, False, _stepped(problem, likelihood, bare, key, start), bare)
    if problem.discrepancy is None:
        return
    if got is not None and got.evidence > near.evidence - problem.settings.hopeless:
        _fit(found, key, True, got.point, got.sizes.with_discrepancy(_SMALL))
        return
    sizes = near.sizes.with_discrepancy()
    loose = _fit(found, key, True, _stepped(problem, likelihood, sizes, key, start), sizes)
    if got is None and loose is not None and loose.evidence > best - problem.settings.hopeless:
        # It may explain the trials without discrepancy, though one step did not show it.
        _fit(found, key, False, without_discrepancy(problem, loose.point), loose.sizes)


def _stepped(problem: Problem, likelihood: Likelihood, sizes: Sizes, key: Key, start: Point) -> Point:
    """Where one full step from a point leads; the point itself where the model diverges there."""
    try:
        step = likelihood.solve(sizes, key)
    except np.linalg.LinAlgError:
        return start
    point = problem.moved(start, step.shared, step.local)
    return point if np.isfinite(problem.errors(point)).all() else start


def _fit(found: Search, key: Key, discrepancy: bool, start: Point, sizes: Sizes, attempt: int = 1) -> Fit | None:
    """Fits one hypothesis, and keeps the better of its fits; what cannot be fitted is set aside with its reason."""
    name = f"fit {'+'.join(key)} {'with' if discrepancy else 'without'} discrepancy, attempt {attempt}"
    stored = found.store.get(name)
    if stored is not None:
        return _kept(found, _restored(found.problem, key, discrepancy, stored, found.known))
    rival = found.rival if key and attempt < 3 else -math.inf
    try:
        got = fit(found.problem, key, start, sizes, found.known, discrepancy=discrepancy, rival=rival)
    except np.linalg.LinAlgError as trouble:
        found.failed.setdefault(key, str(trouble))
        return None
    if not math.isfinite(got.evidence):
        found.failed.setdefault(key, "its likelihood is not finite")
        return None
    found.store.put(name, _stored(got))
    return _kept(found, got)


def _kept(found: Search, got: Fit) -> Fit:
    """Keeps the better of a hypothesis' fits."""
    place = got.effects, got.discrepancy
    known = found.fits.get(place)
    if known is None or got.evidence > known.evidence:
        found.fits[place] = got
    return found.fits[place]


def _stored(got: Fit) -> dict[str, Any]:
    """What a fit can be made from again."""
    point, sizes = got.point, got.sizes
    return {
        "shared": point.shared,
        "initial": point.initial,
        "forces": point.forces,
        "white": sizes.white,
        "shape": list(sizes.shape),
        "terms": sizes.terms,
        "force_sizes": sizes.forces,
        "coupling": sizes.coupling,
        "settled": got.settled,
    }


def _restored(problem: Problem, key: Key, discrepancy: bool, stored: Mapping[str, Any], known: NoisePrior) -> Fit:
    point = Point(stored["shared"], stored["initial"], stored["forces"])
    sizes = Sizes(stored["white"], tuple(stored["shape"]), stored["terms"], stored["force_sizes"], stored["coupling"])
    return fit_at(problem, key, point, sizes, known, discrepancy=discrepancy, settled=bool(stored["settled"]))


def _screen(found: Search, at: Fit) -> list[str]:
    """Effects that are not in a fit, in the order of the linearized evidence of it with each of them."""
    problem, settings = found.problem, found.problem.settings
    others = [name for name in problem.effects if name not in at.effects]
    name = f"screen {'+'.join(at.effects)}"
    stored = found.store.get(name)
    if stored is not None:
        for other, (plain, loose, start) in stored.items():
            if start:
                found.starts[other] = np.array(start)
            found.screened[tuple(sorted((*at.effects, other))), False] = float(plain)
            found.screened[tuple(sorted((*at.effects, other))), True] = float(loose)
        return _ranked(found, at, others)
    likelihood = Likelihood(problem, problem.linearize(at.point, (*at.effects, *others)))
    bare = at.sizes.without_discrepancy()
    shrunk = [at.sizes.shrunk(part) for part in _PARTS] if at.discrepancy else []
    # Size by size, since what takes time does not depend on the effect.
    loose_scores = dict.fromkeys(others, -math.inf)
    for sizes in shrunk:
        prior = log_prior(settings, sizes, found.known)
        for other in others:
            value = likelihood.evidence(sizes, (*at.effects, other)) + prior
            loose_scores[other] = max(loose_scores[other], value)
    plain_prior = log_prior(settings, bare, found.known)
    scores: dict[str, tuple[float, float, list[float]]] = {}
    for other in others:
        key, loose = (*at.effects, other), loose_scores[other]
        plain = likelihood.evidence(bare, key) + plain_prior
        chosen = found.starts.get(other, _best_start(found, at, other))
        if chosen is not None:
            from_there = _score_from(found, at, key, other, chosen, bare)
            if max(from_there) > max(plain, loose):
                found.starts[other] = chosen
            plain, loose = max(plain, from_there[0]), max(loose, from_there[1])
        scores[other] = plain, loose, found.starts[other].tolist() if other in found.starts else []
        found.screened[tuple(sorted(key)), False] = plain
        found.screened[tuple(sorted(key)), True] = loose
    found.store.put(name, scores)
    return _ranked(found, at, others)


def _ranked(found: Search, at: Fit, others: Sequence[str]) -> list[str]:
    return sorted(others, key=lambda name: (-found.expected(tuple(sorted((*at.effects, name)))), name))


def _finite_starts(problem: Problem, name: str) -> list[Array]:
    """Finite values from which an effect is tried whose null is no regular point: it has no slope there."""
    effect = problem.effects[name]
    if not effect.starts:
        return []
    return [
        np.array([float(start[q.name]) for q in effect.parameters])
        for start in effect.starting_points(problem.study.model)
    ]


def _best_start(found: Search, at: Fit, name: str) -> Array | None:
    """The finite start of an effect that leaves least once everything else is refitted; None where it has none.

    The derivatives by everything else are those of the fit: each start costs one simulation.
    """
    problem = found.problem
    options: list[tuple[float, Array]] = []
    for values in _finite_starts(problem, name):
        errors = problem.errors(_moved_to(problem, at.point, name, values))
        if np.isfinite(errors).all():
            likelihood = Likelihood(problem, replace(at.at, errors=errors))
            options.append((likelihood.log_likelihood(at.sizes, at.effects), values))
    return max(options, key=lambda option: option[0])[1] if options else None


def _moved_to(problem: Problem, point: Point, name: str, values: Array) -> Point:
    shared = point.shared.copy()
    columns = problem.columns[name]
    shared[columns] = np.clip(values, problem.low[columns], problem.high[columns])
    return Point(shared, point.initial, point.forces)


def _score_from(found: Search, at: Fit, key: Key, name: str, values: Array, bare: Sizes) -> tuple[float, float]:
    """Linearized evidence of a set about a finite start of one of its effects, without and with discrepancy."""
    problem = found.problem
    there = problem.linearize(_moved_to(problem, at.point, name, values), key)
    if not np.isfinite(there.errors).all():
        return -math.inf, -math.inf
    likelihood = Likelihood(problem, there)

    def value(sizes: Sizes) -> float:
        return likelihood.evidence(sizes, key) + log_prior(problem.settings, sizes, found.known)

    return value(bare), value(at.sizes) if at.discrepancy else -math.inf


def _start(found: Search, key: Key, near: Fit) -> Point:
    """The point of a near fit, with each further effect where it is best begun."""
    point = near.point
    for name in key:
        if name not in near.effects and name in found.starts:
            point = _moved_to(found.problem, point, name, found.starts[name])
    return point
