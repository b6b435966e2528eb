"""Other faults of a single actuator, which join the search where one of its faults leads.

A vehicle with many thrusters has a hundred single faults, so that a diagnosis begins with the loss of each thruster's
thrust alone: whatever one thruster lacks shows there. What looks like such a loss may be a lag or a dead band.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from seatruth.diagnosis.fit import Fit, fit_at
from seatruth.diagnosis.hypotheses import HOPE, Key, Search
from seatruth.diagnosis.hypothesis_fits import fit_both
from seatruth.diagnosis.problem import Point, Problem
from seatruth.effects import Effect, available
from seatruth.study import Study


def untried(study: Study, tried: Mapping[str, Effect], name: str) -> list[Effect]:
    """Faults of the same single actuators as effect `name` that are not among those `tried`, and can act."""
    which = tried[name].which
    if not which:
        return []
    forms = [form for effect in available().values() for form in effect.variants(study.model)]
    others = [form for form in forms if form.which == which and form.name not in tried]
    return [form for form in others if form.dynamic and not form.missing(study.model)]


def with_faults_of(found: Search, key: Key) -> Search:
    """The search with all faults of the single actuators that these effects blame; the same where there are none.

    Fits that are far behind the leader stay behind: their sets keep their linearized evidence. Not for a black box,
    whose runs are counted.
    """
    problem = found.problem
    if problem.few_runs is not None:
        return found
    forms = [form for name in key for form in untried(problem.study, problem.effects, name)]
    added = {form.name: form for form in forms}
    return _moved(found, problem.with_effects(added.values())) if added else found


def with_other_faults(found: Search, say: Callable[[str], None]) -> Search:
    """The same for the leading set, with the added faults fitted in the place of those that lead.

    `say` gets the effects of each set that is fitted.
    """
    wider = with_faults_of(found, found.leader.effects)
    added = [effect for name, effect in wider.problem.effects.items() if name not in found.problem.effects]
    for key, base in _in_place(found, added):
        near = wider.fits.get((base, True)) or wider.best(base)
        if near is not None:
            say(" and ".join(key))
            wider.rival = wider.leader.evidence
            fit_both(wider, key, near)
    return wider


def _in_place(found: Search, added: Sequence[Effect]) -> Iterator[tuple[Key, Key]]:
    """Each leading set with an added fault in the place of one of the same actuators, and what the two have in common.

    The added fault alone comes first, as other sets are built from it.
    """
    effects = found.problem.effects
    near = found.leader.evidence - found.problem.settings.hopeless
    sets = [(), *(fit.effects for fit in found.sets() if fit.evidence > near)]
    seen: set[Key] = set()
    for fault in added:
        seen.add((fault.name,))
        yield (fault.name,), ()
    for one in sorted(sets, key=len):
        for name in one:
            rest = tuple(other for other in one if other != name)
            for fault in added:
                key = tuple(sorted((*rest, fault.name)))
                if effects[name].which == fault.which and key not in seen:
                    seen.add(key)
                    yield key, rest


def _moved(found: Search, problem: Problem) -> Search:
    """The search over a wider library: the fits of the model alone, of the leader's parts, and of what is near it."""
    leader = found.leader
    wider = replace(found, problem=problem, fits={}, screened=dict(found.screened))
    for (key, on), fit in found.fits.items():
        if set(key) <= set(leader.effects) or fit.evidence > leader.evidence - HOPE:
            wider.fits[key, on] = _same(found.problem, problem, fit, found)
        elif len(key) == 1:
            wider.screened[key, on] = fit.evidence
    return wider


def _same(before: Problem, after: Problem, fit: Fit, found: Search) -> Fit:
    """A fit as that of a problem with more effects, which stand at their null."""
    shared, values = after.start.shared.copy(), before.named(fit.point)
    for k, unknown in enumerate(after.unknowns):
        shared[k] = values.get(unknown.name, shared[k])
    point = Point(shared, fit.point.initial, fit.point.forces)
    sizes, on = fit.sizes, fit.discrepancy
    return fit_at(after, fit.effects, point, sizes, found.known, discrepancy=on, settled=fit.settled)
