"""Fits of one hypothesis: from where it begins, with discrepancy and without, and how a fit is kept on disk."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.fit import FEW_ROUNDS, ROUNDS, Fit, Stopped, fit, fit_at, without_discrepancy
from seatruth.diagnosis.followed import follows, loses_heading
from seatruth.diagnosis.hypotheses import HOPE, Key, Search, strays
from seatruth.diagnosis.initial_guess import (
    forces_instead,
    from_equation_error,
    likely_values,
    moved_to,
    started,
    stepped,
)
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sections import RunsBend
from seatruth.diagnosis.size_search import OfSizes
from seatruth.diagnosis.sizes import NoisePrior, Sizes, first_sizes, log_prior
from seatruth.diagnosis.steps import likelihood_at

PARTS = (1.0, 0.3, 0.1, 0.03, 0.01)
"""Parts of the discrepancy beside the model alone that may be left beside an effect, as linearized."""
_FIRST = "first"
"""The attempt that is broken off where it falls far behind its rival; all others go to their end."""
_FROM_ITS_BEST_PART = "from its best part"
_OTHER_STARTS = 3
"""How many other starts of an effect are tried. [S]"""
_NOT_AGAIN = 1.0
"""Rise of the evidence (nats) of the model alone below which it is not fitted again. [S] As `fit` has it."""
_FALLEN = 1e-3
"""Distance from its null, over that of a start, below which an effect has fallen back to it. [S]"""
_NEAR_LIKELY = 0.1
"""Distance from a likely value, over that of the value from the null, below which a fit is at its optimum. [S]"""
_AGAIN = 3
"""Times that the model alone is fitted again from its own end. [S]"""
_NESTED = 8.0
"""nats by which a set may be behind one that it contains: what a prior that is too wide costs."""
_ASTRAY = 1000.0
"""nats by which a fit without missing forces may be behind for one with them to begin there. [S] Further behind, it has
left its record."""
_BENT = 100.0
"""nats that a fit has ahead of it from which it is begun anew under the sizes it was given. [S] Of a boat with its
antenna 0.8 m off it had 370,000; of 99 fits of another state of that boat none had a hundred."""
_LARGE = math.log(0.3)
"""Log size of discrepancy from which runs that stray are fitted."""
_SMALL = math.log(0.003)
"""Log size of discrepancy beside a set that explains the trials without it."""
_SHORT = 0.05
"""nats for each sample that a fit of the model alone has ahead of it, from which it ended too far short. [S] Of a ship
on a pond on two days it was 0 and 0.016, and the wind was found in whole trials; of a catamaran 0.086, and nothing."""


def fit_null(found: Search, say: Callable[[str], None] = lambda text: None) -> None:
    """Fits the model alone, with and without discrepancy. Raises LinAlgError where neither can be done.

    Of a bare search, without discrepancy, if that can be done. Raises RunsBend where the trials can be cut and the fit
    with discrepancy ends falsely, or, of whole trials, far short, or the one without loses the heading: in sections
    that forces hold near their records these are the lesser evil. The whole runs of a small vehicle with a weak
    thruster went astray by several turns.
    """
    problem = found.problem
    start, sizes, whole = problem.start, first_sizes(problem, found.known), problem.settings.sections == 1
    plain, loose = found.fits.get(((), False)), None
    if problem.few_runs is not None and plain is None:
        # What it reaches without the many columns of forces is a begin nearer to the record for those with them.
        plain = fit_once(found, (), False, start, sizes)
    if found.bare and plain is not None and plain.settled:
        return
    found.bare = False
    if problem.discrepancy is not None:
        near = (start, sizes) if plain is None else (plain.point, plain.sizes.with_discrepancy(_LARGE))
        say("the model alone, with missing forces")
        loose = fit_once(found, (), True, *near)
        if loose is None or not loose.settled:
            loose = fit_from_equation_error(found, near[1]) or loose
        short = loose is None or (whole and loose.ahead > _SHORT * problem.count)
        if found.may_cut and (loose is None or short or not follows(problem, loose.sizes, sizes)):
            raise RunsBend
    # From where the study begins, and, where that leads nowhere, from the fit with discrepancy.
    if problem.few_runs is None:
        say("the model alone, without missing forces")
        plain = fit_once(found, (), False, start, sizes)
    if loose is not None and (plain is None or not plain.settled):
        fit_once(found, (), False, loose.point, loose.sizes, attempt="from its fit with discrepancy")
    plain = found.fits.get(((), False))
    if found.may_cut and (plain is None or (whole and loses_heading(problem, plain))):
        raise RunsBend
    if not any(not key for key, _ in found.fits):
        raise np.linalg.LinAlgError("the model alone could not be fitted")
    # Discrepancy contains the model without it: where its fit is far behind, its search went astray.
    bare, loose = found.fits.get(((), False)), found.fits.get(((), True))
    if problem.discrepancy is not None and bare and (loose is None or loose.evidence < bare.evidence - _NESTED):
        little = bare.sizes.with_discrepancy(_SMALL)
        fit_once(found, (), True, bare.point, little, attempt="from its fit without discrepancy")
    lost = strays(found) and not found.fits[(), False].settled  # further attempts at it do not converge either
    say("the model alone, from its end")
    for on in (True,) if lost else (False, True):
        fit_again(found, discrepancy=on)


def fit_from_equation_error(found: Search, sizes: Sizes) -> Fit | None:
    """Fits the model alone with the forces that the recorded motion asks for; None where it does not say."""
    guess = from_equation_error(found.problem)
    if guess is None:
        return None
    return fit_once(found, (), True, guess, sizes.with_discrepancy(_LARGE), attempt="from the equation error")


def fit_again(found: Search, *, discrepancy: bool) -> None:
    """Fits the model alone from its own end, where it may still find better noise: everything is measured by it."""
    for number in range(1, 1 + _AGAIN):
        known = found.fits.get(((), discrepancy))
        if known is None:
            return
        again = fit_once(found, (), discrepancy, known.point, known.sizes, attempt=f"from its end, {number}")
        if again is None or again.evidence < known.evidence + _NOT_AGAIN:
            return


def fit_both(found: Search, key: Key, near: Fit) -> None:
    """Fits a set with and without discrepancy, at least as well as the sets that it contains."""
    found.begun[key] = near.effects, near.discrepancy, near.evidence
    from_near = False
    try:
        from_near = _fit_forward(found, key, near)
    except np.linalg.LinAlgError as trouble:
        found.failed.setdefault(key, str(trouble))
    for on in (False, True):
        parts = [found.fits.get((tuple(n for n in key if n != name), on)) for name in key]
        parent = max((p for p in parts if p is not None), key=lambda p: p.evidence, default=None)
        own = found.fits.get((key, on))
        # A set contains its parts at the null of the rest: where it is far behind, its search went astray.
        if on and from_near and parent is not None and parent.effects == near.effects:
            continue  # it began there
        if parent is not None and own is not None and own.evidence < parent.evidence - _NESTED:
            near_enough = found.rival - HOPE
            fit_once(found, key, on, parent.point, parent.sizes, attempt=_FROM_ITS_BEST_PART, rival=near_enough)


def ensure(found: Search, key: Key, near: Fit, attempt: str = _FIRST) -> Fit | None:
    """The fit of a set with discrepancy as beside `near`, which holds its effects: fitted if it was not yet."""
    known = found.fits.get((key, near.discrepancy))
    if known is not None:
        return known
    point = forces_instead(found.problem, near.point, [name for name in near.effects if name not in key])
    got = fit_once(found, key, near.discrepancy, point, near.sizes, attempt=attempt)
    return got if got is not None else _beside_the_model_alone(found, key, near, attempt)


def _beside_the_model_alone(found: Search, key: Key, near: Fit, attempt: str) -> Fit | None:
    """The fit of a set from where the model alone ended, where its runs diverge from the end of `near`.

    Forces cannot always replace a strong term: of an AUV, the scale of its speed sensor was never fitted without it.
    """
    problem, alone = found.problem, found.fits.get(((), near.discrepancy))
    if alone is None or not key:
        return None
    point = alone.point
    for name in key:
        point = moved_to(problem, point, name, near.point.shared[problem.columns[name]])
    for words, begin in (("with their values", point), ("at its end", alone.point)):
        words = f"{attempt}, beside the model alone {words}"
        got = fit_once(found, key, near.discrepancy, begin, alone.sizes, attempt=words)
        if got is not None:
            return got
    return None


def without_forces(found: Search, key: Key) -> Fit:
    """The fit of a set without discrepancy, whose runs can be simulated, at least as good as those of its parts.

    A set that leads beside forces may never have been fitted without them: what its fit beside them gives once they are
    taken away is no measure of it. The fit beside them where there is no other.
    """
    problem = found.problem
    loose, got = found.fits.get((key, True)), found.fits.get((key, False))
    if got is None and loose is not None:
        bare = without_discrepancy(problem, loose.point)
        got = fit_once(found, key, False, bare, loose.sizes, attempt="from its fit with discrepancy")
    sets = [tuple(n for n in key if n != name) for name in key] + [()]
    parts = [found.fits[part, False] for part in sets if (part, False) in found.fits]
    parent = max(parts, key=lambda fit: fit.evidence, default=None)
    if parent is not None and key and (got is None or got.evidence < parent.evidence - _NESTED):
        fit_once(found, key, False, parent.point, parent.sizes, attempt="from its best part, without forces")
    return found.fits.get((key, False)) or loose or found.null


def fit_once(
    found: Search,
    key: Key,
    discrepancy: bool,
    start: Point,
    sizes: Sizes,
    attempt: str = _FIRST,
    rival: float = -math.inf,
    stop: Callable[[Point], bool] | None = None,
) -> Fit | None:
    """Fits one hypothesis, and keeps the better of its fits; what cannot be fitted is set aside with its reason.

    `attempt` says in words where it begins: no two attempts at one hypothesis have the same words, under which a
    finished one is stored. A fit that cannot come near `rival` (nats) is broken off; the first attempt at a set takes
    that of the search. So is one that comes where it must `stop`, and an earlier fit stands.
    """
    beside = f"{'with' if discrepancy else 'without'} discrepancy over {found.problem.settings.knots} knots"
    name = f"fit {'+'.join(key)} {beside} of {found.scope}, attempt {attempt}"
    settings = found.problem.settings
    name += f", in {settings.sections} sections" if settings.sections > 1 else ""
    name += "" if settings.near_orders else ", actuators anywhere at the start"
    stored = found.store.get(name)
    if stored is not None:
        return _kept(found, _restored(found.problem, key, discrepancy, stored, found.known))
    rival = found.rival if key and attempt == _FIRST else rival
    found.tell(key)
    try:
        rounds = FEW_ROUNDS if key and discrepancy and _is_rough(found) else ROUNDS
        begun = partial(fit, found.problem, key, start, sizes, found.known, discrepancy=discrepancy)
        got = begun(rival=rival, rounds=rounds, stop=stop)
        if key and discrepancy and got.ahead > _BENT and found.problem.few_runs is None:
            with suppress(np.linalg.LinAlgError):  # what there is stands
                again = begun(rival=rival, rounds=rounds, stop=stop, held=True)
                got = max(got, again, key=lambda one: one.evidence)
    except Stopped:
        return found.fits.get((key, discrepancy))
    except np.linalg.LinAlgError as trouble:
        found.failed.setdefault(key, str(trouble))
        return None
    if not math.isfinite(got.evidence):
        found.failed.setdefault(key, "its likelihood is not finite")
        return None
    found.store.put(name, _stored(got))
    return _kept(found, got)


def _fit_forward(found: Search, key: Key, near: Fit) -> bool:
    """Fits a set without discrepancy from where the near fit's linearization predicts it, and then with it.

    Whether the fit with it began where the near fit ended.
    """
    problem, best, start = found.problem, found.rival, _start(found, key, near)
    near_enough = best - HOPE  # further attempts at what is hopeless are broken off too, if later
    # It may be fitted already, in a search without forces.
    got = found.fits.get((key, False))
    if got is None:
        start, got = _fit_bare(found, key, near, start)
    got = _from_likely_values(found, key, near, got and _from_other_starts(found, key, near, got))
    if problem.discrepancy is None or found.bare:
        return False
    if got is not None and got.evidence > near.evidence - problem.settings.hopeless:
        fit_once(found, key, True, got.point, _beside(found, got, near))
        return False
    sizes = near.sizes.with_discrepancy()
    # Not a whole step away: the near fit is at its optimum, and a long run does not survive one.
    loose = fit_once(found, key, True, start, sizes)
    first = tuple(found.explaining(1))  # forces may hold it at another optimum, however far ahead
    short = loose is not None and not loose.settled  # as a compass 3 deg off, of a boat in a short sea
    if got is not None and (loose is None or short or got.evidence > loose.evidence - _ASTRAY or key == first):
        # Forces hold a run near its record whatever the effect is: what it is worth without them shows its size.
        words, stop = "from its fit without discrepancy", found.known_end(key, True)
        loose = fit_once(found, key, True, got.point, sizes, attempt=words, rival=near_enough, stop=stop) or loose
    hope = loose is not None and loose.evidence > best - problem.settings.hopeless
    if loose is not None and hope and (got is None or got.evidence < loose.evidence - _NESTED):
        # It may explain the trials without discrepancy, though one step, or a fit of runs that stray, did not show it.
        bare = without_discrepancy(problem, loose.point)
        words = "from its fit with discrepancy"
        got = fit_once(found, key, False, bare, loose.sizes, attempt=words, rival=near_enough)
        if got is not None and got.evidence > loose.evidence + _NESTED:
            # What it reaches there is no optimum of forces: they contain it.
            fit_once(found, key, True, got.point, _beside(found, got, near), attempt="from its end without discrepancy")
    return near.discrepancy and start is near.point


def _fit_bare(found: Search, key: Key, near: Fit, start: Point) -> tuple[Point, Fit | None]:
    """The point from which a set is best begun, and its fit without discrepancy; None where that has no hope."""
    problem, best = found.problem, found.rival
    at = problem.linearize(start, key, discrepancy=near.discrepancy)
    if not np.isfinite(at.errors).all():
        start = near.point
        at = problem.linearize(start, key, discrepancy=near.discrepancy)
    likelihood = Likelihood(problem, at)
    bare = near.sizes.without_discrepancy()
    expected = likelihood.evidence(bare, key) + log_prior(problem.settings, bare, found.known)
    plain = found.fits.get(((), False))
    gap = best - plain.evidence if plain is not None else 0.0
    # Where the model alone strays, a slope beside forces says nothing of what an effect does without them.
    if plain is not None and strays(found) and near.discrepancy and not near.effects:
        return start, fit_once(found, key, False, plain.point, plain.sizes, _FROM_ITS_BEST_PART, best - HOPE)
    if not near.discrepancy or expected > best - max(HOPE, gap / 2.0):
        return start, fit_once(found, key, False, stepped(problem, likelihood, bare, key, start), bare)
    return start, None


def _from_other_starts(found: Search, key: Key, near: Fit, got: Fit | None) -> Fit | None:
    """The best fit without discrepancy, from an effect's other starts where the first one fell back to its null."""
    problem = found.problem
    for name in (n for n in key if n not in near.effects and problem.effects[n].starts and n in found.starts):
        columns, mean = problem.columns[name], problem.mean[problem.columns[name]]
        plain = found.fits.get((near.effects, False), near)
        for number, values in enumerate(found.starts[name][:_OTHER_STARTS]):
            least = _FALLEN * float(np.abs(values - mean).max())

            def fallen(at: Point, columns: Indices = columns, mean: Array = mean, least: float = least) -> bool:
                return bool((np.abs(at.shared[columns] - mean) <= least).all())

            if got is not None and not fallen(got.point):
                break
            point, words = moved_to(problem, plain.point, name, values), f"from start {number} of {name}"
            # One that falls back too would end where the first one did.
            stop = None if got is None else fallen
            rival = found.rival - HOPE  # as of the first attempt, a little later
            got = fit_once(found, key, False, point, plain.sizes, attempt=words, rival=rival, stop=stop) or got
    return got


def _from_likely_values(found: Search, key: Key, near: Fit, got: Fit | None) -> Fit | None:
    """The best fit without discrepancy, from the likely values of an effect where the best one is not near them."""
    problem = found.problem
    for name in (n for n in key if n not in near.effects):
        columns, mean = problem.columns[name], problem.mean[problem.columns[name]]
        plain = found.fits.get((near.effects, False), near)
        # Where nothing was fitted from its null, only what the records themselves show is worth a fit.
        for number, values in enumerate(likely_values(problem, name, shown=got is None)):
            away = math.inf if got is None else float(np.abs(got.point.shared[columns] - values).max())
            if away < _NEAR_LIKELY * float(np.abs(values - mean).max()):
                continue
            point, best = moved_to(problem, plain.point, name, values), -math.inf if got is None else got.evidence
            attempt = f"from likely value {number} of {name}"
            got = fit_once(found, key, False, point, plain.sizes, attempt=attempt, rival=best) or got
    return got


def _beside(found: Search, got: Fit, near: Fit) -> Sizes:
    """Sizes from which discrepancy is sought beside a set that was fitted without it: little, or as in the near fit."""
    little = got.sizes.with_discrepancy(_SMALL)
    if not near.discrepancy:
        return little
    as_near = [near.sizes.shrunk(part) for part in PARTS]
    options = [little, *as_near, *(replace(got.sizes, terms=s.terms, forces=s.forces) for s in as_near)]
    likelihood = likelihood_at(found.problem, found.problem.linearize(got.point, got.effects), got.sizes, got.effects)
    return max(options, key=OfSizes(likelihood, got.effects, found.known))


def _start(found: Search, key: Key, near: Fit) -> Point:
    """The point of a near fit, with each further effect where it is best begun."""
    point = near.point
    for name in key:
        if name not in near.effects and name in found.starts:
            point = started(found.problem, replace(near, point=point), name, found.starts[name][0])
    return point


def _is_rough(found: Search) -> bool:
    """Whether the model alone was fitted with forces, and did not converge."""
    loose = found.fits.get(((), True))
    return loose is not None and not loose.settled


def _kept(found: Search, got: Fit) -> Fit | None:
    """Keeps the better of a hypothesis' fits; none with a small share of what acts wholly or not at all."""
    place = got.effects, got.discrepancy
    if not got.is_whole(found.problem):
        found.screened[place] = -math.inf
        return found.fits.get(place)
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
