"""Which solver is better, and whether the data show it: scores, ranks and tests.

Solvers are compared on the same realisations (blocks). A condition is a problem with its cost, noise and level. Where
there are enough conditions for the tests to find anything, a block is a condition with the median over its seeds,
because the runs of one condition say little about others. Otherwise a block is a realisation, and the result holds for
these conditions only (Demsar 2006). Pairs are tested by Wilcoxon's signed ranks on the ratios of scores, with Holm's
correction; the critical-difference diagram joins solvers that no test distinguishes (Benavoli and others 2016). The
Bayesian signed-rank test stands beside it: it can also say that two solvers are alike in practice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.comparison.optimisation import CONDITION, NEGLIGIBLE_EXCESS, evaluations_to, records
from seatruth.statistics.bayesian import signed_rank_posterior
from seatruth.statistics.ranks import (
    friedman_p,
    holm_adjusted,
    indistinguishable_groups,
    mean_ranks,
    rank_biserial,
    signed_rank_p,
)

Score = Literal["fit", "effort", "accuracy"]
SCORES: dict[str, str] = {
    "fit": "excess of the cost over the best known fit",
    "effort": "evaluations until the excess is below the headline target",
    "accuracy": "error of the parameters (of the prediction of trials held out, where the truth is not known)",
}
ALPHA = 0.05
"""Significance level of all tests: the usual 5 %."""
ROPE = 1.1
"""Scores within this factor of each other are alike in practice. Chosen here [S]: nobody changes a solver for 10 %."""
_DIGITS = 2
"""Decimals of log10 of a score: scores that differ by about 1 % are a tie. Chosen here [S]."""
_NEVER = 99.0
"""log10 of the score of a run that failed or did not reach the target: larger than any score."""
_SMALLEST_SCORE = 1e-12
"""Scores below it are taken as this, so that a perfect one has a logarithm."""


@dataclass(frozen=True)
class Ranking:
    """Solvers in the order of their mean ranks (1 is best), and which differences are significant.

    Attributes:
        by: The score: "fit", "effort" or "accuracy".
        blocks: How many blocks there are.
        block_kind: What a block is: "realisation" or "condition".
        p_friedman: p-value of Friedman's test that all are alike (Wilcoxon's for two solvers).
        table: By solver its mean rank (mean_rank), the blocks in which it is best or shares that (best_in), and those
            in which it failed or did not reach the target (never).
        pairs: For each two solvers wins, losses, ties, ratio (median of first over second), p (Wilcoxon), p_holm (with
            Holm's correction) and effect (matched rank-biserial correlation; below 0 the first is better); p_better,
            p_alike, p_worse: probabilities that the first is better in practice, alike, or worse (Bayesian).
        groups: Sets of neighbours in rank that no test distinguishes.
        incomplete: Solvers left out because they ran on some of the problems only.
    """

    by: str
    blocks: int
    block_kind: str
    p_friedman: float
    table: pd.DataFrame
    pairs: pd.DataFrame
    groups: tuple[tuple[str, ...], ...]
    incomplete: tuple[str, ...] = ()

    @property
    def order(self) -> list[str]:
        """Solvers, the best mean rank first."""
        return list(self.table["solver"])

    def pair(self, first: str, second: str) -> Mapping[str, Any]:
        """The row of two solvers, seen from the first."""
        for row in self.pairs.to_dict("records"):
            if (row["first"], row["second"]) == (first, second):
                return {str(k): v for k, v in row.items()}
            if (row["first"], row["second"]) == (second, first):
                turned = {"first": first, "second": second, "wins": row["losses"], "losses": row["wins"]}
                turned |= {"p_better": row["p_worse"], "p_worse": row["p_better"]}
                turned |= {"ratio": 1.0 / row["ratio"] if row["ratio"] else math.inf, "effect": -row["effect"]}
                return {str(k): v for k, v in row.items()} | turned
        raise KeyError((first, second))

    def differ(self, first: str, second: str) -> bool:
        """Whether the difference of two solvers is significant."""
        return bool(self.pair(first, second)["p_holm"] < ALPHA)


def scores(runs: pd.DataFrame, estimates: pd.DataFrame, histories: Any, target: float) -> pd.DataFrame:
    """What solvers are ranked by: one row a run with log10 of its three scores, small is good.

    Scores are rounded, so that negligible differences are ties. NaN where there is nothing to judge by.
    """
    errors = _errors(estimates)
    rows = []
    for run in records(runs):
        row = {name: getattr(run, name) for name in (*CONDITION, "seed", "solver")}
        row["fit"] = _log(max(float(run.excess), NEGLIGIBLE_EXCESS))
        row["effort"] = _log(evaluations_to(run, histories, target))
        row["accuracy"] = _accuracy(run, errors)
        rows.append(row)
    table = pd.DataFrame(rows, columns=[*CONDITION, "seed", "solver", "fit", "effort", "accuracy"])
    # A run without an answer is worse than all others, where those on the same realisation have one.
    judged = table.groupby([*CONDITION, "seed"])["accuracy"].transform("count") > 0
    table.loc[judged & table["accuracy"].isna(), "accuracy"] = _NEVER
    return table


def across_costs(frame: pd.DataFrame) -> pd.DataFrame:
    """The scores with each solver on each cost as a solver of its own: "least_squares on regression"."""
    return frame.assign(solver=frame["solver"] + " on " + frame["cost"], cost="any")


def rank_solvers(
    frame: pd.DataFrame, by: str, where: Mapping[str, Any], solvers: Sequence[str], rope: float = ROPE
) -> Ranking | None:
    """Ranks solvers on the runs that `where` selects.

    Args:
        frame: The scores (`scores`).
        by: "fit", "effort" or "accuracy".
        where: Column values that a run must have.
        solvers: Labels in the comparison's order.
        rope: Scores whose ratio is within this factor are alike in practice.

    Returns:
        None where fewer than two solvers ran on the same realisations.
    """
    for name, value in where.items():
        frame = frame[frame[name] == value]
    frame = frame.dropna(subset=[by])
    if not len(frame):
        return None
    table = frame.pivot_table(index=[*CONDITION, "seed"], columns="solver", values=by, aggfunc="first")
    present = [label for label in solvers if label in table]
    # With a solver that fits only some problems, the others would count for nobody.
    problems = table.notna().groupby(level=["problem", "cost"]).any()
    complete = [label for label in present if bool(problems[label].all())]
    incomplete = tuple(label for label in present if label not in complete) if len(complete) > 1 else ()
    chosen = complete if len(complete) > 1 else present
    table = table[chosen].dropna()
    if len(chosen) < 2 or not len(table):
        return None
    conditions = table.groupby(level=CONDITION, sort=False)
    block_kind = "realisation"
    # With n blocks the smallest possible p-value is 2^(1-n); it must pass Holm's correction for all pairs.
    if conditions.ngroups > 1 and 2.0 ** (1 - conditions.ngroups) * math.comb(len(chosen), 2) < ALPHA / 2.0:
        table, block_kind = conditions.median(), "condition"
    return _rank(table.to_numpy(dtype=float), chosen, by, block_kind, incomplete, rope)


def _rank(
    values: Array, solvers: Sequence[str], by: str, block_kind: str, incomplete: tuple[str, ...], rope: float
) -> Ranking:
    """The ranking of scores (blocks, solvers)."""
    best = values == values.min(axis=1, keepdims=True)
    table = pd.DataFrame(
        {
            "solver": list(solvers),
            "mean_rank": mean_ranks(values),
            "best_in": best.sum(axis=0),
            "never": (values >= _NEVER).sum(axis=0),
        }
    ).sort_values("mean_rank", ignore_index=True, kind="stable")
    rows = []
    order = [solvers.index(name) for name in table["solver"]]
    for a, b in combinations(order, 2):
        rows.append({"first": solvers[a], "second": solvers[b], **_pair(values[:, a], values[:, b], rope)})
    pairs = pd.DataFrame(rows)
    pairs["p_holm"] = holm_adjusted(pairs["p"].to_numpy(dtype=float))
    p = float(pairs["p"].iloc[0]) if len(solvers) == 2 else friedman_p(values)
    different = {frozenset((row["first"], row["second"])) for row in pairs.to_dict("records") if row["p_holm"] < ALPHA}
    groups = indistinguishable_groups(list(table["solver"]), lambda one, two: frozenset((one, two)) in different)
    return Ranking(by, len(values), block_kind, p, table, pairs, groups, incomplete)


def _pair(first: Array, second: Array, rope: float) -> dict[str, Any]:
    """Comparison of the log10 scores (blocks,) of two solvers."""
    difference = first - second
    nonzero = difference[difference != 0]
    row: dict[str, Any] = {"wins": int((difference < 0).sum()), "losses": int((difference > 0).sum())}
    row |= {"ties": int((difference == 0).sum()), "ratio": 10.0 ** float(np.clip(np.median(difference), -99, 99))}
    posterior = signed_rank_posterior(difference, math.log10(rope))
    row |= {"p_better": posterior.lower, "p_alike": posterior.alike, "p_worse": posterior.higher}
    if not nonzero.size:
        return row | {"p": 1.0, "effect": 0.0}
    row["effect"] = rank_biserial(nonzero)
    row["p"] = signed_rank_p(nonzero)
    return row


def _errors(estimates: pd.DataFrame) -> dict[str, float]:
    """By run the root mean square of its parameters' errors over their Cramer-Rao bounds (without noise: over their
    size)."""
    if not len(estimates):
        return {}
    scale = estimates["crlb"].where(estimates["crlb"] > 0, estimates["truth"].abs().where(estimates["truth"] != 0, 1.0))
    square = ((estimates["value"] - estimates["truth"]) / scale) ** 2
    means = square.groupby(estimates["key"]).agg(lambda part: math.nan if part.isna().any() else float(part.mean()))
    return {str(key): math.sqrt(value) for key, value in means.items()}


def _accuracy(run: Any, errors: Mapping[str, float]) -> float:
    """log10 of a run's error, or of its prediction error where the truth is not known; NaN without either."""
    error = errors.get(run.key, math.nan)
    if math.isfinite(error):
        return _log(error)
    held = run.held_out
    if held is not None and not math.isnan(held):
        return _log(float(held))
    return math.nan


def _log(value: float) -> float:
    if not math.isfinite(value):
        return _NEVER
    return round(math.log10(max(value, _SMALLEST_SCORE)), _DIGITS)
