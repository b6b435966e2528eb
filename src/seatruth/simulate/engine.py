"""The one engine: a population of candidates through all trials in one compiled call."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array, Flags
from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.simulate.compiler.program import Program, program
from seatruth.simulate.grid import Hold, grid
from seatruth.trials.trial import Trial

_MOST_RECORD = 256 * 1024 * 1024
"""Bytes of lanes that a recording call holds at a time."""


class Sums(NamedTuple):
    """`squares` (P, T, D) weighted sums of squares, inf where diverged; `end` (P, T, S) last states."""

    squares: Array
    end: Array
    diverged: Flags


class Outputs(NamedTuple):
    """`y` (P, N, D) simulated outputs; `end` (P, T, S) last states; `diverged` (P, T)."""

    y: Array
    end: Array
    diverged: Flags


class Jacobian(NamedTuple):
    """`y` (N, D), `dy` (N, D, K + F), `end` (T, S), `dend` (T, S, K + F), `diverged` (T,).

    Column K + j of the rows of trial t is the derivative by the trial's own initial state, the j-th of the free ones.
    """

    y: Array
    dy: Array
    end: Array
    dend: Array
    diverged: Flags


class Simulator(Protocol):
    """A model on some trials, ready to run; made by `simulator`.

    Shapes: P candidates, K free parameters, T trials, N samples in all, S states, D outputs.
    """

    model: Model
    free: tuple[str, ...]
    rows: list[slice]
    """Samples of each trial among the N."""
    measured: Array
    """(N, D), NaN where a sample is not valid or the channel was not recorded."""
    first_states: Array
    """(T, S) from the trials' first samples."""
    assumed: tuple[tuple[str, str], ...]
    """(trial, channel): outputs that were not recorded and count as zero in the first state."""
    steps: int
    """Runge-Kutta steps of one candidate through all trials."""

    def sums(self, theta: Array, x0: Array, weights: Array) -> Sums: ...

    def outputs(self, theta: Array, x0: Array) -> Outputs: ...

    def states(self, theta: Array, x0: Array) -> Array: ...

    def jacobian(self, theta: Array, x0: Array, free_states: Sequence[str] = ()) -> Jacobian: ...

    def discretisation_error(self, theta: Array, x0: Array) -> Array: ...

    def change_inputs(self, trials: Sequence[Trial]) -> None: ...


@dataclass(frozen=True)
class Setting:
    """Which parameters a candidate sets, and the values of all."""

    names: tuple[str, ...]
    free: tuple[str, ...]
    nominal: Array
    columns: NDArray[np.intp]

    def values(self, theta: Array) -> Array:
        """All parameters of every candidate: (P, K) -> (P, n_parameters)."""
        found = np.empty((len(theta), self.nominal.size))
        found[:] = self.nominal
        found[:, self.columns] = theta
        return found


def setting(model: Model, free: Sequence[str], values: Mapping[str, float]) -> Setting:
    """Checks names and values; BadInput names what is unknown, missing or not finite."""
    names = tuple(parameter.name for parameter in model.parameters)
    where = f"model {model.name!r}"
    for name in (*free, *values):
        if name not in names:
            raise BadInput(f"it has no parameter {name!r}", where=where, do=nearest(name, names))
    missing = [name for name in names if name not in values and name not in free]
    if missing:
        raise BadInput(f"parameter {missing[0]!r} has no value", where=where)
    if len(set(free)) != len(free):
        raise BadInput("a free parameter is named twice", where=where)
    nominal = np.array([float(values.get(name, math.nan)) for name in names])
    fixed = np.array([name not in free for name in names])
    if names and not np.isfinite(nominal[fixed]).all():
        bad = names[int(np.flatnonzero(fixed & ~np.isfinite(nominal))[0])]
        raise BadInput(f"parameter {bad!r} is {values[bad]}", where=where)
    columns = np.array([names.index(name) for name in free], dtype=np.intp)
    return Setting(names, tuple(free), nominal, columns)


def first_states(
    model: Model, trials: Sequence[Trial], values: Mapping[str, float]
) -> tuple[Array, tuple[tuple[str, str], ...]]:
    """Initial state of each trial (T, S): from its first valid samples; an output never recorded counts as zero."""
    found = np.zeros((len(trials), len(model.states)))
    assumed = []
    for row, trial in enumerate(trials):
        y = {}
        for channel in model.outputs:
            column = trial.outputs.get(channel.name)
            valid = np.flatnonzero(np.isfinite(column)) if column is not None else np.zeros(0, dtype=int)
            if column is None or not valid.size:
                assumed.append((trial.name, channel.name))
                y[channel.name] = 0.0
            else:
                y[channel.name] = float(column[valid[0]])
        i = {channel.name: float(trial.inputs[channel.name][0]) for channel in model.inputs}
        found[row] = model.first_state(y, i, values)
    return found, tuple(assumed)


def measurements(model: Model, trials: Sequence[Trial]) -> Array:
    """Recorded outputs of all trials, (N, D)."""
    parts = []
    for trial in trials:
        nothing = np.full(len(trial), math.nan)
        parts.append(np.stack([trial.outputs.get(channel.name, nothing) for channel in model.outputs], axis=1))
    measured = np.concatenate(parts)
    return np.where(np.isfinite(measured), measured, math.nan)


class CompiledSimulator:
    """Simulates a model given by equations. See Simulator for shapes."""

    def __init__(
        self,
        model: Model,
        trials: Sequence[Trial],
        free: Sequence[str],
        values: Mapping[str, float],
        hold: Hold,
        max_step: float | None,
        threads: int,
    ) -> None:
        self.model, self.trials, self.threads = model, tuple(trials), threads
        self.setting = setting(model, free, values)
        self.free = self.setting.free
        self._hold, self._max_step = hold, max_step
        self.grid = grid(model, trials, hold, max_step)
        self.rows = self.grid.rows
        self.steps = self.grid.steps
        self.measured = measurements(model, trials)
        nominal = {name: float(values.get(name, model.parameter(name).value)) for name in self.setting.names}
        self.first_states, self.assumed = first_states(model, trials, nominal)
        self._aims: tuple[Array, Array, Array] | None = None

    @cached_property
    def _program(self) -> Program:
        return program(self.model)

    def change_inputs(self, trials: Sequence[Trial]) -> None:
        """The same trials with other values of their inputs: samples, times and the compiled program stay."""
        self.trials = tuple(trials)
        self.grid = grid(self.model, trials, self._hold, self._max_step)

    def sums(self, theta: Array, x0: Array, weights: Array) -> Sums:
        """Weighted sums of squares of measured less simulated: theta (P, K), x0 (T, S) or (P, T, S), weights (N, D)."""
        theta, x0 = self._checked(theta), self._first(x0, len(theta))
        weighted, weights = self._aim(weights)
        squares, end = self._program.sums(self.grid, self.setting.values(theta), x0, weighted, weights, self.threads)
        diverged: Flags = ~(_finite(squares) & _finite(end))
        if diverged.any():
            squares[diverged] = math.inf
        return Sums(squares, end, diverged)

    def outputs(self, theta: Array, x0: Array) -> Outputs:
        """Simulated outputs of every candidate; not-a-number from where it diverged."""
        theta, x0 = self._checked(theta), self._first(x0, len(theta))
        y = np.empty((len(theta), len(self.measured), len(self.model.outputs)))
        end = np.empty((len(theta), len(self.trials), len(self.model.states)))
        size = max(1, _MOST_RECORD // max(1, y[:1].nbytes))
        for k in range(0, len(theta), size):
            part = slice(k, k + size)
            y[part], end[part] = self._program.record(
                self.grid, self.setting.values(theta[part]), x0[part], self.threads, what="outputs"
            )
        return Outputs(y, end, self._diverged(y, end))

    def states(self, theta: Array, x0: Array) -> Array:
        """States at every sample, (N, S), of one candidate."""
        one = self._one(theta)
        first = self._first(np.asarray(x0, dtype=np.float64), 1)
        found, _ = self._program.record(self.grid, self.setting.values(one), first, self.threads, what="states")
        return np.asarray(found[0])

    def jacobian(self, theta: Array, x0: Array, free_states: Sequence[str] = ()) -> Jacobian:
        """Outputs and their exact derivatives by the free parameters and the named initial states of each trial."""
        one = self._one(theta)
        names = [channel.name for channel in self.model.states]
        for name in free_states:
            if name not in names:
                raise BadInput(f"model {self.model.name!r} has no state {name!r}", do=nearest(name, names))
        kept = [names.index(name) for name in free_states]
        first = self._first(np.asarray(x0, dtype=np.float64), 1)
        along = [
            (kept.index(names.index(state)), names.index(own), sign)
            for own, (state, sign) in self.model.follows.items()
            if names.index(state) in kept and own not in free_states
        ]
        found = self._program.jacobian(
            self.grid, self.setting.values(one)[0], first[0], self.setting.columns, kept, self.threads, along
        )
        finite = _finite(found.end)
        for k, rows in enumerate(self.rows):
            finite[k] &= bool(np.isfinite(found.y[rows]).all())
        return Jacobian(found.y, found.dy, found.end, found.dend, ~finite)

    def discretisation_error(self, theta: Array, x0: Array) -> Array:
        """Root mean square change (D,) of the outputs when every step is halved; NaN where the candidate diverges."""
        one = self._one(theta)
        first = self._first(np.asarray(x0, dtype=np.float64), 1)
        values = self.setting.values(one)
        coarse, _ = self._program.record(self.grid, values, first, self.threads, what="outputs")
        finer = grid(self.model, self.trials, self._hold, self._max_step, finer=2)
        fine, _ = self._program.record(finer, values, first, self.threads, what="outputs")
        return np.asarray(np.sqrt(np.mean((coarse[0] - fine[0]) ** 2, axis=0)))

    def _diverged(self, y: Array, end: Array) -> Flags:
        found: Flags = ~_finite(end)
        for k, rows in enumerate(self.rows):
            found[:, k] |= ~np.isfinite(y[:, rows]).all(axis=(1, 2))
        return found

    def _checked(self, theta: Array) -> Array:
        theta = np.ascontiguousarray(theta, dtype=np.float64)
        if theta.ndim != 2 or theta.shape[1] != len(self.free):
            raise ValueError(f"theta has shape {theta.shape}, (P, {len(self.free)}) is needed")
        return theta

    def _one(self, theta: Array) -> Array:
        theta = np.asarray(theta, dtype=np.float64)
        if theta.shape != (len(self.free),):
            raise ValueError(f"theta has shape {theta.shape}, ({len(self.free)},) is needed")
        return theta[None]

    def _first(self, x0: Array, size: int) -> Array:
        x0 = np.asarray(x0, dtype=np.float64)
        want = (len(self.trials), len(self.model.states))
        if x0.shape not in (want, (size, *want)):
            raise ValueError(f"x0 has shape {x0.shape}, {want} or {(size, *want)} is needed")
        return x0 if x0.ndim == 3 else np.broadcast_to(x0, (size, *want))

    def _aim(self, weights: Array) -> tuple[Array, Array]:
        """Weights, and weights times measurements, with samples that are not valid out of the sum."""
        known = self._aims
        if known is not None and known[0] is weights:
            return known[1], known[2]
        if weights.shape != self.measured.shape:
            raise ValueError(f"weights have shape {weights.shape}, {self.measured.shape} is needed")
        valid = np.isfinite(self.measured)
        clean = np.ascontiguousarray(np.where(valid, weights, 0.0))
        weighted = clean * np.where(valid, self.measured, 0.0)
        if not weights.flags.writeable:  # only then can it not change behind our back
            self._aims = (weights, weighted, clean)
        return weighted, clean


def _finite(values: Array) -> Flags:
    """Whether all numbers along the last axis are finite."""
    return np.asarray(np.isfinite(values).all(axis=-1))
