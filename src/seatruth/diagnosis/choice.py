"""Which effects are fitted alone, and which beside a leading set.

All are compared by one linearization first. Where that may be wrong by far, others are fitted as well: those without a
slope at their null, those that explain most without missing forces, and the first of each family.
"""

from __future__ import annotations

import math

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.initial_guess import likely_values
from seatruth.diagnosis.posterior import causes_in, log_prior
from seatruth.diagnosis.screening import screen

_CURVED = 5
"""Effects without a slope at their null, such as a play, that are fitted alone though others come first. [S]"""
WITHOUT = 2
"""Effects that explain most without missing forces, which are fitted with them whatever is linearized there. [S]"""
_PROBABLE = 0.05
"""Probability over that of no effect from which a set could matter. [S]"""
_ALIKE = 3.0
"""nats of linearized evidence behind the best further effect within which others may look like it: odds of 20. [S]"""


def may_matter(found: Search, key: Key, evidence: float) -> bool:
    """Whether a set of this evidence (nats) could be probable, where nothing that was fitted is more so than no effect.

    Elsewhere what a set is worth is not known before it is fitted. Of a launch on which nothing acts, whose model has
    another form, the best of 20 effects explained 3.8 nats, and 400 of 670 s went to sets of several.
    """
    settings, effects = found.problem.settings, found.problem.effects

    def weight(key: Key, on: bool, value: float) -> float:
        return value + log_prior(causes_in(key, effects), on, len(effects), settings)

    weights = {place: weight(*place, fit.evidence) for place, fit in found.fits.items()}
    none = max((value for (other, _), value in weights.items() if not other), default=-math.inf)
    if max(weights.values()) > none:
        return True
    return weight(key, found.null.discrepancy, evidence) > none + math.log(_PROBABLE)


def as_alone(found: Search, leader: Fit, name: str, promised: float) -> float:
    """What a set with one more effect promises (nats), as far as that effect kept its promise alone.

    Where it was fitted alone, it brings what it brought there, and what is linearized beside the set beyond what was
    linearized there. Of that launch an arm of the receiver promised 5 nats beside each leading set, as it had alone,
    where its fit was 8 behind: five sets were fitted, and each ended within a nat of this, 12 nats or more below the
    linearized one.
    """
    alone, null = found.best((name,)), found.null.evidence
    if alone is None:
        return promised
    beyond = max(0.0, (promised - leader.evidence) - (found.expected((name,)) - null))
    return min(promised, leader.evidence + alone.evidence - null + beyond)


def singles(found: Search, near: Fit) -> list[str]:
    """Effects that are fitted alone: the first ones, and those of which a linearization at their null says little.

    Before them those that the records themselves show: a heading half a turn off promises nothing at its null.
    """
    ranked, effects = screen(found, near), found.problem.effects
    few = found.problem.settings.singles
    curved = [name for name in ranked[few:] if effects[name].starts and name in found.starts]
    gross = [name for name in ranked if likely_values(found.problem, name, shown=True)]
    return list(dict.fromkeys([*gross, *ranked[:few], *curved[:_CURVED], *found.explaining(WITHOUT)]))


def additions(found: Search, leader: Fit) -> list[str]:
    """Effects that are added to a set: the first ones, what looks like the first one, and the first of each family.

    What is linearized may be wrong by far, and for one family more than for another: on a ship in wind, beside a late
    position, a sloshing liquid and a dead band stood before the drift that a fit finds 28 nats ahead.
    """
    ranked, effects = screen(found, leader), found.problem.effects
    values = [found.expected(tuple(sorted((*leader.effects, name)))) for name in ranked]
    few, families = found.problem.settings.additions, set[str]()
    chosen = []
    for k, name in enumerate(ranked):
        # A force fixed to the earth and moving water are two families: what shows the one may hide the other.
        family = ".".join(effects[name].cause.split(".")[: 2 if effects[name].direction else 1])
        if k < few or (k < 2 * few and values[k] > values[0] - _ALIKE) or family not in families:
            chosen.append(name)
        families.add(family)
    return chosen
