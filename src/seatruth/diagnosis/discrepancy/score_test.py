"""Where something unnamed acts, and what it looks like: probes of equations, inputs, sensors, screened at a fit.

Each place gets a function of time with independent values at the knots of each trial, each equation a sum of simple
terms shared by all trials. Their size is not known: the evidence is averaged over a ladder of sizes, so that a probe
that could explain anything pays for it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.costs.trajectory import TrajectoryCost
from seatruth.diagnosis.discrepancy.terms import ProbedModel, Term, equations, terms_of
from seatruth.diagnosis.fit import Fit, Screen, screen
from seatruth.diagnosis.noise import NoiseFloor
from seatruth.diagnosis.problem import GapProblem
from seatruth.models.parameter import Prior

KNOTS = 12
_LARGEST = 1e12
LADDER = (0.01, 0.03, 0.1, 0.3)
"""Sizes of an unnamed cause, as parts of what is usual in its place."""


@dataclass(frozen=True)
class Probe:
    """One place or one equation's terms: its evidence over the fit, and the size that speaks most for it."""

    label: str
    gain: float
    size: float
    kind: str
    """ "place" (a function of time), "terms" (a formula), "sensor" (an offset of a channel in time)."""


@dataclass
class Probes:
    """What probes add to a fit. Blocks of columns by label, whitened; `scale` their usual size."""

    problem: GapProblem
    floor: NoiseFloor
    at: Fit
    model: ProbedModel
    cost: TrajectoryCost
    blocks: dict[str, Array] = field(default_factory=dict)
    scales: dict[str, Array] = field(default_factory=dict)
    kept: dict[str, Indices] = field(default_factory=dict)
    """Which columns of a block the trials feel at all."""
    terms: dict[str, list[Term]] = field(default_factory=dict)
    found: list[Probe] = field(default_factory=list)
    screens: dict[str, Screen] = field(default_factory=dict)

    def errors(self, x: Array, terms: Mapping[str, float]) -> Array:
        """Whitened errors (rows,) of the probed model, from an x of the problem and values of terms."""
        values = {**dict(zip(self.problem.names, x.tolist())), **terms}
        named = np.array([values.get(name, 0.0) for name in self.cost.names])
        return self.floor.whiten(self.cost.residuals(named)[: self.problem.rows])

    def best(self, *kinds: str) -> Probe:
        return max((p for p in self.found if not kinds or p.kind in kinds), key=lambda p: p.gain)

    def average(self, *kinds: str) -> float:
        """Log of the mean evidence ratio over these probes, each as likely as the others before."""
        gains = np.array([p.gain for p in self.found if not kinds or p.kind in kinds])
        return _log_mean(gains)

    def posterior(self, label: str, size: float) -> tuple[Array, Array]:
        """Most probable values (n,) of a block's columns, and their deviations."""
        one, scale = self.screens[label], self.scales[label]
        at = one.columns[label]
        precision = one.information[np.ix_(at, at)] + np.diag(1.0 / (size * scale) ** 2)
        covariance = np.linalg.inv(precision)
        return covariance @ one.slope[at], np.sqrt(np.maximum(np.diag(covariance), 0.0))


def probes(problem: GapProblem, floor: NoiseFloor, at: Fit) -> Probes:
    """Probes everything at a fit."""
    duration = max(trial.duration for trial in problem.trials)
    scales = _usual(problem, at)
    terms = terms_of(problem.study.model)
    model = ProbedModel(problem.model, KNOTS, duration, terms, scales)
    values = dict(zip(problem.names, at.x))
    known = {p.name for p in problem.parameters}
    extra = [p.replace(vary=True, prior=Prior(0.0, 1.0)) for p in model.parameters if p.name not in known]
    cost = problem.cost_of(model, extra, values)
    x = np.array([values.get(name, 0.0) for name in cost.names])
    derivatives = cost.jacobian(x)[: problem.rows]
    column = {name: k for k, name in enumerate(cost.names)}
    found = Probes(problem, floor, at, model, cost)
    rates = _rates(problem, at)
    for place in model.places:
        one = derivatives[:, [column[name] for name in place.names]]
        usual = rates.get(place.state, 0.0) if place.state else scales[place.channel]
        found.blocks[place.label] = floor.whiten(_by_trial(problem, one))
        found.scales[place.label] = np.full(found.blocks[place.label].shape[1], max(usual, 1e-12))
        _add(found, place.label, "place")
    for state, label in equations(problem.study.model).items():
        own = [term for term in terms if term.state == state]
        name = f"terms:{label}"
        found.terms[name] = own
        found.blocks[name] = floor.whiten(derivatives[:, [column[term.name] for term in own]])
        found.scales[name] = np.full(len(own), max(rates.get(state, 0.0), 1e-12))
        _add(found, name, "terms")
    for k, channel in enumerate(problem.outputs):
        rows = problem.channel_of == k
        if not rows.any():
            continue
        hats = _hats(problem.time_of, model.spacing, KNOTS) * rows[:, None]
        label = f"sensor:{channel}"
        found.blocks[label] = floor.whiten(_by_trial(problem, -hats))
        found.scales[label] = np.full(found.blocks[label].shape[1], 30.0 * floor.sd[channel])
        _add(found, label, "sensor")
    return found


def _add(found: Probes, label: str, kind: str) -> None:
    """Screens one block and takes its evidence over the ladder of sizes."""
    block, scale = found.blocks[label], found.scales[label]
    kept = np.flatnonzero(np.abs(block).max(axis=0) > 0)
    found.blocks[label], found.scales[label], found.kept[label] = block[:, kept], scale[kept], kept
    # A run that is about to diverge feels a push so strongly that no number holds its square.
    if not kept.size or not np.isfinite(block).all() or np.abs(block).max() > _LARGEST:
        return
    one = screen(found.at, found.problem, {label: block[:, kept]}, {label: scale[kept]})
    found.screens[label] = one
    root = np.sqrt(scale[kept])
    values, vectors = np.linalg.eigh(one.information * np.outer(root, root))
    values = np.maximum(values, 0.0)
    along = (vectors.T @ (one.slope * root)) ** 2
    gains = []
    for size in LADDER:
        # prior covariance size^2 scale^2 = (size^2 scale) * scale: with equal scales this is exact
        weight = size**2 * float(scale[kept].mean())
        gains.append(
            0.5 * float((along * weight / (1.0 + weight * values)).sum()) - 0.5 * float(np.log1p(weight * values).sum())
        )
    best = int(np.argmax(gains))
    found.found.append(Probe(label, _log_mean(np.array(gains)), LADDER[best], kind))


def _log_mean(gains: Array) -> float:
    top = float(gains.max(initial=-math.inf))
    if not math.isfinite(top):
        return -math.inf
    return top + math.log(float(np.exp(gains - top).mean()))


def _by_trial(problem: GapProblem, columns: Array) -> Array:
    """Columns (rows, n) to columns of each trial's own (rows, n trials)."""
    parts = [columns * (problem.trial_of == k)[:, None] for k in range(len(problem.trials))]
    return np.concatenate(parts, axis=1)


def _hats(t: Array, spacing: float, knots: int) -> Array:
    return np.maximum(0.0, 1.0 - np.abs(t[:, None] / spacing - np.arange(knots)))


def _usual(problem: GapProblem, at: Fit) -> dict[str, float]:
    """Root mean square of each state and input over all trials; 1 where it is zero throughout."""
    states = np.concatenate(problem.states(at.x))
    found = {c.name: _rms(states[:, k]) for k, c in enumerate(problem.model.states)}
    for channel in problem.model.inputs:
        found[channel.name] = _rms(np.concatenate([np.asarray(t.inputs[channel.name]) for t in problem.trials]))
    return found


def _rates(problem: GapProblem, at: Fit) -> dict[str, float]:
    """Usual size of each state's rate: its root mean square along the trials."""
    found: dict[str, float] = {}
    states = problem.states(at.x)
    for k, channel in enumerate(problem.model.states):
        parts = [np.gradient(s[:, k], t.t) for s, t in zip(states, problem.trials)]
        found[channel.name] = _rms(np.concatenate(parts))
    return found


def _rms(values: Array) -> float:
    finite = values[np.isfinite(values)]
    size = float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0
    return size if size > 0.0 else 1.0
