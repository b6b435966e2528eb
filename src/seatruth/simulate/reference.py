"""The reference backend: a model's plain functions, step by step in plain Python.

Slow, and independent of everything that is compiled: no tracing, no generated code, no derivative rules. Every kernel
is tested against it (tests/simulate/test_simulate_reference.py). It shares the time grid with the compiled backend,
so both take the same Runge-Kutta steps and differ by rounding only. Its derivatives are central differences: about
1e-8 of the largest one, where the equations are smooth over the difference's step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import PluginError
from seatruth.models.base import Environment, Model, record
from seatruth.models.servo import stages
from seatruth.simulate.serial import RELATIVE_STEP, SerialSimulator
from seatruth.simulate.setup import ParameterLayout, Setup
from seatruth.simulate.time_grid import TimeGrid, time_grid
from seatruth.trials.channel import Hold
from seatruth.trials.trial import Trial

Row = Sequence[float]


class PlainEquations:
    """A model's `rhs` and `output` on plain floats, with its parameters bound.

    Where they raise an arithmetic error (a division by zero, an overflow, the root of a negative number), which
    compiled code answers with infinity or NaN, the result is NaN.
    """

    def __init__(self, model: Model, values: Row) -> None:
        self._model = model
        self._states, self._inputs = record("States", model.states), record("Inputs", model.inputs)
        self._parameters = record("Parameters", model.parameters)(*values)
        names = [channel.name for channel in model.states]
        inputs = [channel.name for channel in model.inputs]
        self._servos = [
            (names.index(servo.state), inputs.index(servo.input), *servo.settings(self._parameters))
            for servo in model.servos
        ]
        # An output that no function computes is the state of the same name.
        self._output_columns = [names.index(channel.name) for channel in model.outputs] if model.output is None else []

    def rates(self, state: Row, inputs: Row, t: float, trial: float) -> list[float]:
        """d/dt of the states (S) at a state (S), inputs (I) as they act, time in s and `e.trial`."""
        return self._call("rhs", self._model.rhs, len(self._model.states), state, inputs, (t, trial))

    def acting(self, state: Row, inputs: Row) -> list[float]:
        """Inputs (I) with those behind servos as they act at a state (S)."""
        found = list(inputs)
        for place, column, _, _ in self._servos:
            found[column] = state[place]
        return found

    def driven(self, state: Row, inputs: tuple[Row, Row, Row], h: float) -> tuple[list[list[float]], dict[int, float]]:
        """Inputs (3, I) that act in a step of h s, from the recorded ones, and where the servos (states) end."""
        found, ends = [list(row) for row in inputs], {}
        for place, column, lag, slowness in self._servos:
            try:
                values = stages(state[place], inputs[0][column], inputs[2][column], h, lag, slowness)
            except (ArithmeticError, ValueError):
                values = (math.nan, math.nan, math.nan)
            for row, value in zip(found, values):
                row[column] = value
            ends[place] = values[2]
        return found, ends

    def outputs(self, state: Row, inputs: Row, t: float, trial: float) -> list[float]:
        """Outputs (D) at a state (S), recorded inputs (I), time in s and `e.trial`."""
        if self._model.output is None:
            return [state[column] for column in self._output_columns]
        acting = self.acting(state, inputs)
        return self._call("output", self._model.output, len(self._model.outputs), state, acting, (t, trial))

    def _call(
        self, role: str, function: Callable[..., Any], size: int, state: Row, inputs: Row, when: tuple[float, float]
    ) -> list[float]:
        t, trial = when
        arguments = (self._states(*state), self._inputs(*inputs), self._parameters, Environment(t=t, trial=trial))
        try:
            return [_real(value) for value in function(*arguments)]
        except (ArithmeticError, ValueError):
            return [math.nan] * size
        except Exception as problem:
            raise PluginError(
                f"{role} raised {type(problem).__name__}: {problem}",
                where=f"model {self._model.name!r}",
                do="Correct the model file.",
            ) from problem


class ReferenceSimulator(SerialSimulator):
    """Classical Runge-Kutta steps of the model's plain functions on the time grid of the compiled backend."""

    def __init__(self, setup: Setup, hold: Hold, max_step: float | None) -> None:
        self._grid = time_grid(setup.model, setup.trials, hold, max_step)
        self._options = (hold, max_step)
        super().__init__(setup, self._grid.steps)

    def rebind(
        self,
        *,
        free: Sequence[str] | None = None,
        values: Mapping[str, float] | None = None,
        trials: Sequence[Trial] | None = None,
    ) -> ReferenceSimulator:
        """See `Simulator.rebind`."""
        return ReferenceSimulator(self._setup.changed(free, values, trials), *self._options)

    def discretisation_error(self, theta: Array, x0: Array) -> Array:
        """See `Simulator.discretisation_error`."""
        values = self._setup.parameters.values(self._setup.candidate(theta))[0]
        starts = self._setup.starts(x0, 1)[0]
        halved = time_grid(self.model, self._setup.trials, *self._options, finer=2)
        change = [
            self._integrate(self._grid, values, trial, x0)[0] - self._integrate(halved, values, trial, x0)[0]
            for trial, x0 in enumerate(starts)
        ]
        return np.asarray(np.sqrt(np.mean(np.concatenate(change) ** 2, axis=0)))

    def _run(self, values: Array, trial: int, x0: Array) -> tuple[Array, Array]:
        return self._integrate(self._grid, values, trial, x0)

    def _integrate(self, grid: TimeGrid, values: Array, trial: int, x0: Array) -> tuple[Array, Array]:
        equations = PlainEquations(self.model, values.tolist())
        rows, number = grid.rows[trial], self.model.number_of(self._setup.trials[trial].name)
        stage = int(grid.stage_start[trial])
        x: list[float] = x0.tolist()
        states, outputs = [], []
        with np.errstate(all="ignore"):
            for k in range(rows.start, rows.stop):
                states.append(x)
                outputs.append(equations.outputs(x, grid.inputs[k].tolist(), float(grid.t[k]), number))
                for _ in range(int(grid.substeps[k])):
                    x = _step(equations, grid, stage, x, float(grid.length[k]), number)
                    stage += 3
        return np.array(outputs), np.array(states).reshape(len(states), x0.size)


def _step(equations: PlainEquations, grid: TimeGrid, stage: int, x: Row, h: float, trial: float) -> list[float]:
    """The state one classical Runge-Kutta step of `h` seconds later; `stage` is the step's first row in the grid."""
    times = grid.stage_t[stage : stage + 3].tolist()
    recorded = grid.stage_inputs[stage : stage + 3].tolist()
    (start, middle, end), servos = equations.driven(x, tuple(recorded), h)
    k1 = equations.rates(x, start, times[0], trial)
    k2 = equations.rates(_ahead(x, h / 2, k1), middle, times[1], trial)
    k3 = equations.rates(_ahead(x, h / 2, k2), middle, times[1], trial)
    k4 = equations.rates(_ahead(x, h, k3), end, times[2], trial)
    after = [a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(x, k1, k2, k3, k4)]
    return [servos.get(place, value) for place, value in enumerate(after)]


def _ahead(x: Row, h: float, rates: Row) -> list[float]:
    return [a + h * b for a, b in zip(x, rates)]


def _real(value: Any) -> float:
    """A plain float; NaN for a complex number, such as Python makes of (-1.0) ** 0.5."""
    return math.nan if isinstance(value, complex) else float(value)


def rates_on_rows(model: Model, values: Array, states: Array, inputs: Array, t: Array, trial: Array) -> Array:
    """Rates (P, N, S): values (P, n_parameters), states (N, S), inputs (N, I), t (N,) s, trial (N,)."""
    rates = np.empty((len(values), *states.shape))
    with np.errstate(all="ignore"):
        for candidate, row in enumerate(values.tolist()):
            equations = PlainEquations(model, row)
            rows = zip(states.tolist(), inputs.tolist(), t.tolist(), trial.tolist())
            for k, (x, i, time, number) in enumerate(rows):
                rates[candidate, k] = equations.rates(x, equations.acting(x, i), time, number)
    return rates


def rate_derivatives_on_rows(
    model: Model, parameters: ParameterLayout, theta: Array, states: Array, inputs: Array, t: Array, trial: Array
) -> Array:
    """Central differences (N, S, K) of the rates by the free parameters: theta (K,), the rest as `rates_on_rows`."""
    derivatives = np.empty((*states.shape, len(theta)))
    for k, name in enumerate(parameters.free):
        step = RELATIVE_STEP * (abs(theta[k]) or abs(model.parameter(name).value) or 1.0)
        pair = np.stack([theta, theta])
        pair[:, k] += (step, -step)
        ahead, behind = rates_on_rows(model, parameters.values(pair), states, inputs, t, trial)
        derivatives[:, :, k] = (ahead - behind) / (2.0 * step)
    return derivatives
