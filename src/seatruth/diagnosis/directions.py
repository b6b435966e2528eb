"""Effects with a direction on the earth, each fitted in the place of another one.

At its null a wind has no slope, and from a wrong direction its fit falls back there. What one effect of a leading set
has shown of the direction holds for those that it can be confused with: they begin along it, with the size that leaves
least to missing forces. So what looks alike is compared at its own optimum, not at where its search happened to end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import HOPE, Key, Search
from seatruth.diagnosis.hypothesis_fits import fit_once
from seatruth.diagnosis.initial_guess import started, starting
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Point
from seatruth.diagnosis.sizes import log_prior
from seatruth.diagnosis.steps import objective
from seatruth.effects import Effect

_PARTS = (1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0, 4.0)
"""Sizes from which an effect is tried, over its typical one. [S]"""
_BETTER = 1.0
"""nats by which a set must have risen for what looks like it to be fitted from it again. [S] Between look-alikes a nat
decides, and of a ship on a pond the drift of waves had gained four late in the search."""
_ASIDE = math.pi / 4
"""Angle from its waves beyond which a drift may stand at another optimum. [S] Where it stood at one, 86 and 93 deg."""


def fit_directions(found: Search, leaders: Sequence[Fit]) -> None:
    """Fits these sets with each effect that has a direction replaced by each that is confused with it.

    What comes with waves begins along these. No set is fitted so again that has not risen since.
    """
    for leader in leaders:
        if found.bare and leader.discrepancy:
            continue  # forces of a black box, which bring nothing beside it
        fit_along_waves(found, leader)
        for name in leader.effects:
            for other in _confused(found, leader, name):
                count = _times(found, leader, name, other)
                if not count:
                    continue
                key = tuple(sorted((*(n for n in leader.effects if n != name), other)))
                shown = np.array([leader.point.shared[k] for k in _components(found, name)])
                start = _in_its_place(found, leader, name, other, shown)
                words = f"along the direction of {name} in {'+'.join(leader.effects)}"
                words += f", {count}" if count > 1 else ""
                if start is not None and _hopeful(found, leader, key, start):
                    _fit_from(found, leader, key, start, words)
                start = _as_alone(found, leader, key, name, other)
                if start is not None and _hopeful(found, leader, key, start):
                    _fit_from(found, leader, key, start, f"{words}, with its own values")


def _fit_from(found: Search, leader: Fit, key: Key, start: Point, attempt: str) -> None:
    on, stop = leader.discrepancy, found.known_end(key, leader.discrepancy)
    fit_once(found, key, on, start, leader.sizes, attempt=attempt, rival=leader.evidence, stop=stop)


def _as_alone(found: Search, leader: Fit, key: Key, name: str, other: str) -> Point | None:
    """The point of a leader with an effect replaced by another with the values that it has alone.

    None where it was not fitted alone, or is already no further behind than a wrong form costs. Beside two other
    effects the wind of a ship on a pond, begun along its drift, was 0.4 m/s; alone it was 1.5 m/s, near that day's 1.3.
    """
    problem, got, alone = found.problem, found.fits.get((key, leader.discrepancy)), found.best((other,))
    near = leader.evidence - problem.settings.unseen_form
    if alone is None or len(key) < 2 or (got is not None and got.evidence > near):
        return None
    values = alone.point.shared[problem.columns[other]]
    bare = started(problem, leader, name, problem.mean[problem.columns[name]])
    return started(problem, replace(leader, point=bare), other, values)


def _times(found: Search, leader: Fit, name: str, other: str) -> int:
    """How many times an effect of a set was replaced by another, with this one; 0 if the set has not risen since."""
    before = found.replaced.setdefault((leader.effects, leader.discrepancy, name, other), [])
    if before and leader.evidence < before[-1] + _BETTER:
        return 0
    before.append(leader.evidence)
    return len(before)


def fit_along_waves(found: Search, leader: Fit) -> None:
    """Fits a set in which waves act anew, with their drift where they run to, unless it is near that.

    Beside a current the drift of a sea ended at another optimum, 90 deg from its waves, whose direction was known to a
    degree; begun along them it has 145 nats more. Of another sea the drift without a current had 200 nats less than it
    has, and stood behind currents of 0.03 m/s.
    """
    problem = found.problem
    for name in leader.effects:
        order = [q.name for q in problem.effects[name].parameters]
        drift = next((n for n in problem.effects[name].comes_with if n in leader.effects), None)
        if drift is None or "towards" not in order or not problem.effects[drift].direction:
            continue
        towards = leader.point.shared[problem.columns[name][order.index("towards")]]
        north, east = leader.point.shared[_components(found, drift)]
        aside = abs(math.remainder(math.atan2(east, north) - towards, math.tau))
        count = _times(found, leader, drift, drift) if aside > _ASIDE else 0
        if not count:
            continue
        # Of its usual size: what is small ends where it was, since a current takes up what it does to the motion.
        start = _in_its_place(found, leader, drift, drift, np.array([np.cos(towards), np.sin(towards)]), (1.0,))
        if start is not None:
            words = f"{drift} along {name}, {count}"
            fit_once(
                found, leader.effects, leader.discrepancy, start, leader.sizes, attempt=words, rival=leader.evidence
            )


def _hopeful(found: Search, leader: Fit, key: Key, start: Point) -> bool:
    """Whether a set may come near a leader from a point, as linearized there.

    Of what looks like a leader, in trials of ships and of the benchmark, the linearized evidence there is within 30
    nats of the fitted one; of what does not, thousands behind.
    """
    least = leader.evidence - max(HOPE, (leader.evidence - found.null.evidence) / 2.0)
    return promised(found, leader, key, start) > least


def promised(found: Search, leader: Fit, key: Key, start: Point) -> float:
    """Linearized evidence (nats) of a set at a point, under a leader's sizes; -inf where its runs diverge there."""
    problem = found.problem
    at = problem.linearize(start, key, discrepancy=leader.discrepancy)
    if not np.isfinite(at.errors).all():
        return -math.inf
    value = Likelihood(problem, at).evidence(leader.sizes, key)
    return value + log_prior(problem.settings, leader.sizes, found.known) - leader.price


def _confused(found: Search, leader: Fit, name: str) -> list[str]:
    effects = found.problem.effects
    one = effects[name]

    def alike(other: Effect) -> bool:
        near = other.name in one.confused_with or name in other.confused_with
        return near and bool(other.direction) and not other.each_trial and other.name not in leader.effects

    return [other.name for other in effects.values() if alike(other)] if one.direction and not one.each_trial else []


def _in_its_place(
    found: Search, leader: Fit, name: str, other: str, shown: Array, parts: Sequence[float] = _PARTS
) -> Point | None:
    """The point of a fit with one effect replaced by one along a direction; None where the model diverges there.

    `shown` (2,) are the components of that direction, north and east; None as well where both are 0. Of `parts` of the
    typical size, that is taken which leaves least to missing forces.
    """
    problem = found.problem
    if not shown.any():
        return None
    bare = started(problem, leader, name, problem.mean[problem.columns[name]])
    columns, places = problem.columns[other].tolist(), _components(found, other)
    power = problem.effects[other].power
    typical = float(np.mean(problem.sd[places])) / problem.settings.prior_width**power
    rest = [n for n in leader.effects if n != name]
    best: tuple[float, Point] | None = None
    begin = starting(problem, replace(leader, point=bare))
    for part in parts:
        values = problem.mean[columns].copy()
        values[[columns.index(k) for k in places]] = part**power * typical * shown / np.linalg.norm(shown)
        point = begin(other, values)
        errors = problem.errors(point)
        if np.isfinite(errors).all():
            left = objective(problem, point, errors, leader.sizes, rest, leader.likelihood)
            if best is None or left < best[0]:
                best = left, point
    return None if best is None else best[1]


def _components(found: Search, name: str) -> list[int]:
    """Columns of the components of an effect's direction."""
    effect = found.problem.effects[name]
    order = [q.name for q in effect.parameters]
    return [int(found.problem.columns[name][order.index(component)]) for component in effect.direction]
