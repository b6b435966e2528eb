"""Which hypotheses are fitted: all effects by a linearized marginal likelihood, the leaders in full, then sets."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.linear_problem import Point, Problem
from seatruth.diagnosis.map_fit import Fit, Known, fit
from seatruth.diagnosis.marginal_likelihood import PAIRS, Likelihood, Sizes, log_prior, maximised

SINGLES = 10
LEADERS = 3
ADDITIONS = 3


@dataclass
class Search:
    problem: Problem
    known: Known
    fits: dict[tuple[tuple[str, ...], bool], Fit] = field(default_factory=dict)
    screened: dict[tuple[str, ...], float] = field(default_factory=dict)
    failed: dict[tuple[str, ...], str] = field(default_factory=dict)
    log: list[str] = field(default_factory=list)

    def evidence(self, effects: Sequence[str], discrepancy: bool) -> float:
        f = self.fits.get((tuple(sorted(effects)), discrepancy))
        return -math.inf if f is None else f.evidence

    def best(self, effects: Sequence[str]) -> float:
        return max(self.evidence(effects, False), self.evidence(effects, True))

    def sets(self) -> list[tuple[str, ...]]:
        return sorted({k for k, _ in self.fits}, key=lambda k: (-self.best(k), k))


def first_sizes(problem: Problem, known: Known) -> Sizes:
    """White noise as stated, or of the second differences of neighbouring samples; discrepancy of a few per cent."""
    white = []
    for c, name in enumerate(problem.outputs):
        if c in known.stated:
            white.append(math.log(known.stated[c]))
            continue
        second = [np.diff(np.asarray(t.outputs[name]), n=2) for t in problem.trials if name in t.outputs]
        values = np.concatenate(second) if second else np.zeros(0)
        values = np.abs(values[np.isfinite(values)])
        size = 1.4826 * float(np.median(values)) / math.sqrt(6.0) if values.size else 0.0
        spread = max((float(np.nanstd(t.outputs[name])) for t in problem.trials if name in t.outputs), default=1.0)
        white.append(math.log(max(size, known.least.get(c, 0.0), 1e-5 * spread, 1e-12)))
    E = len(problem.equations)
    pairs = sum(a in problem.equations and b in problem.equations for a, b in PAIRS)
    return Sizes(np.array(white), (0,) * len(white), np.full(E, math.log(0.03)), np.full(E, math.log(0.03)), np.zeros(pairs))


def quantum(problem: Problem) -> dict[int, float]:
    """Deviation of rounding to the record's last digit."""
    found: dict[int, float] = {}
    for c, name in enumerate(problem.outputs):
        values = [np.asarray(t.outputs[name]) for t in problem.trials if name in t.outputs]
        finite = np.unique(np.concatenate([v[np.isfinite(v)] for v in values])) if values else np.zeros(0)
        steps = np.diff(finite)
        if steps.size and (np.abs(steps / steps.min() - np.rint(steps / steps.min())) < 1e-3).all():
            found[c] = float(steps.min()) / 12**0.5
    return found


def search(problem: Problem, say: Callable[[str], None] = lambda text: None, largest: int = 3) -> Search:
    stated = {c: float(problem.study.noise[n]) for c, n in enumerate(problem.outputs) if isinstance(problem.study.noise.get(n), (int, float))}
    known = Known(stated, quantum(problem))
    found = Search(problem, known)
    sizes = first_sizes(problem, known)
    say("model alone, with discrepancy")
    null = None
    if problem.discrepancy is not None:
        null = _fit(found, (), True, problem.start, sizes)
    _fit(found, (), False, null.point if null else problem.start, sizes)
    base = null or found.fits[(), False]
    singles = _screen(found, base, ())
    for name in singles[:SINGLES]:
        say(f"effect {name}")
        _both(found, (name,), base)
    for size in range(2, largest + 1):
        for leader in [k for k in found.sets() if len(k) == size - 1][: LEADERS if size == 2 else 2]:
            at = max((f for (k, d), f in found.fits.items() if k == leader), key=lambda f: f.evidence)
            more = _screen(found, at, leader)
            for name in more[:ADDITIONS]:
                key = tuple(sorted((*leader, name)))
                gain = found.screened[key] - found.best(leader)
                if gain > 1.0 and (key, True) not in found.fits and (key, False) not in found.fits:
                    say(f"effects {key} (+{gain:.1f})")
                    _both(found, key, at)
    return found


def _both(found: Search, key: tuple[str, ...], near: Fit) -> None:
    key = tuple(sorted(key))
    start = _started(found, key, near)
    sizes = near.sizes if near.discrepancy else first_sizes(found.problem, found.known)
    got = None
    if found.problem.discrepancy is not None:
        got = _fit(found, key, True, start, _with_discrepancy(sizes))
    got = got if got is not None else near
    _fit(found, key, False, got.point if got.effects == key else start, got.sizes)


def _with_discrepancy(sizes: Sizes) -> Sizes:
    def on(v: Array) -> Array:
        return np.where(np.isfinite(v), np.maximum(v, math.log(0.003)), math.log(0.01))

    return replace(sizes, terms=on(sizes.terms), forces=on(sizes.forces))


def _fit(found: Search, key: tuple[str, ...], discrepancy: bool, start: Point, sizes: Sizes) -> Fit | None:
    try:
        rival = max((f.evidence for f in found.fits.values()), default=-math.inf) if key else -math.inf
        got = fit(found.problem, key, start, sizes, found.known, discrepancy=discrepancy, rival=rival)
    except np.linalg.LinAlgError as trouble:
        found.failed[key] = str(trouble)
        return None
    if not math.isfinite(got.evidence):
        found.failed[key] = "it diverges"
        return None
    found.fits[key, discrepancy] = got
    return got


def _started(found: Search, key: tuple[str, ...], near: Fit) -> Point:
    """The point with each new effect where the linearized likelihood or its best finite start puts it."""
    problem = found.problem
    new = [name for name in key if name not in near.effects]
    x = near.point.x.copy()
    best, value = Point(x, near.point.forces), -math.inf
    for name in new:
        effect = problem.effects[name]
        columns = problem.shared[problem.columns[name]]
        options = [x[columns]]
        if effect.starts:
            for start in effect.starts:
                options.append(np.array([float(start[q.name]) for q in effect.parameters]) )
            scored = []
            for values in options:
                x2 = x.copy(); x2[columns] = values
                trial = Point(x2, near.point.forces)
                at = problem.linearize(trial)
                if not np.isfinite(at.errors).all():
                    continue
                lk = Likelihood(problem, at, key)
                try:
                    scored.append((lk.log_likelihood(near.sizes if near.discrepancy else near.sizes, key), values))
                except np.linalg.LinAlgError:
                    continue
            if scored:
                x[columns] = max(scored, key=lambda e: e[0])[1]
    return Point(x, near.point.forces)


def _screen(found: Search, at: Fit, inside: tuple[str, ...]) -> list[str]:
    """Effects in the order of the linearized evidence of `inside` with each of them."""
    problem = found.problem
    others = [name for name in problem.effects if name not in inside]
    lk = Likelihood(problem, at.at, [*inside, *others])
    channels = [c for c in range(len(problem.outputs)) if any(s.channel == c for s in problem.series)]
    scores = {}
    for name in others:
        key = (*inside, name)

        def f(s: Sizes, key=key) -> float:
            return lk.log_likelihood(s, key) + log_prior(problem, s, found.known.stated, found.known.least)

        _, best = maximised(f, at.sizes, channels, at.discrepancy, sweeps=1, noise=False)
        none = replace(at.sizes, terms=np.full_like(at.sizes.terms, -math.inf), forces=np.full_like(at.sizes.forces, -math.inf))
        best = max(best, f(none))
        effect = problem.effects[name]
        if effect.starts:
            columns = problem.shared[problem.columns[name]]
            for start in effect.starts:
                x2 = at.point.x.copy(); x2[columns] = [float(start[q.name]) for q in effect.parameters]
                lin = problem.linearize(Point(x2, at.point.forces))
                if np.isfinite(lin.errors).all():
                    l2 = Likelihood(problem, lin, key)
                    for z in (at.sizes, none):
                        best = max(best, l2.log_likelihood(z, key) + log_prior(problem, z, found.known.stated, found.known.least))
        scores[name] = best
        found.screened[tuple(sorted(key))] = best
    return sorted(scores, key=lambda n: (-scores[n], n))
