"""Derivatives of a black box from as few runs as will do.

A column of derivatives costs a run of all trials, and a diagnosis asks for a hundred of them at every step of every
fit. All fits simulate much the same motion, since all follow the same record. So the columns of one point serve others
too: the chord method (Ortega and Rheinboldt, Iterative Solution of Nonlinear Equations in Several Variables, 1970,
section 10.2). Columns of coefficients and effects are computed anew where they do not predict what the simulator gives;
those of missing forces and initial states, which are many and depend on the motion alone, where the motion is another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.equations import equations
from seatruth.diagnosis.discrepancy.model import can_carry, humps_of, scales_of
from seatruth.diagnosis.discrepancy.terms import terms_of
from seatruth.diagnosis.settings import Settings
from seatruth.effects import Effect
from seatruth.effects.base import CHANGES
from seatruth.models.black_box import BlackBox
from seatruth.simulate import BlackBoxSimulator
from seatruth.study import Study
from seatruth.trials.prepare.outliers import MAD_TO_SD

if TYPE_CHECKING:
    from seatruth.diagnosis.problem import Point, Problem

GOOD = 0.15
"""Error of a predicted change over the change, below which the columns that predicted it are used. [S] A Gauss-Newton
step with columns that far off still takes seven eighths of the way."""
BELOW_NOISE = 0.5
"""The same as a part of the noise: what the trials do not show decides nothing. [S]"""
LENT = 0.5
"""The same, below which columns of missing forces, which are many, are lent to another point. [S] Steps with them come
half as near as they would with its own."""
NEAR = 0.1
"""Distance of two motions, over the spread of the record, within which they share the columns of missing forces. [S]"""
_LEAST_NOISE = 1e-3
"""Noise over the spread of a record that is taken at least: exact records would want exact columns. [S]"""
_SAME = 1e-3
"""Change over the noise, below which two points are one. [S]"""
_COMPARED = 4
"""Points, the nearest, whose predictions are compared. [S]"""
_KEPT = 10
"""Points whose columns are kept: the first two, of the model alone, and the last ones. [S]"""
_AT_ONCE = 32
"""Candidates in memory at a time. [S]"""


@dataclass
class _Base:
    """A point, its outputs (N,) at the valid samples, and columns of derivatives (N,) by name."""

    point: Point
    y: Array
    columns: dict[str, Array] = field(default_factory=dict)
    borrowed: bool = False
    """Whether its columns of missing forces and initial states are those of another motion nearby."""


class FewRuns:
    """Outputs and derivatives of a problem whose model is a black box."""

    def __init__(self, problem: Problem, simulator: BlackBoxSimulator) -> None:
        self._problem, self._simulator = problem, simulator
        self._bases: list[_Base] = []
        self._outputs: list[tuple[Point, Array]] = []
        self._noise: float | None = None
        self._scales: tuple[Array, Array] | None = None
        self._renewed, self._own = False, False
        """Whether the next columns are to be their point's own, and whether the last ones were."""
        free = [effect for effect in problem.effects.values() if _only_outputs(effect)]
        self.without_run = {effect.named(q.name) for effect in free for q in effect.parameters}
        """Parameters of effects that change outputs alone: a run that is kept shows what they do."""

    def outputs(self, point: Point) -> Array:
        """Simulated outputs (samples, C) at a point; asked again for the same point, it costs no run."""
        for known, y in reversed(self._outputs):
            if known is point or _equal(known, point):
                return y
        bound = self._problem.bound(point, self._problem.space.varying)
        y = bound.outputs(self._problem.theta(point)[None], self._problem.start_states(point)).y[0]
        self._outputs = [*self._outputs[-2:], (point, y)]
        return np.asarray(y)

    def linearize(self, point: Point, names: Sequence[str]) -> tuple[Array, Array]:
        """Outputs (samples, C), and derivatives (N, K + I) at the valid samples by parameters and initial states."""
        problem = self._problem
        whole = self.outputs(point)
        y = whole[problem.valid]
        initial = [_initial(name) for name in problem.initial_names]
        keys = [*names, *initial]
        if not np.isfinite(y).all():
            return whole, np.zeros((len(y), len(keys)))
        forces = self._missing_forces()
        moving = [key for key in keys if key in forces or key in initial]
        own = [key for key in keys if key not in set(moving)]
        near = sorted(self._bases, key=lambda base: self._distance(base, y))
        renewed, self._renewed = self._renewed, False
        good = (one for one in near[:_COMPARED] if self._misprediction(one, one.columns, point, y) < GOOD)
        base = None if renewed else next(good, None)
        if base is None:
            base = _Base(point, y)
            if renewed:
                self._bases = [one for one in self._bases if not (one.borrowed and np.array_equal(one.y, y))]
            self._bases = [*self._bases[:2], *self._bases[2:][-(_KEPT - 3) :], base]
        self._complete(base, own)
        lender = next((one for one in near if one.columns.keys() >= set(moving)), None)
        if not renewed and lender is not None and not base.columns.keys() >= set(moving):
            self._borrow(base, lender, moving)
        self._complete(base, moving)
        self._own = base.point is point and not base.borrowed
        columns = base.columns
        found = np.stack([columns[key] for key in keys], axis=1) if keys else np.zeros((len(y), 0))
        return whole, found

    @property
    def lent(self) -> bool:
        """Whether the last columns are, in part, those of another point."""
        return not self._own

    def renew(self) -> None:
        """Has the next columns computed at their own point."""
        self._renewed = True

    def _missing_forces(self) -> set[str]:
        model = self._problem.discrepancy
        if model is None:
            return set()
        return {*(term.name for term in model.terms), *(name for names in model.knot_names.values() for name in names)}

    def _distance(self, base: _Base, y: Array) -> float:
        """Distance of two motions over the spread of the record."""
        spread, _ = self._channel_scales()
        return float(np.sqrt(np.mean(((y - base.y) / spread) ** 2)))

    def _borrow(self, base: _Base, lender: _Base, keys: Sequence[str]) -> None:
        """Gives a base the columns of missing forces and initial states of another, where these lead near enough."""
        columns = {**{key: lender.columns[key] for key in keys}, **base.columns}
        near = self._distance(lender, base.y) < NEAR
        if near and self._misprediction(lender, columns, base.point, base.y) < LENT:
            base.columns, base.borrowed = columns, True

    def _steps(self, start: Point, end: Point) -> dict[str, Array]:
        """How far each unknown moves between two points, at every error (N,); those that do not move are left out."""
        problem = self._problem
        found: dict[str, Array] = {}
        for name, step in zip(problem.space.varying, problem.theta(end) - problem.theta(start)):
            if step != 0.0:
                found[name] = np.full(problem.count, step)
        starts, forces = end.initial - start.initial, end.forces - start.forces
        for k, name in enumerate(problem.initial_names):
            if starts[:, k].any():
                found[_initial(name)] = starts[problem.trial_of, k]
        model = problem.discrepancy
        for e, names in enumerate(model.knot_names.values() if model is not None else ()):
            for k, name in enumerate(names):
                if forces[:, e, k].any():
                    found[name] = forces[problem.trial_of, e, k]
        return found

    def _misprediction(self, base: _Base, columns: dict[str, Array], point: Point, y: Array) -> float:
        """Which part of the change from a base to the outputs (N,) at a point its columns do not predict.

        0 where that is no more than noise, inf where a column is lacking.
        """
        _, noise = self._channel_scales()
        change = y - base.y
        size = float(np.sqrt(np.mean((change / noise) ** 2)))
        if size < _SAME:
            return 0.0
        left = change.copy()
        for name, step in self._steps(base.point, point).items():
            if name not in columns:
                return math.inf
            left -= columns[name] * step
        error = float(np.sqrt(np.mean((left / noise) ** 2)))
        return 0.0 if error < BELOW_NOISE else error / size

    def _channel_scales(self) -> tuple[Array, Array]:
        """Spread and noise (N,) of each error's channel in the record."""
        if self._scales is None:
            problem = self._problem
            spread, noise = np.ones(len(problem.outputs)), np.ones(len(problem.outputs))
            for c, name in enumerate(problem.outputs):
                own = problem.measured[problem.valid][problem.channel_of == c]
                spread[c] = float(np.ptp(own)) if own.size and np.ptp(own) > 0.0 else 1.0
                stated = problem.study.noise.get(name)
                second = np.abs(np.diff(own, n=2))
                # Second differences of white noise have variance 6 sd^2.
                guess = MAD_TO_SD * float(np.median(second)) / math.sqrt(6.0) if second.size else 0.0
                noise[c] = max(stated if isinstance(stated, float) else guess, _LEAST_NOISE * spread[c])
            self._scales = spread[problem.channel_of], noise[problem.channel_of]
        return self._scales

    def _complete(self, base: _Base, keys: Sequence[str]) -> None:
        """Computes the columns that a base lacks, by forward differences, all in one population."""
        for without_run in (False, True):
            lacking = [k for k in keys if k not in base.columns and (k in self.without_run) == without_run]
            for first in range(0, len(lacking), _AT_ONCE):
                self._compute(base, lacking[first : first + _AT_ONCE], without_run)

    def _compute(self, base: _Base, keys: Sequence[str], without_run: bool) -> None:
        problem = self._problem
        varying = dict(zip(problem.space.varying, problem.theta(base.point)))
        names = [key for key in keys if key in varying]
        bound = problem.bound(base.point, names)
        assert isinstance(bound, BlackBoxSimulator)
        if without_run:
            bound = bound.unmetered()
        theta, start = np.array([varying[name] for name in names]), problem.start_states(base.point)
        if self._noise is None:
            self._noise = bound.noise(theta, start)
        part = math.sqrt(self._noise)
        thetas, starts = np.repeat(theta[None], len(keys), axis=0), np.repeat(start[None], len(keys), axis=0)
        steps = np.empty(len(keys))
        for row, key in enumerate(keys):
            steps[row] = part * self._size(key, varying.get(key, 0.0))
            if key in varying:
                thetas[row, names.index(key)] += steps[row]
            else:
                k = [_initial(name) for name in problem.initial_names].index(key)
                moved = base.point.initial.copy()
                moved[:, k] += steps[row]
                starts[row] = problem.start_states(type(base.point)(base.point.shared, moved, base.point.forces))
        found = bound.outputs(thetas, starts).y
        for row, key in enumerate(keys):
            column = (found[row][problem.valid] - base.y) / steps[row]
            base.columns[key] = np.where(np.isfinite(column), column, 0.0)

    def _size(self, key: str, value: float) -> float:
        """How far a parameter or an initial state usually reaches: what a difference's step is a part of."""
        problem = self._problem
        for k, name in enumerate(problem.initial_names):
            if key == _initial(name):
                return max(float(problem.initial_sd[k]) / problem.settings.initial_width, 1e-12)
        for k, unknown in enumerate(problem.unknowns):
            if unknown.name == key:
                at = problem.terms.tolist().index(k) if k in problem.terms else -1
                usual = float(problem.usual[problem.term_equation[at]]) if at >= 0 else float(problem.sd[k])
                return max(abs(value), usual)
        model = problem.discrepancy
        for e, names in enumerate(model.knot_names.values() if model is not None else ()):
            if key in names:
                return float(problem.usual[e])
        return abs(value) or 1.0


_FITS = 70
"""Fits of a diagnosis: of the model alone, ten effects, sets of them, each with and without missing forces, and the
prediction of trials left out. experiments/one_vehicle_four_ways.py measures what they take."""
_STEPS = 6
"""Runs of a fit beside its columns. [S]"""


def expected_evaluations(study: Study, effects: Sequence[Effect], settings: Settings) -> int:
    """About how many simulations of all trials a diagnosis of a black box takes; 0 for equations.

    Every column of derivatives is computed about twice, and each fit has steps, and columns of its own.
    """
    if not isinstance(study.model, BlackBox):
        return 0
    free = len(study.space.free)
    columns = free + len(study.model.states)
    columns += sum(len(effect.parameters) for effect in effects if not _only_outputs(effect))
    if can_carry(study.model):
        humps = humps_of(study.model, study.trials, scales_of(study.model, study.trials))
        columns += len(terms_of(study.model, humps)) + settings.knots * len(equations(study.model))
    return 2 * columns + _FITS * (_STEPS + (free + 2) // 2)


def _initial(name: str) -> str:
    return f"initial {name}"


def _only_outputs(effect: Effect) -> bool:
    """Whether an effect changes what sensors show, and nothing else."""
    return all(hook is None for hook in (getattr(effect, name) for name in CHANGES if name != "measured_outputs"))


def _equal(one: Point, other: Point) -> bool:
    return (
        np.array_equal(one.shared, other.shared)
        and np.array_equal(one.initial, other.initial)
        and np.array_equal(one.forces, other.forces)
    )
