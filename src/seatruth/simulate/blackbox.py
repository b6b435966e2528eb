"""The same interface for a user's own simulator: one run a candidate and trial, derivatives by differences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.simulate.engine import Jacobian, Outputs, Sums, first_states, measurements, setting
from seatruth.trials.trial import Trial

_REACH = 6.0e-6
"""Relative reach of a central difference: the cube root of the rounding error."""


class BlackBoxSimulator:
    """Simulates a BlackBox. A state's value at a trial's end is that of the output of the same name."""

    def __init__(
        self, model: BlackBox, trials: Sequence[Trial], free: Sequence[str], values: Mapping[str, float], threads: int
    ) -> None:
        if not trials:
            raise BadInput("there is no trial to simulate", do="Add one.")
        for trial in trials:
            for channel in model.inputs:
                if channel.name not in trial.inputs:
                    hint = nearest(channel.name, [*trial.inputs, *trial.outputs])
                    raise BadInput(f"it has no input {channel.name!r}", where=f"trial {trial.name!r}", do=hint)
        self.model: Model = model
        self._box, self.trials, self.threads = model, tuple(trials), threads
        self.setting = setting(model, free, values)
        self.free = self.setting.free
        edges = np.concatenate([[0], np.cumsum([len(trial) for trial in trials])])
        self.rows = [slice(int(a), int(b)) for a, b in pairwise(edges)]
        self.steps = int(edges[-1]) - len(trials)
        self.measured = measurements(model, trials)
        self.first_states, self.assumed = first_states(model, trials, values)
        names = [channel.name for channel in model.outputs]
        self._ends = [names.index(state.name) for state in model.states]

    def sums(self, theta: Array, x0: Array, weights: Array) -> Sums:
        """Weighted sums of squares of measured less simulated; inf where a run was not finite."""
        found = self.outputs(theta, x0)
        valid = np.isfinite(self.measured)
        squares = np.zeros((len(theta), len(self.trials), self.measured.shape[1]))
        for k, rows in enumerate(self.rows):
            error = np.where(valid[rows], self.measured[rows] - found.y[:, rows], 0.0) * weights[rows]
            squares[:, k] = (error**2).sum(axis=1)
        squares[found.diverged] = math.inf
        return Sums(squares, found.end, found.diverged)

    def outputs(self, theta: Array, x0: Array) -> Outputs:
        """Simulated outputs of every candidate."""
        theta = np.asarray(theta, dtype=np.float64)
        x0 = np.broadcast_to(np.asarray(x0, dtype=np.float64), (len(theta), *self.first_states.shape))
        y = np.empty((len(theta), *self.measured.shape))
        end = np.empty((len(theta), *self.first_states.shape))
        diverged = np.zeros((len(theta), len(self.trials)), dtype=np.bool_)
        values = self.setting.values(theta)
        names = [state.name for state in self.model.states]
        for candidate in range(len(theta)):
            parameters = dict(zip(self.setting.names, values[candidate].tolist()))
            for k, (trial, rows) in enumerate(zip(self.trials, self.rows)):
                first = dict(zip(names, x0[candidate, k].tolist())) if names else None
                found = self._box.run(trial, parameters, first)
                y[candidate, rows] = found
                end[candidate, k] = found[-1, self._ends]
                diverged[candidate, k] = not np.isfinite(found).all()
        return Outputs(y, end, diverged)

    def states(self, theta: Array, x0: Array) -> Array:
        """States at every sample (N, S): the outputs of the same names."""
        return np.asarray(self.outputs(np.asarray(theta)[None], x0).y[0][:, self._ends])

    def jacobian(self, theta: Array, x0: Array, free_states: Sequence[str] = ()) -> Jacobian:
        """Outputs and central differences: two runs a free parameter and free initial state."""
        theta = np.asarray(theta, dtype=np.float64)
        x0 = np.asarray(x0, dtype=np.float64)
        names = [state.name for state in self.model.states]
        for name in free_states:
            if name not in names:
                raise BadInput(f"model {self.model.name!r} has no state {name!r}", do=nearest(name, names))
        kept = [names.index(name) for name in free_states]
        size = len(theta) + len(kept)
        base = self.outputs(theta[None], x0)
        dy = np.empty((*self.measured.shape, size))
        dend = np.empty((*self.first_states.shape, size))
        for column in range(size):
            ahead, behind = (self._moved(theta, x0, kept, column, sign) for sign in (1.0, -1.0))
            reach = 2.0 * self._reach(theta, x0, kept, column)  # (T,)
            for k, rows in enumerate(self.rows):
                dy[rows, :, column] = (ahead.y[0, rows] - behind.y[0, rows]) / reach[k]
                dend[k, :, column] = (ahead.end[0, k] - behind.end[0, k]) / reach[k]
        return Jacobian(base.y[0], dy, base.end[0], dend, base.diverged[0])

    def discretisation_error(self, theta: Array, x0: Array) -> Array:
        """Not known of a black box: NaN for every output, (D,)."""
        return np.full(self.measured.shape[1], math.nan)

    def _reach(self, theta: Array, x0: Array, kept: list[int], column: int) -> Array:
        if column < len(theta):
            name = self.free[column]
            size = abs(theta[column]) or abs(self.model.parameter(name).value) or 1.0
            return np.full(len(self.trials), _REACH * size)
        return np.asarray(_REACH * np.maximum(1.0, np.abs(x0[:, kept[column - len(theta)]])))

    def _moved(self, theta: Array, x0: Array, kept: list[int], column: int, sign: float) -> Outputs:
        reach = sign * self._reach(theta, x0, kept, column)
        theta, x0 = theta.copy(), x0.copy()
        if column < len(theta):
            theta[column] += reach[0]
        else:
            x0[:, kept[column - len(theta)]] += reach
        return self.outputs(theta[None], x0)
