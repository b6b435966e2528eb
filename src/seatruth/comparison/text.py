"""The conclusions of a comparison in sentences: which solver wins, by how much, where that ends, what is undecided."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import pandas as pd

from seatruth.comparison.optimisation import CONDITION
from seatruth.comparison.ranks import ALPHA, Ranking
from seatruth.text import listed

if TYPE_CHECKING:
    from seatruth.comparison.results import Results

MIN_SEEDS = 15
"""Realisations from which solvers can be compared. Chosen here [S]: Wilcoxon's test with Holm's correction for ten
solvers then finds a difference that is the same in nearly all of them."""
_MAX_LISTED = 4
"""Conditions that a sentence names."""
_MEASURES = {"fit": "excess cost", "effort": "evaluations", "accuracy": "error"}
_FAILED_RATIO = 1e30
"""A larger ratio of scores means that one of the two solvers failed or never reached the target."""
_EQUAL_WITHIN = 0.01
"""Relative difference of two medians below which they are called the same; scores are rounded to as much."""
_SAME_RANK = 1e-9
"""Difference of two mean ranks that rounding alone may make."""
_COVERAGE_ERRORS = 3.0
"""Standard errors by which a coverage must fall short of 95 % to be marked. Chosen here [S]: one false alarm in 700."""


@dataclass(frozen=True)
class Conclusion:
    """One sentence or more about a comparison.

    Attributes:
        about: "optimisation", "estimation", or "caution" for a limit of the comparison itself.
        text: The sentences.
        grave: Whether it should be marked.
    """

    about: Literal["optimisation", "estimation", "caution"]
    text: str
    grave: bool = False

    def __str__(self) -> str:
        return self.text


def conclusions(results: Results) -> list[Conclusion]:
    """All conclusions, the most important first."""
    if not len(results.runs):
        return [Conclusion("caution", "No run is done yet.", True)]
    made = []
    for cost in dict.fromkeys(results.runs["cost"]):
        for by in ("effort", "fit"):
            ranking = results.ranking(by, cost=cost)
            made += [Conclusion("optimisation", text) for text in _ranking_sentences(results, ranking, cost)]
    for cost in dict.fromkeys(results.runs["cost"]):
        ranking = results.ranking("accuracy", cost=cost)
        made += [Conclusion("estimation", text) for text in _ranking_sentences(results, ranking, cost)]
    made += [Conclusion("estimation", text) for text in _cost_sentences(results)]
    made += [Conclusion("estimation", text, grave) for text, grave in _coverage_sentences(results)]
    if results.left:
        made.append(Conclusion("caution", f"{results.left} runs are not done yet: all this is preliminary.", True))
    return made + [Conclusion("caution", text, True) for text in _cautions(results)]


def condition_label(noise: str, level: float) -> str:
    """A noise with its level: "1 % white", "no noise"."""
    return "no noise" if level == 0 and noise == "white" else f"{100 * level:g} % {noise}"


def _headline(results: Results, by: str) -> str:
    """What a ranking is by."""
    if by == "effort":
        return f"By evaluations to within {results.comparison.success:g} chi-square of the best known fit"
    if by == "fit":
        return "By the fit that is reached with the whole budget"
    unknown = " (of predictions, where the truth is not known)" if _without_truth(results) else ""
    return f"By the error of the parameters{unknown}"


def _ranking_sentences(results: Results, ranking: Ranking | None, cost: str) -> Iterator[str]:
    """Which solver wins, by how much, from which it is not distinguished, and where another wins."""
    if ranking is None:
        return
    order = ranking.order
    head = f"{_headline(results, ranking.by)} ({cost} cost, {ranking.blocks} {ranking.block_kind}s)"
    if ranking.p_friedman >= ALPHA:
        test = "Wilcoxon" if len(order) == 2 else "Friedman"
        yield f"{head}, the data do not distinguish the solvers ({test}: p {_p(ranking.p_friedman)})."
        return
    best = order[0]
    equal = [name for name in order[1:] if not ranking.differ(best, name)]
    beaten = [name for name in order[1:] if name not in equal]
    rank = float(ranking.table["mean_rank"].iloc[0])
    if not beaten:
        means = ranking.table["mean_rank"].to_numpy(dtype=float)
        first = [name for name, mean in zip(order, means) if mean - rank < _SAME_RANK]
        lead, them = (f"{best} has", "it") if len(first) == 1 else (f"{listed(first)} share", "them")
        yield (
            f"{head}, {lead} the best mean rank ({rank:.2g} of {len(order)}), but the data distinguish {them} from no "
            "single solver: they show only that the solvers are not all alike."
        )
        return
    parts = [f"{name} ({_margin(ranking, best, name)})" for name in beaten]
    lead = f"{best} is best" if not equal else f"{best} ranks first"
    text = f"{head}, {lead} (mean rank {rank:.2g} of {len(order)}); it beats {listed(parts)}"
    if equal:
        text += f"; the data do not distinguish it from {listed(equal)}"
    yield " ".join([text + ".", *_exceptions(results, ranking, best, cost), *_incomplete(ranking)])


def _incomplete(ranking: Ranking) -> Iterator[str]:
    if ranking.incomplete:
        yield f"{listed(list(ranking.incomplete))} fits only some of the problems and is not in this ranking."


def _exceptions(results: Results, ranking: Ranking, best: str, cost: str) -> Iterator[str]:
    """Conditions in which the winner loses, and those in which it is not distinguished from the next solver."""
    scores = results.scores[results.scores["cost"] == cost]
    lost, even, won = [], [], 0
    for condition in scores[CONDITION].drop_duplicates().itertuples(index=False):
        here = results.ranking(ranking.by, **dict(zip(CONDITION, condition)))
        if here is None or best not in here.order:
            continue
        better = [name for name in here.order if name != best and here.differ(best, name) and _ahead(here, name, best)]
        if better:
            margin = _margin(here, better[0], best)
            lost.append(f"{_condition(condition)}, where {better[0]} is ahead ({margin})")
        elif here.order[0] != best or not here.differ(best, here.order[1]):
            even.append(_condition(condition))
        else:
            won += 1
    if lost:
        yield f"This is not so on {listed(lost, _MAX_LISTED)}."
    if even and not won:
        where = "On the other conditions" if lost else "On any single condition"
        yield f"{where} the data do not distinguish it from the next."
    elif even:
        where = listed(even, _MAX_LISTED)
        yield f"It beats all others on {won} conditions. On {where} the data do not distinguish it from the next."
    elif won:
        yield f"It is ahead of each other solver on {f'{won}' if lost else 'each'} of the conditions."


def _ahead(ranking: Ranking, first: str, second: str) -> bool:
    return bool(ranking.pair(first, second)["effect"] < 0)


def _margin(ranking: Ranking, better: str, worse: str) -> str:
    """ "3.1 times fewer evaluations, p = 0.002"."""
    pair = ranking.pair(better, worse)
    ratio = float(pair["ratio"])
    factor = 1.0 / ratio if ratio > 0 else math.inf
    same = 1.0 - _EQUAL_WITHIN < factor < 1.0 + _EQUAL_WITHIN
    if same and ranking.by == "fit":
        text = f"better in {pair['wins']} of {ranking.blocks}"
    elif same:
        text = f"better in {pair['wins']} of {ranking.blocks}, the same in the median"
    elif factor > _FAILED_RATIO or not math.isfinite(factor):
        text = "which in the median does not get there" if ranking.by == "effort" else "which in the median fails"
    elif ranking.by == "effort":
        text = f"{_times(factor)} fewer evaluations in the median"
    else:
        text = f"{_times(factor)} less {_MEASURES[ranking.by]} in the median"
    return f"{text}, p {_p(float(pair['p_holm']))}"


def _cost_sentences(results: Results) -> Iterator[str]:
    """How the kinds of cost compare where one problem was fitted by several."""
    table = results.overall.dropna(subset=["error_percent"])
    for problem, group in table.groupby("problem", sort=False):
        best = group.groupby(["noise", "level", "cost"], sort=False)["error_percent"].min().unstack("cost")
        if not {"trajectory", "regression"} <= set(best.columns):
            continue
        parts = [
            f"{condition_label(str(noise), float(level))} {row['regression']:.2g} % against {row['trajectory']:.2g} %"
            for (noise, level), row in _rows(best.dropna())
        ]
        if parts:
            yield (
                f"{problem}: median error of the parameters by regression against trajectory, each by its best solver: "
                f"{'; '.join(parts)}."
            )


def _rows(frame: pd.DataFrame) -> Any:
    return frame.iterrows()


def _coverage_sentences(results: Results) -> Iterator[tuple[str, bool]]:
    """How often intervals contain the truth, where the search came near the best fit; whether that is too rarely."""
    table = results.overall.dropna(subset=["coverage"])
    table = table[table["excess"] <= results.comparison.success]
    for cost, near in table.groupby("cost", sort=False):
        parts, low = [], False
        for noise, group in near.groupby("noise", sort=False):
            total = int(group["intervals"].sum())
            share = float((group["coverage"] * group["intervals"]).sum() / total)
            # The intervals of one run are correlated, so runs are counted and not intervals.
            error = math.sqrt(0.95 * 0.05 / max(1, int(group["runs"].sum())))
            low |= share < 0.95 - _COVERAGE_ERRORS * error
            parts.append(f"{100 * share:.3g} % under {noise} noise")
        text = (
            f"Where the search by {cost} cost came near the best fit, the 95 % intervals contain the truth in "
            f"{'; '.join(parts)}."
        )
        yield text, low


def _cautions(results: Results) -> Iterator[str]:
    """What limits the conclusions."""
    failed = results.failures
    if len(failed):
        first = str(failed["error"].iloc[0])
        yield f"{len(failed)} of {len(results.runs)} runs failed; they count as the worst. The first: {first[:200]}"
    if results.comparison.seeds < MIN_SEEDS:
        yield (
            f"Each noise has {results.comparison.seeds} realisations; at least {MIN_SEEDS} are needed to compare "
            "solvers with some confidence."
        )
    if len(results.sources) > 1:
        yield "The runs were made by more than one version of the program or on more than one machine (see Provenance)."
    unknown = _without_truth(results)
    if unknown:
        yield (
            f"The true parameters of {listed(unknown)} are not known: bias, errors, bounds and coverage are left "
            "empty there, and accuracy is the prediction of trials held out."
        )


def _without_truth(results: Results) -> list[str]:
    return [problem.name for problem in results.comparison.problems if problem.truth is None]


def _condition(condition: Any) -> str:
    problem, _, noise, level = condition
    return f"{problem} ({condition_label(str(noise), float(level))})"


def _times(factor: float) -> str:
    if factor > 1e6:
        return "over a million times"
    return f"{factor:.2g} times" if factor < 100 else f"{float(f'{factor:.2g}'):.0f} times"


def _p(value: float) -> str:
    return "< 0.0001" if value < 1e-4 else f"= {value:.2g}"
