"""What stands beside an effect in the tree of causes, in its place in the leading sets.

Only a few further effects are tried beside a leading set, the first of each family of causes, as linearized. Where that
is the rate limit of a rudder, its lag may explain as much alone and more there: of a boat with a slow nozzle beside a
current the limit was 86 nats behind it, and all that was fitted.
"""

from __future__ import annotations

from collections.abc import Mapping

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.hypothesis_fits import fit_once
from seatruth.diagnosis.initial_guess import moved_to, without_effects
from seatruth.effects import Effect
from seatruth.effects.causes import parent


def fit_siblings(found: Search) -> None:
    """Fits the leading sets of several effects with each of these replaced by a sibling that explains as much alone."""
    settings = found.problem.settings
    near = found.leader.evidence - settings.hopeless
    sets = [fit for fit in found.sets() if len(fit.effects) > 1 and fit.evidence > near]
    for at in sets[: settings.leaders]:
        for name in at.effects:
            for other in siblings(found, name):
                _in_its_place(found, at, name, other)


def siblings(found: Search, name: str) -> list[str]:
    """Effects of the same kind of cause that explain about as much alone, the first first."""
    own = found.best((name,))
    if own is None:
        return []
    alone = {one: found.best((one,)) for one in _of_one_kind(found.problem.effects, name)}
    least = own.evidence - found.problem.settings.hopeless
    likely = {one: fit.evidence for one, fit in alone.items() if fit is not None and fit.evidence > least}
    return sorted(likely, key=lambda one: (-likely[one], one))


def _of_one_kind(effects: Mapping[str, Effect], name: str) -> list[str]:
    node = parent(effects[name].cause)
    same = [one for one, effect in effects.items() if one != name and parent(effect.cause) == node]
    return [one for one in same if effects[one].each_trial == effects[name].each_trial]


def _in_its_place(found: Search, at: Fit, name: str, other: str) -> None:
    key = tuple(sorted({*at.effects, other} - {name}))
    alone = found.best((other,))
    if other in at.effects or (key, at.discrepancy) in found.fits or alone is None:
        return
    problem = found.problem
    values = alone.point.shared[problem.columns[other]]
    point = moved_to(problem, without_effects(problem, at.point, [name]), other, values)
    fit_once(found, key, at.discrepancy, point, at.sizes, attempt=f"in the place of {name}")
