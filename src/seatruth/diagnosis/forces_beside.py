"""Whether a black box lacks forces beside the effects that explain its trials without.

The forces of each trial have many unknowns, and a fit of the model alone with forces that stand for a whole cause takes
twelve sets of their derivatives: a thousand runs and more. So a black box is searched without forces first. Where the
leading set then leaves nothing to forces, the model alone with forces is no rival that needs a fit: what it can
explain is seen from the leader's own derivatives. Where forces do bring something, the search is made with them.
"""

from __future__ import annotations

import math

import numpy as np

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import HOPE, Search
from seatruth.diagnosis.hypothesis_fits import fit_once
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.size_search import OfSizes, maximise

_SMALL, _LARGE = math.log(0.003), math.log(0.3)
"""Log size of forces, over the usual ones, from which those beside a leader, and those in its place, are sought. [S]"""
_BRINGS = 1.0
"""nats by which forces must improve a set to be looked for beside others too. [S]"""
_SWEEPS = 4
"""Most sweeps over all sizes of forces in the place of a leader. [S]"""


def forces_wanted(found: Search) -> bool:
    """Fits the leading sets of a bare search with forces; whether these, or forces alone, may explain more.

    Where they may not, the model alone with forces is screened.
    """
    leader = found.leader
    if leader.evidence < found.null.evidence + HOPE:
        return True  # forces alone are a rival, and cost less where so little is to be explained
    loose = _with_forces(found, leader)
    if loose is None or loose.evidence > leader.evidence + _BRINGS:
        return True
    alone = _forces_alone(found, loose)
    if alone > leader.evidence - HOPE:
        return True
    found.screened[(), True] = alone
    for fit in found.sets():
        if fit.effects and fit.evidence > leader.evidence - found.problem.settings.hopeless:
            _with_forces(found, fit)
    return False


def _with_forces(found: Search, fit: Fit) -> Fit | None:
    known = found.fits.get((fit.effects, True))
    return known or fit_once(found, fit.effects, True, fit.point, fit.sizes.with_discrepancy(_SMALL))


def _forces_alone(found: Search, loose: Fit) -> float:
    """Linearized evidence of the model alone with forces, at a set's fit with forces, in nats."""
    problem = found.problem
    likelihood = Likelihood(problem, loose.linearized(problem))
    value = OfSizes(likelihood, (), found.known)
    channels = sorted({series.channel for series in problem.series})
    try:
        _, found_value = maximise(
            value, loose.sizes.with_discrepancy(_LARGE), problem.settings,
            channels=channels, shapes=False, sweeps=_SWEEPS,
        )  # fmt: skip
    except np.linalg.LinAlgError:
        return math.inf
    return found_value - loose.price
