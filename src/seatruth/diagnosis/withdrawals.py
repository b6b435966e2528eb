"""What is taken back of a decision once it is seen what its causes close of the gap, and what they predict of it.

What is too small to be the cause stands in `practical_size.py`, what trials left out are predicted better without in
`outdone.py`. Of nine other things nothing is named: what explains the trials only together with its opposite, what may
as well be something that cannot be tried, what trials disagree about so far that it may be nothing, what is neither
sure nor much, what is no longer significant without these, what stands only beside an effect of a size that nobody
believes, what does not surely predict where motion is taken for noise, and where the model leaves no more than noise
what no trial left out could show, and what is neither sure nor of one kind.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.decision import SURELY, Decision, kind_of
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.parts import Validation
from seatruth.diagnosis.posterior import ENVIRONMENT
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.effects import Effect
from seatruth.effects.causes import is_within
from seatruth.effects.each_trial import follows_each_trial

_ALONE = 0.1
"""Part of the evidence of several effects that one of them, or some, must explain without the others. [S] Of 20 pairs
named in opened cases of `experiments/withheld` and recorded trials, 19 had 0.28 or more, all that acted among them; of
a rudder that stalls, its offset and a bank had 0.0 each."""
MOST = 0.5
"""Part of the gap from which most of it is closed, where too few trials bound it. [S] Of a launch, true
causes closed 0.99 and 1.00 of it, others 0.11 and 0.20."""

_SURE, _MUCH = 0.9, 0.2
"""Probability from which a cause is sure, and part of the gap that is much of it. [S]"""
CERTAIN = 0.99
"""Probability from which an error of a sensor stands though it closes next to nothing of a gap of unknown cause. [S] A
receiver of 0.5 s, which was late, had over 0.999; a log scaled by 5 %, which was right, 0.77."""
_AS_MUCH = 0.05
"""Part of the gap within which two sets close as much, that which is said to be of no practical size."""


def without_opposed(decision: Decision, found: Sequence[Hypothesis]) -> Decision:
    """The decision, unless it names effects that explain the trials only together, where the model also lacks forces.

    Faults have nothing to do with each other, and what one of them explains it explains without the other. Two that
    push opposite ways, and of which neither explains anything alone, have between them the form of something else. What
    may stand in the place of one of them explains alone what that does.
    """
    names = {cluster.member_in(decision.shown) for cluster in decision.clusters}
    if len(names) < 2 or not decision.discrepancy:
        return decision
    evidence: dict[frozenset[str], float] = {}
    for one in found:
        key = frozenset(one.effects)
        evidence[key] = max(one.log_evidence, evidence.get(key, -math.inf))
    none, whole = evidence.get(frozenset(), 0.0), evidence.get(frozenset(decision.shown), math.inf)
    causes = [{*cluster.effects, *cluster.counted} for cluster in decision.clusters]
    parts = [value for key, value in evidence.items() if _is_part(key, causes)]
    if not parts or not max(parts) - none < _ALONE * (whole - none) < math.inf:
        return decision
    part = tuple(sorted(names))
    return Decision("unknown", (), probably_lacking(found, part), True, (), decision.form, decision.along, part=part)


def _is_part(key: Collection[str], causes: Sequence[Collection[str]]) -> bool:
    """Whether a set has an effect of some of these causes, one of each, but not of all."""
    own = [next((k for k, effects in enumerate(causes) if name in effects), -1) for name in key]
    return 0 < len(own) < len(causes) and len(set(own)) == len(own) and -1 not in own


def without_unseen(decision: Decision, found: Sequence[Hypothesis], effects: Mapping[str, Effect]) -> Decision:
    """The decision where the refitted model leaves no more than noise, less what each trial has its own of.

    No other trial predicts them, and there is no gap in which they show: with a phase of its own in each trial, a wave
    follows whatever a controller's limit cycle, or another form of the model, leaves below the noise.
    """
    kept = tuple(one for one in decision.clusters if not follows_each_trial(effects[one.effects[0]]))
    if len(kept) == len(decision.clusters):
        return decision
    unseen = tuple(one.member_in(decision.shown) for one in decision.clusters if one not in kept)
    if not kept:
        lacking = probably_lacking(found, unseen)
        return Decision("unknown", (), lacking, True, (), decision.form, decision.along, unseen)
    return keeping(decision, kept)


def without_vague(decision: Decision, found: Sequence[Hypothesis]) -> Decision:
    """The decision where the refitted model leaves no more than noise, less what is neither sure nor of one kind.

    That is below 0.9, and several effects that have no more than their family in common. There is no gap that it could
    close on trials left out, so that nothing but its probability speaks for it. Of a hull of another form on which
    nothing acted, the scale of a speed or another error of a sensor had 64 %.
    """
    vague = [one for one in decision.clusters if one.probability < _SURE and len(one.effects) > 1 and _of_a_family(one)]
    kept = tuple(one for one in decision.clusters if one not in vague)
    if not vague or kept:
        return keeping(decision, kept) if vague else decision
    none = sum(one.probability for one in found if not one.effects and not one.discrepancy)
    acts = none <= SURELY
    first = max(vague, key=lambda one: one.probability)
    which = first.effects if acts else ()
    return Decision("underpowered", (), first.probability, False, (), acts=acts, vague=which, possible=which)


def _of_a_family(cluster: Cluster) -> bool:
    """Whether its effects have no more in common than the family of their causes, such as `sensor`."""
    return "." not in cluster.cause


def others(decision: Decision, cluster: Cluster) -> Key:
    """The shown effects less the one of a cause."""
    return tuple(name for name in decision.shown if name != cluster.member_in(decision.shown))


def closed(validation: Validation | None) -> float:
    """Part of the gap that effects close on trials left out; -inf where nobody can say."""
    explained = math.nan if validation is None else validation.gap_explained
    return explained if math.isfinite(explained) else -math.inf


def without_untried(
    decision: Decision,
    found: Sequence[Hypothesis],
    effects: Mapping[str, Effect],
    validated: Callable[[Key], Validation | None],
    *,
    forces: bool,
) -> Decision:
    """The decision less what may as well be something that cannot be tried on the model.

    That is a drift where the model also lacks something, and any effect where no missing `forces` can be tried. It
    stays where it closes most of the gap on trials left out, or surely a part. Of a launch in wind, whose model takes
    no outside force, the hull's moment in a current towards 319 deg stood for that of a wind towards 138 deg; of one
    whose damping is quadratic, beside an opaque simulator, shallow water had over 99.9 %.
    """
    if forces and not decision.discrepancy:
        return decision
    kept = tuple(
        one for one in decision.clusters if forces and not effects[one.member_in(decision.shown)].stands_for_untried
    )
    validation = validated(decision.shown) if len(kept) < len(decision.clusters) else None
    if len(kept) == len(decision.clusters) or (validation is not None and _closes(validation)):
        return decision
    untried = tuple(one.member_in(decision.shown) for one in decision.clusters if one not in kept)
    if kept:
        return replace(keeping(decision, kept), untried=untried)
    return replace(as_unknown(decision, probably_lacking(found, untried), decision.outdone), untried=untried)


def _closes(validation: Validation) -> bool:
    """Whether effects close most of the gap on trials left out, or surely a part of it."""
    return validation.lower > 0.0 or validation.gap_explained > MOST


def without_taken_for_noise(
    decision: Decision,
    found: Sequence[Hypothesis],
    agreed: Collection[str],
    validated: Callable[[Key], Validation | None],
) -> Decision:
    """The decision, where motion is taken for noise, less what not every trial left out is predicted better with.

    What the forces of time do not follow is then in the residuals, and effects take its shape. Of an AUV in which oil
    ran fore and aft, depth sensor and log seemed to stand 0.4 m from their places, at over 99.9 %; one trial was
    predicted worse by 14 and 23 nats. With a current of a boat in a short sea, and with a compass that was 3 deg off,
    all six were better, and `agreed`. All stays where the set surely closes a part of the gap on trials left out.
    """
    members = {one: one.member_in(decision.shown) for one in decision.clusters}
    kept = tuple(one for one, name in members.items() if name in agreed)
    gone = unless_it_closes(decision, kept, validated)
    return refusing(decision, found, kept, refused=gone) if gone else decision


def without_disputed(
    decision: Decision,
    found: Sequence[Hypothesis],
    effects: Mapping[str, Effect],
    sure: Collection[str],
    validated: Callable[[Key], Validation | None],
) -> Decision:
    """The decision less what trials disagree about so far that its size cannot be told from none.

    What is not `sure` stays where the set surely closes a part of the gap on trials left out, and so does the weather,
    about which trials may well disagree: of a ship on a pond, four turns are 3 errors from no wind, that of the day.
    """
    members = {one: one.member_in(decision.shown) for one in decision.clusters}
    kept = tuple(one for one, name in members.items() if name in sure or is_within(effects[name].cause, ENVIRONMENT))
    gone = unless_it_closes(decision, kept, validated)
    return refusing(decision, found, kept, refused=gone) if gone else decision


def without_little(
    decision: Decision,
    found: Sequence[Hypothesis],
    share: Callable[[str], float],
    validated: Callable[[Key], Validation | None],
    agreed: Callable[[str], bool],
) -> Decision:
    """The decision where the model also lacks something, less what is neither sure nor much.

    That is below 0.9 and closes less than a fifth of the gap. It stays where the set surely closes a part of the gap on
    trials left out by it. Of a boat whose outer propeller drew air in turns, a rate limit of the thrusters had 81 %,
    closed 9 % of the gap, and 14 % of it on trials left out (-41 to 69 %).

    Wind and water that moves are there on any day, and are no fault that must be sure: what each trial left out has
    `agreed` about stays. Of a model ship on a pond in a wind of 1.5 m/s each of five days' trials was predicted better
    with the weather, by 2 to 8 nats; beside late positions and thrusters it had 69 %, and closed 14 %.
    """
    if not decision.discrepancy:
        return decision

    def stays(one: Cluster) -> bool:
        name = one.member_in(decision.shown)
        weather = is_within(one.cause, ENVIRONMENT) and agreed(name)
        return one.probability >= _SURE or weather or not share(name) < _MUCH

    kept = tuple(one for one in decision.clusters if stays(one))
    gone = unless_it_closes(decision, kept, validated)
    return refusing(decision, found, kept, refused=gone) if gone else decision


def without_unsure(decision: Decision, found: Sequence[Hypothesis], helps: Callable[[str, Key], bool]) -> Decision:
    """The decision less what its set no longer bears out, once other effects have been taken from that.

    Of a glider's depth sensor 10 % off, which was refused, an arm of 0.1 +- 0.1 m was left. It is asked beside what
    stands for another form of the model, as it was asked before.
    """
    members = {one: one.member_in(decision.shown) for one in decision.clusters}
    asked = tuple(sorted({*decision.shown, *decision.form}))
    kept = tuple(one for one, name in members.items() if helps(name, asked))
    if len(kept) == len(decision.clusters):
        return decision
    if kept:
        return keeping(decision, kept)
    return as_unknown(decision, probably_lacking(found, [*decision.outdone, *members.values()]), decision.outdone)


def without_leaning(
    decision: Decision, found: Sequence[Hypothesis], doubtful: Collection[str], settings: Settings
) -> Decision:
    """The decision less what stands only beside effects of a size that nobody believes.

    Such `doubtful` effects stand for something else, and what fits beside them need not act beside that: the other
    causes are as sure as hypotheses without these make them. Of a fouled glider, whose depth sensor seemed 20 % off, a
    weight beside that had 88 %, and none without.
    """
    if not doubtful:
        return decision
    left = [one for one in found if not {*doubtful} & {*one.effects}]
    total = sum(one.probability for one in left)
    kept = []
    for cluster in decision.clusters:
        if cluster.member_in(decision.shown) not in doubtful and total > 0.0:
            acting = sum(one.probability for one in left if {*cluster.counted} & {*one.effects}) / total
            cluster = replace(cluster, probability=min(cluster.probability, acting))
        if cluster.probability >= settings.name_threshold:
            kept.append(cluster)
    return keeping(replace(decision, clusters=tuple(kept)), tuple(kept)) if kept else decision


def unless_it_closes(decision: Decision, kept: Sequence[Cluster], validated: Callable[[Key], Validation | None]) -> Key:
    """What of a decision is not kept; nothing where its set surely closes a part of the gap on trials left out by it.

    Where what is kept closes as much without it, that is not by it. Of a glider 60 g too heavy the weight closed all,
    and with it a depth that read 2.5 +- 1.1 % too much, which was right, was a cause.
    """
    gone = tuple(one.member_in(decision.shown) for one in decision.clusters if one not in kept)
    validation = validated(decision.shown) if gone else None
    if validation is None or not validation.lower > 0.0:
        return gone
    rest = tuple(sorted(one.member_in(decision.shown) for one in kept))
    return gone if rest and closed(validated(rest)) > validation.gap_explained - _AS_MUCH else ()


def refusing(
    decision: Decision,
    found: Sequence[Hypothesis],
    kept: tuple[Cluster, ...],
    *,
    refused: Key = (),
    drift: Key = (),
    turning: Key = (),
) -> Decision:
    """The decision with these of its causes alone; what is refused, or looks like another, joins what did before."""
    refused, drift, turning = (
        (*decision.refused, *refused), (*decision.drift, *drift), (*decision.turning, *turning)
    )  # fmt: skip
    if kept:
        return replace(keeping(decision, kept), refused=refused, drift=drift, turning=turning)
    left = as_unknown(decision, probably_lacking(found, (*refused, *drift, *turning)), decision.outdone)
    return replace(left, refused=refused, drift=drift, turning=turning, small=decision.small)


def as_unknown(decision: Decision, lacking: float, outdone: Key) -> Decision:
    return Decision("unknown", (), lacking, True, (), decision.form, decision.along, outdone=outdone)


def keeping(decision: Decision, kept: tuple[Cluster, ...]) -> Decision:
    """The decision with these of its causes alone; one or more."""
    shown = tuple(sorted(one.member_in(decision.shown) for one in kept))
    sure = min(one.probability for one in kept)
    return replace(decision, kind=kind_of(kept), clusters=kept, probability=sure, shown=shown)


def probably_lacking(found: Sequence[Hypothesis], outdone: Sequence[str] = ()) -> float:
    """Probability that the model lacks something that no effect describes: what is outdone stands for that as well."""
    return min(1.0, sum(one.probability for one in found if one.discrepancy or {*outdone} & {*one.effects}))
