"""Whether positions are late, or their vehicle drifts otherwise in turns than its model.

A drift that is off in proportion to the rate of turn shows as a receiver ahead of its place, and at an even speed a
late receiver moves positions nearly alike. Which of both it is the rest of the motion tells: as the speed changes, as a
turn begins, and by what missing forces take up in the equations. So a place ahead is fitted instead of the delay.
"""

from __future__ import annotations

import numpy as np

from seatruth.diagnosis.drift_in_turns import ANTENNA, TIMING, drift_error, equivalent_place, look_like_drift
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import fit_once
from seatruth.diagnosis.initial_guess import moved_to, without_effects
from seatruth.diagnosis.posterior import counted, explained_from
from seatruth.effects.causes import is_within

_CLEARLY = 3.0
"""nats, as they count for probabilities, by which a delay must explain more than a place ahead: odds of 20. [S] Of a
ferry of another form whose receiver was 0.8 s late they were 38 of evidence, of a river vessel's, 1.2 s late, 22."""


def drifting(search: Search, at: Fit | None, names: Key) -> list[str]:
    """Errors of positions, of these effects of a fit, that another drift in turns shows as well."""
    like = look_like_drift(search.problem, at, names)
    return [name for name in like if at is None or not _is_late(search, at, name)]


def _is_late(search: Search, at: Fit, name: str) -> bool:
    """Whether a delay explains clearly more, beside missing forces, than any place ahead of the receiver does.

    Not one that the usual error of a drift leaves open, where no trial records the speed abeam.
    """
    problem, effects = search.problem, search.problem.effects
    antenna = next((one for one, effect in effects.items() if effect.cause == ANTENNA and not effect.each_trial), None)
    if not at.discrepancy or not is_within(effects[name].cause, TIMING) or antenna is None or antenna in at.effects:
        return False
    if drift_error(problem, at, name) ** 2 * problem.settings.least_noncentrality >= 1.0:
        return False
    place = equivalent_place(problem, at.point, name)
    if place is None or len(problem.columns[antenna]) != len(place):
        return False
    key = tuple(sorted({*at.effects, antenna} - {name}))
    begin = moved_to(problem, without_effects(problem, at.point, [name]), antenna, np.array(place))
    ahead = fit_once(search, key, True, begin, at.sizes, attempt=f"as far ahead as {name} is late")
    if ahead is None:
        return False
    sets = [(at.effects, True), (key, True)]
    late, drifts = counted(search, np.array([at.evidence, ahead.evidence]), sets, explained_from(search))
    return bool(late - drifts > _CLEARLY)
