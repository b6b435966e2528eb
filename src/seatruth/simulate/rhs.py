"""The model's rates on known states and inputs, without simulation: what equation-error methods need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.models.base import OTHER_TRIAL, Model
from seatruth.models.black_box import BlackBox
from seatruth.simulate.base import Backend, check_backend
from seatruth.simulate.compiler.program import program
from seatruth.simulate.reference import rate_derivatives_on_rows, rates_on_rows
from seatruth.simulate.setup import ParameterLayout, parameter_layout
from seatruth.simulate.threads import thread_count


def evaluate_rhs(
    model: Model,
    theta: Array,
    free: Sequence[str],
    values: Mapping[str, float],
    states: Array,
    inputs: Array,
    t: Array | None = None,
    threads: int | None = None,
    backend: Backend = "compiled",
    trial: Array | None = None,
) -> Array:
    """Rates of the states on N rows for P candidates.

    theta (P, K) or (K,) sets the parameters `free`, `values` gives the others; states (N, S), inputs (N, I), t (N,) s
    (zero where None); trial (N,) `e.trial` of each row (another trial than the model's where None). Gives (P, N, S), or
    (N, S) for one candidate (K,). Raises BadInput for an unknown parameter or a black box.
    """
    theta = np.asarray(theta, dtype=np.float64)
    check_backend(backend)
    layout = _layout(model, free, values)
    candidates = layout.values(np.atleast_2d(theta))
    x, i, time, number = _rows(states, inputs, t, trial)
    if backend == "reference":
        rates = rates_on_rows(model, candidates, x, i, time, number)
    else:
        by_state = program(model).rates(candidates, _leaves(x, i, time, number), thread_count(threads))
        rates = np.ascontiguousarray(np.moveaxis(by_state, 1, 2))
    return rates if theta.ndim == 2 else np.asarray(rates[0])


def evaluate_rhs_jacobian(
    model: Model,
    theta: Array,
    free: Sequence[str],
    values: Mapping[str, float],
    states: Array,
    inputs: Array,
    t: Array | None = None,
    threads: int | None = None,
    backend: Backend = "compiled",
    trial: Array | None = None,
) -> Array:
    """Derivatives of the rates by the free parameters: theta (K,) gives (N, S, K); the rest as `evaluate_rhs`.

    Exact with the compiled backend, central differences with the reference one.
    """
    theta = np.asarray(theta, dtype=np.float64)
    check_backend(backend)
    layout = _layout(model, free, values)
    x, i, time, number = _rows(states, inputs, t, trial)
    if not len(layout.free):
        return np.zeros((*x.shape, 0))
    if backend == "reference":
        return rate_derivatives_on_rows(model, layout, theta, x, i, time, number)
    size = len(layout.names)
    # One row a free parameter: all values, then the direction along which the derivative is taken.
    directions = np.zeros((len(layout.free), 2 * size))
    directions[:, :size] = layout.values(theta[None])
    directions[np.arange(len(layout.free)), size + layout.columns] = 1.0
    derivatives = program(model).rate_derivatives(directions, _leaves(x, i, time, number), thread_count(threads))
    return np.ascontiguousarray(np.transpose(derivatives, (2, 1, 0)))


def _layout(model: Model, free: Sequence[str], values: Mapping[str, float]) -> ParameterLayout:
    if isinstance(model, BlackBox):
        raise BadInput(
            f"model {model.name!r} is a black box: it has no equations to evaluate",
            do="Use the trajectory cost, which simulates it.",
        )
    return parameter_layout(model, free, values)


def _rows(states: Array, inputs: Array, t: Array | None, trial: Array | None) -> tuple[Array, Array, Array, Array]:
    states, inputs = np.asarray(states, dtype=np.float64), np.asarray(inputs, dtype=np.float64)
    time = np.zeros(len(states)) if t is None else np.asarray(t, dtype=np.float64)
    number = np.full(len(states), OTHER_TRIAL) if trial is None else np.asarray(trial, dtype=np.float64)
    return states, inputs.reshape(len(states), -1), time, number


def _leaves(states: Array, inputs: Array, t: Array, trial: Array) -> Array:
    """(S + I + 2, N): one line a state, an input, the time, and the trial."""
    return np.concatenate([states.T, inputs.T, t[None], trial[None]])
