"""Prediction bands: what sets of parameters that the trials cannot tell apart predict for each trial."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.study_cost import StudyCost
from seatruth.errors import SeatruthError
from seatruth.progress import Progress, ProgressEvent, remaining
from seatruth.statistics.posterior_sample import LEVEL, Ensemble, Posterior
from seatruth.trials.trial import Trial
from seatruth.uncertainty.optima import indistinguishable

MEMBERS = 200
"""Draws of a posterior that are simulated. Chosen here [S]: the part of the posterior outside each edge of the band is
then 2.5 +- 1.1 %."""
BAND_COLUMNS = ("band_lower", "band_upper")
_BATCH = 16
"""Simulated members that are held at once, so that long trials fit into memory. Chosen here [S]."""


def near_optimal(starts: pd.DataFrame, names: Sequence[str], inflation: float) -> Array:
    """The ends (P, K) of a multi-start whose cost cannot be told from the lowest, that one first.

    Args:
        starts: The table of the starts.
        names: (K,), parameters and nuisances.
        inflation: Linear standard errors over those of white noise of the stated size.
    """
    usable = starts[(starts["optimum"] > 0) & np.isfinite(starts["cost"])].sort_values("cost", kind="stable")
    near = usable[usable["cost"] - usable["cost"].min() <= indistinguishable(inflation)]
    return np.asarray(near[[f"end {name}" for name in names]].to_numpy(dtype=float))


def posterior_members(found: Posterior, seed: int) -> Array:
    """At most `MEMBERS` draws (P, K), none of them twice."""
    draws = found.draws.to_numpy(dtype=float)
    chosen = np.random.default_rng(seed).permutation(len(draws))[:MEMBERS]
    return np.asarray(draws[np.sort(chosen)])


def with_bands(
    traces: pd.DataFrame,
    cost: StudyCost,
    members: Array,
    source: Literal["posterior", "starts"],
    holdout: Sequence[Trial],
    *,
    progress: Progress,
) -> tuple[pd.DataFrame, Ensemble]:
    """The traces of an estimate with the bands of an ensemble.

    The band holds what the parameters alone leave open: neither measurement noise nor what the model lacks is in it.

    Args:
        traces: One row a sample of each trial and channel.
        cost: The cost.
        members: (P, K), the sets of parameters and nuisances; each trial of the cost starts as its member says.
        source: Where they come from.
        holdout: Trials that took no part in the fit.
        progress: Called with a `ProgressEvent` after each member.

    Returns:
        The traces with `band_lower` and `band_upper`, the 2.5 and 97.5 % quantiles of the members at each sample (of
        fewer than 40 members nearly the lowest and the highest); and what was simulated.
    """
    began = time.perf_counter()
    trials = [*cost.trials, *holdout]
    edges = [_Edges(len(members)) for _ in trials]
    diverged = 0
    for k, member in enumerate(members, 1):
        runs = [*cost.predict(member), *_held_out(cost, member, holdout)]
        diverged += not all(np.isfinite(run).all() for run in runs)
        for edge, run in zip(edges, runs):
            edge.add(run)
        left = remaining(k, len(members), time.perf_counter() - began)
        progress(ProgressEvent("Prediction bands", k, len(members), "members", remaining_s=left))
    found = traces.copy()
    for name in BAND_COLUMNS:
        found[name] = math.nan
    channels = [channel.name for channel in cost.problem.model.outputs]
    for trial, edge in zip(trials, edges):
        bands = edge.quantiles()
        for column, channel in enumerate(channels):
            rows = (found["trial"] == trial.name) & (found["channel"] == channel)
            if rows.any():
                found.loc[rows, list(BAND_COLUMNS)] = np.stack([band[:, column] for band in bands], axis=1)
    return found, Ensemble(source, len(members), diverged)


def _held_out(cost: StudyCost, member: Array, holdout: Sequence[Trial]) -> list[Array]:
    """Predictions (n, D) of the trials held out; NaN where no initial state can be fitted with these parameters."""
    if not len(holdout):
        return []
    try:
        return cost.predict(member, holdout)
    except SeatruthError:
        return [np.full((len(trial), len(cost.problem.model.outputs)), math.nan) for trial in holdout]


class _Edges:
    """The lowest and the highest of many runs (n, D) at each sample, as many as the quantiles need."""

    def __init__(self, members: int) -> None:
        self._kept = math.ceil((1.0 - LEVEL) / 2.0 * max(members - 1, 0)) + 1
        self._waiting: list[Array] = []
        self._low: Array | None = None
        self._high: Array | None = None
        self._count: Array | int = 0

    def add(self, run: Array) -> None:
        # A run that diverges does not count, its beginning neither.
        self._waiting.append(run if np.isfinite(run).all() else np.full(run.shape, math.nan))
        if len(self._waiting) == _BATCH:
            self._merge()

    def quantiles(self) -> tuple[Array, Array]:
        """The 2.5 and the 97.5 % quantile (n, D) of the finite runs; NaN at samples that none predicts."""
        self._merge()
        assert self._low is not None  # there is a member
        assert self._high is not None
        place = (1.0 - LEVEL) / 2.0 * np.maximum(np.asarray(self._count) - 1, 0)
        some = np.asarray(self._count) > 0
        lower = np.where(some, _between(self._low, place), np.nan)
        return lower, np.where(some, -_between(-self._high, place), np.nan)

    def _merge(self) -> None:
        if not self._waiting:
            return
        runs = np.stack(self._waiting)
        self._waiting = []
        finite = np.isfinite(runs)
        self._count = self._count + finite.sum(axis=0)
        low, high = np.where(finite, runs, np.inf), np.where(finite, runs, -np.inf)
        low = low if self._low is None else np.concatenate([self._low, low])
        high = high if self._high is None else np.concatenate([self._high, high])
        self._low = np.sort(low, axis=0)[: self._kept]
        self._high = -np.sort(-high, axis=0)[: self._kept]


def _between(ordered: Array, place: Array) -> Array:
    """The value at a fractional place (n, D) of ordered values (k, n, D)."""
    below = np.floor(place).astype(np.intp)
    above = np.minimum(below + 1, len(ordered) - 1)
    low = np.take_along_axis(ordered, below[None], axis=0)[0]
    high = np.take_along_axis(ordered, above[None], axis=0)[0]
    part = place - below
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(part > 0, low + part * (high - low), low))
