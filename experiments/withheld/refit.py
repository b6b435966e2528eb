"""What a real refit leaves of a cause: the referee's lambda.

To first order nearly all of some signatures (drag, thrust, tether, shallow water) is what the coefficients do, too;
what is left of a finite change then is mostly curvature, which a refit that follows the curve takes up. So reality's
own baseline is refitted here, coefficients under their priors and all first states, to the noise-free outputs with
the cause, by Levenberg-Marquardt steps. lambda is the squared whitened misfit at the minimum with what
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

STEPS = 20
"""Levenberg-Marquardt steps at most."""
ENOUGH = 0.03
"""Relative fall of the misfit that another step would bring, below which the minimum is reached."""
LEAST = 0.02
"""The same, absolute."""
LEAST_DAMPING, LARGEST_DAMPING, FASTER, SLOWER = 1e-3, 1e9, 8.0, 4.0
"""Of the steps, and how it changes when they fail and when they succeed."""
HOPELESS = 1e9
"""Misfit from which no refit is tried: the motion ran away."""
DIRECT, GROWING = 8, (0.1, 0.3, 0.6)
"""Steps after which a refit is tried along another way, and the parts of the cause on it."""
FIRSTS = 1e-9
"""Weight that keeps first states where nothing tells them."""
LOOSE = 1e-9
"""Weight of the free sizes' priors: none, but for sizes that move nothing."""
ABSORBED = 0.03
"""Share of a typical signature that is left, below which curvature would rule what is left."""
SMALL = 0.01
"""Share of a typical magnitude at which such a signature is taken instead."""
FOLLOWED = 3
"""Rivals among those, the nearest ones, that are refitted in full."""
SIZES = tuple(0.1 * 1.5**k for k in range(11))
"""Parts of a typical magnitude at which what a gear does to an order is looked at: 0.1 to 5.8."""
BETWEEN = 1.5**0.5
"""Factor either way by which such a signature is stretched: halfway to the next one."""
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
    settled: bool
    """Whether it ended in a minimum. Where it did not, nothing is known of lambda."""


def refit(rig: Rig, aim: Array, start: Point | None = None, steps: int = STEPS) -> Refit:
    """Refits a vehicle's baseline (and the sizes of what is free in it) to noise-free outputs (samples, 6, trials).

    It begins at `start` or at the truth, whichever lies nearer.
    """
    begun = rig.truth()
    if start is not None and misfit(rig, aim, start) <= misfit(rig, aim, begun):
        begun = start
    now = _Looked(rig, aim, begun)
    damping = LEAST_DAMPING
    for _ in range(steps if now.cost < HOPELESS else 0):
        move, firsts, predicted = now.step(0.0)
        if now.cost - predicted < max(ENOUGH * now.cost, LEAST):
            return Refit(max(0.0, min(now.cost, predicted)), now.point, now.here, True)
        failed = False
        while damping <= LARGEST_DAMPING:
            move, firsts, _ = now.step(damping)
            tried = now.point.at(move, firsts)
            # Where one step failed the next is looked at in full only if it does not.
            if not failed or misfit(rig, aim, tried) < now.cost:
                there = _Looked(rig, aim, tried)
                if there.cost < now.cost:
                    break
            failed = True
            damping *= FASTER
        else:
            return Refit(now.cost, now.point, now.here, False)
        now, damping = there, max(LEAST_DAMPING, damping / SLOWER)
    return Refit(now.cost, now.point, now.here, False)


def misfit(rig: Rig, aim: Array, point: Point) -> float:
    """What a refit minimises, at a point: one run of each trial, where a look at all derivatives takes hundreds."""
    left = aim - rig.there(point)
    moved = float(point.moved @ point.moved)
    return moved + sum(float(np.sum(rig.whiten(record, left[:, :, k]) ** 2)) for k, record in enumerate(rig.records))


class _Looked:
    """A point, what changes about it, and the Levenberg-Marquardt steps from it."""

    def __init__(self, rig: Rig, aim: Array, point: Point) -> None:
        self.point, self.here = point, rig.look(point, aim=aim)
        whole, own = self.here.whole, len(point.moved) + len(point.sizes)
        self.charged = float(point.moved @ point.moved)
        self.cost = sum(float(w[:, -1] @ w[:, -1]) for w in whole) + self.charged
        self.weight, self.prior = np.ones(own), np.concatenate([point.moved, np.zeros(len(point.sizes))])
        diagonal = sum((w[:, :own] ** 2).sum(axis=0) for w in self.here.whitened)
        self.weight[len(point.moved) :] = LOOSE * np.maximum(1.0, np.asarray(diagonal)[len(point.moved) :])
        # Of each trial: first states on themselves, on the rest, and on what is left.
        pairs = list(zip(whole, self.here.whole_starts, strict=True))
        self.blocks = [(s.T @ s, s.T @ w[:, :own], s.T @ w[:, -1]) for w, s in pairs]
        self.gram = np.sum([w[:, :own].T @ w[:, :own] for w in whole], axis=0) + np.diag(self.weight)
        self.pull = np.sum([w[:, :own].T @ w[:, -1] for w in whole], axis=0) - self.prior

    def step(self, damping: float) -> tuple[Array, Array, float]:
        """(coefficients and sizes, first states, cost after it to first order); damped in units of the priors, and of
        the noise."""
        gram, pull = self.gram + damping * np.eye(len(self.weight)), self.pull.copy()
        solved = []
        for own, cross, left in self.blocks:
            held = own + (damping + FIRSTS) * np.eye(len(own))
            across, alone = np.linalg.solve(held, cross), np.linalg.solve(held, left)
            gram, pull = gram - cross.T @ across, pull - cross.T @ alone
            solved.append((across, alone))
        move = np.linalg.solve(gram, pull)
        firsts = np.array([alone - across @ move for across, alone in solved])
        gained = float(self.pull @ move) + sum(float(b[2] @ f) for b, f in zip(self.blocks, firsts, strict=True))
        return move, firsts, max(0.0, self.cost - gained)


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
    others, cause = [one for k, one in enumerate(causes) if k != which], causes[which]
    rig = Rig(family, records, coefficients, noise, others)
    aim = rig.outputs(causes)
    found = refit(rig, aim, start, DIRECT)
    if not found.settled:
        # The way was crooked: another follows the minimum while the cause grows.
        point = None
        for share in GROWING:
            part = Present(cause.mechanism, cause.mechanism.scaled(cause.values, share))
            grown = refit(rig, rig.outputs([part if one is cause else one for one in causes]), point, DIRECT)
            if not grown.settled:
                return Judged(found, aim, rig)
            point = grown.point
        other = refit(rig, aim, point)
        if (not other.settled, other.left) < (not found.settled, found.left):
            found = other
    return Judged(found, aim, rig)


def pairs(found: Judged, rivals: Sequence[Mechanism]) -> dict[str, float]:
    """lambda that is left of a cause when a rival mechanism may act in its place, by the rival's key.

    A rival's signatures are taken about the refitted baseline: at their typical magnitudes, or at small ones where a
    refit absorbs nearly all of them. The nearest of the latter are refitted in full. What a gear does to an order is no
    multiple of what it does at another size (a dead time of 0.1 s is none of one of 1 s): it is looked at at many.
    """
    fit, rig = found.fit, found.rig
    flexible = [one for one in rivals if one.kind != "gear"]
    late = [one for one in rivals if one.kind == "gear" and one.orders]
    variants = [
        *spans([one for one in rivals if one not in late]),
        *((f"{key}~", acting) for key, acting in spans(flexible, SMALL)),
    ]
    variants += [(f"{key}@", acting) for size in SIZES for key, acting in spans(late, size)]
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
        if one in late:
            left[one.key] = min(fit.left, *(_stretched(rest, end, k, always) for k in here.columns(f"{one.key}@")))
            continue
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


def _stretched(gram: Array, column: int, other: int, always: Sequence[int]) -> float:
    """Squared norm of a column less another one that is stretched a little, after the best combination of `always`."""
    own, cross = float(gram[other, other]), float(gram[column, other])
    by = float(np.clip(cross / own, 1 / BETWEEN, BETWEEN)) if own > 0.0 else 0.0
    change = np.zeros(len(gram))
    change[column], change[other] = 1.0, -by
    free = [*always]
    joined = np.vstack([np.eye(len(gram))[free], change])
    return left_over(joined @ gram @ joined.T, len(free), range(len(free)))


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
