"""The compiled backend: a population of candidates through all trials in one compiled call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from seatruth.arrays import Array, Flags
from seatruth.models.base import Model
from seatruth.simulate.base import Jacobian, Outputs, SquaredErrors
from seatruth.simulate.compiler.program import Program, program
from seatruth.simulate.compiler.sensitivities import sensitivities
from seatruth.simulate.compiler.system import Directions
from seatruth.simulate.setup import Setup
from seatruth.simulate.time_grid import TimeGrid, time_grid, with_inputs
from seatruth.trials.channel import Hold
from seatruth.trials.trial import Trial

_MOST_RECORDED = 256 * 1024 * 1024
"""Bytes of outputs that one call of a kernel records; more candidates take several calls. Chosen here [S]."""


class CompiledSimulator:
    """Simulates a model of equations by kernels compiled from them; see `Simulator`. Derivatives are exact."""

    def __init__(
        self, setup: Setup, hold: Hold, max_step: float | None, threads: int, grid: TimeGrid | None = None
    ) -> None:
        self._setup = setup
        self.model: Model = setup.model
        self.free = setup.parameters.free
        self.rows = setup.rows
        self.measured = setup.measured
        self._hold, self._max_step, self._threads = hold, max_step, threads
        self._grid = time_grid(setup.model, setup.trials, hold, max_step) if grid is None else grid
        self.steps = self._grid.steps
        self._weighted: tuple[Array, Array, Array] | None = None

    @property
    def initial_states(self) -> Array:
        """See `Simulator.initial_states`."""
        return self._setup.initial_states

    @property
    def assumed_zero(self) -> tuple[tuple[str, str], ...]:
        """See `Simulator.assumed_zero`."""
        return self._setup.assumed_zero

    @cached_property
    def _program(self) -> Program:
        return program(self.model)

    def squared_errors(self, theta: Array, x0: Array, weights: Array) -> SquaredErrors:
        """See `Simulator.squared_errors`."""
        values, starts = self._values(theta), self._setup.starts(x0, len(theta))
        weighted_measured, clean = self._weights(weights)
        sums, x_end = self._program.squared_errors(self._grid, values, starts, weighted_measured, clean, self._threads)
        diverged: Flags = ~(_finite(sums) & _finite(x_end))
        if diverged.any():
            sums[diverged] = np.inf
        return SquaredErrors(sums, x_end, diverged)

    def outputs(self, theta: Array, x0: Array) -> Outputs:
        """See `Simulator.outputs`."""
        values, starts = self._values(theta), self._setup.starts(x0, len(theta))
        y = np.empty((len(values), *self.measured.shape))
        x_end = np.empty((len(values), len(self.rows), len(self.model.states)))
        size = max(1, _MOST_RECORDED // max(1, y[:1].nbytes))
        for k in range(0, len(values), size):
            part = slice(k, k + size)
            y[part], x_end[part] = self._program.record(
                self._grid, values[part], starts[part], self._threads, what="outputs"
            )
        diverged: Flags = ~_finite(x_end)
        for trial, rows in enumerate(self.rows):
            diverged[:, trial] |= ~np.isfinite(y[:, rows]).all(axis=(1, 2))
        return Outputs(y, x_end, diverged)

    def states(self, theta: Array, x0: Array) -> Array:
        """See `Simulator.states`."""
        values, starts = self._one(theta, x0)
        states, _ = self._program.record(self._grid, values, starts, self._threads, what="states")
        return np.asarray(states[0])

    def jacobian(
        self, theta: Array, x0: Array, free_states: Sequence[str] = (), *, last_states: bool = True
    ) -> Jacobian:
        """See `Simulator.jacobian`. The derivatives are exact to rounding."""
        values, starts = self._one(theta, x0)
        along = Directions(
            self._setup.parameters.columns,
            self._setup.state_columns(free_states),
            self._setup.following(free_states),
        )
        program, grid, threads = self._program, self._grid, self._threads
        if last_states:
            answer = program.jacobian(grid, values[0], starts[0], along, threads)
        else:
            answer = sensitivities(program).jacobian(program, grid, values[0], starts[0], along, threads)
        finite = _finite(answer.x_end)
        for trial, rows in enumerate(self.rows):
            finite[trial] &= bool(np.isfinite(answer.y[rows]).all())
        dx_end = answer.dx_end if last_states else answer.dx_end[:, :0]
        return Jacobian(answer.y, answer.dy, answer.x_end, dx_end, ~finite)

    def rebind(
        self,
        *,
        free: Sequence[str] | None = None,
        values: Mapping[str, float] | None = None,
        trials: Sequence[Trial] | None = None,
    ) -> CompiledSimulator:
        """See `Simulator.rebind`."""
        grid = self._grid if trials is None else self._grid_of(trials)
        changed = CompiledSimulator(
            self._setup.changed(free, values, trials), self._hold, self._max_step, self._threads, grid
        )
        changed.__dict__["_program"] = self._program
        return changed

    def _grid_of(self, trials: Sequence[Trial]) -> TimeGrid | None:
        """The grid of other trials where these differ from its own in inputs alone; None where it is made anew."""
        own, names = self._setup.trials, [channel.name for channel in self.model.inputs]
        pairs = list(zip(own, trials))
        same = len(own) == len(trials) and all(old.name == new.name and old.t is new.t for old, new in pairs)
        if not same or not all(name in new.inputs for new in trials for name in names):
            return None
        changed = {name for name in names if any(old.inputs[name] is not new.inputs[name] for old, new in pairs)}
        if changed & {*self.model.delays}:
            return None
        return with_inputs(self._grid, self.model, trials, changed, self._hold) if changed else self._grid

    def discretisation_error(self, theta: Array, x0: Array) -> Array:
        """See `Simulator.discretisation_error`."""
        values, starts = self._one(theta, x0)
        coarse, _ = self._program.record(self._grid, values, starts, self._threads, what="outputs")
        halved = time_grid(self.model, self._setup.trials, self._hold, self._max_step, finer=2)
        fine, _ = self._program.record(halved, values, starts, self._threads, what="outputs")
        return np.asarray(np.sqrt(np.mean((coarse[0] - fine[0]) ** 2, axis=0)))

    def _values(self, theta: Array) -> Array:
        """All parameters (P, n_parameters) of a population (P, K)."""
        return self._setup.parameters.values(self._setup.population(theta))

    def _one(self, theta: Array, x0: Array) -> tuple[Array, Array]:
        """All parameters (1, n_parameters) and initial states (1, T, S) of one candidate."""
        return self._setup.parameters.values(self._setup.candidate(theta)), self._setup.starts(x0, 1)

    def _weights(self, weights: Array) -> tuple[Array, Array]:
        """Measurements times weights, and the weights, both (N, D) and zero where a sample is not valid."""
        last = self._weighted
        if last is not None and last[0] is weights:
            return last[1], last[2]
        clean = self._setup.weights(weights)
        weighted_measured = clean * np.where(np.isfinite(self.measured), self.measured, 0.0)
        if not weights.flags.writeable:  # only then can nobody change it before the next call
            self._weighted = (weights, weighted_measured, clean)
        return weighted_measured, clean


def _finite(values: Array) -> Flags:
    """Whether all numbers along the last axis are finite."""
    return np.asarray(np.isfinite(values).all(axis=-1))
