"""Other effects in the place of one of a leading set: what stands beside it in the tree of causes, or looks like it.

Only a few further effects are tried beside a leading set, the first of each family of causes, as linearized. Where that
is the rate limit of a rudder, its lag may explain as much alone and more there: of a boat with a slow nozzle beside a
current the limit was 86 nats behind it, and all that was fitted.

What looks like an effect was fitted from where it begins alone, and may have ended short of its optimum.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.approach import LEAST_RISE
from seatruth.diagnosis.choice import may_matter
from seatruth.diagnosis.directions import promised
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import HOPE, Search, strays
from seatruth.diagnosis.hypothesis_fits import fit_once
from seatruth.diagnosis.initial_guess import moved_to, started, without_effects
from seatruth.effects import Effect
from seatruth.effects.causes import parent

_RIVALS = 4
"""Sets that are asked what they promise from the leader's end, for each of its effects, the nearest to it first. [S]"""
_AS_PROBABLE = 2
"""Effects of other kinds that are tried in the place of one. [S] Each is a fit."""


def fit_siblings(found: Search) -> None:
    """Fits the leading sets with each of their effects replaced by a sibling.

    By one that explains as much alone, where there are several effects, and those of the leading set also by what else
    is about as probable alone: of an AUV whose stern plane stood off, that was 9 nats behind an asymmetry of the hull
    alone, and was never fitted beside the cross-flow drag that led with it. Where only forces hold the runs near their
    records, those of the leading set also by one at the same place that was never fitted: what its linearized gain says
    of such runs is little. Of an ROV whose six thrusters lagged by 0.25 s a dead time and a rate limit together were
    the answer, the lag hopeless.
    """
    settings = found.problem.settings
    near = found.leader.evidence - settings.hopeless
    sets = [fit for fit in found.sets() if fit.effects and fit.evidence > near]
    sets = [fit for fit in sets if may_matter(found, fit.effects, fit.evidence)]
    for place, at in enumerate(sets[: settings.leaders]):
        new = place == 0 and at.discrepancy and strays(found)
        for name in at.effects:
            several = len(at.effects) > 1
            others = siblings(found, name) if several else []
            others += as_probable_alone(found, name) if several and place == 0 else []
            for other in (*others, *(_never_fitted(found, name) if new else ())):
                _in_its_place(found, at, name, other)


def fit_rivals(found: Search) -> None:
    """Fits what looks like the leading set from where that ended, as far as it promises more there than it reached.

    Those are sets with one other effect in the place of one of its own. What has a direction begins along the other's
    (`directions.py`). Of a glider whose centre of gravity was 3 mm ahead, the trim ended 24 nats short of what it
    reaches, and the offset of a battery, 1.6 nats ahead of it then, had 83 %. A black box is not asked: a promise
    costs as many runs as a step.
    """
    if found.problem.few_runs is not None:
        return
    at, effects = found.leader, found.problem.effects
    for name in (one for one in at.effects if not effects[one].direction):
        rest = {*at.effects} - {name}
        alike = [
            fit
            for (key, on), fit in found.fits.items()
            if on == at.discrepancy and len(key) == len(at.effects) and {*key} > rest and name not in key
        ]
        near = [fit for fit in alike if fit.evidence > at.evidence - HOPE]
        for fit in sorted(near, key=lambda one: (-one.evidence, one.effects))[:_RIVALS]:
            _begun_anew(found, at, name, fit)


def _begun_anew(found: Search, at: Fit, name: str, rival: Fit) -> None:
    """Fits a rival from the end of a leader, with its own values of the effect that stands in the place of another."""
    problem, (other,) = found.problem, {*rival.effects} - {*at.effects}
    bare = started(problem, at, name, problem.mean[problem.columns[name]])
    point = started(problem, replace(at, point=bare), other, rival.point.shared[problem.columns[other]])
    if promised(found, at, rival.effects, point) > rival.evidence + LEAST_RISE:
        words = f"from the end of {'+'.join(at.effects)}, in the place of {name}"
        fit_once(
            found, rival.effects, at.discrepancy, point, at.sizes, attempt=words, rival=rival.evidence,
            stop=found.known_end(rival.effects, at.discrepancy),
        )  # fmt: skip


def siblings(found: Search, name: str) -> list[str]:
    """Effects of the same kind of cause that explain about as much alone, and those of one actuator that explain more.

    The first comes first. Of a boat in a short sea a thruster that gave 12 % less explained 54 nats more alone than its
    dead band, which stood before it beside the waves, as linearized.
    """
    own, effects = found.best((name,)), found.problem.effects
    if own is None:
        return []
    which = effects[name].which
    kind, most = _of_one_kind(effects, name), found.problem.settings.hopeless
    near = {one: 0.0 for one, effect in effects.items() if which and effect.which == which and one != name}
    behind = {**near, **dict.fromkeys(kind, most)}
    alone = {one: found.best((one,)) for one in behind}
    likely = {
        one: fit.evidence for one, fit in alone.items() if fit is not None and fit.evidence > own.evidence - behind[one]
    }
    return sorted(likely, key=lambda one: (-likely[one], one))


def as_probable_alone(found: Search, name: str) -> list[str]:
    """Effects of other kinds that would count as look-alikes of an effect if each acted alone, the first of them."""
    own, null, settings = found.best((name,)), found.null, found.problem.settings
    if own is None:
        return []
    heat = settings.temperature + settings.model_form * max(0.0, own.evidence - null.evidence)
    least = own.evidence + math.log(settings.least_rival) * heat
    kind = {name, *_of_one_kind(found.problem.effects, name)}
    alone = {one: found.best((one,)) for one in found.problem.effects if one not in kind}
    likely = {one: fit.evidence for one, fit in alone.items() if fit is not None and fit.evidence > least}
    return sorted(likely, key=lambda one: (-likely[one], one))[:_AS_PROBABLE]


def _never_fitted(found: Search, name: str) -> list[str]:
    """Effects of the same kind of cause, at the same places of the model, that no fitted set has.

    Not what acts wholly or not at all: that is seen first of all.
    """
    effects, model = found.problem.effects, found.problem.study.model
    tried = {one for key, _ in found.fits for one in key}
    untried = [one for one in _of_one_kind(effects, name) if one not in tried and not effects[one].wholly]
    return [one for one in untried if {*effects[one].places(model)} == {*effects[name].places(model)}]


def _of_one_kind(effects: Mapping[str, Effect], name: str) -> list[str]:
    node = parent(effects[name].cause)
    same = [one for one, effect in effects.items() if one != name and parent(effect.cause) == node]
    return [one for one in same if effects[one].each_trial == effects[name].each_trial]


def _in_its_place(found: Search, at: Fit, name: str, other: str) -> None:
    key = tuple(sorted({*at.effects, other} - {name}))
    if other in at.effects or (key, at.discrepancy) in found.fits:
        return
    problem, alone = found.problem, found.best((other,))
    values = _begin(found, other) if alone is None else alone.point.shared[problem.columns[other]]
    point = moved_to(problem, without_effects(problem, at.point, [name]), other, values)
    least = found.leader.evidence - HOPE  # what cannot come near it is broken off
    fit_once(found, key, at.discrepancy, point, at.sizes, attempt=f"in the place of {name}", rival=least)


def _begin(found: Search, name: str) -> Array:
    """Values from which an effect that was never fitted begins: where it is best begun, if that is known.

    Else its null, from which a step leads either way, or its typical size where it has one sign alone.
    """
    if name in found.starts:
        return np.asarray(found.starts[name][0])
    problem, effect = found.problem, found.problem.effects[name]
    values: Array = np.empty(len(effect.parameters))
    for n, (k, q) in enumerate(zip(problem.columns[name], effect.parameters, strict=True)):
        null = effect.null[q.name]
        values[n] = q.value if null in (problem.low[k], problem.high[k]) else null
    return values
