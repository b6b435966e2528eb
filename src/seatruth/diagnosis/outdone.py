"""Whether what is named comes nearer to trials left out than nothing does, than free terms, or than a part of it.

Where it does not, a model of another form explains the trials, and the effects only take its shape.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.parts import Validation
from seatruth.diagnosis.posterior import SENSOR
from seatruth.diagnosis.sensor_errors import SensorErrors
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.diagnosis.withdrawals import (
    CERTAIN,
    MOST,
    as_unknown,
    closed,
    keeping,
    others,
    probably_lacking,
    refusing,
)
from seatruth.effects import Effect
from seatruth.effects.causes import is_within
from seatruth.effects.each_trial import EachTrial, follows_each_trial

_MISSED = 0.25
"""Part of the gap by which what an error of a sensor closes on trials left out falls short of what it would close if it
acted, from which it does not act. [S] 10 % of the depth, of a glider whose hull its model has too slippery, fell short
by 0.96; the bias of a ship's gyro in a basin, which moves its runs by a fortieth of what they miss, by nothing."""
_LITTLE = 0.1
"""Part of the gap that free terms may close on trials left out, for what is of its own in each trial to stand by
what it closes itself. [S] Of a glider in a current of its own in each dive they closed 0.4 %, and the current 95 %."""
_NO_FARTHER = 0.05
"""Part of the gap by which trials left out may be missed by more with a certain error of a sensor that hides in it. [S]
Of a ferry of another form, whose receiver was 0.8 s late, 48 nats and over 99.9 %, with it by 0.002; of a boat on which
nothing acted, with an antenna 0.17 m from its place, by a quarter."""
_STANDS_OUT = 1.1
"""Part of the noise from which what is left of a sensor's channels stands above it. [S]"""


def without_outdone(
    decision: Decision,
    found: Sequence[Hypothesis],
    effects: Mapping[str, Effect],
    validated: Callable[[Key], Validation | None],
    moves: Callable[[str], float],
    shared: Collection[str] = (),
    shows: Callable[[str, Key], Sequence[SensorErrors]] = lambda name, key: (),
    *,
    strays: bool = True,
) -> Decision:
    """The decision, where what it names predicts more of trials left out than nothing, or free terms, do.

    Where the gap does not shrink surely on trials left out, and free terms in the equations, the same in all trials,
    shrink it more, or nothing does, and the terms shrink it no less than together with the named effects, then a model
    of another form explains the trials, and the effects only take its shape. Effects whose phase belongs to one trial,
    as that of waves, stay: others do not predict them. Effects with a size of their own in each trial do not stand by
    what they add to the terms: they follow whatever the terms leave of a trial. They stand where the terms close next
    to nothing, and trials left out are predicted much better once such a size is fitted to them: no trial tells the
    size of another, so that beside it, left open in both, the same trial without it errs as little. What has a
    direction on the earth that trials on several courses `shared` stays where runs stray, which then tell nothing.

    Errors of a sensor that are small beside what such runs miss stay: they change what one sensor says, which no term
    can without moving the others. What one `moves` the trials by, in deviations of the noise, tells how much nearer the
    set comes to trials left out than the same set without it, if it acts; where it comes less near, the error falls.
    Those stay as well that close, beside the terms, what these leave of the sensor's own channels, which a set `shows`.
    Where no run `strays`, nothing hides an error that acts, and what comes no nearer at all falls: of a boat on which
    nothing acted, an antenna 0.17 m from its place had over 99.9 %, and predicted trials left out worse by a quarter.
    `validated` tries a set of effects on trials left out. Where several do not stand, one is taken away and the others
    are asked again: that one without which they come nearest to trials left out.
    """
    left = decision
    while fallen := _outdone_of(left, effects, validated, moves, shared, shows, strays=strays):
        worst = max(fallen, key=lambda one: closed(validated(others(left, one)))) if len(fallen) > 1 else fallen[0]
        kept = tuple(one for one in left.clusters if one is not worst)
        outdone = (*left.outdone, worst.member_in(left.shown))
        if not kept:
            return as_unknown(left, probably_lacking(found, outdone), outdone)
        left = replace(keeping(left, kept), discrepancy=True, outdone=outdone)
    return left


def without_hindering(
    decision: Decision,
    found: Sequence[Hypothesis],
    validated: Callable[[Key], Validation | None],
    fitted: Callable[[Key], object | None],
) -> Decision:
    """The decision, where runs stray, less causes without which the others surely close a part of the gap.

    The forces of each trial hold such runs near their records, and what these leave to explain may be anything: where
    trials left out can decide, they do. Errors of sensors, which are small beside such a gap, take no part. The others
    stand by whichever of their effects are `fitted` together; of several causes that goes without which most is closed.
    Of a model ship on a pond, whose positions were late, the thrusters seemed to be late as well, by 73 nats. With a
    wind alone beside the positions 58 % of the gap on trials left out were closed (35 to 82 %), with the thrusters
    beside both 35 % (-45 to 114 %).
    """
    left = decision
    while len(left.clusters) > 1:
        whole = validated(left.shown)
        if whole is None or whole.lower > 0.0:
            break
        closing: list[tuple[float, Cluster, Key]] = []
        for cluster in (one for one in left.clusters if not is_within(one.cause, SENSOR)):
            rest = [one.effects for one in left.clusters if one is not cluster]
            for key in (tuple(sorted({*names})) for names in itertools.product(*rest)):
                without = validated(key) if len(key) == len(rest) and fitted(key) is not None else None
                if without is not None and without.lower > 0.0 and closed(without) > closed(whole):
                    closing.append((closed(without), cluster, key))
        if not closing:
            break
        _, gone, key = max(closing, key=lambda one: one[0])
        kept = tuple(one for one in left.clusters if one is not gone)
        left = replace(refusing(left, found, kept, refused=(gone.member_in(left.shown),)), shown=key, discrepancy=True)
    return left


def _outdone_of(
    decision: Decision,
    effects: Mapping[str, Effect],
    validated: Callable[[Key], Validation | None],
    moves: Callable[[str], float],
    shared: Collection[str],
    shows: Callable[[str, Key], Sequence[SensorErrors]],
    *,
    strays: bool,
) -> list[Cluster]:
    """The causes of a decision that do not stand, as `without_outdone` has it."""
    validation = validated(decision.shown) if decision.clusters else None
    if validation is None or not max(0.0, validation.control) > validation.gap_explained:
        return []
    surely, adds = validation.lower > 0.0, _adds(validation)

    def stands(cluster: Cluster) -> bool:
        name = cluster.member_in(decision.shown)
        if is_within(cluster.cause, SENSOR):
            rest = others(decision, cluster)
            without = validated(rest) if rest else None
            nearer = validation.gap_explained > (-_NO_FARTHER if cluster.probability >= CERTAIN else 0.0)
            hides = (strays or nearer) and _hides(moves(name), without, validation)
            return hides or _shows_beside_terms(without, validation) or shows_in_its_sensor(shows(name, decision.shown))
        if surely or name in shared or follows_each_trial(effects[cluster.effects[0]]):
            return True
        if isinstance(effects[name], EachTrial):
            return _closes_its_own(validation, validated(others(decision, cluster)))
        return adds

    return [one for one in decision.clusters if not stands(one)]


def _closes_its_own(having: Validation, without: Validation | None) -> bool:
    """Whether what has a size of its own in each trial closes most of what is missed without it, and terms do not."""
    if without is None or not without.control <= _LITTLE:
        return False
    pairs = [(fold.error_noise, before, fold.error_effects) for fold, before in zip(having.folds, _errors(without))]
    missed = sum(before - noise for noise, before, _ in pairs)
    return missed > 0.0 and sum(after - noise for noise, _, after in pairs) < (1.0 - MOST) * missed


def _hides(moved: float, without: Validation | None, having: Validation) -> bool:
    """Whether an effect that moves trials by so much may act though with it they come no nearer than was found.

    What acts leaves the rest of a trial's error, in squares; at least noise is left. Where nothing is `without` it, it
    stands beside the refitted model. An error that grew by more than an effect moves a trial is not that effect's: fits
    without forces, where they miss much, end at one optimum or another. What closes little itself, where free terms
    come nearer to the trials, must not fall short beside these either: of a planing boat on which nothing acted, whose
    runs missed up to 11 deviations, an antenna 5 m ahead of its place, which moves them by 4, could hide in that, but
    not in the 1 to 9 that terms left.
    """
    folds = having.folds
    alone = [fold.error_refit for fold in folds] if without is None else _errors(without)
    pairs = [(fold.error_noise, before, fold.error_effects) for fold, before in zip(folds, alone, strict=True)]
    gap = sum(fold.error_refit - fold.error_noise for fold in folds)
    closes = sum(before - after for _, before, after in pairs)
    if not _comes_nearer(pairs, moved, gap):
        return False
    terms = [fold.error_discrepancy for fold in folds] if without is None else [f.error_both for f in without.folds]
    pairs = [(fold.error_noise, before, fold.error_both) for fold, before in zip(folds, terms, strict=True)]
    fitted = all(math.isfinite(after) for _, _, after in pairs)
    if closes > _MISSED * gap or not fitted or not sum(terms) < sum(alone):
        return True
    return _comes_nearer(pairs, moved, sum(before - noise for noise, before, _ in pairs))


def _comes_nearer(pairs: Sequence[tuple[float, float, float]], moved: float, gap: float) -> bool:
    """Whether errors (noise, without, with) fall as those of an effect that moves a trial by so much, but for a part of
    the gap."""
    left = 0.0
    for noise, before, after in pairs:
        expected = max(noise, math.sqrt(max(0.0, before**2 - moved**2)))
        left += min(after, before + moved) - expected
    return not left >= _MISSED * gap


def _shows_beside_terms(without: Validation | None, having: Validation) -> bool:
    """Whether beside free terms an effect closes most of what these leave of most trials left out.

    Where a model of another form misses whole runs by far, refitted coefficients take up much of an error that acts,
    and runs without terms come no nearer with it. Beside terms, which take the place of the form, they do: of a ferry
    whose receiver was 2.5 s late 60 % in the median, where the scale of a depth that was right closed 15 %.
    """
    folds = having.folds
    alone = [fold.error_discrepancy for fold in folds] if without is None else [f.error_both for f in without.folds]
    left = [(fold.error_noise, before, fold.error_both) for fold, before in zip(folds, alone, strict=True)]
    closed_most = sum(before > noise and both - noise < (1.0 - MOST) * (before - noise) for noise, before, both in left)
    return 2 * closed_most > len(left)


def shows_in_its_sensor(errors: Sequence[SensorErrors]) -> bool:
    """Whether an error of a sensor closes most of what free terms leave of its own channels, in most trials left out.

    Over all channels it may drown: of a launch whose gyro read 8 % too much the terms left 1.5 to 3.5 deviations of
    the rate of turn in five of six trials, and 1.0 to 1.1 with it; positions and heading, which no gyro touches, stayed
    where they were, and over all channels three trials were closed by half.
    """
    closed_most = [
        one.without > _STANDS_OUT * one.noise and one.having - one.noise < (1.0 - MOST) * (one.without - one.noise)
        for one in errors
    ]
    return 2 * sum(closed_most) > len(errors)


def _errors(validation: Validation) -> list[float]:
    return [fold.error_effects for fold in validation.folds]


def _adds(validation: Validation) -> bool:
    """Whether effects predict most trials left out better beside free terms than the terms do alone.

    Not in the mean: in one trial that a model of another form misses by far, they may do no better.
    """
    pairs = [(fold.error_discrepancy, fold.error_both) for fold in validation.folds]
    return 2 * sum(both < alone for alone, both in pairs) > len(pairs)
