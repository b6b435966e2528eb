"""Whether a black box lacks forces beside the effects that explain its trials without.

The forces of each trial have many unknowns, and a fit of the model alone with forces that stand for a whole cause takes
twelve sets of their derivatives: a thousand runs and more. So a black box is searched without forces first. Where the
leading set then leaves nothing to forces, the model alone with forces is no rival that needs a fit: what it can
explain is seen from the leader's own derivatives. Where forces do bring something, the search is made with them.
"""

from __future__ import annotations

import math

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import HOPE, Search
from seatruth.diagnosis.hypothesis_fits import fit_once
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.size_search import best_evidence

_SMALL, _LARGE = math.log(0.003), math.log(0.3)
"""Log size of forces, over the usual ones, from which those beside a leader, and those in its place, are sought. [S]"""
_BRINGS = 1.0
"""nats by which forces must improve a set to be looked for beside others too. [S]"""


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
    likelihood = Likelihood(found.problem, loose.linearized(found.problem))
    alone = best_evidence(likelihood, (), found.known, loose.sizes.with_discrepancy(_LARGE))
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
