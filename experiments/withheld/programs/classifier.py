"""A classifier trained on the simulator: draws of the study's own model with each effect of the library, and without.

For each study anew: every effect is drawn from its prior, over scales of a tenth to three times its deviation, and run
on the study's inputs; noise is added, white as the residuals show it and slow as sensors have it; coefficients and
first states are refitted to first order. A random forest learns the cause from what is left. Reality is never seen.

Features: how much of the residuals each effect's signatures take away (logarithm of the fall of chi-square), what all
leave, and each channel's size and correlation from sample to sample. It knows no cause outside the library: where all
effects together leave more than in 99 of 100 draws, it says "unknown".
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter
from sklearn.ensemble import RandomForestClassifier

from seatruth.effects import available
from withheld.programs.common import Array, Refitted, Rows, refitted, soft
from withheld.verdicts import verdict

EACH, COPIES = 12, 4
"""Runs of each effect, and noises added to each."""
NONE = 5
"""Times as many draws have no effect as have one of the effects."""
SCALES = (0.1, 3.0)
"""Of an effect's prior deviation, even in the logarithm."""
SLOW, TAU = (0.1, 2.0), (3.0, 300.0)
"""Slow part of a channel's noise over its white part, and its correlation time in samples; even in the logarithm
[S]."""
LEARNED = 3
"""Directions in which an effect's runs are kept, at most."""
TREES, LEAF = 200, 2
STRANGE = 0.99


@dataclass(frozen=True)
class Space:
    """What residuals are seen through: `nuisance` (n, p) and each effect's `signatures` (n, k), orthonormal columns;
    `every` (n, K) those of all effects together; `runs` the rows of each channel of each trial."""

    nuisance: Array
    signatures: Mapping[str, Array]
    every: Array
    runs: Sequence[tuple[str, Rows]]

    def features(self, residuals: Array) -> Array:
        """(draws, F) of residuals (n, draws) in units of white noise; the last is what all effects leave."""
        rest = residuals - self.nuisance @ (self.nuisance.T @ residuals)
        found = [np.log1p(((u.T @ rest) ** 2).sum(axis=0)) for u in self.signatures.values()]
        for channel in dict.fromkeys(name for name, _ in self.runs):
            own = [rest[rows] for name, rows in self.runs if name == channel]
            size = sum((one**2).sum(axis=0) for one in own) / sum(len(one) for one in own)
            found.append(np.log(size))
            found.append(sum((one[1:] * one[:-1]).mean(axis=0) for one in own) / len(own) / size)
        left = rest - self.every @ (self.every.T @ rest)
        return np.stack([*found, np.log((left**2).mean(axis=0))], axis=1)


def noise(rng: np.random.Generator, runs: Sequence[tuple[str, Rows]], draws: int) -> Array:
    """(n, draws) of white noise of deviation 1 and a slow part that is another one in each channel of each draw."""
    n = 1 + max(int(rows.max()) for _, rows in runs)
    found = rng.standard_normal((n, draws))
    channels = list(dict.fromkeys(name for name, _ in runs))
    for k in range(draws):
        size, tau = (np.exp(rng.uniform(math.log(a), math.log(b), len(channels))) for a, b in (SLOW, TAU))
        for name, rows in runs:
            j = channels.index(name)
            keep = math.exp(-1 / tau[j])
            kicks = rng.standard_normal(len(rows)) * math.sqrt(1 - keep**2)
            kicks[0] /= math.sqrt(1 - keep**2)
            found[rows, k] += size[j] * lfilter([1.0], [1.0, -keep], kicks)
    return found


def runs_of_effects(found: Refitted, rng: np.random.Generator) -> dict[str, Array]:
    """Effect -> (M, EACH) changes of the residuals by drawn values of its parameters, without those that diverge."""
    changes = {}
    low, high = found.cost.bounds
    base = found.cost.residuals(found.at)
    for name, columns in found.columns.items():
        effect = available()[name]
        priors = effect.priors(found.study.model)
        own = []
        for _ in range(EACH):
            scale = math.exp(rng.uniform(*np.log(SCALES)))
            x = found.at.copy()
            for k, q in zip(columns, effect.parameters, strict=True):
                prior = priors[q.name]
                shape = q.prior is not None
                x[k] = prior.mean + prior.sd * rng.standard_normal() * (1.0 if shape else scale)
            residuals = found.cost.residuals(np.clip(x, low, high))
            if np.isfinite(residuals).all():
                own.append(residuals - base)
        if own:
            changes[name] = np.stack(own, axis=1)
    return changes


def decided(
    residuals: Array, nuisances: Array, changes: Mapping[str, Array], runs: Sequence[tuple[str, Rows]],
    rng: np.random.Generator,
) -> dict[str, float]:  # fmt: skip
    """Probabilities of each effect and of none (""), after training on draws; {} where no draw is like the residuals.

    Residuals (M,), nuisances (M, K) and each effect's changes (M, draws) are in units of white noise; `runs` numbers
    the data among the rows, the others are the priors'.
    """
    q, _ = np.linalg.qr(nuisances / np.maximum(np.linalg.norm(nuisances, axis=0), 1e-300))
    signatures = {}
    for name, own in changes.items():
        rest = own - q @ (q.T @ own)
        size = np.linalg.norm(rest, axis=0)
        rest = rest[:, size > 0] / size[size > 0]
        if rest.shape[1]:
            u, s, _ = np.linalg.svd(rest, full_matrices=False)
            signatures[name] = u[:, : min(LEARNED, int((s > 0.1 * s[0]).sum()))]
    every, _ = np.linalg.qr(np.concatenate(list(signatures.values()), axis=1))
    space = Space(q, signatures, every, runs)
    data = np.concatenate([rows for _, rows in runs])
    drawn: list[Array] = []
    labels: list[str] = []
    nothing = np.zeros((len(residuals), NONE * EACH))
    for name, own in [("", nothing), *((name, changes[name]) for name in signatures)]:
        for _ in range(COPIES):
            noisy = own.copy()
            noisy[data] += noise(rng, runs, own.shape[1])[data]
            drawn.append(space.features(noisy))
            labels += [name] * own.shape[1]
    learned, seen = np.concatenate(drawn), space.features(residuals[:, None])
    if seen[0, -1] > np.quantile(learned[:, -1], STRANGE):
        return {}
    forest = RandomForestClassifier(TREES, min_samples_leaf=LEAF, random_state=0)
    forest.fit(learned, labels)
    return dict(zip(forest.classes_.tolist(), forest.predict_proba(seen)[0].tolist(), strict=True))


def classifier(study: Path) -> dict[str, Any]:
    """Trains on the study's own simulator, then looks at the study's residuals."""
    rng = np.random.default_rng(0)
    found = refitted(study)
    white = found.white()
    changes = {name: own / white[:, None] for name, own in runs_of_effects(found, rng).items()}
    chances = decided(found.residuals / white, found.nuisances / white[:, None], changes, found.runs, rng)
    if not chances:
        return verdict(study.parent.name, [(["unknown"], 1.0)])
    return verdict(study.parent.name, soft({name: math.log(p) for name, p in chances.items() if p > 0}))
