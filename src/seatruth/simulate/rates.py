"""The model's rates on given states and inputs, without simulation: what equation-error methods need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.simulate.compiler.program import program
from seatruth.simulate.engine import Setting, setting
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
) -> Array:
    """Rates of the states on N rows for P candidates.

    theta (P, K) or (K,) sets the parameters `free`, states (N, S), inputs (N, I), t (N,) s (zero where None);
    gives (P, N, S), or (N, S) for one candidate (K,).
    """
    theta = np.asarray(theta, dtype=np.float64)
    chosen = _setting(model, free, values)
    found = program(model).rates(chosen.values(np.atleast_2d(theta)), _leaves(states, inputs, t), thread_count(threads))
    rates = np.ascontiguousarray(np.moveaxis(found, 1, 2))
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
) -> Array:
    """Exact derivatives of the rates by the free parameters: theta (K,) gives (N, S, K)."""
    theta = np.asarray(theta, dtype=np.float64)
    chosen = _setting(model, free, values)
    size = len(chosen.names)
    seeds = np.zeros((len(chosen.free), 2 * size))
    if not len(chosen.free):
        return np.zeros((*np.shape(states), 0))
    seeds[:, :size] = chosen.values(theta[None])
    seeds[np.arange(len(chosen.free)), size + chosen.columns] = 1.0
    found = program(model).rate_directions(seeds, _leaves(states, inputs, t), thread_count(threads))
    return np.ascontiguousarray(np.transpose(found, (2, 1, 0)))


def _setting(model: Model, free: Sequence[str], values: Mapping[str, float]) -> Setting:
    if isinstance(model, BlackBox):
        raise BadInput(
            f"model {model.name!r} is a black box: it has no equations to evaluate",
            do="Use the trajectory cost, which simulates it.",
        )
    return setting(model, free, values)


def _leaves(states: Array, inputs: Array, t: Array | None) -> Array:
    states, inputs = np.asarray(states, dtype=np.float64), np.asarray(inputs, dtype=np.float64)
    time = np.zeros(len(states)) if t is None else np.asarray(t, dtype=np.float64)
    return np.concatenate([states.T, inputs.reshape(len(states), -1).T, time[None]])
