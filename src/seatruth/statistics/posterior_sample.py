"""What a sample of a posterior says: its draws, the intervals they give, and how far the chain can be relied on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from seatruth.arrays import Array

ENOUGH_TIMES = 50.0
"""Autocorrelation times that a chain needs before its own estimate of that time can be believed: emcee's own limit
(Foreman-Mackey and others 2013, and the manual's page on autocorrelation)."""
STEPS = 10_000
"""Steps after which a chain ends at the latest, unless told otherwise. Chosen here [S]: a hundred autocorrelation times
of a normal distribution of some 20 dimensions."""
MOST_STEPS = 1_000_000
"""Steps that can be asked for: with more, the chain of a few parameters does not fit into memory. Chosen here [S]."""
LEVEL = 0.95
"""Of every interval and band: from the 2.5 to the 97.5 % quantile, as the linear intervals are."""
SUMMARY_COLUMNS = ("mean", "sd", "lower", "median", "upper", "autocorrelation_time", "effective_samples")
CHAIN_COLUMNS = ("walker", "step", "log_probability")
VALUE = "value "
"""What stands before the name of a parameter in a column of the chain: one may be called "step"."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """A sample of the posterior of the free parameters and nuisances.

    Attributes:
        chain: one row a walker and kept step: walker, step, log_probability (up to a constant), and "value NAME" of
            each parameter and nuisance. It is thinned, and holds the steps before `burn_in` as well.
        summary: table with index name: mean, sd, lower, median and upper (95 %, equal tails), autocorrelation_time
            (steps) and effective_samples. It is made of all steps from `burn_in` on, not of the thinned ones.
        walkers, steps: how many there were.
        burn_in: steps that are left out at the beginning.
        acceptance: part of the proposals that were accepted.
    """

    chain: pd.DataFrame
    summary: pd.DataFrame
    walkers: int
    steps: int
    burn_in: int
    acceptance: float

    @property
    def draws(self) -> pd.DataFrame:
        """The kept draws from `burn_in` on: a column for each parameter and nuisance, a row a draw."""
        kept = self.chain[self.chain["step"] > self.burn_in].drop(columns=list(CHAIN_COLUMNS))
        return kept.rename(columns=lambda name: str(name).removeprefix(VALUE)).reset_index(drop=True)

    @property
    def times(self) -> float:
        """Length of the chain after `burn_in`, in the longest of its autocorrelation times; 0 where that is unknown."""
        longest = float(self.summary["autocorrelation_time"].max(skipna=False))
        return (self.steps - self.burn_in) / longest if math.isfinite(longest) and longest > 0 else 0.0

    @property
    def long_enough(self) -> bool:
        """Whether the chain has at least `ENOUGH_TIMES` autocorrelation times."""
        return self.times >= ENOUGH_TIMES


@dataclass(frozen=True)
class Ensemble:
    """The simulated sets of parameters whose spread the bands of an estimate's time histories show.

    Attributes:
        source: "posterior" (draws of it) or "starts" (ends of a multi-start that cannot be told from the best).
        members: how many were simulated.
        diverged: how many of them left some trial without a prediction; they count in the others.
    """

    source: Literal["posterior", "starts"]
    members: int
    diverged: int


def summarised(names: Sequence[str], draws: Array, times: Array, every: int = 1) -> pd.DataFrame:
    """The summary of draws.

    Args:
        names: (K,) what was sampled.
        draws: (N, W, K), steps of the walkers.
        times: (K,), autocorrelation times in steps of the draws; NaN where unknown.
        every: steps of the chain from one draw of a walker to its next.

    Example:
        >>> import numpy as np
        >>> draws = np.random.default_rng(1).normal(size=(500, 20, 1))
        >>> found = summarised(["a"], draws, np.array([1.0]))
        >>> [round(float(value)) for value in found.loc["a", ["lower", "median", "upper"]]]
        [-2, 0, 2]
    """
    flat = draws.reshape(-1, draws.shape[2])
    tail = (1.0 - LEVEL) / 2.0
    lower, median, upper = np.quantile(flat, [tail, 0.5, 1.0 - tail], axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        effective = len(flat) / np.maximum(times, 1.0)
    columns = (flat.mean(axis=0), flat.std(axis=0, ddof=1), lower, median, upper, every * times, effective)
    return pd.DataFrame(dict(zip(SUMMARY_COLUMNS, columns)), index=pd.Index(list(names), name="name"))
