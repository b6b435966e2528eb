"""The measures of the score: each a number with its interval, the cases it rests on, and the goal.

A pair is (truth, verdict), both in the words of `same.py`. Shares have Wilson intervals, the others bootstrap intervals
over cases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from withheld.intervals import bootstrap, by_chance, calibration_error, calibration_interval, wilson
from withheld.referee import TELLS_APART

Truth = Mapping[str, Any]
Verdict = Mapping[str, Any]
Pair = tuple[Truth, Verdict]
SURE = 0.9
CLOSES = 0.2
"""Least closure of the oracle for which a ratio to it means something,"""
GAP = 0.05
"""and the least gap, in multiples of the noise, that a refit leaves: of a smaller one closure is a ratio of noise."""
SURVIVORS = 4
"""Leading candidates between which the next trial is to tell."""
LEAST = 9.0
"""lambda below which a cause could not have shown: no case is asked for one that small."""


@dataclass(frozen=True)
class Measure:
    """One measure: value, 95 % interval, number of cases; `met` is None where there is nothing to judge.

    `clear`: the interval lies wholly on one side of the goal, so that more cases would hardly change the answer.
    """

    name: str
    value: float
    low: float
    high: float
    n: int
    goal: str
    met: bool | None
    clear: bool = False
    says: str = ""
    """In plain words."""


def strength(truth: Truth) -> float:
    """Smallest lambda of the causes; 0 where there is none."""
    return min((float(x) for x in truth["lambda"].values()), default=0.0)


def is_right(truth: Truth, effects: Sequence[str]) -> bool:
    """Whether a candidate's effects are exactly the sealed ones ([] is none, ["unknown"] outside the library)."""
    return sorted(effects) == sorted(truth["effects"])


def top(pair: Pair, many: int) -> bool:
    """Whether the truth is among the first so many candidates."""
    return any(is_right(pair[0], candidate["effects"]) for candidate in pair[1]["candidates"][:many])


def of_kind(pairs: Sequence[Pair], kind: str, low: float = 0.0, high: float = math.inf) -> list[Pair]:
    """Pairs of one kind whose smallest lambda lies in a range."""
    return [pair for pair in pairs if pair[0]["kind"] == kind and low <= strength(pair[0]) < high]


def place_right(pair: Pair) -> bool:
    """Whether the place ranked first is one in which the cause acts."""
    places = pair[1]["places"]
    return bool(places) and places[0] in pair[0]["places"]


def confident_and_wrong(pair: Pair) -> bool:
    """Whether a probability of 0.9 or more stands on what is not the truth."""
    best = pair[1]["candidates"][:1]
    return bool(best) and float(best[0]["probability"]) >= SURE and not is_right(pair[0], best[0]["effects"])


def reported_set(verdict: Verdict) -> set[str]:
    """What a verdict leaves open: its set, or what it declares."""
    return set(verdict["set"]) | set(verdict["effects"])


def like(truth: Truth, effects: Sequence[str]) -> bool:
    """Whether a candidate is the truth, or one effect that the referee says these trials do not tell from it."""
    if is_right(truth, effects):
        return True
    if len(effects) != 1 or len(truth["effects"]) != 1:
        return False
    return any(of.get(effects[0], math.inf) < TELLS_APART for of in truth["pairs"].values())


def brier(pair: Pair) -> float:
    """Multi-class Brier score over the candidates; the truth counts as stated with 0 where it is not among them."""
    stated = [(is_right(pair[0], c["effects"]), float(c["probability"])) for c in pair[1]["candidates"]]
    score = sum((p - right) ** 2 for right, p in stated)
    return score if any(right for right, _ in stated) else score + 1.0


def stated(pair: Pair) -> tuple[float, bool] | None:
    """Probability of the first candidate, and whether it is right."""
    best = pair[1]["candidates"][:1]
    return (float(best[0]["probability"]), is_right(pair[0], best[0]["effects"])) if best else None


def rivals_of(pair: Pair) -> list[str]:
    """From what the cause is to be told: the other effects among the first candidates and in the set; [] where the
    cause is not among those."""
    truth, verdict = pair
    if len(truth["effects"]) != 1 or not truth["pairs"]:
        return []
    cause, before = truth["effects"][0], next(iter(truth["pairs"].values()))
    alive = {c["effects"][0] for c in verdict["candidates"][:SURVIVORS] if len(c["effects"]) == 1} | set(verdict["set"])
    return sorted(name for name in alive - {cause} if name in before) if cause in alive else []


def doubled(pair: Pair) -> float | None:
    """Factor by which the suggested trial raises the smallest pairwise lambda between the cause and its rivals.

    None where there are no rivals, or where the referee cannot run what was suggested. "next" of the truth was made by
    the referee for the suggested manoeuvre. Where rivals are left and nothing was suggested, nothing is gained: 1.
    """
    truth, verdict = pair
    rivals = rivals_of(pair)
    if not rivals:
        return None
    before = next(iter(truth["pairs"].values()))
    if not verdict["next_trial"]:
        return 1.0
    after = truth.get("next", {})
    rivals = [name for name in rivals if name in after]
    if not rivals:
        return None
    return min(float(after[name]) for name in rivals) / max(min(float(before[name]) for name in rivals), 1e-9)


def closures(pairs: Sequence[Pair]) -> list[tuple[float, float, float, float, bool]]:
    """Of cases whose oracle closes something: stated closure, its ends, the oracle's, whether the cause came first.

    A verdict without a closure closes nothing, and its interval holds nothing; [] where no verdict states any.
    """
    own = [pair for pair in pairs if pair[0]["kind"] in ("single", "double") and pair[0].get("oracle")]
    own = [pair for pair in own if pair[0]["oracle"]["closure"] >= CLOSES and pair[0]["oracle"]["refit"] >= 1.0 + GAP]
    if not any(pair[1]["closure"] for pair in pairs):
        return []
    found = []
    for truth, verdict in own:
        values = [(verdict["closure"] or {}).get(word) for word in ("value", "lower", "upper")]
        value, low, high = (math.nan if x is None else float(x) for x in values)
        value = value if math.isfinite(value) else 0.0
        found.append((value, low, high, float(truth["oracle"]["closure"]), top((truth, verdict), 1)))
    return found


def share(
    name: str,
    pairs: Sequence[Any],
    hit: Callable[[Any], bool],
    goal: float | None = None,
    says: str = "",
    *,
    most: bool = False,
    limit: float = math.inf,
) -> Measure:
    """A share of cases; `most` says that the goal is an upper limit; `limit` is an upper one beside a lower goal."""
    n, hits = len(pairs), sum(1 for pair in pairs if hit(pair))
    return _measure(name, hits / n if n else math.nan, wilson(hits, n), n, goal, most, says, limit)


def number(
    name: str,
    values: Sequence[Any],
    what: Callable[[Sequence[Any]], float],
    goal: float | None = None,
    says: str = "",
    *,
    most: bool = False,
    ends: tuple[float, float] | None = None,
) -> Measure:
    """A statistic over cases, with its bootstrap interval unless another is given."""
    value = what(values) if len(values) else math.nan
    ends = ends or bootstrap(values, what)
    return _measure(name, value, ends, len(values), goal, most, says)


def _measure(
    name: str,
    value: float,
    ends: tuple[float, float],
    n: int,
    goal: float | None,
    most: bool,
    says: str,
    limit: float = math.inf,
) -> Measure:
    low, high = ends
    if goal is None or not math.isfinite(value):
        return Measure(name, value, low, high, n, _goal(goal, most, limit), None, False, says)
    met = value <= goal if most else goal <= value <= limit
    clear = high < goal or low > goal
    return Measure(name, value, low, high, n, _goal(goal, most, limit), met, clear, says)


def _goal(goal: float | None, most: bool, limit: float) -> str:
    if goal is None:
        return ""
    return f"{'<=' if most else '>='} {goal:g}" if limit == math.inf else f"{goal:g} to {limit:g}"


def measures(pairs: Sequence[Pair], prior: Mapping[str, Verdict]) -> list[Measure]:
    """All measures of the table; `prior` are the verdicts of the prior alone, by case."""
    shown = of_kind(pairs, "single", 25.0)
    known = [pair for pair in pairs if pair[0]["kind"] != "outside"]
    confounded = of_kind(pairs, "confounded", LEAST)
    with_prior = [(pair, (pair[0], prior[pair[0]["case"]])) for pair in pairs if pair[0]["case"] in prior]
    closed = closures(pairs)
    suggests = any(pair[1]["next_trial"] for pair in pairs)
    gains = [gain for pair in pairs if suggests and (gain := doubled(pair)) is not None]
    said = [one for pair in pairs if (one := stated(pair)) is not None]
    sets = [len(reported_set(p[1])) for p in confounded if reported_set(p[1])]
    return [
        share("top-1, one effect, lambda >= 100", of_kind(pairs, "single", 100.0), lambda p: top(p, 1), 0.90,
              "a strong single cause comes first"),
        share("top-1, one effect, lambda 25-100", of_kind(pairs, "single", 25.0, 100.0), lambda p: top(p, 1), 0.75,
              "a medium single cause comes first"),
        share("top-1, one effect, lambda 9-25", of_kind(pairs, "single", LEAST, 25.0), lambda p: top(p, 1),
              says="a weak single cause comes first"),
        share("top-1 or its look-alike, one effect, lambda >= 25", shown,
              lambda p: any(like(p[0], c["effects"]) for c in p[1]["candidates"][:1]),
              says="the same, counting as right what the referee says these trials do not tell from the cause"),
        share("top-3, one effect, lambda >= 25", shown, lambda p: top(p, 3), 0.97,
              "the cause is among the first three"),
        share("equation or place named, lambda >= 25", shown, place_right, 0.95,
              "the place ranked first is one where the cause acts"),
        share("exact set of two, lambda >= 100 each", of_kind(pairs, "double", 100.0), lambda p: top(p, 1), 0.80,
              "of two causes exactly these two come first"),
        share("false cause where there is none", of_kind(pairs, "none"),
              lambda p: p[1]["verdict"] in ("effects", "unknown", "inseparable"), 0.03,
              "a cause is declared although nothing is missing", most=True),
        share("unknown flagged, lambda 100-400", of_kind(pairs, "outside", 100.0, 400.0),
              lambda p: p[1]["verdict"] == "unknown", 0.50, "a cause outside the library is called that"),
        share("unknown flagged, lambda >= 400", of_kind(pairs, "outside", 400.0),
              lambda p: p[1]["verdict"] == "unknown", 0.90, "a strong one is"),
        share("unknown said of what is known", known, lambda p: p[1]["verdict"] == "unknown", 0.05,
              "no such cause is there, but one is declared", most=True),
        share("confidently wrong", pairs, confident_and_wrong, 0.03,
              "a probability of 0.9 or more stands on what is not the truth", most=True),
        *calibration(said),
        number("Brier skill against the prior", with_prior, _skill, 0.6,
               "all probabilities together: 1 is perfect, 0 is no better than the prior alone"),
        share("confounded: truth inside the set", confounded,
              lambda p: set(p[0]["effects"]) <= reported_set(p[1]), 0.95,
              "where trials cannot tell causes apart, the true one is in the set that is reported"),
        number("confounded: mean set", sets, lambda x: float(np.mean(x)), 2.5,
               "size of the sets that are reported there", most=True),
        number("closure over the oracle's, median", [c[0] / c[3] for c in closed], lambda x: float(np.median(x)), 0.95,
               "share of the gap that closes on trials left out, over that of one who knows the cause"),
        number("the same where the cause comes first", [c[0] / c[3] for c in closed if c[4]],
               lambda x: float(np.median(x))),
        share("closure's 95 % interval holds the oracle's", [c for c in closed if c[4]], lambda c: c[1] <= c[3] <= c[2],
              0.90, "where the cause comes first, so that both close by the same effect", limit=0.98),
        share("next trial doubles the smallest pairwise lambda", gains, lambda gain: gain >= 2.0, 0.80,
              "run in reality, the suggested trial tells cause and rivals apart twice as well"),
    ]  # fmt: skip


def calibration(said: Sequence[tuple[float, bool]]) -> list[Measure]:
    """Calibration error of the first candidates' probabilities, what chance alone makes of it, which way it leans."""
    chance = by_chance([p for p, _ in said]) if said else np.full(1, math.nan)
    low, high = (float(x) for x in np.percentile(chance, (2.5, 97.5)))
    return [
        number("calibration error", said, calibration_error, 0.05,
               "mean gap between stated probability and share that is right, over ten bins",
               most=True, ends=calibration_interval(said)),
        number("the same by chance alone", said, lambda x: float(chance.mean()), ends=(low, high),
               says="what perfect probabilities of these sizes would show with so many cases"),
        number("stated less right, on average", said, lambda x: float(np.mean([p - right for p, right in x])),
               says="above 0 it is too sure, below 0 not sure enough"),
    ]  # fmt: skip


def _skill(both: Sequence[tuple[Pair, Pair]]) -> float:
    prior = sum(brier(of_prior) for _, of_prior in both)
    return 1 - sum(brier(own) for own, _ in both) / prior if prior > 0 else math.nan


def groups(pairs: Sequence[Pair], key: str) -> dict[str, list[Pair]]:
    """Pairs by a field of the truth ("stratum", "family", "kind")."""
    found: dict[str, list[Pair]] = {}
    for pair in pairs:
        found.setdefault(str(pair[0][key]), []).append(pair)
    return dict(sorted(found.items(), key=lambda one: (_ORDER.index(one[0]) if one[0] in _ORDER else -1, one[0])))


_ORDER = ("<9", "9-25", "25-100", "100-400", ">400", "none")
"""Strata as they rise."""


def confusion(pairs: Sequence[Pair]) -> dict[tuple[str, str], int]:
    """(truth, said) -> cases, of those with at most one cause. No cause is "none"."""
    found: dict[tuple[str, str], int] = {}
    for truth, verdict in pairs:
        if len(truth["effects"]) > 1:
            continue
        best = verdict["candidates"][0]["effects"] if verdict["candidates"] else []
        key = (_word(truth["effects"]), _word(best))
        found[key] = found.get(key, 0) + 1
    return found


def _word(effects: Sequence[str]) -> str:
    return "none" if not effects else effects[0] if len(effects) == 1 else "two"
