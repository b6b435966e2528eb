"""What a comparison says, in plain sentences: who wins, by how much, where that stops, where the data cannot tell."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import pandas as pd

from seatruth.comparison.optimisation import PLACE
from seatruth.comparison.ranks import ALPHA, Ranking

if TYPE_CHECKING:
    from seatruth.comparison.results import Results

_FEW_SEEDS = 15
_MOST_PLACES = 4
_THING = {"fit": "excess cost", "effort": "evaluations", "accuracy": "error"}
_FAILED = 1e30
"""Ratios of scores beyond it mean that one of the two never got there."""
_MISCOVERED = 3.0
"""Standard errors by which a coverage must miss 95 % to be worth a word."""


@dataclass(frozen=True)
class Verdict:
    """One thing that a comparison says, about "optimisation", "estimation" or its own limits ("caution")."""

    about: Literal["optimisation", "estimation", "caution"]
    text: str
    grave: bool = False

    def __str__(self) -> str:
        return self.text


def verdicts(results: Results) -> list[Verdict]:
    """What came out, the most important first."""
    if not len(results.runs):
        return [Verdict("caution", "No run is done yet.", True)]
    found = []
    for cost in dict.fromkeys(results.runs["cost"]):
        for by in ("effort", "fit"):
            made = results.ranking(by, cost=cost)
            found += [Verdict("optimisation", text) for text in _of_ranking(results, made, cost)]
    for cost in dict.fromkeys(results.runs["cost"]):
        made = results.ranking("accuracy", cost=cost)
        found += [Verdict("estimation", text) for text in _of_ranking(results, made, cost)]
    found += [Verdict("estimation", text) for text in _of_costs(results)]
    found += [Verdict("estimation", text, grave) for text, grave in _of_coverage(results)]
    if results.left:
        found.append(Verdict("caution", f"{results.left} runs are not done yet: all this is preliminary.", True))
    return found + [Verdict("caution", text, True) for text in _worries(results)]


def headline(results: Results, by: str) -> str:
    return {
        "effort": f"By evaluations to within {results.comparison.success:g} chi-square of the best known fit",
        "fit": "By the fit that is reached with the whole budget",
        "accuracy": "By the error of the parameters"
        + (" (of predictions, where the truth is not known)" if _unknown(results) else ""),
    }[by]


def _of_ranking(results: Results, made: Ranking | None, cost: str) -> Iterator[str]:
    """Who wins, by how much, whom it cannot be told from, and where somebody else does."""
    if made is None:
        return
    order = made.order
    head = f"{headline(results, made.by)} ({cost} cost, {made.blocks} {made.block_is}s)"
    if made.p_friedman >= ALPHA:
        what = "Wilcoxon" if len(order) == 2 else "Friedman"
        yield f"{head}, the data cannot tell the solvers apart ({what}: p {_p(made.p_friedman)})."
        return
    best = order[0]
    level = [name for name in order[1:] if not made.told(best, name)]
    beaten = [name for name in order[1:] if name not in level]
    rank = float(made.table["mean_rank"].iloc[0])
    if not beaten:
        yield (
            f"{head}, {best} has the best mean rank ({rank:.2g} of {len(order)}), but no single solver is told from "
            "it: only that they are not all alike."
        )
        return
    parts = [f"{name} ({_margin(made, best, name)})" for name in beaten]
    lead = f"{best} is best" if not level else f"{best} ranks first"
    text = f"{head}, {lead} (mean rank {rank:.2g} of {len(order)}); it beats {_listed(parts)}"
    if level:
        text += f"; the data cannot tell it from {_listed(level)}"
    yield " ".join([text + ".", *_elsewhere(results, made, best, cost), *_partly(made)])


def _partly(made: Ranking) -> Iterator[str]:
    if made.partly:
        yield f"{_listed(list(made.partly))} fits only some of the problems and is not in this ranking."


def _elsewhere(results: Results, made: Ranking, best: str, cost: str) -> Iterator[str]:
    """Places where the winner loses, and where it cannot be told from the next."""
    scores = results.scores[results.scores["cost"] == cost]
    lost, even, told = [], [], 0
    for place in scores[PLACE].drop_duplicates().itertuples(index=False):
        here = results.ranking(made.by, **dict(zip(PLACE, place)))
        if here is None or best not in here.order:
            continue
        better = [name for name in here.order if name != best and here.told(best, name) and _ahead(here, name, best)]
        if better:
            lost.append(f"{_place(place)}, where {better[0]} is ahead ({_margin(here, better[0], best)})")
        elif here.order[0] != best or not here.told(best, here.order[1]):
            even.append(_place(place))
        else:
            told += 1
    if lost:
        yield f"That stops being true on {_listed(lost, _MOST_PLACES)}."
    if even and not told:
        yield (
            "On the others it is not told from the next."
            if lost
            else "On no single condition is it told from the next."
        )
    elif even:
        where = _listed(even, _MOST_PLACES)
        yield f"It is told from each other solver on {told} conditions, and not from the next on {where}."
    elif told:
        yield f"It is ahead of each other solver on {f'{told}' if lost else 'each'} of the conditions."


def _ahead(made: Ranking, first: str, second: str) -> bool:
    return bool(made.pair(first, second)["effect"] < 0)


def _margin(made: Ranking, better: str, worse: str) -> str:
    """ "3.1 times fewer evaluations, p = 0.002"."""
    pair = made.pair(better, worse)
    ratio, blocks = float(pair["ratio"]), int(made.blocks)
    size = 1.0 / ratio if ratio > 0 else math.inf
    if made.by == "fit" and 0.99 < size < 1.01:
        often = f"better in {pair['wins']} of {blocks}"
    elif size > _FAILED or not math.isfinite(size):
        often = "which in the median does not get there" if made.by == "effort" else "which in the median fails"
    elif 0.99 < size < 1.01:
        often = f"better in {pair['wins']} of {blocks}, the same in the median"
    else:
        often = f"{_times(size)} less {_THING[made.by]} in the median"
        if made.by == "effort":
            often = f"{_times(size)} fewer evaluations in the median"
    return f"{often}, p {_p(float(pair['p_holm']))}"


def _of_costs(results: Results) -> Iterator[str]:
    """How the kinds of cost compare where one problem was fitted by several."""
    table = results.overall.dropna(subset=["error_percent"])
    for problem, group in table.groupby("problem", sort=False):
        best = group.groupby(["noise", "level", "cost"], sort=False)["error_percent"].min().unstack("cost")
        if not {"trajectory", "regression"} <= set(best.columns):
            continue
        texts = [
            f"{_level(str(noise), float(level))} {row['regression']:.2g} % against {row['trajectory']:.2g} %"
            for (noise, level), row in _items(best.dropna())
        ]
        if texts:
            yield (
                f"{problem}: median error of the parameters by regression against trajectory, each by its best solver: "
                f"{'; '.join(texts)}."
            )


def _items(frame: pd.DataFrame) -> Any:
    return frame.iterrows()


def _of_coverage(results: Results) -> Iterator[tuple[str, bool]]:
    """Whether intervals hold the truth as often as they say, where the search came near the best fit."""
    table = results.overall.dropna(subset=["coverage"])
    table = table[table["excess"] <= results.comparison.success]
    for cost, near in table.groupby("cost", sort=False):
        parts, low = [], False
        for noise, group in near.groupby("noise", sort=False):
            total = int(group["intervals"].sum())
            share = float((group["coverage"] * group["intervals"]).sum() / total)
            # Intervals of one run hang together, so runs are counted, not intervals.
            error = math.sqrt(0.95 * 0.05 / max(1, int(group["runs"].sum())))
            low |= share < 0.95 - _MISCOVERED * error
            parts.append(f"{100 * share:.3g} % under {noise} noise")
        yield (
            f"Of the 95 % intervals by {cost}, where the search came near the best fit, hold the truth: "
            + (f"{'; '.join(parts)}."),
            low,
        )


def _worries(results: Results) -> Iterator[str]:
    """What limits the conclusions."""
    failed = results.failures
    if len(failed):
        first = str(failed["error"].iloc[0])
        yield f"{len(failed)} of {len(results.runs)} runs failed; they count as the worst. The first: {first[:200]}"
    if results.comparison.seeds < _FEW_SEEDS:
        yield (
            f"Each noise has {results.comparison.seeds} realisations; at least {_FEW_SEEDS} are needed to tell solvers "
            "apart with some confidence."
        )
    if len(results.sources) > 1:
        yield "The runs were made by more than one version of the program or on more than one machine (see Provenance)."
    unknown = _unknown(results)
    if unknown:
        yield (
            f"The true parameters of {_listed(unknown)} are not known: bias, errors, bounds and coverage are left "
            "empty there, and accuracy is the prediction of trials held out."
        )


def _unknown(results: Results) -> list[str]:
    return [problem.name for problem in results.comparison.problems if problem.truth is None]


def _place(place: Any) -> str:
    problem, _, noise, level = place
    return f"{problem} ({_level(str(noise), float(level))})"


def _level(noise: str, level: float) -> str:
    return "no noise" if level == 0 and noise == "white" else f"{100 * level:g} % {noise}"


def _times(size: float) -> str:
    if size > 1e6:
        return "over a million times"
    return f"{size:.2g} times" if size < 100 else f"{float(f'{size:.2g}'):.0f} times"


def _p(value: float) -> str:
    return "< 0.0001" if value < 1e-4 else f"= {value:.2g}"


def _listed(names: list[str], most: int = 6) -> str:
    if len(names) > most:
        return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else ""


def level_label(noise: str, level: float) -> str:
    """A noise and its level as a reader says it."""
    return _level(noise, level)
