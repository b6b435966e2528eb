"""What is significant, but too small to be the cause of the gap, and is not named.

It closes next to nothing of the gap of the trials, or of that of trials left out, or is next to nothing by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.outdone import shows_in_its_sensor
from seatruth.diagnosis.parts import Validation
from seatruth.diagnosis.posterior import ENVIRONMENT, SENSOR
from seatruth.diagnosis.sensor_errors import SensorErrors
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.diagnosis.withdrawals import CERTAIN, as_unknown, closed, keeping, others, probably_lacking
from seatruth.effects import Effect
from seatruth.effects.causes import is_within
from seatruth.effects.each_trial import EachTrial, follows_each_trial

_UNTIMED = 1.0 / math.sqrt(12.0)
"""Sampling steps by which a record is off in time anyway: the standard deviation of what is uniform over a step. Of an
AUV on which nothing acted, but which rolls and its model does not, rudders that were measured every 0.2 s, and moved by
30 deg/s, had a rate limit of 28 deg/s, at 99.9 %: it made them late by 0.03 s."""
_LITTLE = 0.1
"""Part of the gap on trials left out below which what moves the trials by little surely stays. [S] Lags of 0.05 s,
which acted, of two vehicles that their models miss by far: 0.04 and 0.055."""
_TYPICAL = 0.5
"""Size, over a typical one, from which what acts is never of no practical size. [S] Those lags had 0.17 and 0.2."""
_MOST = 0.5
"""Part of the gap from which what is next to nothing for what it is, is its cause all the same. [S] Of six such in two
opened sets of `experiments/withheld` (2026-11-30), which closed 0.88 of it or more, or acted where the model met its
noise, all acted; they were "not in the library"."""
_OF_SPEED = frozenset({"sensor.bias_or_scale.speed", "sensor.alignment.speed"})
"""Errors of a speed sensor that a speed shows at once."""


class Measured(Protocol):
    """How large the effects of an answer are, by their names; see `Gap`."""

    def share(self, name: str) -> float:
        """Part of the gap that it closes; NaN where nobody can say."""

    def part_moved(self, name: str) -> float:
        """What it moves the trials by over what runs miss, in squares."""

    def typical_sizes(self, name: str) -> float:
        """Its size over a typical one."""

    def is_of_evidence(self, name: str) -> bool:
        """Whether that part is of the evidence, since runs stray, and not of the misfit."""

    def steps_late(self, name: str) -> float:
        """How late a rate limit makes what is recorded, in sampling steps; inf of another effect."""

    def closed_in_its_sensor(self, name: str) -> float:
        """Part of what runs miss of its sensor that an error of that closes."""


def without_small(
    decision: Decision,
    found: Sequence[Hypothesis],
    effects: Mapping[str, Effect],
    gap: Measured,
    settings: Settings,
) -> Decision:
    """The decision, where what it names is worth naming.

    Where the model also lacks something that no effect describes, and nothing that is named closes a part of the gap
    that matters, the gap is that something's: the cause is unknown. Errors of sensors that are nearly certain, and of
    a usual size, stay: a late receiver is late whatever the hull lacks. Beside other causes, an effect whose phase
    belongs to one trial is none where it closes next to nothing: with a phase of its own in each zigzag a wave follows
    what any model leaves of it.
    """
    share = gap.share
    kept = tuple(
        one
        for one in decision.clusters
        if not follows_each_trial(effects[one.effects[0]]) or not _small(one, decision, share, settings)
    )
    if decision.discrepancy and 0 < len(kept) < len(decision.clusters):
        decision = keeping(decision, kept)
    names = [cluster.member_in(decision.shown) for cluster in decision.clusters]
    if not names or not decision.discrepancy or _explains(names, share, settings):
        return decision
    certain = tuple(
        one
        for one, name in zip(decision.clusters, names, strict=True)
        if is_certain_error(one, gap.typical_sizes(name))
    )
    if certain:
        return decision if len(certain) == len(names) else keeping(decision, certain)
    lacking = probably_lacking(found)
    return Decision("unknown", (), lacking, True, (), decision.form, decision.along, tuple(names))


def without_tiny(
    decision: Decision,
    found: Sequence[Hypothesis],
    measured: Measured,
    size: Callable[[Cluster], float],
    settings: Settings,
    *,
    gap: bool,
) -> Decision:
    """The decision less what is next to nothing for what it is, unless it is most of the gap, which then is small too.

    A fault may be of any size, but one that is a hundredth of a typical one is rarely what a record shows beside other
    causes: it takes the shape of something else. So does a rate limit that only cuts the fastest moves that were
    recorded. Where nothing else is named, the cause is unknown if the refitted model leaves a `gap`, and these trials
    cannot decide if it leaves no more than noise. Of runs that stray nobody can say what part of the gap it is. The
    `size` of a cause, over a typical one, is that of its largest effect: a drift of waves may be a usual wind.
    """

    def is_tiny(cluster: Cluster) -> bool:
        name = cluster.member_in(decision.shown)
        if measured.steps_late(name) < _UNTIMED:
            return True
        if not size(cluster) < settings.tiny:
            return False
        return measured.is_of_evidence(name) or measured.share(name) < _MOST

    kept = tuple(one for one in decision.clusters if not is_tiny(one))
    if len(kept) == len(decision.clusters):
        return decision
    tiny = tuple(one.member_in(decision.shown) for one in decision.clusters if one not in kept)
    if kept:
        return replace(keeping(decision, kept), small=tiny)
    if gap:
        return replace(as_unknown(decision, probably_lacking(found, tiny), decision.outdone), small=tiny)
    return Decision("underpowered", (), decision.probability, False, (), small=tiny)


def without_negligible(
    decision: Decision,
    found: Sequence[Hypothesis],
    effects: Mapping[str, Effect],
    validated: Callable[[Key], Validation | None],
    gap: Measured,
    settings: Settings,
    shows: Callable[[str, Key], Sequence[SensorErrors]] = lambda name, key: (),
) -> Decision:
    """The decision less what surely closes next to nothing of the gap on trials left out, beside something unknown.

    For runs that stray from their records, whose misfit tells no share: of a planing boat that its model misses by 90
    times the noise a lag of 0.06 s, which acts, was named the cause, and closed -5 to 4 % of the gap. It must also move
    the trials by little of what runs miss, in squares: such runs come no nearer with a current that acts. And its size,
    in typical ones, is small: a plane's lag of 0.37 s, of an AUV whose heading its model misses by a radian, is not. Of
    several causes one is small without which the others close as much. An error of a sensor is small beside what that
    sensor shows: that of a speed, which does not drift away as an angle does, where it closes next to nothing of what
    runs miss there, and any that is not nearly certain. So is one that is neither nearly certain nor of a usual size
    beside other causes that close as much without it: of a tanker in a basin whose antenna was moved, a gyro scaled by
    0.5 % had 97 %. Either stays where it `shows` beside free terms: of a tanker in
    a basin, whose runs stray by 24 times the noise, a log scaled by 3 % had 94 %, and these came no nearer with it.
    What has its own size or phase in each trial is not predicted.
    """
    validation = validated(decision.shown) if decision.clusters and decision.discrepancy else None
    if validation is None:
        return decision
    none_closes = validation.upper < _LITTLE and validation.gap_explained < settings.small_share

    def as_much_without(one: Cluster) -> bool:
        rest = others(decision, one)
        return len(rest) > 0 and closed(validated(rest)) > closed(validation) - settings.small_share > -math.inf

    def negligible(one: Cluster, effect: Effect) -> bool:
        if is_within(one.cause, SENSOR):
            usual = gap.typical_sizes(effect.name) > _TYPICAL
            doubtful = one.probability < CERTAIN and (none_closes or (not usual and as_much_without(one)))
            little = effect.cause in _OF_SPEED and gap.closed_in_its_sensor(effect.name) < settings.small_share
            return (doubtful or little) and not shows_in_its_sensor(shows(effect.name, decision.shown))
        if follows_each_trial(effect) or isinstance(effect, EachTrial):
            return False
        if not gap.part_moved(effect.name) < settings.small_share or gap.typical_sizes(effect.name) > _TYPICAL:
            return False
        return none_closes or (not is_within(effect.cause, ENVIRONMENT) and as_much_without(one))

    members = {one: effects[one.member_in(decision.shown)] for one in decision.clusters}
    kept = tuple(one for one, effect in members.items() if not negligible(one, effect))
    if len(kept) == len(decision.clusters):
        return decision
    small = tuple(effect.name for one, effect in members.items() if one not in kept)
    if kept:
        return replace(keeping(decision, kept), small=small)
    return replace(as_unknown(decision, probably_lacking(found, small), decision.outdone), small=small)


def is_certain_error(cluster: Cluster, size: float) -> bool:
    """Whether a cause is an error of a sensor that is nearly certain, and of a usual `size` over a typical one."""
    return is_within(cluster.cause, SENSOR) and cluster.probability >= CERTAIN and size > _TYPICAL


def _small(cluster: Cluster, decision: Decision, share: Callable[[str], float], settings: Settings) -> bool:
    return share(cluster.member_in(decision.shown)) < settings.small_share


def _explains(names: Sequence[str], share: Callable[[str], float], settings: Settings) -> bool:
    """Whether one of these effects closes a part of the gap that matters, as far as anybody can say."""
    return any(not share(name) < settings.small_share for name in names)
