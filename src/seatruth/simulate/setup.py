"""What every backend shares: which parameters a candidate sets, the recorded outputs, the initial states."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.simulate.first_slope import first_slope
from seatruth.simulate.first_velocity import first_velocity
from seatruth.trials.trial import Trial


@dataclass(frozen=True, eq=False)
class ParameterLayout:
    """Which parameters a candidate sets, and the values of all.

    `names` (n_parameters) in the model's order; `free` (K) those that a candidate sets, at `columns` (K,) among them;
    `fixed` (n_parameters,) the values of the others.
    """

    names: tuple[str, ...]
    free: tuple[str, ...]
    fixed: Array
    columns: Indices

    def values(self, theta: Array) -> Array:
        """All parameters of every candidate: (P, K) -> (P, n_parameters)."""
        values = np.empty((len(theta), self.fixed.size))
        values[:] = self.fixed
        values[:, self.columns] = theta
        return values


def parameter_layout(model: Model, free: Sequence[str], values: Mapping[str, float]) -> ParameterLayout:
    """Checks names and values; BadInput names what is unknown, missing or not finite."""
    names = tuple(parameter.name for parameter in model.parameters)
    place, freed = {name: k for k, name in enumerate(names)}, set(free)
    where = f"model {model.name!r}"
    for name in (*free, *values):
        if name not in place:
            raise BadInput(f"it has no parameter {name!r}", where=where, do=nearest(name, names))
    missing = [name for name in names if name not in values and name not in freed]
    if missing:
        raise BadInput(f"parameter {missing[0]!r} has no value", where=where, do="Give it one in `values`.")
    if len(freed) != len(free):
        raise BadInput("a free parameter is named twice", where=where, do="Name each one once.")
    fixed = np.array([float(values.get(name, math.nan)) for name in names])
    needed = np.array([name not in freed for name in names])
    if names and not np.isfinite(fixed[needed]).all():
        bad = names[int(np.flatnonzero(needed & ~np.isfinite(fixed))[0])]
        raise BadInput(f"parameter {bad!r} is {values[bad]}", where=where, do="Give it a finite value.")
    columns = np.array([place[name] for name in free], dtype=np.intp)
    return ParameterLayout(names, tuple(free), fixed, columns)


@dataclass(frozen=True, eq=False)
class Setup:
    """A model bound to trials and parameters, before a backend is chosen. See `Simulator` for the attributes.

    `nominal`: a value of every parameter, with which a model computes initial states that depend on parameters.
    """

    model: Model
    trials: tuple[Trial, ...]
    parameters: ParameterLayout
    rows: list[slice]
    measured: Array
    nominal: Mapping[str, float]

    @cached_property
    def initial_states(self) -> Array:
        """Initial states (T, S) from the trials' first valid samples.

        A speed that was never recorded is that of the first positions; `Model.complete` adds other outputs.
        """
        states = np.zeros((len(self.trials), len(self.model.states)))
        places = {channel.name: k for k, channel in enumerate(self.model.states)}
        for row, trial in enumerate(self.trials):
            first = {channel.name: _first_valid(trial, channel.name) for channel in self.model.outputs}
            y = {name: value for name, value in first.items() if value is not None}
            y = first_velocity(self.model, trial) | y
            i = {channel.name: float(trial.inputs[channel.name][0]) for channel in self.model.inputs}
            states[row] = self.model.first_state(y, i, self.nominal)
            for state, slope in self.model.slopes.items():
                states[row, places[state]] += slope.factor * first_slope(trial, slope.output, slope.seconds)
        return states

    @property
    def assumed_zero(self) -> tuple[tuple[str, str], ...]:
        """(trial, channel) of the outputs that were never recorded, nor follow from positions."""
        found: list[tuple[str, str]] = []
        for trial in self.trials:
            known = first_velocity(self.model, trial)
            unrecorded = (c.name for c in self.model.outputs if _first_valid(trial, c.name) is None)
            found += [(trial.name, name) for name in unrecorded if name not in known]
        return tuple(found)

    def changed(
        self,
        free: Sequence[str] | None,
        values: Mapping[str, float] | None,
        trials: Sequence[Trial] | None,
    ) -> Setup:
        """The same model with other free parameters, values or trials; None leaves them."""
        return set_up(
            self.model,
            self.trials if trials is None else trials,
            self.parameters.free if free is None else free,
            self.nominal if values is None else values,
        )

    def population(self, theta: Array) -> Array:
        """theta as (P, K); ValueError for another shape."""
        theta = np.ascontiguousarray(theta, dtype=np.float64)
        if theta.ndim != 2 or theta.shape[1] != len(self.parameters.free):
            raise ValueError(f"theta has shape {theta.shape}, (P, {len(self.parameters.free)}) is needed")
        return theta

    def candidate(self, theta: Array) -> Array:
        """theta (K,) as a population of one, (1, K); ValueError for another shape."""
        theta = np.asarray(theta, dtype=np.float64)
        if theta.shape != (len(self.parameters.free),):
            raise ValueError(f"theta has shape {theta.shape}, ({len(self.parameters.free)},) is needed")
        return theta[None]

    def starts(self, x0: Array, size: int) -> Array:
        """x0, (T, S) or (P, T, S), as (P, T, S) for P = `size` candidates; ValueError for another shape."""
        x0 = np.asarray(x0, dtype=np.float64)
        shape = (len(self.trials), len(self.model.states))
        if x0.shape not in (shape, (size, *shape)):
            raise ValueError(f"x0 has shape {x0.shape}, {shape} or {(size, *shape)} is needed")
        return x0 if x0.ndim == 3 else np.broadcast_to(x0, (size, *shape))

    def weights(self, weights: Array) -> Array:
        """weights as (N, D), zero where a sample is not valid; ValueError for another shape."""
        if np.shape(weights) != self.measured.shape:
            raise ValueError(f"weights have shape {np.shape(weights)}, {self.measured.shape} is needed")
        return np.ascontiguousarray(np.where(np.isfinite(self.measured), weights, 0.0))

    def state_columns(self, free_states: Sequence[str]) -> list[int]:
        """Places of the named states; BadInput for one that the model does not have."""
        names = [channel.name for channel in self.model.states]
        for name in free_states:
            if name not in names:
                raise BadInput(f"model {self.model.name!r} has no state {name!r}", do=nearest(name, names))
        return [names.index(name) for name in free_states]

    def following(self, free_states: Sequence[str]) -> list[tuple[int, int, float]]:
        """Hidden states that move with a free one: (place among `free_states`, the hidden state's column, sign)."""
        names = [channel.name for channel in self.model.states]
        return [
            (list(free_states).index(leader), names.index(follower), sign)
            for follower, (leader, sign) in self.model.follows.items()
            if leader in free_states and follower not in free_states
        ]


def set_up(model: Model, trials: Sequence[Trial], free: Sequence[str], values: Mapping[str, float]) -> Setup:
    """Binds a model to trials; BadInput where a parameter, an input or a sample is missing."""
    parameters = parameter_layout(model, free, values)
    if not trials:
        raise BadInput("there is no trial to simulate", do="Add one.")
    for trial in trials:
        _check(model, trial)
    edges = np.concatenate([[0], np.cumsum([len(trial) for trial in trials])])
    nominal = {parameter.name: float(values.get(parameter.name, parameter.value)) for parameter in model.parameters}
    rows = [slice(int(start), int(stop)) for start, stop in pairwise(edges)]
    return Setup(model, tuple(trials), parameters, rows, _measured(model, trials), nominal)


def _check(model: Model, trial: Trial) -> None:
    where = f"trial {trial.name!r}"
    if not len(trial):
        raise BadInput("it has no samples", where=where, do="Leave it out.")
    for channel in model.inputs:
        if channel.name not in trial.inputs:
            hint = nearest(channel.name, [*trial.inputs, *trial.outputs])
            raise BadInput(f"it has no input {channel.name!r}", where=where, do=hint)


def _first_valid(trial: Trial, channel: str) -> float | None:
    """The first finite sample of an output; None where there is none."""
    column = trial.outputs.get(channel)
    valid = np.flatnonzero(np.isfinite(column)) if column is not None else np.zeros(0, dtype=int)
    return None if column is None or not valid.size else float(column[valid[0]])


def _measured(model: Model, trials: Sequence[Trial]) -> Array:
    """Recorded outputs of all trials, (N, D)."""
    parts = []
    for trial in trials:
        unrecorded = np.full(len(trial), math.nan)
        parts.append(np.stack([trial.outputs.get(channel.name, unrecorded) for channel in model.outputs], axis=1))
    measured = np.concatenate(parts)
    return np.where(np.isfinite(measured), measured, math.nan)
