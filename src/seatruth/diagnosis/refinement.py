"""How finely the forces of each trial follow time: with more knots as long as the trials ask for them.

A trial's own missing force keeps its sign over `force_memory` knots. Hulls forget within one to five times L / U, while
a recorded trial may last a hundred times that: with few knots what a gust or a wake does within a knot is taken for
slow errors of every sensor, and what causes it is not seen. The spacing is a size like the others, chosen by the
marginal likelihood of the model alone. Where forces explain little, their spacing matters to nothing, and is left. A
spacing whose fit converges is not given up for a finer one whose fit does not: with that, no effect's fit converges
either, and nothing can be compared.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit, fit_at
from seatruth.diagnosis.hypotheses import HOPE, Search
from seatruth.diagnosis.hypothesis_fits import fit_again, fit_from_equation_error, fit_once
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sections import knots_of_section
from seatruth.diagnosis.size_search import best_evidence
from seatruth.diagnosis.sizes import NoisePrior, Sizes
from seatruth.diagnosis.steps import likelihood_at

_FINER = 10.0
"""nats that half the spacing must bring: a search with twice the knots takes up to twice the time. [S] Not a part of
what forces explain: of six trials of an ROV 45 knots brought 62 nats, 0.7 % of that, and without them the thrust of
two thrusters, which was right, led the model alone by 33 nats."""
_PART = 0.05
"""Part of what forces explain that a finer spacing whose fit did not converge must bring, beside one that did, for one
finer yet to be tried. [S] Of six trials of an ROV 23 knots brought 0.024, and over 45 no fit came to its end, in a
third of the time of the search. Of a ship on a pond they brought 0.048, and converged."""
_MOST = 45
"""Most knots, so that 23 and 45 are tried. [S] On a trial of 444 s a line between two of 45 lasts 10 s, two L / U of a
3 m ship; 72 knots brought 100 nats more there, in twice the time."""


def refine(found: Search, say: Callable[[int], None]) -> Search:
    """The search with the spacing of the trials' own forces halved as often as the evidence rises by it.

    `say` gets the number of knots that is tried. The model alone is fitted already, with discrepancy and without. Fits
    of effects without discrepancy stay as they are.
    """
    first = found.problem
    coarse, plain = found.fits.get(((), True)), found.fits.get(((), False))
    explained = math.inf if coarse is None or plain is None else coarse.evidence - plain.evidence
    if coarse is None or explained < HOPE or first.discrepancy is None or first.few_runs is not None:
        return found
    knots, forces = 2 * first.settings.knots - 1, coarse.point.forces
    most = knots_of_section(_MOST, first.settings.sections)
    while knots <= most:
        say(knots)
        # From the forces of a fit that did not converge, too: it says nothing of finer ones, with which the next may.
        problem = first.with_settings(replace(first.settings, knots=knots))
        forces, at = between(forces), found.fits[(), True]
        finer = Search(problem, found.known, store=found.store)
        start, sizes = Point(at.point.shared, at.point.initial, forces), _over(at, found.problem, problem)
        if at.settled and _promised(finer, start, sizes) < at.evidence + _FINER:
            break
        loose = _loose(finer, start, sizes, at.evidence, at.evidence + _PART * explained if at.settled else -math.inf)
        better = loose is not None and loose.evidence >= at.evidence + _FINER
        if loose is not None and better and (loose.settled or not at.settled):
            bare = [fit for fit in found.fits.values() if not fit.discrepancy]
            finer.fits |= {(fit.effects, False): _same(fit, problem, found.known) for fit in bare}
            found, forces = finer, loose.point.forces
        elif loose is not None and (loose.settled or (at.settled and loose.evidence - at.evidence < _PART * explained)):
            break
        knots = 2 * knots - 1
    return found


def _promised(finer: Search, start: Point, sizes: Sizes) -> float:
    """Linearized evidence (nats) of the model alone with forces over more knots, from a fit that converged over fewer.

    At that fit little is left to bend: on a ship's trials it is within 4 % of what a fit of the finer forces gains.
    Where the algebra fails it says nothing, and is infinite.
    """
    likelihood = likelihood_at(finer.problem, finer.problem.linearize(start, ()), sizes, ())
    return best_evidence(likelihood, (), finer.known, sizes)


def _loose(finer: Search, start: Point, sizes: Sizes, coarse: float, worth: float) -> Fit | None:
    """The fit of the model alone with forces, from a coarser fit, and from the recorded motion where that fails.

    That takes longest, and a fit that does not converge is asked for it only if its evidence (nats) is `worth` it. What
    is ahead of the `coarse` fit's evidence may still find better noise at its own end.
    """
    loose = fit_once(finer, (), True, start, sizes)
    if loose is None or (not loose.settled and loose.evidence >= worth):
        loose = fit_from_equation_error(finer, sizes) or loose
    if loose is not None and loose.evidence >= coarse and (loose.settled or loose.evidence >= worth):
        fit_again(finer, discrepancy=True)
    return finer.fits.get(((), True))


def _same(bare: Fit, problem: Problem, known: NoisePrior) -> Fit:
    """A fit without forces as that of another problem."""
    point = Point(bare.point.shared, bare.point.initial, problem.start.forces)
    return fit_at(problem, bare.effects, point, bare.sizes, known, discrepancy=False, settled=bare.settled)


def between(forces: Array) -> Array:
    """The same broken lines (T, E, K) with a further knot within each piece: (T, E, 2 K - 1)."""
    found: Array = np.zeros((*forces.shape[:2], 2 * forces.shape[2] - 1))
    found[:, :, ::2] = forces
    found[:, :, 1::2] = 0.5 * (forces[:, :, 1:] + forces[:, :, :-1])
    return found


def _over(fit: Fit, before: Problem, after: Problem) -> Sizes:
    """The sizes of a fit over the usual accelerations of another problem."""
    change = np.log(before.usual / after.usual)
    return replace(fit.sizes, terms=fit.sizes.terms + change, forces=fit.sizes.forces + change)
