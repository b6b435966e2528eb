"""Which hypotheses are fitted: every effect by its linearized likelihood, the leaders in full, then sets of them.

The search begins with the model alone, with and without discrepancy. At the fit with discrepancy every run is near its
record, so that effects can be compared there by one linearization. Each hypothesis is then fitted with discrepancy, and
from there without. Where an effect may explain the trials without any, all are fitted without it first
(`forces_beside.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np

from seatruth.costs.growth import Growth
from seatruth.diagnosis.actuator_starts import anywhere
from seatruth.diagnosis.choice import WITHOUT, additions, as_alone, may_matter, singles
from seatruth.diagnosis.directions import fit_along_waves, fit_directions
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.forces_beside import forces_wanted, may_do_without
from seatruth.diagnosis.gross_sizes import with_gross_sizes
from seatruth.diagnosis.hypotheses import HOPE, Key, Search, comparable, strays
from seatruth.diagnosis.hypothesis_fits import ensure, fit_both, fit_null, fit_once
from seatruth.diagnosis.initial_guess import forces_instead, in_all_trials, in_each_trial, likely_values
from seatruth.diagnosis.nesting import nest
from seatruth.diagnosis.noise_sharing import share_noise
from seatruth.diagnosis.other_faults import with_faults_of, with_other_faults
from seatruth.diagnosis.posterior import causes_in, hypotheses
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.refinement import refine
from seatruth.diagnosis.screening import own_in_each_trial, screen, waves_beside
from seatruth.diagnosis.sections import RunsBend, most_sections
from seatruth.diagnosis.sensors_beside import fit_sensor_errors
from seatruth.diagnosis.siblings import fit_rivals, fit_siblings
from seatruth.diagnosis.sizes import noise_prior
from seatruth.diagnosis.stage import Rising, Say
from seatruth.effects.each_trial import EachTrial
from seatruth.simulate import OutOfRuns
from seatruth.storage.checkpoint import Checkpoint

_FAR = 100.0
"""nats behind the leader beyond which a part is not fitted again: no other optimum is worth as much. [S]"""
_ALIKE = 3.0
"""nats of linearized evidence behind the best further effect within which others may look like it: odds of 20. [S]"""
_SHORT = 1.0
"""nats that a fit has still ahead of it from which it is taken up again. [S] What could change an answer."""
_ELSEWHERE = 5.0
"""Standard deviations between the values of an effect in two fits from which they are two optima, not one. [S]"""
_PROBABLE = 0.01
"""Probability from which a set is asked what its parts explain. [S]"""
_ROUNDS = 3
"""Times that leading sets are compared with what looks like them, and with their parts. [S]"""


def search(
    problem: Problem,
    say: Say,
    store: Checkpoint | None = None,
    workers: int = 1,
    *,
    widen: bool = False,
    may_cut: bool = False,
) -> Search:
    """Fits hypotheses. `say` gets what is done next, how many sets are done, and how many are expected.

    With `widen`, where a fault of a single actuator leads, its other faults join the library. With `may_cut`,
    trials are cut into sections where the model alone, with forces, cannot be fitted to whole ones (`sections.py`).

    Finished fits are kept in `store` and read from there. An interrupt, or the end of the runs that a black box may
    cost, after the model alone is fitted ends the search with what there is. Raises LinAlgError where the model alone
    cannot be fitted, or where no hypothesis can be simulated without discrepancy, and OutOfRuns where the runs do not
    suffice for the model alone.
    """
    begun = partial(_searched, say=Rising(say), store=store, workers=workers, widen=widen, may_cut=may_cut)
    return with_gross_sizes(begun(problem), problem, begun)


def _searched(
    problem: Problem, say: Rising, store: Checkpoint | None, workers: int, *, widen: bool, may_cut: bool
) -> Search:
    """As `search`, with priors as they are."""
    settings = problem.settings
    say.again()
    expected = 2 + settings.singles + (settings.most_effects - 1) * settings.leaders * settings.additions
    say("the model alone", 0, expected)
    found = _begun(problem, Checkpoint(None, "") if store is None else store, say, expected, may_cut=may_cut)
    problem = found.problem
    try:
        if problem.few_runs is None:
            found = with_faults_of(found, _screened_first(found)) if widen else found
            found.bare = may_do_without(found, lambda name: say(f"effect {name} without missing forces", 0, expected))
        if found.bare:
            found = _fit_library(found, say, expected, workers, widen=widen)
            if forces_wanted(found):
                found.bare = False
                say.again()
                if problem.few_runs is not None:
                    fit_null(found, lambda text: say(text, 0, expected))
        if not found.bare:
            found = refine(found, lambda knots: say(f"forces between {knots} knots", 1, expected))
            found = _fit_library(found, say, expected, workers, widen=widen)
        found.tell = lambda key: say(f"the leading sets again, {_in_words(key)}", expected, expected)
        stages: tuple[tuple[str, Callable[[], None]], ...] = (
            ("what looks like the leading sets", lambda: _fit_alike(found, 1)),
            ("what stands beside their effects in the tree of causes", lambda: fit_siblings(found)),
            ("what looks like their effects, from their ends", lambda: fit_rivals(found)),
            ("leading sets with values for each trial", lambda: _fit_each_trial(found)),
            ("parts of the leading sets", lambda: _refit_parts(found)),
            ("errors of sensors beside the leading set", lambda: fit_sensor_errors(found)),
            ("parts of probable sets", lambda: _fit_missing_parts(found)),
            # A part that had not been fitted shows directions as well.
            ("what looks like the leading parts", lambda: _fit_alike(found, 2)),
            ("the noise of the leading sets", lambda: share_noise(found, 2)),
            ("sets within others", lambda: nest(found)),
        )
        if not comparable(found):
            found.failed[("sets of several effects",)] = "no fit of a leading one converged"
            stages = ()
        for what, stage in stages:
            found.or_set_aside(what, stage, None)
    except KeyboardInterrupt:
        found.interrupted = True
    except OutOfRuns:
        found.interrupted = found.spent = True
    if all(on for _, on in found.fits):
        # With any forces whatever a model can be held near its record; without them there is nothing to report of it.
        raise np.linalg.LinAlgError("without forces that hold it near its record, the model diverges")
    return found


def _begun(problem: Problem, store: Checkpoint, say: Say, expected: int, *, may_cut: bool) -> Search:
    """A search with the model alone fitted: to whole trials, or to sections of them where no fit follows whole ones.

    Trials along which runs part too fast are cut at once. Where it cannot be fitted to sections either, it is not the
    length of the runs, and they stay whole.
    """
    may_cut = may_cut and problem.few_runs is None
    grown = _growth(problem) if may_cut else None
    if grown is not None and grown.is_too_far:
        sections = grown.sections
        order = [(sections, True), (1, False)]
    else:
        sections = most_sections(problem.trials) if may_cut else 1
        order = [(1, sections > 1), (sections, True), (1, False)]
    for count, cut in order:
        try:
            whole = problem if count == 1 else problem.in_sections(count)
            found = _with_model_alone(whole, store, lambda text: say(text, 0, expected), may_cut=cut)
            break
        except RunsBend:
            say(f"trials in {sections} sections" if count == 1 else "whole trials", 0, expected)
    return found


def _growth(problem: Problem) -> Growth:
    """How far runs of the model alone part along the records, as the study begins."""
    at, space = problem.start, problem.space
    run = problem.bound(at, space.varying)
    return Growth(run, problem.theta(at), problem.trials, space.nominal(), problem.initial_names)


def _with_model_alone(problem: Problem, store: Checkpoint, say: Callable[[str], None], *, may_cut: bool) -> Search:
    """A search with the model alone fitted. Raises as `fit_null`."""
    found = Search(problem, noise_prior(problem), store=store, may_cut=may_cut)
    found.bare = problem.few_runs is not None and problem.discrepancy is not None
    fit_null(found, say)
    wider = anywhere(found)
    return found if wider is None else _with_model_alone(wider, store, say, may_cut=may_cut)


def _in_words(key: Key) -> str:
    return f"effect{'s' if len(key) > 1 else ''} {' and '.join(key)}" if key else "the model alone"


def _fit_library(found: Search, say: Say, expected: int, workers: int, *, widen: bool) -> Search:
    """Fits sets of effects; with `widen`, then those of other faults of a single actuator that one of them blames."""
    _fit_sets(found, say, expected, workers)
    return with_other_faults(found, lambda name: say(f"effect {name}", expected, expected)) if widen else found


def _screened_first(found: Search) -> Key:
    """The effect that the model alone wants most, as linearized with forces, if it wants one."""
    near = found.fits.get(((), True)) or found.null
    ranked = screen(found, near)[:1]
    return tuple(
        name for name in ranked if found.expected((name,)) > near.evidence + found.problem.settings.worth_fitting
    )


def _fit_sets(found: Search, say: Say, expected: int, workers: int) -> None:
    """Fits effects alone, and the leading ones with others."""
    settings = found.problem.settings
    # With discrepancy the runs are near their records, where one linearization serves all effects.
    near = found.fits.get(((), True)) or found.null
    first = singles(found, near)
    count = len(first)
    # The leader first: what it reaches tells which of the others are hopeless.
    for batch in (first[:1], first[1:]):
        _fit_at_once(found, batch, near, say, expected, workers)
    none: list[str] = []
    own = found.or_set_aside("sizes of each trial", lambda: own_in_each_trial(found, near), none)
    for name in (*own, *found.or_set_aside("waves", lambda: waves_beside(found, near), none)):
        say(f"effect {name}", count, expected)
        fit_both(found, (name,), near)
    if not comparable(found):
        return
    share_noise(found, 1)
    # A sea is one cause of two effects.
    for size in range(2, settings.most_effects + (2 if found.waves else 1)):
        fewer = [fit for fit in found.sets() if len(fit.effects) < size]
        smaller = [fit for fit in fewer if len(fit.effects) == size - 1 and _leads(found, fit)]
        beaten = max(fit.evidence for fit in fewer) + settings.worth_fitting
        for leader in smaller[: settings.leaders]:
            beside = f"effects beside {' and '.join(leader.effects)}"
            more = found.or_set_aside(beside, partial(additions, found, leader), none)
            for name in (*more, *found.or_set_aside(beside, partial(waves_beside, found, leader), none)):
                count += 1
                key = tuple(sorted((*leader.effects, name)))
                found.rival = found.leader.evidence
                # Sets that explain as much as the leading one of their size are its look-alikes.
                least = max(beaten, found.rival - settings.hopeless)
                promised = found.expected(key)
                if causes_in(key, found.problem.effects) > settings.most_effects or promised < least:
                    continue
                if _fitted(found, key) or not may_matter(found, key, as_alone(found, leader, name, promised)):
                    continue
                say(_in_words(key), count, expected)
                fit_both(found, key, leader)
                loose = found.fits.get((key, True))
                if loose is not None:  # others are judged by it, and begin where it ended
                    fit_along_waves(found, loose)


def _fitted(found: Search, key: Key) -> bool:
    """Whether a set is fitted: with forces, unless the search is without."""
    bare = found.bare or found.problem.discrepancy is None
    return found.best(key) is not None if bare else (key, True) in found.fits


def _fit_at_once(found: Search, names: Sequence[str], near: Fit, say: Say, expected: int, workers: int) -> None:
    """Fits effects alone, several at once; each sees the same rival, whatever is finished first."""
    found.rival = found.leader.evidence
    done, alone = len({key for key, _ in found.fits if key}), () if found.bare else found.explaining(WITHOUT)

    def run(number: int, name: str) -> None:
        say(f"effect {name}", done + number + 1, expected)
        if found.hopeful((name,)) or name in alone or likely_values(found.problem, name, shown=True):
            fit_both(found, (name,), near)

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


def _with_direction(found: Search) -> list[Fit]:
    """The sets near the leader in which an effect has a direction, the most probable first.

    By evidence alone, sets of most effects would stand before those of which the answer is made.
    """
    effects, near = found.problem.effects, found.leader.evidence - found.problem.settings.hopeless
    ranked = [found.fits.get((one.effects, one.discrepancy)) for one in hypotheses(found, found.problem.settings)]
    least = found.leader.evidence - _ALIKE
    sets = [fit for fit in ranked if fit and fit.evidence > near and (fit.evidence > least or _leads(found, fit))]
    sets = [fit for fit in sets if any(effects[name].direction for name in fit.effects)]
    return [fit for fit in sets if may_matter(found, fit.effects, fit.evidence)]


def _fit_each_trial(found: Search) -> None:
    """Fits the leading sets with values for each trial in the place of effects that are the same in all, and back.

    Only there: values of their own let an effect follow whatever differs between trials, and an environment is believed
    to differ from trial to trial only where it is seen in all of them. What was seen so beside another effect may be
    the same in all: of a compass that was 8 deg off in one trial, the current was, once that had its own.
    """
    effects = found.problem.effects.items()
    alike = {effect.like.name: name for name, effect in effects if isinstance(effect, EachTrial)}
    for names, begin in ((alike, in_each_trial), ({own: name for name, own in alike.items()}, in_all_trials)):
        leaders = [fit.effects for fit in found.sets() if fit.effects and _leads(found, fit)]
        for leader in leaders[: found.problem.settings.leaders]:
            for name in (one for one in leader if names.get(one, one) not in leader):
                key = tuple(sorted((*(n for n in leader if n != name), names[name])))
                for on in (False, True):
                    same = found.fits.get((leader, on))
                    if same is not None and not (on and found.problem.few_runs is not None):
                        fit_once(found, key, on, begin(found.problem, same.point, name, names[name]), same.sizes)


def _fit_alike(found: Search, turn: int) -> None:
    """Fits what looks like the leading sets where these show it to begin. `turn` as in what it calls."""
    for _ in range(_ROUNDS):
        # What began along another's direction may lead now, and show where the other should have begun.
        fit_directions(found, _with_direction(found)[: found.problem.settings.leaders])
    _fit_to_the_end(found, turn)


def _fit_to_the_end(found: Search, turn: int) -> None:
    """Fits the sets near the leader again from where they stopped short of what their slope promises.

    Steps end where several of them bring nothing, which in a curved valley is not its end; with sizes set anew they go
    on. Between look-alikes the difference would decide. `turn` counts the calls of one search.
    """
    near = found.leader.evidence - found.problem.settings.hopeless
    for fit in found.sets():
        tried = (fit.effects, fit.discrepancy, fit.evidence)
        if fit.effects and fit.promised > near and fit.ahead > _SHORT and tried not in found.ended:
            found.ended.add(tried)
            words = f"from where it stopped short, {turn}"
            fit_once(found, fit.effects, fit.discrepancy, fit.point, fit.sizes, attempt=words, rival=near - HOPE)


def _refit_parts(found: Search) -> None:
    """Fits the parts of the leading sets again from where the sets ended, until no part takes the lead.

    A long run has many optima: what looks like the gain of an effect may be that of a better optimum of the model.
    Where the best part has other values of an effect than its set, the set is fitted from there as well. A part that is
    worse than the model alone, which it contains, did not reach its end, however far it seems to be behind.
    """
    nothing: Key = ()
    for round_ in range(_ROUNDS):
        at = found.leader
        leader = at.effects
        rests = [tuple(n for n in leader if n != name) for name in leader]
        for key in dict.fromkeys([nothing, *rests]):
            point = forces_instead(found.problem, at.point, [name for name in leader if name not in key])
            for on in _with_forces(found, at, key):
                known, alone = found.fits.get((key, on)), found.fits.get((nothing, on))
                anyway = not key and on and round_ == 0 and strays(found)
                short = known is not None and alone is not None and known.evidence < alone.evidence - _SHORT
                if known is None or anyway or short or known.promised > at.evidence - _FAR:
                    sizes = at.sizes if at.discrepancy or not on else at.sizes.with_discrepancy()
                    words = f"from the end of {'+'.join(leader)}, {round_}"
                    stop = None if short else found.known_end(key, on)
                    fit_once(found, key, on, point, sizes, attempt=words, stop=stop)
        parts = [found.fits[key, at.discrepancy] for key in rests if key and (key, at.discrepancy) in found.fits]
        part = max(parts, key=lambda fit: fit.evidence, default=None)
        if part is not None and _elsewhere(found.problem, part, at):
            begin = f"from the end of {'+'.join(part.effects)}, {round_}"
            fit_once(found, leader, at.discrepancy, part.point, part.sizes, attempt=begin)
        if found.leader.effects == leader and found.leader.evidence < at.evidence + _SHORT:
            break


def _fit_missing_parts(found: Search) -> None:
    """Fits the parts of every probable set that were not fitted, from where the set ended.

    An effect may look hopeless where it is linearized and lead beside another one: what the other adds is known only
    when the effect has been fitted alone. Of a log's lever arm of 2.8 m on a ship that its model hardly follows, the
    linearized evidence was a ninth of the fitted one.
    """
    for _ in range(found.problem.settings.most_effects - 1):
        ranked = hypotheses(found, found.problem.settings)
        probable = [one for one in ranked if one.fitted and one.probability > _PROBABLE and len(one.effects) > 1]
        missing = False
        for one in probable:
            at = found.fits[one.effects, one.discrepancy]
            for name in one.effects:
                key = tuple(other for other in one.effects if other != name)
                if (key, one.discrepancy) not in found.fits:
                    fitted = ensure(found, key, at, attempt=f"as a part of {'+'.join(one.effects)}")
                    missing = missing or fitted is not None
        if not missing:
            break


def _with_forces(found: Search, at: Fit, key: Key) -> list[bool]:
    """Whether the part of a leading set is fitted again without forces, with them, or both.

    Forces alone always, where the model alone strays: the rival of all effects is not to stand at a worse optimum.
    """
    unknown = not key and not found.bare and found.problem.discrepancy is not None and strays(found)
    return sorted({False, at.discrepancy or unknown})


def _elsewhere(problem: Problem, part: Fit, whole: Fit) -> bool:
    """Whether the effects of a part have other values than in the whole set, by many of their deviations."""
    columns = [k for name in part.effects for k in problem.columns[name]]
    away = np.abs(part.point.shared - whole.point.shared)[columns]
    deviation = np.maximum(part.stderr(problem), whole.stderr(problem))[columns]
    return bool((away > _ELSEWHERE * deviation).any())


def _leads(found: Search, fit: Fit) -> bool:
    """Whether a set explains at least half of what the best one does: only such sets are worth extending."""
    null = found.null.evidence
    return fit.evidence >= null + 0.5 * (found.leader.evidence - null)
