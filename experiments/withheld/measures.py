"""The measures of the score: each a number with its interval, the cases it rests on, and the goal.

A pair is (truth, verdict). Shares have Wilson intervals, the others bootstrap intervals over cases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from withheld.intervals import bootstrap, calibration_error, wilson

Truth = Mapping[str, Any]
Verdict = Mapping[str, Any]
Pair = tuple[Truth, Verdict]
SURE = 0.9
CLOSES = 0.2
"""Least closure of the oracle for which a ratio to it means something."""
SURVIVORS = 4
"""Leading candidates between which the next trial is to tell."""


@dataclass(frozen=True)
class Measure:
    """One measure: value, 95 % interval, number of cases; `met` is None where there is nothing to judge."""

    name: str
    value: float
    low: float
    high: float
    n: int
    goal: str
    met: bool | None


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


def brier(pair: Pair) -> float:
    """Multi-class Brier score over the candidates; the truth counts as stated with 0 where it is not among them."""
    stated = [(is_right(pair[0], c["effects"]), float(c["probability"])) for c in pair[1]["candidates"]]
    score = sum((p - right) ** 2 for right, p in stated)
    return score if any(right for right, _ in stated) else score + 1.0


def stated(pair: Pair) -> tuple[float, bool] | None:
    """Probability of the first candidate, and whether it is right."""
    best = pair[1]["candidates"][:1]
    return (float(best[0]["probability"]), is_right(pair[0], best[0]["effects"])) if best else None


def doubled(pair: Pair) -> float | None:
    """Factor by which the suggested trial raises the smallest pairwise lambda between the cause and its rivals.

    The rivals are the other effects among the first candidates and in the set; None where the truth is not among
    those, or nothing was suggested. "next" of the truth was made by the referee for the suggested manoeuvre.
    """
    truth, verdict = pair
    after = truth.get("next", {})
    if not after or len(truth["effects"]) != 1:
        return None
    cause = truth["effects"][0]
    alive = {c["effects"][0] for c in verdict["candidates"][:SURVIVORS] if len(c["effects"]) == 1} | set(verdict["set"])
    before = next(iter(truth["pairs"].values()))
    rivals = [name for name in alive - {cause} if name in before and name in after]
    if cause not in alive or not rivals:
        return None
    now = min(float(after[name]) for name in rivals)
    return now / max(min(float(before[name]) for name in rivals), 1e-9)


def share(
    name: str, pairs: Sequence[Any], hit: Callable[[Any], bool], goal: float | None, *, most: bool = False
) -> Measure:
    """A share of cases; `most` says that the goal is an upper limit."""
    n, hits = len(pairs), sum(1 for pair in pairs if hit(pair))
    value = hits / n if n else math.nan
    low, high = wilson(hits, n)
    if goal is None:
        return Measure(name, value, low, high, n, "", None)
    text = f"{'<=' if most else '>='} {goal:g}"
    return Measure(name, value, low, high, n, text, None if not n else value <= goal if most else value >= goal)


def number(
    name: str, values: Sequence[Any], what: Callable[[Sequence[Any]], float], goal: float, *, most: bool = False
) -> Measure:  # fmt: skip
    """A statistic over cases."""
    value = what(values) if len(values) else math.nan
    low, high = bootstrap(values, what)
    met = None if not math.isfinite(value) else value <= goal if most else value >= goal
    return Measure(name, value, low, high, len(values), f"{'<=' if most else '>='} {goal:g}", met)


def measures(pairs: Sequence[Pair], prior: Mapping[str, Verdict]) -> list[Measure]:
    """All measures of the table; `prior` are the verdicts of the prior alone, by case."""
    single = of_kind(pairs, "single")
    shown = of_kind(pairs, "single", 25.0)
    known = [pair for pair in pairs if pair[0]["kind"] != "outside"]
    confounded = of_kind(pairs, "confounded")
    with_prior = [(pair, (pair[0], prior[pair[0]["case"]])) for pair in pairs if pair[0]["case"] in prior]
    closures = [
        (pair[1]["closure"], pair[0]["oracle"]["closure"])
        for pair in [*single, *of_kind(pairs, "double")]
        if pair[1]["closure"] and pair[0].get("oracle") and pair[0]["oracle"]["closure"] >= CLOSES
        and math.isfinite(float(pair[1]["closure"].get("value") or math.nan))
    ]  # fmt: skip
    gains = [gain for pair in pairs if (gain := doubled(pair)) is not None]
    said = [one for pair in pairs if (one := stated(pair)) is not None]
    return [
        share("top-1, one effect, lambda >= 100", of_kind(pairs, "single", 100.0), lambda p: top(p, 1), 0.90),
        share("top-1, one effect, lambda 25-100", of_kind(pairs, "single", 25.0, 100.0), lambda p: top(p, 1), 0.75),
        share("top-1, one effect, lambda 9-25", of_kind(pairs, "single", 9.0, 25.0), lambda p: top(p, 1), None),
        share("top-3, one effect, lambda >= 25", shown, lambda p: top(p, 3), 0.97),
        share("place named rightly, lambda >= 25", shown, place_right, 0.95),
        share("exact set of two, lambda >= 100 each", of_kind(pairs, "double", 100.0), lambda p: top(p, 1), 0.80),
        share("false cause where there is none", of_kind(pairs, "none"),
              lambda p: p[1]["verdict"] in ("effects", "unknown", "inseparable"), 0.03, most=True),
        share("unknown flagged, lambda 100-400", of_kind(pairs, "outside", 100.0, 400.0),
              lambda p: p[1]["verdict"] == "unknown", 0.50),
        share("unknown flagged, lambda >= 400", of_kind(pairs, "outside", 400.0),
              lambda p: p[1]["verdict"] == "unknown", 0.90),
        share("unknown said of a known cause", known, lambda p: p[1]["verdict"] == "unknown", 0.05, most=True),
        share("confidently wrong", pairs, confident_and_wrong, 0.03, most=True),
        number("calibration error", said, calibration_error, 0.05, most=True),
        number("Brier skill against the prior", with_prior, _skill, 0.6),
        share("confounded: truth inside the set", confounded,
              lambda p: set(p[0]["effects"]) <= reported_set(p[1]), 0.95),
        number("confounded: mean set", [len(reported_set(p[1])) for p in confounded],
               lambda x: float(np.mean(x)), 2.5, most=True),
        number("closure over the oracle's, median", [c["value"] / o for c, o in closures],
               lambda x: float(np.median(x)), 0.95),
        share("closure interval holds the oracle's", closures, lambda c: c[0]["lower"] <= c[1] <= c[0]["upper"], 0.90),
        share("next trial doubles the smallest pairwise lambda", gains, lambda gain: gain >= 2.0, 0.80),
    ]  # fmt: skip


def _skill(both: Sequence[tuple[Pair, Pair]]) -> float:
    prior = sum(brier(of_prior) for _, of_prior in both)
    return 1 - sum(brier(own) for own, _ in both) / prior if prior > 0 else math.nan


def groups(pairs: Sequence[Pair], key: str) -> dict[str, list[Pair]]:
    """Pairs by a field of the truth ("stratum", "family", "kind")."""
    found: dict[str, list[Pair]] = {}
    for pair in pairs:
        found.setdefault(str(pair[0][key]), []).append(pair)
    return dict(sorted(found.items()))


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
