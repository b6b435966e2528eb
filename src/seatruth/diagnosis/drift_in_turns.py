"""Errors of a position that a model shows as well whose vehicle drifts a little too much, or too little, in turns.

In a turn a vehicle slides outward, by a speed abeam that is nearly in proportion to its rate of turn. A receiver that
stands ahead of its place shows the same beside the truth, and so, at an even speed, does a position that is late. What
a model misses of its own drift cannot be told from them: of a ferry on which nothing acted, and whose model has another
form, a receiver was late by 0.16 s with over 99.9 %, which moves it by 4 % of what its drift does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.initial_guess import without_effects
from seatruth.diagnosis.parts import Validation
from seatruth.diagnosis.posterior import SENSOR
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.diagnosis.withdrawals import refusing, unless_it_closes
from seatruth.effects.causes import is_within
from seatruth.effects.vehicle import dimensions_of
from seatruth.models.measures import GRAVITY

_PART = 0.1
"""Part of a model's drift in turns by which it may be wrong. [S] Of that ferry 0.04. Two positions of recorded vehicles
that were late, or beside their place, and named beside something missing, moved by 0.21 and 0.54 of it, a ferry's late
one by 0.36. Of five that were named in opened cases of `experiments/withheld`, two moved by 0.07 and 0.11: their models
lacked nothing, and are not asked."""
_USUAL = 0.03
"""Part of its drift in turns, or of its length, that a model that lacks something usually misses of it (standard
deviation). [S] Of that ferry 0.04 of the drift; an antenna and a late receiver, put there, were 0.023 and 0.029 of it
off. Where the origin is near the pivot point the drift is small, and the model no better for it: of a catamaran of 4 m,
which drifts by 0.4 m, antennas were 0.16 and 0.17 m off, 0.04 of its length, as one of a river vessel was."""
_USUAL_OF_DELAYS = 0.06
"""The same of what a late position moves. [S] How soon a vehicle slides after it turns, and gains speed after its
drive, shows as a delay as well: what was off of five late receivers moved them by 0.02, 0.02, 0.03, 0.04 and, of a boat
with an outboard, by 0.12 of the length; the root of their mean square is 0.06."""
_USUAL_OF_PLANING = 0.2
"""The same of a planing craft, whose wetted hull, and drift with it, changes with speed and heel. [S] Of two boats
whose models have another form antennas were named, or led, that were where the study had them: 1.27 to 1.79 m ahead in
three states of one of 7.2 m, 0.18 to 0.25 of the length, and 4.8 m of one of 7.5 m."""
_LIFTED = 0.5
"""Froude number of the length from which a hull is lifted: below 0.4 to 0.5 it displaces water, from 1.0 it planes
(Faltinsen 2005, Hydrodynamics of High-Speed Marine Vehicles, chapter 1). [S] Of a workboat of 6.4 m at 1.3, whose model
said "ship", an antenna was 1.45 +- 0.54 m ahead of its place with 96.8 %, where it was not."""
_WITHIN = 2.0
"""Deviations of the usual error up to which an antenna's place ahead is that error: two, by convention."""
ANTENNA, TIMING = "sensor.alignment.position", "sensor.timing"
"""Causes of the place of a receiver, and of what is late."""
_REST = 0.25
"""Part of what an effect moves the positions by, in squares, that a place ahead leaves, up to which it looks like one.
[S] Of seven late positions four left 0.02 to 0.1 of it, and three 0.3 to 0.6."""


class _Place(NamedTuple):
    """The place of a receiver that moves positions as an effect does, and the drift in turns beside it."""

    ahead: float
    """In m, as are the two others."""
    abeam: float
    drift: float
    """Place ahead that would move positions as the whole drift of the model does."""
    rest: float
    """Part of what the effect moves positions by, in squares, that no place shows."""

    @property
    def is_ahead(self) -> bool:
        return abs(self.abeam) < abs(self.ahead) and self.rest < _REST


def look_like_drift(problem: Problem, fit: Fit | None, names: Sequence[str]) -> list[str]:
    """Errors of sensors, of these effects, that move positions as an error of the drift in turns within reason would.

    As large as in a fit. None where the model has no plane motion, or the trials no position. A place of the receiver
    does so as well up to a part of the vehicle's length: a model drifts no better where its own drift is small.
    """
    places = {name: _place(problem, fit.point, name) for name in names} if fit is not None else {}
    least = {name: _PART * abs(at.drift) for name, at in places.items() if at is not None and at.is_ahead}
    short = _WITHIN * _usual(problem) * _length(problem)
    least |= {name: max(part, short) for name, part in least.items() if problem.effects[name].cause == ANTENNA}
    return [name for name, at in places.items() if at is not None and abs(at.ahead) < least.get(name, 0.0)]


def equivalent_place(problem: Problem, point: Point, name: str) -> tuple[float, float] | None:
    """Place of a receiver, m ahead and to starboard, that moves positions as an error of a sensor; None for none."""
    at = _place(problem, point, name)
    return None if at is None else (at.ahead, at.abeam)


def _usual(problem: Problem) -> float:
    """Part of the length that a model usually misses of its drift in turns."""
    hidden = not _shows_drift(problem)
    return _USUAL_OF_PLANING if hidden and _is_lifted(problem) else _USUAL


def _is_lifted(problem: Problem) -> bool:
    """Whether the water lifts a good part of the hull: of a planing craft, and of any as fast for its length."""
    size, kind = dimensions_of(problem.study.model), problem.study.model.kind
    ahead = next((name for name in problem.equations if problem.study.model.standard_of(name)[0] == "u"), "")
    if kind != "ship" or size is None or not ahead or problem.discrepancy is None:
        return kind == "planing"
    return problem.discrepancy.scales[ahead] > _LIFTED * math.sqrt(GRAVITY * size.length)


def _shows_drift(problem: Problem) -> bool:
    """Whether trials record the speed abeam, over ground or through the water."""
    recorded = {one.channel for one in problem.series if len(one.rows)}
    abeam = (at for name, at in _standard(problem, problem.outputs).items() if name in ("v", "v_w"))
    return any(channel in recorded for channel, _ in abeam)


def _length(problem: Problem) -> float:
    """Of the vehicle, m; 0 where the model does not say."""
    size = dimensions_of(problem.study.model)
    return 0.0 if size is None else size.length


def drift_error(problem: Problem, fit: Fit, name: str) -> float:
    """Error of an effect's magnitudes, as a part of them, that the usual error of a model's drift in turns leaves.

    Where the model also lacks something, and no trial records the speed abeam, over ground or through the water. An
    error of the drift does not shrink with it: the usual one is a part of the vehicle's length, where that is larger.
    However many turns there are, all of them show the same drift.
    """
    if not fit.discrepancy or _shows_drift(problem):
        return 0.0
    at = _place(problem, fit.point, name)
    if at is None or not at.is_ahead:
        return 0.0
    usual = _USUAL_OF_DELAYS if is_within(problem.effects[name].cause, TIMING) else _usual(problem)
    return usual * max(abs(at.drift), _length(problem)) / abs(at.ahead)


def _standard(problem: Problem, names: Sequence[str]) -> dict[str, tuple[int, float]]:
    """Standard names of states or outputs, with their columns and signs."""
    pairs = map(problem.study.model.standard_of, names)
    return {standard: (k, sign) for k, (standard, sign) in enumerate(pairs)}


def _place(problem: Problem, point: Point, name: str) -> _Place | None:
    outputs, states = (_standard(problem, q) for q in (problem.outputs, [c.name for c in problem.model.states]))
    if not is_within(problem.effects[name].cause, SENSOR):
        return None
    if not {"x", "y"} <= {*outputs} or not {"psi", "v", "r"} <= {*states}:
        return None
    without = without_effects(problem, point, [name])
    before, after = problem.simulate(without), problem.simulate(point)
    moved, places, drift = list[Array](), list[Array](), np.zeros(2)
    for motion, first, second in zip(problem.states(without), before, after):
        psi, v, r = (sign * motion[:, k] for k, sign in (states[state] for state in ("psi", "v", "r")))
        north, east = (sign * (second - first)[:, k] for k, sign in (outputs["x"], outputs["y"]))
        # Beside the mean of each trial, whose first position is free: north, then east, of a metre ahead and abeam.
        for away, ahead, abeam in ((north, np.cos(psi), -np.sin(psi)), (east, np.sin(psi), np.cos(psi))):
            rows = np.stack([away, ahead, abeam], axis=1)
            rows = rows[np.isfinite(rows).all(axis=1)]
            rows = rows - rows.mean(axis=0) if len(rows) else rows
            moved.append(rows[:, 0])
            places.append(rows[:, 1:])
        drift += np.nansum([v * r, r * r], axis=1)
    target, columns = np.concatenate(moved), np.concatenate(places)
    whole = float(target @ target)
    if whole == 0.0 or drift[1] == 0.0:
        return None
    place = np.linalg.lstsq(columns, target, rcond=None)[0]
    rest = float(np.sum((target - columns @ place) ** 2)) / whole
    # A place ahead by `a` adds a r to the speed abeam, which is v: their quotients by r, over all trials.
    return _Place(float(place[0]), float(place[1]), float(drift[0] / drift[1]), rest)


def without_drift(
    decision: Decision,
    found: Sequence[Hypothesis],
    like: Collection[str],
    validated: Callable[[Key], Validation | None],
) -> Decision:
    """The decision where the model also lacks something, less what looks `like` an error of its drift in turns.

    A delay stays where the set surely closes a part of the gap on trials left out. An antenna does not: its place is
    the same in all trials, as that error is, which predicts them alike.
    """
    if not decision.discrepancy:
        return decision
    likely = [one for one in decision.clusters if one.member_in(decision.shown) in like]
    gone = tuple(one.member_in(decision.shown) for one in likely if one.cause == ANTENNA)
    kept = tuple(one for one in decision.clusters if one not in likely)
    gone = tuple(dict.fromkeys([*gone, *unless_it_closes(decision, kept, validated)]))
    kept = tuple(one for one in decision.clusters if one.member_in(decision.shown) not in gone)
    return refusing(decision, found, kept, drift=gone) if gone else decision
