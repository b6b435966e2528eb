"""Noise is a property of the sensors, not of a hypothesis: fits near the leader try the noise that others found.

The likelihood of noise has several optima: a slow error of a sensor and a missing force look alike. Two hypotheses that
stand at different ones are not on equal terms, and what looks like the gain of an effect may be that of better noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import fit_once
from seatruth.diagnosis.problem import Point
from seatruth.diagnosis.size_search import OfSizes
from seatruth.diagnosis.sizes import Sizes
from seatruth.diagnosis.steps import likelihood_at

_ROUNDS = 3
"""Times that noise is passed on. [S] One or two are usual."""
_OFFERS = 4
"""Fits, the leaders, whose noise is tried by the others. [S]"""
_TRIED = 12
"""Fits, the leaders, that try it, beside the model alone. [S]"""
_FAR = 400.0
"""nats behind the leader beyond which no noise makes a fit a rival. [S]"""
_BETTER = 0.5
"""nats by which other noise must be better for a fit to be made again. [S]"""


def share_noise(found: Search, turn: int) -> None:
    """Fits the leaders and the model alone again, where the noise of another leader is better than their own.

    `turn` counts the calls of one search.
    """
    tried: set[tuple[Key, bool, bytes]] = set()
    for round_ in range(_ROUNDS):
        ranked = sorted(found.fits.items(), key=lambda entry: (-entry[1].evidence, entry[0]))
        best = ranked[0][1].evidence
        near = [entry for k, entry in enumerate(ranked) if k < _TRIED or not entry[0][0]]
        offers = [fit.sizes for _, fit in ranked[:_OFFERS]]
        changed = False
        for (key, on), fit in near:
            if fit.evidence < best - _FAR:
                continue
            sizes = _better_noise(found, fit, offers)
            if sizes is None:
                continue
            attempt = key, on, _content(fit.point, sizes)
            if attempt not in tried:  # the same attempt again would end where it ended
                tried.add(attempt)
                fit_once(found, key, on, fit.point, sizes, attempt=f"with shared noise, {turn}.{round_}")
                changed = True
        if not changed:
            return


def _content(point: Point, sizes: Sizes) -> bytes:
    """All numbers of a point and of sizes."""
    arrays = point.shared, point.initial, point.forces, sizes.white, sizes.terms, sizes.forces, sizes.coupling
    return b"".join(values.tobytes() for values in arrays) + bytes(sizes.shape)


def _better_noise(found: Search, fit: Fit, offers: Sequence[Sizes]) -> Sizes | None:
    """The fit's sizes with noise from the offers, whole or channel by channel; None where its own is as good."""
    others = [one for one in offers if (one.shape, one.white.tobytes()) != (fit.sizes.shape, fit.sizes.white.tobytes())]
    if not others:
        return None
    likelihood = likelihood_at(found.problem, fit.linearized(found.problem), fit.sizes, fit.effects)
    value = OfSizes(likelihood, fit.effects, found.known)
    own = value(fit.sizes)
    whole = [replace(fit.sizes, white=one.white, shape=one.shape) for one in others]
    if fit.discrepancy:
        whole += [one for one in others if one.discrepancy]
    top = max((fit.sizes, *whole), key=value)
    reached = value(top)
    for one in others:
        for c in range(len(one.shape)):
            if one.shape[c] == top.shape[c]:
                continue
            white = top.white.copy()
            white[c] = one.white[c]
            tried = replace(top, white=white, shape=(*top.shape[:c], one.shape[c], *top.shape[c + 1 :]))
            now = value(tried)
            if now > reached:
                top, reached = tried, now
    return top if reached > own + _BETTER else None
