"""The rates of a model at one state, without a simulation: what its equations say where nobody has declared it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Environment, Model, record


def rates_at(
    model: Model,
    states: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    e: Environment | None = None,
) -> Array:
    """Rates of the states (S,), each in the unit of its state per second, at one state under one set of inputs.

    Args:
        model: with equations, so no black box; its parameters have their nominal values.
        states: values of states by name, in their units; the others are zero.
        inputs: values of inputs by name, in their units; the others are zero.
        e: forces and surroundings; none where it is None.

    Raises whatever the equations raise there, as a division by zero.

    Example:
        >>> from seatruth import load_model
        >>> ship = load_model("mmg")
        >>> dict(zip((s.name for s in ship.states), rates_at(ship, {"u": 1.0}).round(4).tolist()))["psi"]
        0.0
    """
    known, orders = states or {}, inputs or {}
    s = record("States", model.states)(*(known.get(channel.name, 0.0) for channel in model.states))
    i = record("Inputs", model.inputs)(*(orders.get(channel.name, 0.0) for channel in model.inputs))
    p = record("Parameters", model.parameters)(**model.nominal())
    return np.array([float(rate) for rate in model.rhs(s, i, p, e or Environment())])
