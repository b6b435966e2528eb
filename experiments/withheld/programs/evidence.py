"""Evidence of one mechanism and of two, over all ways in which they act, for the program that knows reality's forms.

Of two the sizes are summed over by Laplace's method at the ways that fit best; what other ways add is what they add to
each alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from withheld.programs.common import Rows
from withheld.programs.ways import LOOSE, Sizes
from withheld.reality.motion import Array

NOTHING = 1e-12
"""Least lambda at the size 1 that is divided by."""


@dataclass
class Menu:
    """What the mechanisms of a menu could have done: a candidate is a way at a rung.

    `gram` (C, C) and `pull` (C,) are of the candidates among themselves and with the data, whitened, coefficients and
    distractors marginalised; `shape` (ways, rungs) numbers a mechanism's candidates, `logs` (ways,) are their
    prior probabilities. `loose` says of which mechanisms a refit takes up nearly all; `nothing` is the log-evidence of
    no cause.
    """

    gram: Array
    pull: Array
    shapes: list[Rows]
    logs: list[Array]
    loose: list[bool]
    nothing: float = 0.0


def evidence(gram: Array, columns: Sequence[int], sds: Array) -> Array:
    """Log-evidence (cases,), over nothing, of signatures with normal sizes of deviations `sds` (cases, columns)."""
    data = len(gram) - 1
    scaled = gram[np.ix_(columns, columns)] * sds[:, :, None] * sds[:, None, :] + np.eye(len(columns))
    pull = gram[columns, data] * sds
    lower = np.linalg.cholesky(scaled)
    solved = np.linalg.solve(scaled, pull[:, :, None])[:, :, 0]
    log_det = 2 * np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
    return np.asarray(0.5 * (pull * solved).sum(axis=1) - 0.5 * log_det)


def log_sum(logs: Array) -> float:
    """Logarithm of the sum of all numbers of which these are the logarithms."""
    return float(np.logaddexp.reduce(np.ravel(logs)))


def alone(menu: Menu, k: int, prior: Sizes) -> Array:
    """Log-evidence (ways, sizes), over nothing, of one mechanism with the prior probabilities of ways and sizes in it.

    A size that is larger than the largest believable one is that one.
    """
    prior = LOOSE if menu.loose[k] else prior
    own = menu.shapes[k]
    there, pull = np.maximum(np.diag(menu.gram)[own], NOTHING), menu.pull[own]
    wanted = np.minimum(prior.lambdas[None, :], there.max(axis=1)[:, None])
    rung = np.abs(np.log(there[:, :, None]) - np.log(wanted[:, None, :])).argmin(axis=1)
    lam, p = np.take_along_axis(there, rung, axis=1), np.take_along_axis(pull, rung, axis=1)
    return np.asarray(np.sqrt(wanted / lam) * p - 0.5 * wanted + prior.logs[None, :] + menu.logs[k][:, None])


def _best_beside(menu: Menu, k: int, other: int | None) -> int:
    """The candidate of a mechanism that fits best beside another candidate of a free size."""
    own = menu.shapes[k].ravel()
    pull, there = menu.pull[own], np.diag(menu.gram)[own]
    if other is not None:
        g = max(float(menu.gram[other, other]), NOTHING)
        cross = menu.gram[own, other]
        pull, there = pull - cross * menu.pull[other] / g, there - cross**2 / g
    gain = np.maximum(pull, 0.0) ** 2 / np.maximum(there, 1e-6 * np.maximum(np.diag(menu.gram)[own], NOTHING))
    return int(own[int(np.argmax(gain))])


def both(menu: Menu, pair: tuple[int, int], priors: tuple[Sizes, Sizes], beyond: Sequence[float]) -> float:
    """Log-evidence, over nothing, of two mechanisms at once; `beyond` is what `other_ways` says of each."""
    i, j = pair
    priors = (LOOSE if menu.loose[i] else priors[0], LOOSE if menu.loose[j] else priors[1])
    a = _best_beside(menu, i, None)
    for _ in range(2):
        b = _best_beside(menu, j, a)
        a = _best_beside(menu, i, b)
    chosen = [a, b]
    gram, pull = menu.gram[np.ix_(chosen, chosen)], menu.pull[chosen]
    d = np.maximum(np.diag(gram), NOTHING)
    # lambda of each is what the other leaves of it.
    left = np.maximum(1 - gram[0, 1] ** 2 / (d[0] * d[1]), 1e-6)
    held = gram + np.diag(1e-9 * d)
    top = np.linalg.solve(held, pull)
    low = np.array([math.sqrt(p.lambdas[0] / (x * left)) for p, x in zip(priors, d, strict=True)])
    high = np.array([math.sqrt(p.lambdas[-1] / (x * left)) for p, x in zip(priors, d, strict=True)])
    f = np.clip(top, low, high)
    for _ in range(8):
        f = np.array([np.clip((pull[k] - gram[k, 1 - k] * f[1 - k]) / d[k], low[k], high[k]) for k in range(2)])
    fit = float(pull @ f - 0.5 * f @ gram @ f)
    # Widths of what is left of each size's uncertainty, in units of the size, under a density even in its logarithm.
    widths = np.minimum(math.sqrt(2 * math.pi) / np.sqrt(d * left), high - low)
    density = [2 / math.log(p.lambdas[-1] / p.lambdas[0]) / x for p, x in zip(priors, f, strict=True)]
    return fit + float(np.log(widths * density).sum()) + 0.5 * math.log(left) + beyond[i] + beyond[j]


def other_ways(menu: Menu, k: int, prior: Sizes) -> float:
    """What the ways other than the best add to a mechanism's evidence, with their prior probabilities in it."""
    logs = alone(menu, k, prior)
    each = np.logaddexp.reduce(logs, axis=1)
    best = int(np.argmax(each))
    return float(log_sum(each) - (each[best] - menu.logs[k][best]))
