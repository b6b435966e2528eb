"""What the measures of the score are made of: each a number with its interval, the cases it rests on, and the goal.

`goals.py` lists the measures. A pair is (truth, verdict), both in the words of `same.py`. Shares have Wilson intervals,
the others bootstrap intervals over cases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from withheld.intervals import bootstrap, wilson
from withheld.levels import holds, named, named_right
from withheld.referee import TELLS_APART

Truth = Mapping[str, Any]
Verdict = Mapping[str, Any]
Pair = tuple[Truth, Verdict]
SURE = 0.9
CLOSES = 0.2
"""Least closure of the oracle for which a ratio to it means something,"""
GAP = 0.005
"""and the least gap, in multiples of the noise, that a refit leaves: of a smaller one closure is a ratio of noise."""
ONE = ("single", "form+single")
"""Kinds with one effect that the library names; in the second the vehicle also has another form than its model."""
DOUBLES = 2.0
"""Factor of the smallest pairwise lambda that a next trial is asked for."""
UNSEEN = 1.0
"""lambda that counts as none in that factor: one deviation. Who has 0.8 in place of 0.06 tells nothing apart."""
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
    """Smallest lambda of the causes; that of the other form where only that acts; 0 where nothing does."""
    if truth["kind"] == "form":
        return float(truth["form"]["lambda"])
    return min((float(x) for x in truth["lambda"].values()), default=0.0)


def is_right(truth: Truth, effects: Sequence[str]) -> bool:
    """Whether a candidate's effects are exactly the sealed ones ([] is none, ["unknown"] outside the library).

    Where nothing acts but the vehicle has another form than its model, both of these are right.
    """
    return sorted(effects) == sorted(truth["effects"]) or (truth["kind"] == "form" and not effects)


def top(pair: Pair, many: int) -> bool:
    """Whether the truth is among the first so many candidates."""
    return any(is_right(pair[0], candidate["effects"]) for candidate in pair[1]["candidates"][:many])


def of_kind(pairs: Sequence[Pair], kind: str | Sequence[str], low: float = 0.0, high: float = math.inf) -> list[Pair]:
    """Pairs of one kind, or of several, whose smallest lambda lies in a range."""
    kinds = (kind,) if isinstance(kind, str) else tuple(kind)
    return [pair for pair in pairs if pair[0]["kind"] in kinds and low <= strength(pair[0]) < high]


def right(pair: Pair) -> bool:
    """Whether a verdict names something, and all of it is right at the level at which it is named."""
    return named_right(pair[0]["effects"], pair[1])


def names_something(pair: Pair) -> bool:
    """Whether a verdict names any cause."""
    return bool(named(pair[1]))


def place_right(pair: Pair) -> bool:
    """Whether the place ranked first is one in which the cause acts."""
    places = pair[1]["places"]
    return bool(places) and places[0] in pair[0]["places"]


def confident_and_wrong(pair: Pair) -> bool:
    """Whether a probability of 0.9 or more stands on what is not the truth: on a named cause or the first candidate."""
    truth, verdict = pair
    stands = [is_right(truth, c["effects"]) for c in verdict["candidates"][:1] if float(c["probability"]) >= SURE]
    stands += [holds(cause, truth["effects"]) for cause in named(verdict) if float(cause["probability"]) >= SURE]
    return not all(stands)


def reported_set(verdict: Verdict) -> set[str]:
    """What a verdict leaves open: the effects of all causes that it names, its set, or what it declares."""
    return (
        {name for cause in named(verdict) for name in cause["effects"]} | set(verdict["set"]) | set(verdict["effects"])
    )


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


def gained(pair: Pair) -> float | None:
    """Factor by which the suggested trial raises the smallest pairwise lambda between the cause and its rivals.

    None where there are no rivals, or where the referee cannot run what was suggested. "next" of the truth holds the
    pairwise lambdas with the suggested trial; of a verdict without one, those with each trial that was tried instead.
    """
    truth, verdict = pair
    rivals = rivals_of(pair)
    after = truth.get("next")
    if not rivals or not after:
        return None
    before = next(iter(truth["pairs"].values()))
    tried = [after] if suggests(verdict) else list(after.values())
    factors = []
    for values in tried:
        known = [name for name in rivals if name in values]
        if known:
            now, then = (max(UNSEEN, min(float(of[name]) for name in known)) for of in (before, values))
            factors.append(then / now)
    return max(factors) if factors else None


def suggests(verdict: Verdict) -> bool:
    """Whether a verdict suggests a next trial."""
    return bool(verdict["next_trial"] and verdict["next_trial"]["manoeuvre"])


def advised_well(pair: Pair) -> bool | None:
    """Whether the suggested trial doubles the separation, or, where none is suggested, none that was tried does; None
    where nothing is left to tell apart, or nothing could be tried."""
    factor = gained(pair)
    return None if factor is None else (factor >= DOUBLES) == suggests(pair[1])


def closures(pairs: Sequence[Pair]) -> list[tuple[float, float, float, float, bool]]:
    """Of cases whose oracle closes something: stated closure, its ends, the oracle's, whether both close by the same.

    They do where the cause comes first and as many causes are named: who names nothing, or one of two, closes less.

    A verdict without a closure closes nothing; [] where no verdict states any.
    """
    own = [pair for pair in pairs if pair[0]["kind"] in (*ONE, "double") and pair[0].get("oracle")]
    own = [pair for pair in own if pair[0]["oracle"]["closure"] >= CLOSES and _gap(pair[0]["oracle"]) >= GAP]
    if not any(pair[1]["closure"] for pair in pairs):
        return []
    found = []
    for truth, verdict in own:
        values = [(verdict["closure"] or {}).get(word) for word in ("value", "lower", "upper")]
        value, low, high = (math.nan if x is None else float(x) for x in values)
        value = value if math.isfinite(value) else 0.0
        same = top((truth, verdict), 1) and len(named(verdict)) == len(truth["effects"])
        found.append((value, low, high, float(truth["oracle"]["closure"]), same))
    return found


def _gap(oracle: Mapping[str, float]) -> float:
    return oracle["refit"] - oracle["floor"]


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


def groups(pairs: Sequence[Pair], key: str) -> dict[str, list[Pair]]:
    """Pairs by a field of the truth ("stratum", "family", "kind"); "yes" and "no" where it is one or the other."""
    found: dict[str, list[Pair]] = {}
    for pair in pairs:
        value = pair[0][key]
        found.setdefault(("no", "yes")[value] if isinstance(value, bool) else str(value), []).append(pair)
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
