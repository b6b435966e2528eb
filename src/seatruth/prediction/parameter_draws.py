"""Parameters drawn from what an estimate leaves open: the trials' part and the priors' part of their covariance.

At the estimate, with residuals r over their noise and their derivatives J (priors included), H = J'J. The error of the
estimate is H^-1 (s + p): s = J_d' r_d is the trials' score, p the priors'. Its covariance has two parts:

    trials  H^-1 M H^-1, with M from the residuals as they are, autocorrelated (uncertainty/covariance.py)
    priors  H^-1 P H^-1, with P the information of the priors

A parameter without a prior has its bounds for one: a uniform distribution between them has a standard deviation of
their distance over sqrt(12). It does not move the estimate and hardly counts where the trials speak.

**Lack of fit.** M takes what is left as noise that is independent from trial to trial. Where the model's structure
lacks something, trials pull the parameters apart by more than that. The scores of the single trials show it: their
scatter, T / (T - 1) sum_t (s_t - mean)(...)', estimates M as well, from whole trials (cluster-robust, Liang and Zeger
1986). The trials' part is multiplied by the mean ratio of both over the directions that M holds, where it is above 1.
What is still missing then shows in the figures of the fitted trials (intervals.py). What all trials lack alike, and
what another manoeuvre asks of the model beyond them, shows nowhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from seatruth.arrays import Array, Flags
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import ResidualBlock, StudyCost, prior_blocks
from seatruth.errors import BadInput
from seatruth.estimate import Estimate
from seatruth.study.study import Study
from seatruth.uncertainty.covariance import covariance

_HELD = 1e-6
"""Eigenvalue of the trials' part (scaled), over the largest, above which a direction counts for the lack of fit: below
it both estimates are rounding. Chosen here [S]."""
_TRIES = 400
"""Draws made at most for each one that is wanted, before those outside the bounds are moved onto them: with ten
parameters on a bound one in a thousand lies inside. Chosen here [S]."""
_LEAST_FREEDOM = 4.0
"""Degrees of freedom of Student's t below which its variance is hardly finite. Chosen here [S]."""


@dataclass(frozen=True)
class ParameterDraws:
    """What an estimate leaves open about its K free parameters.

    Attributes:
        names: the free parameters.
        center: (K,), the estimate.
        trials, priors: (K, K), the two parts of the covariance, the first with the lack of fit.
        weighed: (K, K), the covariance H^-1 that the fit's own weights of trials and priors stand for.
        freedom: degrees of freedom of the trials' part.
        lack_of_fit: the factor in the variance of the trials' part, 1 where there is none; NaN with one trial.
        fixed_by_nothing: parameters that neither trials nor priors nor bounds hold; they stay at the estimate.
        X: (n, K), the draws, inside bounds and constraints.
        moved: share of the draws that had to be moved onto a bound.
    """

    names: tuple[str, ...]
    center: Array
    trials: Array
    priors: Array
    weighed: Array
    freedom: float
    lack_of_fit: float
    fixed_by_nothing: tuple[str, ...]
    X: Array
    moved: float = 0.0
    noise: dict[str, float] = field(default_factory=dict)


def parameter_draws(study: Study, estimate: Estimate, draws: int, seed: int, threads: int | None) -> ParameterDraws:
    """Draws parameters from an estimate of a study, whatever its cost.

    Raises:
        BadInput: the estimate is of another study, or the cost has no derivatives there.
    """
    cost = cost_of(study, threads=threads)
    x = _answer(cost, estimate)
    cost.reweight(x)
    residuals, J = cost.residuals(x), cost.jacobian(x)
    where = f"estimate of {estimate.study!r}"
    if not (np.isfinite(residuals).all() and np.isfinite(J).all()):
        raise BadInput(
            "the simulation of its trials diverges there, so nothing is known of its uncertainty",
            where=where,
            do="Identify again, from other starts or with narrower bounds.",
        )
    blocks = list(cost.residual_blocks)
    size = len(cost.parameters)
    bounded = _bounds_as_priors(cost)
    rows = np.zeros((len(bounded), size))
    for row, (place, sd) in enumerate(bounded):
        rows[row, place] = 1.0 / sd
    blocks += prior_blocks([cost.names[place] for place, _ in bounded], len(residuals))
    residuals, J = np.concatenate([residuals, np.zeros(len(bounded))]), np.concatenate([J, rows])
    whole = covariance(residuals, J, blocks)
    inverse = np.nan_to_num(covariance(residuals, J, blocks, white=True).covariance)
    total = np.nan_to_num(whole.covariance)
    P = sum((J[b.rows].T @ J[b.rows] for b in blocks if b.kind == "prior"), np.zeros((size, size)))
    priors = inverse @ P @ inverse
    trials = total - priors
    factor = _lack_of_fit(residuals, J, blocks, inverse, trials)
    count = len(cost.space.free)
    own = np.s_[:count, :count]
    trials, priors = trials[own] * (factor if factor > 1.0 else 1.0), priors[own]
    lost = tuple(np.array(cost.names)[whole.unidentifiable][: count + 1])
    rng = np.random.default_rng(seed)
    freedom = max(_LEAST_FREEDOM, whole.degrees_of_freedom)
    X, moved = _drawn(cost, x[:count], trials, priors, freedom, draws, rng)
    names = tuple(cost.space.free_names)
    held = tuple(name for name in names if name in lost)
    return ParameterDraws(
        names, x[:count], trials, priors, inverse[own], freedom, factor, held, X, moved, dict(cost.sigma)
    )


def _answer(cost: StudyCost, estimate: Estimate) -> Array:
    """The estimate as the cost's vector (K,): free parameters, then nuisances."""
    table = {**estimate.parameters["value"].to_dict(), **estimate.nuisances["value"].to_dict()}
    missing = [name for name in cost.names if name not in table]
    strange = [str(name) for name in table if name not in cost.names]
    if missing or strange:
        what = f"no {missing[0]!r}" if missing else f"a {strange[0]!r}, which the study does not free"
        raise BadInput(
            f"it is of another study: it has {what}",
            where=f"estimate of {estimate.study!r}",
            do="Identify the study again, or name the folder of its own result.",
        )
    return np.array([float(table[name]) for name in cost.names])


def _bounds_as_priors(cost: StudyCost) -> list[tuple[int, float]]:
    """(place, standard deviation) of the free parameters that have bounds and no prior."""
    found = []
    for place, parameter in enumerate(cost.space.free):
        width = parameter.max - parameter.min
        if parameter.prior is None and math.isfinite(width):
            found.append((place, width / math.sqrt(12.0)))
    return found


def _lack_of_fit(residuals: Array, J: Array, blocks: list[ResidualBlock], inverse: Array, trials: Array) -> float:
    """Variance between the trials' own pulls on the parameters, over that which their residuals let expect."""
    names = list(dict.fromkeys(block.trial for block in blocks if block.kind == "data"))
    if len(names) < 2:
        return math.nan
    pulls = np.zeros((len(names), J.shape[1]))
    for block in blocks:
        if block.kind == "data":
            pulls[names.index(block.trial)] -= inverse @ (J[block.rows].T @ residuals[block.rows])
    pulls -= pulls.mean(axis=0)
    scale = np.sqrt(np.clip(np.diag(trials), 0.0, None))
    used = scale > 0
    if not used.any():
        return 1.0
    values, vectors = np.linalg.eigh(trials[np.ix_(used, used)] / np.outer(scale[used], scale[used]))
    held = values > _HELD * float(values.max())
    along = (pulls[:, used] / scale[used]) @ vectors[:, held]
    between = len(names) / (len(names) - 1.0) * (along**2).sum(axis=0)
    return float(np.mean(between / values[held]))


def _drawn(
    cost: StudyCost, x: Array, trials: Array, priors: Array, freedom: float, draws: int, rng: np.random.Generator
) -> tuple[Array, float]:
    """Draws (n, K) inside bounds and constraints, and the share that had to be moved onto a bound."""
    roots = _root(trials), _root(priors)
    low, high = (np.asarray(bound)[: len(x)] for bound in cost.bounds)
    kept: list[Array] = []
    count, batch, outside = 0, max(256, 4 * draws), np.zeros((0, len(x)))
    for _ in range(max(1, _TRIES * draws // batch)):
        t = np.sqrt(freedom / rng.chisquare(freedom, (batch, 1)))
        made = x + t * (rng.standard_normal((batch, len(x))) @ roots[0].T)
        made = made + rng.standard_normal((batch, len(x))) @ roots[1].T
        inside: Flags = np.all((made >= low) & (made <= high), axis=1)
        inside[inside] &= cost.space.feasible(made[inside])
        kept.append(made[inside])
        outside = made[~inside]
        count += int(inside.sum())
        if count >= draws:
            break
    found = np.concatenate(kept)[:draws]
    if len(found) == draws:
        return found, 0.0
    moved = np.clip(outside[: draws - len(found)], low, high)
    moved = np.where(cost.space.feasible(moved)[:, None], moved, x)
    return np.concatenate([found, moved]), 1.0 - len(found) / draws


def _root(matrix: Array) -> Array:
    """A square root R (K, K) of a covariance, R R' = matrix, without its negative rounding."""
    scale = np.sqrt(np.clip(np.diag(matrix), 0.0, None))
    safe = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T) / np.outer(safe, safe))
    return np.asarray(scale[:, None] * vectors * np.sqrt(np.clip(values, 0.0, None)))
