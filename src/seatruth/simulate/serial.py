"""Simulators that run one candidate through one trial at a time; derivatives by central differences."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import numpy as np

from seatruth.arrays import Array, Flags
from seatruth.models.base import Model
from seatruth.simulate.base import Jacobian, Outputs, SquaredErrors
from seatruth.simulate.setup import Setup

RELATIVE_STEP = 6.0e-6
"""Step of a central difference over the size of the variable: the cube root of the rounding error, at which rounding
and truncation are of one size (Press et al., Numerical Recipes, 3rd ed. 2007, section 5.7)."""


class SerialSimulator(ABC):
    """Everything of a Simulator from one method, `_run`."""

    def __init__(self, setup: Setup, steps: int) -> None:
        self._setup = setup
        self.model: Model = setup.model
        self.free = setup.parameters.free
        self.rows = setup.rows
        self.measured = setup.measured
        self.initial_states = setup.initial_states
        self.assumed_zero = setup.assumed_zero
        self.steps = steps

    @abstractmethod
    def _run(self, values: Array, trial: int, x0: Array) -> tuple[Array, Array]:
        """Outputs (n, D) and states (n, S) of one trial: values (n_parameters,), x0 (S,)."""

    def _all(self, run: Callable[[tuple[int, int]], None], jobs: Sequence[tuple[int, int]]) -> None:
        """Runs all (candidate, trial), in any order."""
        for job in jobs:
            run(job)

    @abstractmethod
    def discretisation_error(self, theta: Array, x0: Array) -> Array:
        """See `Simulator.discretisation_error`."""

    def squared_errors(self, theta: Array, x0: Array, weights: Array) -> SquaredErrors:
        """See `Simulator.squared_errors`."""
        weights = self._setup.weights(weights)
        simulated = self.outputs(theta, x0)
        valid = np.isfinite(self.measured)
        sums = np.zeros((len(simulated.y), len(self.rows), self.measured.shape[1]))
        for trial, rows in enumerate(self.rows):
            with np.errstate(all="ignore"):  # of diverged candidates
                error = np.where(valid[rows], self.measured[rows] - simulated.y[:, rows], 0.0) * weights[rows]
                sums[:, trial] = (error**2).sum(axis=1)
        sums[simulated.diverged] = math.inf
        return SquaredErrors(sums, simulated.x_end, simulated.diverged)

    def outputs(self, theta: Array, x0: Array) -> Outputs:
        """See `Simulator.outputs`."""
        theta = self._setup.population(theta)
        starts = self._setup.starts(x0, len(theta))
        y = np.empty((len(theta), *self.measured.shape))
        x_end = np.empty((len(theta), *self.initial_states.shape))
        values = self._setup.parameters.values(theta)

        def run(job: tuple[int, int]) -> None:
            candidate, trial = job
            y[candidate, self.rows[trial]], x = self._run(values[candidate], trial, starts[candidate, trial])
            x_end[candidate, trial] = x[-1]

        self._all(run, [(candidate, trial) for candidate in range(len(theta)) for trial in range(len(self.rows))])
        diverged: Flags = np.asarray(~np.isfinite(x_end).all(axis=2))
        for trial, rows in enumerate(self.rows):
            diverged[:, trial] |= ~np.isfinite(y[:, rows]).all(axis=(1, 2))
        return Outputs(y, x_end, diverged)

    def states(self, theta: Array, x0: Array) -> Array:
        """See `Simulator.states`."""
        values = self._setup.parameters.values(self._setup.candidate(theta))[0]
        starts = self._setup.starts(x0, 1)[0]
        return np.concatenate([self._run(values, trial, starts[trial])[1] for trial in range(len(self.rows))])

    def jacobian(
        self, theta: Array, x0: Array, free_states: Sequence[str] = (), *, last_states: bool = True
    ) -> Jacobian:
        """See `Simulator.jacobian`. Differences: the candidate and its neighbours are simulated as one population."""
        theta = self._setup.candidate(theta)[0]
        x0 = np.array(self._setup.starts(x0, 1)[0])
        columns = self._setup.state_columns(free_states)
        following = self._setup.following(free_states)
        size, signs = len(theta) + len(columns), self._signs()
        thetas, starts = [theta], [x0]
        steps = np.array([self._step(theta, x0, columns, k) for k in range(size)]).reshape(size, len(self.rows))
        for variable in range(size):
            # (T,): an initial state has a step of its own in each trial.
            step = steps[variable]
            for sign in signs:
                shifted, start = theta.copy(), x0.copy()
                if variable < len(theta):
                    shifted[variable] += sign * step[0]
                else:
                    place = variable - len(theta)
                    start[:, columns[place]] += sign * step
                    for leader, follower, with_sign in following:
                        if leader == place:
                            start[:, follower] += sign * with_sign * step
                thetas.append(shifted)
                starts.append(start)
        found = self.outputs(np.array(thetas), np.array(starts))
        dy = np.empty((*self.measured.shape, size))
        dx_end = np.empty((*self.initial_states.shape, size))
        for variable in range(size):
            ahead = 1 + len(signs) * variable
            behind = 0 if len(signs) == 1 else ahead + 1
            for trial, rows in enumerate(self.rows):
                width = len(signs) * steps[variable, trial]
                with np.errstate(all="ignore"):
                    dy[rows, :, variable] = (found.y[ahead, rows] - found.y[behind, rows]) / width
                    dx_end[trial, :, variable] = (found.x_end[ahead, trial] - found.x_end[behind, trial]) / width
        ends = dx_end if last_states else dx_end[:, :0]
        return Jacobian(found.y[0], dy, found.x_end[0], ends, found.diverged[0])

    def _signs(self) -> tuple[float, ...]:
        """Sides on which a difference looks: both (central), or one (forward)."""
        return 1.0, -1.0

    def _step(self, theta: Array, x0: Array, columns: Sequence[int], variable: int) -> Array:
        """Step (T,) of the central difference of a free parameter or initial state."""
        if variable < len(theta):
            nominal = self.model.parameter(self.free[variable]).value
            size = abs(theta[variable]) or abs(nominal) or 1.0
            return np.full(len(self.rows), RELATIVE_STEP * size)
        return np.asarray(RELATIVE_STEP * np.maximum(1.0, np.abs(x0[:, columns[variable - len(theta)]])))
