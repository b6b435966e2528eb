"""Who is better, and whether the data can tell: ranks, Friedman's and Wilcoxon's tests, effect sizes.

Solvers are compared on the same realisations (blocks). Where there are places (problem, cost, noise, level) enough for
the tests to tell anything, a block is a place with the median over its seeds, since runs of one place say little about
others; otherwise a block is a realisation, and what is found holds for these places only (Demsar 2006). Pairs are
tested by Wilcoxon's signed ranks on the ratios of scores, with Holm's correction; solvers that no test tells apart are
joined in the critical-difference diagram (Benavoli and others 2016).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.stats import friedmanchisquare, rankdata, wilcoxon

from seatruth.arrays import Array
from seatruth.comparison.optimisation import PLACE, evaluations_to, records

Score = Literal["fit", "effort", "accuracy"]
SCORES: dict[str, str] = {
    "fit": "excess of the cost over the best known fit",
    "effort": "evaluations until the excess is below the headline target",
    "accuracy": "error of the parameters (of the prediction of trials held out, where the truth is not known)",
}
ALPHA = 0.05
_FLOOR = 0.01
"""Excesses below it are a tie: nobody can tell them apart."""
_DIGITS = 2
"""Decimals of log10 of a score: scores that differ by about 1 % are a tie."""
_NEVER = 99.0
"""log10 of the score of a run that failed or never got there."""
_EXACT = 50


@dataclass(frozen=True)
class Ranking:
    """Solvers in the order of their mean ranks (1 is best), and which differences are told from chance.

    `table`: by solver its mean rank, wins (blocks in which it is best or shares that) and failures to get there.
    `pairs`: for each two solvers wins, losses, ties, median ratio of scores (first over second), Wilcoxon's p as it is
    and with Holm's correction, and the effect size (matched rank-biserial correlation, from -1 to 1, below 0 where the
    first is better). `groups` are sets of solvers that no test tells apart.
    """

    by: str
    blocks: int
    block_is: str
    p_friedman: float
    table: pd.DataFrame
    pairs: pd.DataFrame
    groups: tuple[tuple[str, ...], ...]
    partly: tuple[str, ...] = ()
    """Solvers left out because they ran on some of the problems only."""

    @property
    def order(self) -> list[str]:
        return list(self.table["solver"])

    def pair(self, first: str, second: str) -> Mapping[str, Any]:
        """The row of two solvers, seen from the first."""
        for row in self.pairs.to_dict("records"):
            if (row["first"], row["second"]) == (first, second):
                return {str(k): v for k, v in row.items()}
            if (row["first"], row["second"]) == (second, first):
                turned = {"first": first, "second": second, "wins": row["losses"], "losses": row["wins"]}
                turned |= {"ratio": 1.0 / row["ratio"] if row["ratio"] else math.inf, "effect": -row["effect"]}
                return {str(k): v for k, v in row.items()} | turned
        raise KeyError((first, second))

    def told(self, first: str, second: str) -> bool:
        """Whether the difference of two solvers is told from chance."""
        return bool(self.pair(first, second)["p_holm"] < ALPHA)


def scores(runs: pd.DataFrame, estimates: pd.DataFrame, histories: Any, target: float) -> pd.DataFrame:
    """One row a run with log10 of its three scores, rounded so that what nobody can tell apart is a tie; NaN = none."""
    errors = _errors(estimates)
    rows = []
    for run in records(runs):
        row = {name: getattr(run, name) for name in (*PLACE, "seed", "solver")}
        row["fit"] = _log(max(float(run.excess), _FLOOR))
        row["effort"] = _log(evaluations_to(run, histories, target))
        row["accuracy"] = _accuracy(run, errors)
        rows.append(row)
    found = pd.DataFrame(rows, columns=[*PLACE, "seed", "solver", "fit", "effort", "accuracy"])
    # A run without an answer, where others on the same realisation could be judged, is worse than all of them.
    judged = found.groupby([*PLACE, "seed"])["accuracy"].transform("count") > 0
    found.loc[judged & found["accuracy"].isna(), "accuracy"] = _NEVER
    return found


def across_costs(frame: pd.DataFrame) -> pd.DataFrame:
    """The scores with each solver on each cost as a solver of its own: "least_squares on regression"."""
    return frame.assign(solver=frame["solver"] + " on " + frame["cost"], cost="any")


def ranking(frame: pd.DataFrame, by: str, where: Mapping[str, Any], solvers: Sequence[str]) -> Ranking | None:
    """The ranking of the runs that `where` picks; None without two solvers on the same realisations."""
    for name, value in where.items():
        frame = frame[frame[name] == value]
    frame = frame.dropna(subset=[by])
    if not len(frame):
        return None
    table = frame.pivot_table(index=[*PLACE, "seed"], columns="solver", values=by, aggfunc="first")
    present = [label for label in solvers if label in table]
    # A solver that fits only some problems would take the others away from all.
    problems = table.notna().groupby(level=["problem", "cost"]).any()
    full = [label for label in present if bool(problems[label].all())]
    partly = tuple(label for label in present if label not in full) if len(full) > 1 else ()
    chosen = full if len(full) > 1 else present
    table = table[chosen].dropna()
    if len(chosen) < 2 or not len(table):
        return None
    places = table.groupby(level=PLACE, sort=False)
    block_is = "realisation"
    # Conditions are the blocks where they are enough that the clearest of differences would pass Holm's correction.
    if places.ngroups > 1 and 2.0 ** (1 - places.ngroups) * math.comb(len(chosen), 2) < ALPHA / 2.0:
        table, block_is = places.median(), "condition"
    return _ranked(table.to_numpy(dtype=float), chosen, by, block_is, partly)


def _ranked(values: Array, solvers: Sequence[str], by: str, block_is: str, partly: tuple[str, ...]) -> Ranking:
    ranks = np.apply_along_axis(rankdata, 1, values)
    mean = ranks.mean(axis=0)
    best = values == values.min(axis=1, keepdims=True)
    table = pd.DataFrame(
        {
            "solver": list(solvers),
            "mean_rank": mean,
            "best_in": best.sum(axis=0),
            "never": (values >= _NEVER).sum(axis=0),
        }
    ).sort_values("mean_rank", ignore_index=True, kind="stable")
    rows = []
    order = [solvers.index(name) for name in table["solver"]]
    for a, b in combinations(order, 2):
        rows.append({"first": solvers[a], "second": solvers[b], **_pair(values[:, a], values[:, b])})
    pairs = pd.DataFrame(rows)
    pairs["p_holm"] = _holm(pairs["p"].to_numpy(dtype=float))
    p = float(pairs["p"].iloc[0]) if len(solvers) == 2 else _friedman(values)
    names = list(table["solver"])
    return Ranking(by, len(values), block_is, p, table, pairs, _groups(names, pairs), partly)


def _pair(a: Array, b: Array) -> dict[str, Any]:
    difference = a - b
    moved = difference[difference != 0]
    row: dict[str, Any] = {"wins": int((difference < 0).sum()), "losses": int((difference > 0).sum())}
    row |= {"ties": int((difference == 0).sum()), "ratio": 10.0 ** float(np.clip(np.median(difference), -99, 99))}
    if not moved.size:
        return row | {"p": 1.0, "effect": 0.0}
    signed = rankdata(np.abs(moved)) * np.sign(moved)
    row["effect"] = float(signed.sum() / np.abs(signed).sum())
    row["p"] = signed_ranks(moved)
    return row


def signed_ranks(differences: Array) -> float:
    """Two-sided p of Wilcoxon's signed-rank test of differences (n,) other than 0.

    Exact, ties among the sizes included, up to 50 of them (SciPy enumerates permutations for that, which takes half a
    second a test); normal approximation with SciPy's correction for ties beyond.
    """
    if differences.size > _EXACT:
        test: Any = wilcoxon
        return float(test(differences, method="asymptotic", correction=True).pvalue)
    # Twice the midranks are whole numbers, so that the distribution of their sum is counted term by term.
    doubled = np.rint(2 * rankdata(np.abs(differences))).astype(int)
    chance = np.zeros(int(doubled.sum()) + 1)
    chance[0] = 1.0
    for rank in doubled:
        shifted = np.zeros_like(chance)
        shifted[rank:] = chance[: chance.size - rank]
        chance = 0.5 * (chance + shifted)
    found = int(doubled[differences > 0].sum())
    return float(min(1.0, 2.0 * min(chance[: found + 1].sum(), chance[found:].sum())))


def _friedman(values: Array) -> float:
    """Friedman's p that all solvers are alike; 1 where they never differ or there is one block only."""
    if len(values) < 2 or np.ptp(values, axis=1).max() == 0:
        return 1.0
    return float(friedmanchisquare(*values.T).pvalue)


def _holm(p: Array) -> Array:
    """Holm's step-down correction."""
    order = np.argsort(p, kind="stable")
    found = np.empty(p.size)
    highest = 0.0
    for place, k in enumerate(order):
        highest = max(highest, min(1.0, (p.size - place) * p[k]))
        found[k] = highest
    return found


def _groups(names: Sequence[str], pairs: pd.DataFrame) -> tuple[tuple[str, ...], ...]:
    """Largest runs of neighbours in rank among which no pair is told apart; single solvers are left out."""
    told = {frozenset((row["first"], row["second"])) for row in pairs.to_dict("records") if row["p_holm"] < ALPHA}
    found: list[tuple[int, int]] = []
    for first in range(len(names)):
        last = first
        while last + 1 < len(names) and all(
            frozenset((names[k], names[last + 1])) not in told for k in range(first, last + 1)
        ):
            last += 1
        if last > first and not any(a <= first and last <= b for a, b in found):
            found.append((first, last))
    return tuple(tuple(names[a : b + 1]) for a, b in found)


def _errors(estimates: pd.DataFrame) -> dict[str, float]:
    """By run the root mean square of its parameters' errors over their bounds (over their size without noise)."""
    if not len(estimates):
        return {}
    scale = estimates["crlb"].where(estimates["crlb"] > 0, estimates["truth"].abs().where(estimates["truth"] != 0, 1.0))
    square = ((estimates["value"] - estimates["truth"]) / scale) ** 2
    means = square.groupby(estimates["key"]).agg(lambda part: math.nan if part.isna().any() else float(part.mean()))
    return {str(key): math.sqrt(value) for key, value in means.items()}


def _accuracy(run: Any, errors: Mapping[str, float]) -> float:
    """log10 of a run's error; NaN where nothing is known to measure it by."""
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
    return round(math.log10(max(value, 1e-12)), _DIGITS)
