"""What a real refit leaves of a cause: the referee's lambda.

To first order nearly all of some signatures (drag, thrust, tether, shallow water) is what the coefficients do, too;
what is left of a finite change then is mostly curvature, which a refit that follows the curve takes up. So reality's
own baseline is refitted here, coefficients under their priors and all first states, to the noise-free outputs with
the cause, by Gauss-Newton steps with fresh derivatives. lambda is the squared whitened misfit at the minimum with what
the priors charge for the way there: the non-centrality of the best test of the cause. The prior's mean counts as true,
as it does to first order, where the two agree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from withheld.reality.families import Family
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, Record
from withheld.referee import Point, Rig, Signatures, left_over, marginal, spans

STEPS = 8
"""Gauss-Newton steps at most."""
ENOUGH = 0.01
"""Relative fall of the misfit that another step would bring, below which the minimum is reached."""
LEAST = 0.02
"""The same, absolute."""
SHORTEST = 1 / 16
"""Of a step, before no way down is seen."""
LOOSE = 1e-9
"""Weight of the free sizes' priors: none, but for sizes that move nothing."""
ABSORBED = 0.03
"""Share of a typical signature that is left, below which curvature would rule what is left."""
SMALL = 0.01
"""Share of a typical magnitude at which such a signature is taken instead."""
FOLLOWED = 3
"""Rivals among those, the nearest ones, that are refitted in full."""
NEAR = 0.9
"""Of what a cause leaves, above which a rival that leaves as much to first order is not followed."""


@dataclass(frozen=True)
class Refit:
    """A refit: what it leaves, where it ended, and how things change about there."""

    left: float
    """lambda."""
    point: Point
    here: Signatures
    """About `point`; the last column is what is left there."""


@dataclass(frozen=True)
class _Step:
    cost: float
    """At the point."""
    predicted: float
    """After the step, to first order."""
    move: Array
    firsts: Array


def refit(rig: Rig, aim: Array, start: Point | None = None) -> Refit:
    """Refits a vehicle's baseline (and the sizes of what is free in it) to noise-free outputs (samples, 6, trials)."""
    point = start or rig.truth()
    here = rig.look(point, aim=aim)
    now = _step(here, point)
    for _ in range(STEPS):
        if now.cost - now.predicted < max(ENOUGH * now.cost, LEAST):
            break
        part = 1.0
        while part >= SHORTEST:
            further = point.at(part * now.move, part * now.firsts)
            there = rig.look(further, aim=aim)
            then = _step(there, further)
            if then.cost < now.cost:
                break
            part /= 2
        else:
            return Refit(now.cost, point, here)
        point, here, now = further, there, then
    return Refit(min(now.cost, now.predicted), point, here)


def _step(here: Signatures, point: Point) -> _Step:
    """The Gauss-Newton step from a point."""
    size, free = len(point.moved), len(point.sizes)
    own = slice(0, size + free)
    prior = np.concatenate([point.moved, np.zeros(free)])
    gram = np.sum([w[:, own].T @ w[:, own] for w in here.whitened], axis=0)
    weight = np.ones(size + free)
    weight[size:] = LOOSE * np.maximum(1.0, np.diag(gram)[size:])
    pull = np.sum([w[:, own].T @ w[:, -1] for w in here.whitened], axis=0) - prior
    move = np.linalg.solve(gram + np.diag(weight), pull)
    charged = float(point.moved @ point.moved)
    rest = sum(float(w[:, -1] @ w[:, -1]) for w in here.whitened) + charged
    firsts = [
        np.linalg.lstsq(s, w[:, -1] - w[:, own] @ move, rcond=None)[0]
        for s, w in zip(here.whole_starts, here.whole, strict=True)
    ]
    cost = sum(float(w[:, -1] @ w[:, -1]) for w in here.whole) + charged
    return _Step(cost, max(0.0, rest - float(pull @ move)), move, np.array(firsts))


@dataclass(frozen=True)
class Judged:
    """What the referee finds of one cause among those of a case."""

    fit: Refit
    """Of the baseline, with the case's other causes in it at free sizes."""
    aim: Array
    rig: Rig


def judged(
    family: Family,
    records: Sequence[Record],
    coefficients: Mapping[str, float],
    noise: Mapping[str, Noise],
    causes: Sequence[Present],
    which: int,
    start: Point | None = None,
) -> Judged:
    """Refits everything but one cause to the outputs with all causes; its `fit.left` is that cause's lambda."""
    others = [one for k, one in enumerate(causes) if k != which]
    rig = Rig(family, records, coefficients, noise, others)
    aim = rig.outputs(causes)
    return Judged(refit(rig, aim, start), aim, rig)


def pairs(found: Judged, rivals: Sequence[Mechanism]) -> dict[str, float]:
    """lambda that is left of a cause when a rival mechanism may act in its place, by the rival's key.

    A rival's signatures are taken about the refitted baseline: at their typical magnitudes, or at small ones where a
    refit absorbs nearly all of them. The nearest of the latter are refitted in full.
    """
    fit, rig = found.fit, found.rig
    flexible = [one for one in rivals if one.kind != "gear"]
    variants = [*spans(rivals), *((f"{key}~", acting) for key, acting in spans(flexible, SMALL))]
    here = rig.look(fit.point, variants, found.aim)
    size, last = len(fit.point.moved), here.whitened[0].shape[1] - 1
    # What the priors charge stands in rows of its own under the data.
    gram = here.grams.sum(axis=0)
    gram[:size, last] -= fit.point.moved
    gram[last, :size] -= fit.point.moved
    gram[last, last] += float(fit.point.moved @ fit.point.moved)
    rest = marginal(gram, size)
    end, always = len(here.labels) - 1, here.columns("")
    raw = np.diag(gram)[size:]
    left, near = {}, []
    for one in rivals:
        columns = here.columns(one.key)
        share = max(left_over(rest, k, always) / max(float(raw[k]), 1e-300) for k in columns)
        if share < ABSORBED and one.kind != "gear":
            columns = here.columns(f"{one.key}~")
            near.append(one)
        left[one.key] = min(fit.left, left_over(rest, end, [*always, *columns]))
    near.sort(key=lambda one: left[one.key])
    for one in [one for one in near if _plain(one) and left[one.key] < NEAR * fit.left][:FOLLOWED]:
        left[one.key] = min(fit.left, _followed(found, one))
    return left


def _plain(one: Mechanism) -> bool:
    """Whether its spans differ in nothing but magnitudes, so that free sizes stand for all of them."""
    return all({k: v for k, v in s.items() if k not in one.grows} ==
               {k: v for k, v in one.spans[0].items() if k not in one.grows} for s in one.spans)  # fmt: skip


def _followed(found: Judged, rival: Mechanism) -> float:
    """lambda that a refit with the rival at a free size leaves, from the baseline's own refit on."""
    still = Present(rival, rival.scaled(dict(rival.spans[0]), 0.0))
    rig = replace(found.rig, free=[*found.rig.free, still])
    own = found.fit.point
    start = Point(own.moved, np.concatenate([own.sizes, np.zeros(len(rival.grows))]), own.firsts)
    return refit(rig, found.aim, start).left
