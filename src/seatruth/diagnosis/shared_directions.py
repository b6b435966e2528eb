"""Whether trials on several courses agree about a direction on the earth, where whole runs say nothing.

A hull of another form pushes along the vehicle or across it, whatever its course: trials on several courses share no
direction on the earth for that. Of an ROV whose model has another damping each run ended 4 to 150 deviations of the
noise from its record, with the current that acted and without it, while missing forces followed each of five trials
better beside it, by 92 to 259 nats, and a current of its own in each trial explained less than the one.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.effects.each_trial import EachTrial
from seatruth.trials.check.excitation import narrow_headings

_ODDS = math.log(20.0)
"""nats by which each trial left out must be more probable with the effect: odds of 20. [S]"""


def is_shared(search: Search, name: str, fit: Fit, gains: Callable[[str, Key], Array]) -> bool:
    """Whether an effect of a set has one direction on the earth by which forces follow each trial left out better.

    Args:
        search: with the set's fits.
        name: the effect.
        fit: the set's fit; only one with missing forces follows runs that stray.
        gains: log predictive density (nats) of each trial left out, with an effect of a set less without it.
    """
    effects = search.problem.effects
    one = effects[name]
    if not one.direction or isinstance(one, EachTrial) or not fit.discrepancy:
        return False
    if narrow_headings(search.problem.trials) is not None:
        return False
    found = gains(name, fit.effects)
    if len(found) < 2 or not float(found.min()) > _ODDS:
        return False
    own = next((n for n, other in effects.items() if isinstance(other, EachTrial) and other.like.name == name), None)
    if own is None:
        return True
    each = search.best({own, *fit.effects} - {name})
    return each is not None and each.evidence < fit.evidence
