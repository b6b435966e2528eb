"""Whether a model lacks forces beside the effects that explain its trials without.

The forces of each trial have many unknowns. Of a black box, a fit of the model alone with forces that stand for a whole
cause takes twelve sets of their derivatives: a thousand runs and more. Of a vehicle with six degrees of freedom, forces
that follow time as finely as such a cause asks for take minutes a fit. So a black box, and equations whose
trials an effect may explain, are searched without forces first. Where the leading set then leaves nothing to forces,
the model alone with forces is no rival that needs a fit: what it can explain is seen from the leader's own derivatives.
Where forces do bring something, the search is made with them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import HOPE, Search
from seatruth.diagnosis.hypothesis_fits import fit_both, fit_once
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.screening import screen
from seatruth.diagnosis.size_search import best_evidence
from seatruth.diagnosis.sizes import log_prior

_SMALL, _LARGE = math.log(0.003), math.log(0.3)
"""Log size of forces, over the usual ones, from which those beside a leader, and those in its place, are sought. [S]"""
_FIRST = 3
"""Effects that are fitted to see whether one explains the trials without forces. [S] Each such fit is a short one."""
_ACTS = 10.0
"""nats that an effect must bring where it is begun, as linearized there without forces, to be tried without. [S] It is
asked to explain more than forces do, which is `HOPE` at least. Of a launch and a boat, limits of the rate that no order
reached brought 0 to 5, and free liquid in a tank 0 to 2; each took 2 s."""
_BRINGS = 1.0
"""nats by which forces must improve a set to be looked for beside others too. [S]"""


def may_do_without(found: Search, say: Callable[[str], None] = lambda name: None) -> bool:
    """Whether one effect explains the trials better than forces, which explain much. `say` gets the effects it tries.

    Tried are the first effects by their linearized evidence, the other faults of an actuator that the first of them
    blames, and effects without a slope at their null, such as a rate limit, of which that evidence says little: unless
    it says of the values from which they are begun that they bring nothing, as of a rate that no order reaches. The
    model alone is fitted already, with forces and without.
    """
    plain, loose = found.fits.get(((), False)), found.fits.get(((), True))
    if plain is None or loose is None or loose.evidence < plain.evidence + HOPE:
        return False
    # What comes nowhere near forces is broken off.
    effects, found.bare, found.rival = found.problem.effects, True, loose.evidence
    ranked = screen(found, loose)
    if any(found.screened.get(((name,), False), -math.inf) > loose.evidence for name in ranked):
        return True
    blamed, nothing = effects[ranked[0]].which if ranked else (), _of_nothing(found, loose)
    for place, name in enumerate(ranked):
        same = bool(blamed) and effects[name].which == blamed
        begun = effects[name].starts and name in found.starts
        acts = begun and found.screened.get(((name,), False), -math.inf) > nothing + _ACTS
        if place < _FIRST or same or acts:
            say(name)
            fit_both(found, (name,), loose)
            fitted = found.fits.get(((name,), False))
            if fitted is not None and fitted.evidence > loose.evidence:
                return True
    found.bare = False
    return False


def _of_nothing(found: Search, at: Fit) -> float:
    """Linearized evidence of no effect and no forces beside a fit with forces: with it, effects are screened."""
    bare = at.sizes.without_discrepancy()
    likelihood = Likelihood(found.problem, at.linearized(found.problem))
    return likelihood.evidence(bare, ()) + log_prior(found.problem.settings, bare, found.known)


def forces_wanted(found: Search) -> bool:
    """Fits the leading sets of a bare search with forces; whether these, or forces alone, may explain more.

    Where they may not, and the model alone is not fitted with forces, it is screened with them.
    """
    leader = found.leader
    if leader.evidence < found.null.evidence + HOPE:
        return True  # forces alone are a rival, and cost less where so little is to be explained
    loose = _with_forces(found, leader)
    if loose is None or loose.evidence > leader.evidence + _BRINGS:
        return True
    if ((), True) not in found.fits:
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
