"""The measures of the score, in the order of the table."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from withheld.intervals import bootstrap, by_chance, calibration_error, calibration_interval
from withheld.levels import LEVELS, coarsest, named
from withheld.measures import (
    LEAST,
    ONE,
    Measure,
    Pair,
    Verdict,
    advised_well,
    brier,
    closures,
    confident_and_wrong,
    like,
    names_something,
    number,
    of_kind,
    place_right,
    reported_set,
    right,
    share,
    stated,
    suggests,
    top,
)

STRONG, MEDIUM = (100.0, math.inf), (25.0, 100.0)
"""Ranges of lambda."""


def measures(
    pairs: Sequence[Pair], prior: Mapping[str, Verdict], limit: Mapping[str, Verdict] | None = None
) -> list[Measure]:
    """All measures of the table; `prior` are the verdicts of the prior alone, `limit` those of the best possible
    program, by case."""
    shown = of_kind(pairs, ONE, 25.0)
    none = of_kind(pairs, ("none", "form"))
    known = [pair for pair in pairs if pair[0]["kind"] not in ("outside", "form", "form+single")]
    confounded = of_kind(pairs, "confounded", LEAST)
    naming = [pair for pair in pairs if pair[0]["kind"] not in ("none", "form", "outside") and names_something(pair)]
    with_prior = [(pair, (pair[0], prior[pair[0]["case"]])) for pair in pairs if pair[0]["case"] in prior]
    closed = closures(pairs)
    advised = [good for pair in pairs if (good := advised_well(pair)) is not None]
    advised = advised if any(suggests(pair[1]) for pair in pairs) else []
    said = [one for pair in pairs if (one := stated(pair)) is not None]
    sets = [len(reported_set(p[1])) for p in confounded if reported_set(p[1])]
    return [
        share("named right, one effect, lambda >= 100", of_kind(pairs, ONE, *STRONG), right, 0.90,
              "a strong cause is named, and all that is named is right at the level at which it is named"),
        over_limit("the same over the limit's", of_kind(pairs, ONE, *STRONG), limit, 0.95),
        share("named right, one effect, lambda 25-100", of_kind(pairs, ONE, *MEDIUM), right,
              says="a medium cause is"),
        over_limit("the same over the limit's, lambda 25-100", of_kind(pairs, ONE, *MEDIUM), limit, 0.80),
        *(
            share(f"right where {words} is named, lambda >= 25",
                  [p for p in shown if coarsest(named(p[1])) == level], right,
                  says=f"of the verdicts that name {words}, the share that is right")
            for level, words in zip(LEVELS, ("an effect", "a group of effects", "a family of causes"), strict=True)
        ),
        *(
            share(f"named right as {words}, lambda >= 25", shown,
                  _right_at(level), says=f"share of the cases: what is named is right, {words} the coarsest of it")
            for level, words in zip(LEVELS, ("an effect", "a group of effects", "a family of causes"), strict=True)
        ),
        share("false cause where none acts", none, names_something, 0.03,
              "a cause is named although no effect acts, only another form of hull, damping or wake, or nothing",
              most=True),
        share("the same, nothing acts", of_kind(pairs, "none"), names_something, most=True),
        share("the same, another form", of_kind(pairs, "form"), names_something, most=True),
        share("wrong at a probability of 0.9 or more", pairs, confident_and_wrong, 0.02,
              "a probability of 0.9 or more stands on what is not the truth", most=True),
        share("unknown called unknown, lambda >= 100", of_kind(pairs, "outside", *STRONG),
              lambda p: p[1]["verdict"] == "unknown", 0.70, "a strong cause outside the library is called that"),
        share("unknown said of what is known", known, lambda p: p[1]["verdict"] == "unknown", 0.05,
              "no such cause is there, but one is declared", most=True),
        *calibration(said),
        share("truth inside the set", confounded, lambda p: set(p[0]["effects"]) <= reported_set(p[1]), 0.95,
              "where trials cannot tell causes apart, the true one is in the set that is reported"),
        number("mean set", sets, lambda x: float(np.mean(x)), 2.5, "size of the sets that are reported there",
               most=True),
        share("truth inside what is named, all cases with a cause", naming,
              lambda p: set(p[0]["effects"]) <= reported_set(p[1])),
        number("gap closed over the oracle's, median", [c[0] / c[3] for c in closed], lambda x: float(np.median(x)),
               0.95, "share of the gap that closes on trials left out, over that of one who knows the cause"),
        share("its 95 % interval holds the oracle's", [c for c in closed if c[4]], lambda c: c[1] <= c[3] <= c[2],
              0.90, "where the cause comes first and is named, so that both close by the same effects", limit=0.98),
        share("next trial doubles the separation, or none can", advised, lambda good: good, 0.80,
              "run in reality it tells cause and rivals apart twice as well; where none is suggested, none tried does"),
        share("top-1, one effect, lambda >= 100", of_kind(pairs, ONE, *STRONG), lambda p: top(p, 1),
              says="the first candidate is exactly the cause"),
        share("top-1, one effect, lambda 25-100", of_kind(pairs, ONE, *MEDIUM), lambda p: top(p, 1)),
        share("top-1, one effect, lambda 9-25", of_kind(pairs, ONE, LEAST, 25.0), lambda p: top(p, 1)),
        share("top-1 or its look-alike, one effect, lambda >= 25", shown,
              lambda p: any(like(p[0], c["effects"]) for c in p[1]["candidates"][:1]),
              says="counting as right what the referee says these trials do not tell from the cause"),
        share("top-3, one effect, lambda >= 25", shown, lambda p: top(p, 3)),
        share("place, one effect, lambda >= 25", shown, place_right,
              says="the place ranked first is one where the cause acts"),
        share("exact set of two, lambda >= 100 each", of_kind(pairs, "double", *STRONG), lambda p: top(p, 1)),
        share("two causes, all that is named right, lambda >= 100 each", of_kind(pairs, "double", *STRONG), right),
        number("Brier skill against the prior", with_prior, _skill,
               says="all probabilities together: 1 is perfect, 0 is no better than the prior alone"),
    ]  # fmt: skip


def _right_at(level: str) -> Callable[[Pair], bool]:
    """Whether a verdict is right, and names nothing more coarsely than at a level but something there."""
    return lambda pair: right(pair) and coarsest(named(pair[1])) == level


def over_limit(name: str, pairs: Sequence[Pair], limit: Mapping[str, Verdict] | None, goal: float) -> Measure:
    """Share named right over the same share of the best possible program on the same cases; paired bootstrap."""
    both = [
        (right(pair), right((pair[0], limit[pair[0]["case"]]))) for pair in pairs if limit and pair[0]["case"] in limit
    ]

    def ratio(rows: Sequence[tuple[bool, bool]]) -> float:
        best = sum(theirs for _, theirs in rows)
        return sum(own for own, _ in rows) / best if best else math.nan

    return number(name, both, ratio, goal, "of what one names who knows reality's forms, noise and priors",
                  ends=bootstrap(both, ratio))  # fmt: skip


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
        number("stated less right, on average", said, lambda x: float(np.mean([p - hit for p, hit in x])),
               says="above 0 it is too sure, below 0 not sure enough"),
    ]  # fmt: skip


def _skill(both: Sequence[tuple[Pair, Pair]]) -> float:
    prior = sum(brier(of_prior) for _, of_prior in both)
    return 1 - sum(brier(own) for own, _ in both) / prior if prior > 0 else math.nan
