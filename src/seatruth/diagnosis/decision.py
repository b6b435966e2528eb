"""From probabilities to what is said, at the finest level of the tree of causes that reaches its probability.

A cause is first a cluster: one effect of the best answer, with every effect that can stand in its place. If one effect
holds most of the cluster's probability and no look-alike is near, it is named itself; otherwise the cluster is named by
the lowest common ancestor of its members. Nothing is named whose gain on trials left out is not surely positive, or
that of an effect that can stand in its place: where all of an answer falls for that, the most probable answer without
it is asked. A term of the model's forces, or a factor on what its rudder or propeller gives, is not named where others
are missing beside it: it is then a part of a model of another form, and stands for no cause. Damping across the flow
and in turns counts for what it explains beyond forces of unknown cause, since damping of another form looks the same; a
factor on all thrust beside another cause is not named, which a resistance of another form looks like. Where all trials
are on one course, what keeps its direction on the earth is not named beside other missing forces either: it is then a
force ahead or to one side, as a model of another form has them. A term that is refused takes nothing with it: its part
is left to the discrepancy of the model's form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from seatruth.diagnosis.clusters import NEEDED, Cluster, cluster_of, is_factor, merged
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.other_forms import acting, alike, forms_in, only_forms
from seatruth.diagnosis.posterior import answers, leading, none_and_unknown
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.verdict import Hypothesis, Kind
from seatruth.effects import Effect
from seatruth.effects.causes import ROOT, is_within
from seatruth.effects.each_trial import follows_each_trial

_MOST = 0.75
"""Part of what all effects explain from which those that are left count as the cause of the gap all the same. [S]"""
_MOST_APART = 3
"""Effects of different families that are named as one cause. [S] A longer list says that nothing is known."""
_MOST_ALIKE = 6
"""The same where each of them shows in these trials what the first one does. [S] A steady push to one side is a bank's,
a rudder's that stands off, a thruster's that points aside, a propeller's, a hull's, or that of a drag on one side:
naming all six says what to look at."""
_ALMOST_ALONE = 0.75
"""Part of the probability of two causes from which the first is named without the second: odds of three. [S]"""
SURELY = 0.05
"""Probability that nothing acts up to which it is said that something does. [S] As bounds of one side are."""
_ROUNDS = 3
"""Answers that are asked, the most probable first, where what leads does not predict. [S] Each costs some fits."""
_FIXED_TO_EARTH = ("environment.moving_water", "environment.force_fixed_to_earth", "environment.wave_motion")
"""Causes that keep their direction on the earth, by which they are told from what turns with the vehicle. Waves meet it
at one frequency on one course, as a limit cycle has it."""
_STRUCTURE = "hydrodynamics"
"""Family of causes that are terms of the hull's forces, as discrepancy is."""
_UNSYMMETRIC = "hydrodynamics.asymmetry"
"""Those of them that a hull alike above and below has not, whatever the form of its damping: where forces of another
form are missing as well, they act all the same. [S] Of a torpedo with a steeper resistance (an opened case), lift and
moment at no incidence were right to one error, 37 errors from none, and were taken for a part of that form."""


@dataclass(frozen=True)
class Decision:
    """The kind of answer, the causes that are named, and the probability of what is said."""

    kind: Kind
    clusters: tuple[Cluster, ...]
    probability: float
    discrepancy: bool
    shown: Key
    """The set of effects whose fit stands for the answer."""
    form: Key = ()
    """Effects that fit the trials as a hull of another form does, and are not named for that."""
    along: Key = ()
    """Effects that keep their direction on the earth, not named since all trials are on one course."""
    small: Key = ()
    """Effects that are significant beside an unknown cause, but close next to none of the gap."""
    outdone: Key = ()
    """Effects that explain the trials, but not surely those left out, which terms in the equations predict better."""
    untried: Key = ()
    """Effects that what cannot be tried on the model looks like, and that do not surely predict trials left out."""
    part: Key = ()
    """Terms of the model's forces that are probable, and not named since others are missing beside them."""
    refused: Key = ()
    """Effects that are probable, and not named since they do not surely predict trials left out."""
    alike: Key = ()
    """Those of them that the most probable set has, and what looks like them in these trials."""
    drift: Key = ()
    """Errors of positions that explain the trials, and that a model with another drift in turns shows as well."""
    turning: Key = ()
    """Delays of the heading and the rate of turn, equal, which a later steering shows as well."""
    acts: bool = False
    """Where these trials cannot decide what acts: whether it is sure that something does."""
    vague: Key = ()
    """Effects of different kinds that look alike, so many that naming them as one cause would say nothing."""
    possible: Key = ()
    """What may act, where something does and these trials cannot decide what: of what is refused or vague, all that
    looks alike."""


def decide(
    found: Sequence[Hypothesis],
    effects: Mapping[str, Effect],
    settings: Settings,
    *,
    near: Callable[[str, str], float],
    helps: Callable[[str, Key], bool],
    underpowered: bool,
    converged: bool = True,
    gap: bool = True,
    one_course: bool = False,
) -> Decision:
    """What is said.

    Args:
        found: hypotheses with their probabilities.
        effects: by name.
        settings: thresholds.
        near: pairwise noncentrality of two effects.
        helps: whether an effect, as part of a set, predicts trials left out.
        underpowered: whether these trials could not show most effects.
        converged: whether the fit of the model alone converged; if not, nobody can say that there is no gap.
        gap: whether the refitted model leaves more than noise; if not, a refused effect is no sign of another cause.
        one_course: whether all trials are on one course.
    """
    sets = answers(found)
    none, unknown = none_and_unknown(found)
    named = sum(sets.values())
    if none >= max(unknown, named) or (none > 0.5 * named and none > unknown):
        nothing = converged and not underpowered and none >= settings.name_threshold
        return Decision("no_gap" if nothing else "underpowered", (), none, False, ())
    first = leading(sets, effects)
    form = forms_in(first, effects)
    # What leads by chance among many that hardly differ is like nothing.
    leads = first and sets[first] >= settings.least_rival
    shape = alike(first, sets, effects, settings.least_alike) if leads else {}
    along: Key = ()
    if one_course and _discrepancy(found, first):
        along = tuple(name for name in first if _is_fixed_to_earth(name, effects))
    left, gone, part = list(found), set[str](), dict[str, None]()
    refused: Key = ()  # what leads is what the gap looks like, and not what is asked in its place
    lookalikes: Key = ()  # of that, with itself
    vague: Cluster | None = None
    for _ in range(_ROUNDS):
        answer = _answer(left, effects, settings, near, helps, one_course)
        vague = vague or answer.vague
        part |= dict.fromkeys(name for name in answer.part if name not in form)
        if answer.clusters:
            return Decision(
                kind_of(answer.clusters),
                answer.clusters,
                min(cluster.probability for cluster in answer.clusters),
                answer.lacking,
                answer.kept,
                tuple(name for name in form if name not in answer.kept),
                along,
            )
        gone |= set(answer.refused)
        refused, lookalikes = refused or answer.refused, lookalikes or answer.lookalikes
        left = _left(found, gone)
        total = sum(one.probability for one in left)
        if not answer.refused or total == 0.0 or _needed(found, left, gone, effects, one_course):
            break
        left = [replace(one, probability=one.probability / total) for one in left]
    # Whatever stands beside it: the model lacks something, and no effect is sure enough to be named.
    standing = only_forms(sets, effects, settings.least_alike * sets[first]) if shape else []
    formed, like = {*shape.values()}, dict.fromkeys([*form, *shape, *standing] if leads else [])
    lacking = sum(p.probability for p in found if p.discrepancy or p.effects in formed or forms_in(p.effects, effects))
    unnamed = max(lacking, unknown + (sets[first] if gone & set(first) and gap else 0.0))
    if unnamed >= settings.name_threshold:
        return Decision(
            "unknown",
            (),
            min(1.0, unnamed),
            True,
            (),
            tuple(like),
            along,
            part=tuple(part),
            refused=refused,
            alike=lookalikes,
            vague=vague.effects if vague is not None and not refused else (),
        )
    acts = none <= SURELY
    return Decision(
        "underpowered",
        (),
        max(named, unknown) if vague is None else vague.probability,
        unknown > (named if acts else none),
        (),
        part=tuple(part),
        refused=refused,
        alike=lookalikes,
        acts=acts,
        vague=vague.effects if acts and vague is not None else (),
        possible=() if not acts else vague.effects if vague is not None else lookalikes,
    )


def kind_of(clusters: Sequence[Cluster]) -> Kind:
    """Whether each of these causes is one effect, or one is several that stand in each other's place."""
    return "effects" if all(len(cluster.effects) == 1 for cluster in clusters) else "inseparable"


@dataclass(frozen=True)
class _Answer:
    """What the most probable set leads to: the causes that stand, and what was refused though it was probable."""

    clusters: tuple[Cluster, ...]
    kept: Key
    refused: Key
    lookalikes: Key
    """What was refused, with what looks like it."""
    part: Key
    """Terms of the model's forces that were probable beside others that are missing."""
    lacking: bool
    """Whether the model also lacks something that no effect describes."""
    vague: Cluster | None
    """A probable cause that is only a list of effects of all kinds."""


def _answer(
    found: Sequence[Hypothesis],
    effects: Mapping[str, Effect],
    settings: Settings,
    near: Callable[[str, str], float],
    helps: Callable[[str, Key], bool],
    one_course: bool,
) -> _Answer:
    """Takes from the most probable set what is not probable by itself, and what does not predict."""
    sets = answers(found)
    first = leading(sets, effects)
    form, share = forms_in(first, effects), acting(found, first, effects)
    kept, refused, lookalikes, gone, part = first, list[str](), dict[str, None](), set[str](), list[str]()
    clusters: list[Cluster] = []
    vague: Cluster | None = None
    while kept:
        # What is refused leaves the others to explain more, or less: they are asked again without it, so that two that
        # only together look like something else do not stand when one falls. What is only improbable may act.
        beside = _discrepancy(found, kept)
        cluster = partial(
            cluster_of, key=first, sets=sets, effects=effects, settings=settings, near=near, beside=beside
        )
        own = {name: sum(p for key, p in sets.items() if name in key) for name in kept}
        says_nothing = partial(_says_nothing, near=near, settings=settings, beside=beside, own=own)
        candidates = {name: _candidate(partial(cluster, name), own[name], says_nothing, settings) for name in kept}
        # Such a term may stand for another form of the model, and a set with it has a twin of that form that fits as
        # well: what stands beside the term is as sure there.
        for name in set(kept) & set(form):
            candidates[name] = replace(candidates[name], probability=candidates[name].probability * share)
        sure = {name: _without(found, one.counted, gone, effects, one_course) for name, one in candidates.items()}
        likely = [name for name in kept if min(candidates[name].probability, sure[name]) >= settings.name_threshold]
        lists = [name for name in likely if says_nothing(candidates[name])]
        vague = vague or next((candidates[name] for name in lists), None)
        probable = [
            name
            for name in likely
            if not (beside and _is_structure(name, effects))
            and not (beside and one_course and _is_fixed_to_earth(name, effects))
            and name not in lists
        ]
        part += [name for name in likely if beside and _is_structure(name, effects)]
        # So they predict beside what stands for the other form, which forces beside them need not take up.
        asked = tuple(sorted({*kept, *form}))
        passing = tuple(name for name in probable if _one_helps(candidates[name], name, asked, helps))
        failing = [name for name in probable if name not in passing]
        refused += failing
        lookalikes |= dict.fromkeys(member for name in failing for member in candidates[name].effects)
        gone |= set(likely) - set(passing) - set(form)
        clusters = [
            replace(candidates[name], probability=min(candidates[name].probability, sure[name])) for name in passing
        ]
        if passing == kept:
            break
        kept = passing
    lacking = _discrepancy(found, kept) or any(_is_structure(name, effects) for name in set(first) - set(kept))
    causes = tuple(merged(clusters, effects))
    return _Answer(causes, kept, tuple(refused), tuple(lookalikes), tuple(part), lacking, vague)


def _candidate(
    cluster: Callable[..., Cluster], own: float, says_nothing: Callable[[Cluster], bool], settings: Settings
) -> Cluster:
    """An effect of the most probable set with what can stand in its place, where that is no list that says nothing.

    What these trials tell from a cause that is probable without it makes that less probable, and no list: from a node
    of the tree, or from an effect that is probable by itself (`own`). Of an AUV whose rudder stood 2 deg off, an
    asymmetry of the hull was 58 nats behind 650, which the temperature of so much evidence leaves 16 %: the two were a
    list, and the cause was "not in the library".
    """
    found = cluster()
    if not says_nothing(found):
        return found
    alone = cluster(told_apart=False)
    probable = own if alone.cause == ROOT else alone.probability
    return found if probable < settings.name_threshold or says_nothing(alone) else alone


def _one_helps(cluster: Cluster, name: str, kept: Key, helps: Callable[[str, Key], bool]) -> bool:
    """Whether an effect predicts trials left out, or another of its cluster in its place.

    Where one that looks like the leader predicts, the two are the cause: neither is refused for the other's sake.
    """
    rest = [other for other in kept if other != name]
    return any(helps(member, tuple(sorted((*rest, member)))) for member in cluster.effects if member not in rest)


def _says_nothing(
    cluster: Cluster,
    *,
    near: Callable[[str, str], float],
    settings: Settings,
    beside: bool,
    own: Mapping[str, float],
) -> bool:
    """Whether a cluster is only a list of effects of all kinds.

    Where forces are missing beside it, so are two that these trials tell apart: if one of them acted, it would fit
    better than the other. Of a ferry with a bow thruster that worked by itself, play of the rudder, waves and a compass
    were named as one cause. Two are said where one would be named by itself (`own`), and the other has a third of that.
    """
    first, *others = cluster.effects
    alike = all(near(first, other) < settings.apart for other in others)
    first_own = own.get(first, 0.0)
    two = settings.name_threshold <= first_own < _ALMOST_ALONE * cluster.probability
    most = _MOST_ALIKE if alike else _MOST_APART if not beside else 2 if two else 1
    return cluster.cause == ROOT and len(cluster.effects) > most


def _is_fixed_to_earth(name: str, effects: Mapping[str, Effect]) -> bool:
    fixed = any(is_within(effects[name].cause, cause) for cause in _FIXED_TO_EARTH)
    return fixed or effects[name].current is not None


def _is_structure(name: str, effects: Mapping[str, Effect]) -> bool:
    """Whether it is a term of the model's forces."""
    cause = effects[name].cause
    return (is_within(cause, _STRUCTURE) and not is_within(cause, _UNSYMMETRIC)) or is_factor(name, effects)


def _without(
    found: Sequence[Hypothesis],
    members: Sequence[str],
    gone: set[str],
    effects: Mapping[str, Effect],
    one_course: bool,
) -> float:
    """Probability that one of these effects acts, given that those that are gone do not; 0 where they are needed."""
    left = _left(found, gone)
    if _needed(found, left, gone, effects, one_course):
        return 0.0
    total = sum(one.probability for one in left)
    acting = sum(one.probability for one in left if set(members) & set(one.effects))
    return acting / total if total > 0.0 else 0.0


def _left(found: Sequence[Hypothesis], gone: set[str]) -> list[Hypothesis]:
    """The hypotheses in which none of these effects acts."""
    return [one for one in found if not gone & set(one.effects)]


def _needed(
    found: Sequence[Hypothesis],
    left: Sequence[Hypothesis],
    gone: set[str],
    effects: Mapping[str, Effect],
    one_course: bool,
) -> bool:
    """Whether the trials need what is gone, so that it stands for something of another name.

    They do where the hypotheses that are left are too improbable and explain too little. A term of the hull's forces
    has another name already, another form of the model, and so has what is fixed to the earth along one course. What
    follows each trial with a phase of its own, as waves do, is a noise where it is refused.
    """
    foreign = any(
        not (
            _is_structure(name, effects)
            or (one_course and _is_fixed_to_earth(name, effects))
            or follows_each_trial(effects[name])
        )
        for name in gone
    )
    total = sum(one.probability for one in left)
    # In evidence as well: where much is explained, the temperature leaves next to nothing improbable.
    behind = _weight(found) - _weight(left) > -math.log(NEEDED)
    return foreign and (total < NEEDED or behind) and _explained(left) < _MOST * _explained(found)


def _weight(found: Sequence[Hypothesis]) -> float:
    """Log-evidence and log-prior (nats) of the best of these hypotheses."""
    return max((one.log_evidence + one.log_prior for one in found), default=-math.inf)


def _explained(found: Sequence[Hypothesis]) -> float:
    """Log-evidence (nats) of the best of them over the best one without effects."""
    alone = max((one.log_evidence for one in found if not one.effects), default=0.0)
    return max((one.log_evidence for one in found), default=alone) - alone


def _discrepancy(found: Sequence[Hypothesis], kept: Key) -> bool:
    """Whether, with these effects, the model probably also lacks something that no effect describes."""
    having = [one for one in found if set(kept) <= set(one.effects)]
    total = sum(one.probability for one in having)
    return total > 0.0 and sum(one.probability for one in having if one.discrepancy) > 0.5 * total
