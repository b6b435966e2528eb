"""Terms that another form of the model shows as well, and what that leaves of their probability.

A set of effects with cross-flow drag, or a speed loss in turns, has a twin: the same set without the term, on a vehicle
whose damping has another form than its model's, for which the term stands. Where forces that the model lacks stand
beside the term, both fit the trials, and how often each was the truth decides. Without such forces the term describes
the trials alone, and where it explains enough beyond missing forces, it is mostly the cause. A factor on all thrust
that stands beside another effect has a twin, too: with refitted coefficients it is a resistance that rises otherwise
with the speed. For what trials left out refuse it is taken to be the same as for a term beside forces [S].

Two forms of what is missing take part by themselves, and are never a cause: a drag that rises otherwise with the speed
(`drag_curve`), and forces that differ between turns to port and to starboard (`one_sided_turns`). An effect in whose
place one of them can stand, as a thrust near one speed, is not named for what the two explain.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.effects import Effect
from seatruth.effects.causes import is_within
from seatruth.effects.each_trial import follows_each_trial

_FORMS = ("hydrodynamics.damping_or_lift.cross_flow", "hydrodynamics.damping_or_lift.turning")
"""Causes that damping of another form shows as well."""
_LED, _ACTED = 29, 7
"""Opened cases of `experiments/withheld` in which such a term led, and those in which it was the cause: 13 and 3 of the
154 of the development and test set of 2026-11-22, 16 and 4 of the 247 blind ones of 2026-11-24 and 25."""
ACTS = (_ACTED + 1) / (_LED + 2)
"""Probability that such a term is the cause where it stands beside forces: the rule of succession [L: Laplace 1774]."""
_ENOUGH = 5.0
"""nats by which a term without forces has to explain more than its set without it, to be more than another form. Of 30
cases that were drawn to set it, 18 of them with such a term, and the 84 blind ones of 2026-11-25, those in which a set
with a term led without forces: beyond 5 nats it acted in 12, up to 21.7, and in one a bow resisted more across than a
stern (11.6); below, it acted in 7 and did not in 15, with 4.6 nats at most."""
ACTS_ALONE = {True: (12 + 1) / (13 + 2), False: (7 + 1) / (22 + 2)}
"""Probability that it acts, beyond that and below, by the rule of succession."""
_THRUST = "actuator.propulsion.thrust"
_THRUST_LED, _THRUST_ACTED = 5, 0
"""The same for a factor on all thrust beside another effect, of these 247: in four cases the resistance was steeper
than the model's, in one the hull was fouled on one side."""
THRUST_ACTS = (_THRUST_ACTED + 1) / (_THRUST_LED + 2)
_CURVE = "hydrodynamics.damping_or_lift.drag_curve"
_ONLY_FORM = (_CURVE, "hydrodynamics.one_sided")
"""Causes that only give what is missing a form: no vehicle has a fault of that name."""


def _is_damping(name: str, effects: Mapping[str, Effect]) -> bool:
    """Whether an effect is a term that damping of another form shows as well."""
    return any(is_within(effects[name].cause, form) for form in _FORMS)


def hull_forms_in(key: Sequence[str], effects: Mapping[str, Effect]) -> tuple[str, ...]:
    """The effects of a set that a hull of another form shows as well."""
    return tuple(name for name in key if _is_damping(name, effects) or is_only_form(name, effects))


def seas_in(key: Sequence[str], effects: Mapping[str, Effect]) -> tuple[str, ...]:
    """The effects of a set that waves bring about: their first-order forces, and what comes with these.

    Example:
        >>> from seatruth.effects import available
        >>> seas_in(("current", "wave_drift", "wave_forces"), available())
        ('wave_drift', 'wave_forces')
        >>> seas_in(("current", "wave_drift"), available())
        ()
    """
    waves = [name for name in key if follows_each_trial(effects[name])]
    with_them = {other for name in waves for other in effects[name].comes_with}
    return tuple(name for name in key if name in waves or name in with_them)


def forms_in(key: Sequence[str], effects: Mapping[str, Effect]) -> tuple[str, ...]:
    """The effects of a set that another form of the model shows as well.

    A factor on the thrust of all propellers is one beside other effects only; that of one of several never is.
    """
    found = {*hull_forms_in(key, effects)}
    return tuple(name for name in key if name in found or (len(key) > 1 and _is_thrust(name, effects)))


def standing_beside(key: Sequence[str], effects: Mapping[str, Effect]) -> tuple[str, ...]:
    """The effects of a set that count though they are not named: terms of another form, and waves.

    Waves move the vehicle whether they are worth naming or not: of a boat in a short sea a compass that was 4 deg off
    predicted each trial better beside them, and without them not all.
    """
    waves = (name for name in key if follows_each_trial(effects[name]))
    return tuple(dict.fromkeys([*forms_in(key, effects), *waves]))


def is_only_form(name: str, effects: Mapping[str, Effect]) -> bool:
    """Whether an effect is a form of what is missing that no cause stands for."""
    return any(is_within(effects[name].cause, form) for form in _ONLY_FORM)


def are_damping(names: Sequence[str], effects: Mapping[str, Effect]) -> bool:
    """Whether all effects stand for damping or drag of another form, which is no sign that anything is wrong."""
    return all(_is_damping(name, effects) or is_within(effects[name].cause, _CURVE) for name in names)


def alike(key: Key, sets: Mapping[Key, float], effects: Mapping[str, Effect], least: float) -> dict[str, Key]:
    """The effects in whose place in a set a form of the model can stand, each with the set that it stands in.

    Args:
        key: the set, with such a form or without.
        sets: probability of each set of effects, this one among them.
        effects: by name.
        least: part of the set's probability that the other one has at least.

    Example:
        >>> from seatruth.effects import available
        >>> sets = {("thrust_gain",): 0.5, ("drag_curve",): 0.4, ("wind",): 0.01}
        >>> [alike(key, sets, available(), 0.1) for key in sets]
        [{'thrust_gain': ('thrust_gain',)}, {'thrust_gain': ('thrust_gain',)}, {'wind': ('wind',)}]
    """
    forms = [name for name in effects if is_only_form(name, effects)]
    held = [name for name in key if name in forms]
    found = dict[str, Key]()
    for name in effects:
        if name in forms or (name in key) == bool(held):
            continue
        for form in held or forms:
            out, into = (form, name) if held else (name, form)
            other = tuple(sorted({*key} - {out} | {into}))
            if sets.get(other, 0.0) >= least * sets[key]:
                found[name] = other if held else key
    return found


def only_forms(sets: Mapping[Key, float], effects: Mapping[str, Effect], least: float) -> list[str]:
    """The forms of what is missing, in sets that are as probable as that."""
    held = {name for key, probability in sets.items() if probability >= least for name in key}
    return [name for name in effects if name in held and is_only_form(name, effects)]


def _is_thrust(name: str, effects: Mapping[str, Effect]) -> bool:
    return not effects[name].which and is_within(effects[name].cause, _THRUST)


def form_shares(found: Sequence[Hypothesis], effects: Mapping[str, Effect]) -> dict[tuple[Key, bool], float]:
    """Of each hypothesis with such terms, by its effects and discrepancy, the probability that they act, given it."""
    best: dict[Key, float] = {}
    for one in found:
        best[one.effects] = max(best.get(one.effects, -math.inf), one.log_evidence)
    shares = {}
    for one in found:
        like = forms_in(one.effects, effects)
        if like:
            parts = [like, *((name,) for name in like)]
            rests = [tuple(name for name in one.effects if name not in part) for part in parts]
            without = max((best[rest] for rest in rests if rest in best), default=math.inf)
            if any(is_only_form(name, effects) for name in like):
                share = 0.0
            else:
                share = _share(one, without) if all(_is_damping(name, effects) for name in like) else THRUST_ACTS
            shares[one.effects, one.discrepancy] = share
    return shares


def _share(one: Hypothesis, without: float) -> float:
    """Probability that the terms of damping in a hypothesis act.

    Without forces it goes by what they explain beyond the evidence `without` one of them, with forces or without.
    """
    if one.discrepancy or without == math.inf:
        return ACTS
    return ACTS_ALONE[one.log_evidence - without > _ENOUGH]


def acting(found: Sequence[Hypothesis], key: Key, effects: Mapping[str, Effect]) -> float:
    """Probability that the terms of a set that another form shows as well act, given the set; 1 where it has none."""
    shares = form_shares(found, effects)
    having = [one for one in found if one.effects == key]
    total = sum(one.probability for one in having)
    act = sum(one.probability * shares.get((key, one.discrepancy), 1.0) for one in having)
    return act / total if total > 0.0 else 1.0


def with_other_forms(
    found: Iterable[Hypothesis], effects: Mapping[str, Effect], outdone: Collection[str] = ()
) -> list[Hypothesis]:
    """The hypotheses, each that has such a term with its twin beside it; the most probable first.

    The two share its probability; the twin is one with discrepancy, and `like` names what stands for that. `outdone`
    are effects that free terms outdo on trials left out: they only take the shape of another form, and have twins
    as well.
    """
    shared, found = list[Hypothesis](), list(found)
    shares = form_shares(found, effects)
    for one in found:
        forms = forms_in(one.effects, effects)
        like = tuple(name for name in one.effects if name in outdone or name in forms)
        if not like:
            shared.append(one)
            continue
        refused = any(name in outdone for name in like)
        share = shares.get((one.effects, one.discrepancy), 1.0)
        share = ACTS if refused and share > 0.0 else share
        twin = replace(
            one,
            effects=tuple(name for name in one.effects if name not in like),
            discrepancy=True,
            like=like,
            log_prior=one.log_prior + math.log1p(-share),
            probability=(1.0 - share) * one.probability,
        )
        shared.append(twin)
        if share > 0.0:
            cause = replace(one, log_prior=one.log_prior + math.log(share), probability=share * one.probability)
            shared.append(cause)
    return sorted(shared, key=lambda one: (-one.probability, one.effects, one.discrepancy, one.like))
