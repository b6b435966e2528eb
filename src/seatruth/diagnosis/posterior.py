"""From evidence to probabilities and a verdict.

Hypotheses: no effect, each set of effects that was fitted, something that is not in the library. Their prior
probabilities share a fixed part for each kind; the log-evidence is divided by a temperature that was set on cases with
known causes (`experiments/withheld`), because evidence from an approximate model is worth less than it says.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.score_test import Probes
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.problem import WIDER, GapProblem

_Value = Callable[[tuple[str, ...], float], float]
Kind = Literal["effects", "no_gap", "underpowered", "inseparable", "unknown"]
UNKNOWN = "unknown"

PRIOR = {"none": 0.20, "one": 0.57, "two": 0.14, "three": 0.02, "unknown": 0.07}
"""Prior probability of each kind of answer: who asks has reason to, and most causes are too weak to show."""
LEAST_SHARE = 0.01
"""The same of more causes than these."""
UNNAMED = 6.0
"""Log-evidence by which something unnamed must beat what has a name: its forms contain those of named effects."""
TEMPERATURE = 2.2
"""By which log-evidence is divided."""
FORM = 0.003
"""Part of an effect's log-evidence that its form, never exact, leaves to others: a twentieth of its amplitude."""
LITTLE = 1.5
"""Log-evidence that small faults of any model lend to some effect or other."""
SURE = 0.6
"""Probability from which a cause is named."""
TOGETHER = 0.95
"""Probability that the effects reported as a set hold together."""
LEAST = 0.15
"""Probability, as a part of the leader's, below which a rival is left out of such a set."""
RIVAL = 0.5
"""Probability of any cause, as a part of that of none, from which it cannot be said that there is none."""
APART = 11.0
"""Pairwise lambda below which two causes count as not told apart."""
_SEEN = 0.5
"""Projected lambda at a typical magnitude below which an effect takes no part."""
POWER = 2.8
"""Deviations at which an effect is found with probability 0.8 in a test at 0.05: 1.96 + 0.84."""


@dataclass(frozen=True)
class Candidate:
    """One answer and its probability; `effects` is ("unknown",) for a cause that is not in the library."""

    effects: tuple[str, ...]
    probability: float
    evidence: float
    """Log-evidence over the model without effects."""
    beside: float = 0.0
    """Part of the probability that has something unnamed act beside these effects."""


@dataclass(frozen=True)
class _Row:
    effects: tuple[str, ...]
    evidence: float
    prior: float
    beside: bool = False


def candidates(search: Search, probes: Sequence[Probes], temperature: float = TEMPERATURE) -> list[Candidate]:
    """All answers with their probabilities, the most probable first."""
    shown = _shown(search)
    keys = {(name,) for name in shown} | {key for key in search.fits if all(name in shown for name in key)}
    prior = _prior(len(shown), search.beside)
    tempered = _tempered(search)
    evidences = {key: search.evidence(key) for key in sorted(keys)}
    rows = [_Row(key, tempered(key, found), prior(key)) for key, found in evidences.items() if math.isfinite(found)]
    for one in probes:
        rows += _unnamed_rows(one, search, tempered, prior)
    weight = np.array([row.evidence / temperature + row.prior for row in rows])
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()
    chances: dict[tuple[str, ...], list[float]] = {}
    for row, p in zip(rows, weight):
        entry = chances.setdefault(row.effects, [0.0, 0.0, -math.inf])
        entry[0] += float(p)
        entry[1] += float(p) if row.beside else 0.0
        entry[2] = max(entry[2], evidences.get(row.effects, row.evidence))
    found = [Candidate(key, entry[0], entry[2], entry[1]) for key, entry in chances.items()]
    return sorted(found, key=lambda c: -c.probability)


def _shown(search: Search) -> list[str]:
    """Effects that take part: those that these trials could show."""
    return [n for n in search.problem.effects if visible(search, n) or search.evidence((n,)) > 1.0]


def _prior(many: int, beside: int) -> Callable[[tuple[str, ...]], float]:
    """Logarithm of the prior probability of a set of effects, of so many that take part, beside so many others."""
    pairs = many * (many - 1) // 2
    count = {0: 1, 1: many, 2: pairs, 3: pairs * max(1, many - 2) // 3}
    shares = [PRIOR["none"], PRIOR["one"], PRIOR["two"], PRIOR["three"]][beside:]

    def prior(key: tuple[str, ...]) -> float:
        share = shares[len(key)] if len(key) < len(shares) else LEAST_SHARE
        return math.log(share / max(1, count.get(len(key), count[3])))

    return prior


def handicap(search: Search) -> Callable[[tuple[str, ...]], float]:
    """Log-evidence by which a set of effects must be ahead of no effect to be as probable."""
    prior = _prior(len(_shown(search)), search.beside)
    return lambda key: TEMPERATURE * (prior(()) - prior(key)) + (LITTLE if key else 0.0)


def unnamed(found: Sequence[Candidate]) -> float:
    """Probability that something unnamed acts, alone or beside named effects."""
    return sum(c.probability if c.effects == (UNKNOWN,) else c.beside for c in found)


def beside_unnamed(found: Sequence[Candidate], besides: Sequence[Candidate], chance: float) -> list[Candidate]:
    """Answers in which what acts beside something unnamed, with this probability, is shared out as `besides` say."""
    before = 1.0 - unnamed(found)
    rest = (1.0 - chance) / before if before > 1e-9 else 0.0
    chances = {
        c.effects: [rest * (c.probability - c.beside), 0.0, c.evidence] for c in found if c.effects != (UNKNOWN,)
    }
    for c in besides:
        entry = chances.setdefault(c.effects or (UNKNOWN,), [0.0, 0.0, c.evidence])
        entry[0] += chance * c.probability
        entry[1] += chance * c.probability if c.effects else 0.0
        entry[2] = c.evidence if c.effects else entry[2]
    again = [Candidate(key, entry[0], entry[2], entry[1]) for key, entry in chances.items()]
    return sorted(again, key=lambda c: -c.probability)


def _unnamed_rows(
    one: Probes, search: Search, tempered: _Value, prior: Callable[[tuple[str, ...]], float]
) -> list[_Row]:
    """Something unnamed acts, alone or beside the effects that the probes stand beside; or a sensor drifts, which is
    noise that the floor does not know, and speaks for no cause.
    """
    key = one.at.effects
    named = search.evidence(key)
    odds = math.log(PRIOR["unknown"] / (PRIOR["none"] if not key else 1.0 - PRIOR["unknown"]))
    begin, force = tempered(key, named), _worth(one.average("terms", "place") - UNNAMED, named)
    drift = one.average("sensor") - UNNAMED
    rows = [_Row(key, begin + drift, prior(key) + odds)] if math.isfinite(drift) else []
    if key:
        return [*rows, _Row(key, begin + force, prior(key) + odds, beside=True)]
    return [*rows, _Row((UNKNOWN,), force, prior(()) + odds)]


def _worth(gain: float, named: float) -> float:
    """What a further cause's log-evidence is worth beside one that is named already.

    The form of an effect is never exact: a strong one leaves a part of its own signature unexplained, and the next best
    takes that up.
    """
    return max(min(gain, 0.0), gain - FORM * max(0.0, named))


def _tempered(search: Search) -> _Value:
    """Evidence of a set as that of its best part, and what the rest adds to it."""

    def value(key: tuple[str, ...], evidence: float) -> float:
        if len(key) < 2:
            return evidence - LITTLE * len(key)
        inner = max((search.evidence(part), part) for part in itertools.combinations(key, len(key) - 1))
        if not math.isfinite(inner[0]):
            return evidence
        return value(inner[1], inner[0]) + _worth(evidence - inner[0], inner[0])

    return value


def visible(search: Search, name: str) -> bool:
    """Whether these trials would show anything of an effect at its typical magnitude."""
    screen = search.screens[()]
    for option, at in screen.columns.items():
        if option.partition("@")[0] == name:
            scaled = screen.information[np.ix_(at, at)] * np.outer(screen.sd[at], screen.sd[at])
            if float(np.linalg.eigvalsh(scaled).max()) > _SEEN:
                return True
    return False


def inclusion(found: Sequence[Candidate], effects: Sequence[str]) -> dict[str, float]:
    """Probability that each effect acts, alone or with others."""
    return {name: sum(c.probability for c in found if name in c.effects) for name in effects}


@dataclass(frozen=True)
class Verdict:
    """What is said, and the sets that stand behind it."""

    kind: Kind
    effects: tuple[str, ...]
    together: tuple[str, ...]
    """Effects that cannot be told apart on these trials, the most probable first; empty where the cause is named."""
    probability: float
    beside: bool = False
    """Whether something unnamed acts beside the effects."""


def verdict(
    found: Sequence[Candidate],
    powerless: Sequence[str],
    possible: int,
    near: Callable[[str, str], float] | None = None,
) -> Verdict:
    """`powerless` are the effects whose typical magnitude the trials could not have shown, of `possible` in all; `near`
    gives the pairwise lambda of two effects.
    """
    best = found[0]
    named = [c for c in found if c.effects and c.effects != (UNKNOWN,)]
    cause = sum(c.probability for c in named)
    if best.effects == ():
        rival = max((c.probability for c in found[1:]), default=0.0)
        if rival > RIVAL * best.probability:
            return undecided(found)
        kind: Kind = "no_gap" if len(powerless) <= possible // 2 else "underpowered"
        return Verdict(kind, (), (), best.probability)
    if best.effects == (UNKNOWN,):
        return Verdict("unknown", (), (), best.probability)
    if best.probability >= SURE and not _doubles(best, named, near):
        return Verdict("effects", best.effects, (), best.probability, best.beside > 0.5 * best.probability)
    if sum(c.beside for c in named) > 0.5 * cause:
        # Beside something unnamed many effects take part; those that all likely answers have in common are named.
        common = in_common(found)
        if common is not None:
            return common
    # Rivals of the same number: what is said of a second effect is not that the first is another.
    rivals = [c for c in named if len(c.effects) == len(best.effects)]
    total = sum(c.probability for c in rivals)
    together: list[str] = []
    held = 0.0
    for candidate in rivals:
        if held >= TOGETHER * total or candidate.probability < LEAST * best.probability:
            break
        together += [name for name in candidate.effects if name not in together]
        held += candidate.probability
    # Answers that have one of them and more speak for the set as well.
    covered = sum(c.probability for c in named if set(c.effects) & set(together))
    beside = sum(c.beside for c in named) > 0.5 * cause
    if covered < SURE:
        return undecided(found)
    if len(together) == len(best.effects):
        return Verdict("effects", best.effects, (), covered, beside)
    return Verdict("inseparable", best.effects, tuple(together), covered, beside)


def in_common(found: Sequence[Candidate]) -> Verdict | None:
    """The effects that are sure enough, whatever acts with them, beside something unnamed; None if there are none."""
    names = dict.fromkeys(name for c in found for name in c.effects if c.effects != (UNKNOWN,))
    chances = {name: chance for name, chance in inclusion(found, list(names)).items() if chance >= SURE}
    return Verdict("effects", tuple(chances), (), min(chances.values()), True) if chances else None


def refused(found: Sequence[Candidate], effects: Sequence[str]) -> list[Candidate]:
    """The answers without these effects; what named nothing else is something unnamed."""
    merged: dict[tuple[str, ...], Candidate] = {}
    for c in found:
        key = tuple(name for name in c.effects if name not in effects)
        key = key if key or not c.effects else (UNKNOWN,)
        beside = 0.0 if key in ((), (UNKNOWN,)) else c.beside
        old = merged.get(key, Candidate(key, 0.0, -math.inf))
        best = max(old.evidence, c.evidence)
        merged[key] = Candidate(key, old.probability + c.probability, best, old.beside + beside)
    return sorted(merged.values(), key=lambda c: -c.probability)


def undecided(found: Sequence[Candidate]) -> Verdict:
    """No cause stands out; the likeliest effects are given."""
    named = [c for c in found if c.effects and c.effects != (UNKNOWN,)]
    return Verdict("underpowered", (), _leading(named), sum(c.probability for c in named))


def _leading(named: Sequence[Candidate]) -> tuple[str, ...]:
    """The effects of the likeliest answers."""
    return tuple(dict.fromkeys(n for c in named[:4] for n in c.effects))


def _doubles(best: Candidate, named: Sequence[Candidate], near: Callable[[str, str], float] | None) -> bool:
    """Whether a rival that is not improbable leaves the same trace as the best answer."""
    if near is None or len(best.effects) != 1:
        return False
    rivals = [c for c in named if len(c.effects) == 1 and c is not best and c.probability >= LEAST * best.probability]
    return any(near(best.effects[0], rival.effects[0]) < APART for rival in rivals)


def detectable(search: Search) -> dict[str, dict[str, float]]:
    """For each effect the smallest magnitude of each parameter that these trials would show (80 % power at 5 %), by
    parameter: everything that the model's coefficients and initial states can take up is projected out."""
    problem, one = search.problem, search.screens[()]
    found: dict[str, dict[str, float]] = {}
    for name, effect in problem.effects.items():
        at = one.columns.get(name)
        if at is None:
            continue
        information = one.information[np.ix_(at, at)]
        found[name] = {}
        for k, q in enumerate(effect.parameters):
            left = _left(information, k)
            found[name][q.name] = POWER / math.sqrt(left) if left > 0.0 else math.inf
    return found


def powerless(search: Search, least: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Effects none of whose parameters would show at its typical magnitude."""
    problem = search.problem
    found = []
    for name, limits in least.items():
        sds = problem.sd[problem.columns[name]] / WIDER
        if all(limit > sd for limit, sd in zip(limits.values(), sds)):
            found.append(name)
    return found


def apart(search: Search, one: str, other: str) -> float:
    """Pairwise lambda: what is left of one effect's signature, at its fitted magnitude, when the other effect and all
    nuisances may take up what they can."""
    screen, problem = search.screens[()], search.problem
    fit = search.fits.get((one,))
    if fit is None or one not in screen.columns or other not in screen.columns:
        return math.nan
    a, b = screen.columns[one], screen.columns[other]
    size = fit.x[problem.columns[one]] - problem.mean[problem.columns[one]]
    held = screen.information[np.ix_(b, b)] + np.diag(1.0 / screen.sd[b] ** 2)
    cross = screen.information[np.ix_(b, a)]
    left: Array = screen.information[np.ix_(a, a)] - cross.T @ np.linalg.solve(held, cross)
    return float(size @ left @ size)


def _left(information: Array, k: int) -> float:
    """Information on entry k when the others are free."""
    others = [j for j in range(len(information)) if j != k]
    if not others:
        return float(information[k, k])
    rest = np.linalg.pinv(information[np.ix_(others, others)], hermitian=True)
    return float(information[k, k] - information[k, others] @ rest @ information[others, k])


def lambda_of(search: Search, problem: GapProblem, name: str) -> float:
    """Projected lambda of an effect at its fitted magnitude: its squared z-score."""
    fit, screen = search.fits.get((name,)), search.screens[()]
    if fit is None or name not in screen.columns:
        return math.nan
    at = screen.columns[name]
    size = fit.x[problem.columns[name]] - problem.mean[problem.columns[name]]
    return float(size @ screen.information[np.ix_(at, at)] @ size)
