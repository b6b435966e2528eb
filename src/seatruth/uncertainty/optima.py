"""The optima that the searches of a multi-start ended at: which ends are one, and which cannot be told apart.

Two ends are one optimum if no barrier stands between them: along a line from one to the other the cost nowhere rises
above the higher end by more than the data can tell. So an end that stopped short on the slope of an optimum belongs to
it, and so do the ends along a flat valley. Two lines are tried: one on which parameters change evenly, and one on which
they change by equal factors, as valleys run along which a product is the same.

Costs are told apart by the likelihood ratio: a rise of half the 95 % point of chi-square with one degree of freedom,
times the square by which standard errors exceed those of white noise of the stated size.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy

from seatruth.arrays import Array, Flags, Indices
from seatruth.costs.study_cost import StudyCost
from seatruth.optimizers import Outcome
from seatruth.text import listed
from seatruth.trials.finding import Finding

_BETWEEN = np.linspace(0.0, 1.0, 9)[1:-1]
"""Places between two ends at which the cost is looked at. Chosen here [S]: enough to see a barrier of a smooth cost."""
_SAME = 0.1
"""Standard errors within which two ends are the same answer, whatever their initial states. Chosen here [S]."""
_APART = float(scipy.special.ndtri(0.975))
"""Standard errors by which a parameter must differ between two optima to be in doubt: the two-sided 5 % point."""
_ENOUGH_STARTS = 3
"""Starts from which it says something that no other start found the best optimum. Chosen here [S]."""
_MOST_NAMED = 4
_UNSEEN = 0.2
"""Chance of a start ending at an optimum not seen yet above which a best optimum found once is doubted. Chosen here
[S]."""


def indistinguishable(inflation: float) -> float:
    """The difference of two costs up to which they cannot be told apart.

    Args:
        inflation: Standard errors over those that white noise of the stated size gives.
    """
    return 0.5 * float(scipy.special.chdtri(1, 0.05)) * max(inflation, 1.0) ** 2


@dataclass(frozen=True)
class Optima:
    """What the N searches of a multi-start found.

    `table` has one row a start: start (1 is the study's own), cost, optimum (1 is the best; 0 where the search found
    nothing), code, reason, evaluations, the values at the start as "start NAME" and at the end as "end NAME". `rivals`
    are the optima besides the best whose costs cannot be told from its; `differ` are the parameters (K,) that are not
    the same in them. `gain` is how much lower the best is than where the study's own start ended, 0 where that is the
    best. `once` says whether a single start found the best among several optima, and `unseen` estimates the chance that
    one more start ends at an optimum that none has found.
    """

    table: pd.DataFrame
    count: int
    rivals: tuple[int, ...]
    differ: Flags
    gain: float
    once: bool
    unseen: float

    @property
    def doubts_all(self) -> bool:
        """Whether the best optimum was found so rarely that a better one may well have been missed."""
        return self.once and self.unseen > _UNSEEN


def optima(cost: StudyCost, points: Array, outcomes: Sequence[Outcome], stderr: Array, inflation: float) -> Optima:
    """Groups the ends of a multi-start.

    Args:
        cost: The cost, with its noise at the best end.
        points: (N, K), the starts.
        outcomes: The N outcomes.
        stderr: (K,), standard errors at the best end; NaN or infinite where there is none.
        inflation: Standard errors over those that white noise of the stated size gives.

    The chance of an optimum not seen yet is the number of optima found once over the number of starts (Good 1953,
    Biometrika 40, 237-264).
    """
    ends = np.array([outcome.x for outcome in outcomes])
    values = np.array([outcome.value for outcome in outcomes])
    usable = np.isfinite(values)
    tell = indistinguishable(inflation)
    own = np.array([parameter.name not in cost.nuisances for parameter in cost.parameters])
    known = own & np.isfinite(stderr) & (stderr > 0)
    labels = np.zeros(len(outcomes), dtype=np.intp)
    heads: list[int] = []
    for k in (int(place) for place in np.argsort(values, kind="stable") if usable[place]):
        for number, head in enumerate(heads, 1):
            same = values[k] - values[head] <= tell and _same_answer(ends[k], ends[head], stderr, known)
            if same or not _barrier(cost, ends[head], ends[k], values[k], tell):
                labels[k] = number
                break
        else:
            heads.append(k)
            labels[k] = len(heads)
    differ = np.zeros(len(stderr), dtype=np.bool_)
    rivals = []
    for number, head in enumerate(heads[1:], 2):
        if values[head] - values[heads[0]] <= tell:
            apart = known & (np.abs(ends[head] - ends[heads[0]]) > _APART * np.where(known, stderr, 1.0))
            if apart.any():
                rivals.append(number)
                differ |= apart
    found = [int((labels == number).sum()) for number in range(1, len(heads) + 1)]
    gain = float(values[0] - values[heads[0]]) if heads and labels[0] != 1 else 0.0
    return Optima(
        table=_table(cost, points, outcomes, labels),
        count=len(heads),
        rivals=tuple(rivals),
        differ=differ,
        gain=gain,
        once=len(heads) > 1 and found[0] == 1 and len(outcomes) >= _ENOUGH_STARTS,
        unseen=found.count(1) / len(outcomes) if found else math.nan,
    )


def optima_findings(found: Optima, names: Sequence[str]) -> list[Finding]:
    """What a user should know of the optima; `names` (K,) are the parameters'."""
    table = found.table
    findings = []
    at = [int((table["optimum"] == number).sum()) for number in range(1, found.count + 1)]
    if found.rivals:
        shown = table.drop_duplicates("optimum").sort_values("cost")
        shown = shown[shown["optimum"].isin([1, *found.rivals])].iloc[:_MOST_NAMED]
        differing = [name for name, differs in zip(names, found.differ) if differs]
        values = [f"{name} = {listed([f'{v:.4g}' for v in shown[f'end {name}']])}" for name in differing[:_MOST_NAMED]]
        findings.append(
            Finding(
                "warning",
                "exclusive-optima",
                f"{len(found.rivals) + 1} optima explain the trials equally well, and at most one is right. They "
                f"differ in {listed(differing)} ({'; '.join(values)}).",
                "search",
                "Narrow the bounds to what is possible, give a prior, or add a trial that tells them apart.",
            )
        )
    if found.doubts_all:
        findings.append(
            Finding(
                "warning",
                "optimum-found-once",
                f"Only one of {len(table)} starts ended at the best of {found.count} optima. One more start would find "
                f"an optimum that none has found with a probability of about {100 * found.unseen:.0f} %, and it may be "
                "better.",
                "search",
                "Search from more starts, narrow the bounds, or let a global solver begin.",
            )
        )
    if found.gain > 0:
        findings.append(
            Finding(
                "note",
                "better-optimum",
                f"The search from the study's own start values ends at a worse optimum: the cost there is higher by "
                f"{found.gain:.3g}. {at[0]} of {len(table)} starts ended at the best optimum.",
                "search",
                "Take the values here as start values.",
            )
        )
    return findings


def _same_answer(a: Array, b: Array, stderr: Array, known: Flags) -> bool:
    return bool(known.any() and (np.abs(a - b)[known] <= _SAME * stderr[known]).all())


def _barrier(cost: StudyCost, a: Array, b: Array, higher: float, tell: float) -> bool:
    """Whether the cost rises between two ends by more than can be told above the higher one."""
    even = a + _BETWEEN[:, None] * (b - a)
    lines = [even]
    if (factors := a * b > 0).any():
        by_factors = a * np.where(factors, b / np.where(factors, a, 1.0), 1.0) ** _BETWEEN[:, None]
        lines.append(np.where(factors, by_factors, even))
    return all(bool(cost.values(line).max() > higher + tell) for line in lines)


def _table(cost: StudyCost, points: Array, outcomes: Sequence[Outcome], labels: Indices) -> pd.DataFrame:
    names = [str(name) for name in cost.names]
    rows = [
        (k, outcome.value, int(label), outcome.code, outcome.reason, outcome.evaluations)
        for k, (outcome, label) in enumerate(zip(outcomes, labels), 1)
    ]
    frame = pd.DataFrame(rows, columns=["start", "cost", "optimum", "code", "reason", "evaluations"])
    ends = pd.DataFrame([outcome.x for outcome in outcomes], columns=[f"end {name}" for name in names])
    starts = pd.DataFrame(points[: len(outcomes)], columns=[f"start {name}" for name in names])
    return pd.concat([frame, starts, ends], axis=1)
