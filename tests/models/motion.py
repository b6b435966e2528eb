"""Helpers of the model tests: named equations, steady states and modes of motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from seatruth.manoeuvres import Stepper
from seatruth.models.base import Model

Array = NDArray[np.float64]
deg = math.radians


def rates(
    model: Model, state: Mapping[str, float], inputs: Mapping[str, float], values: Any = None, environment: Any = None
) -> dict[str, float]:
    """d/dt of all states by name."""
    stepper = Stepper(model, values, environment)
    given = {channel.name: inputs.get(channel.name, 0.0) for channel in model.inputs}
    found = stepper.rate(0.0, stepper.first(state), given)
    return dict(zip((s.name for s in model.states), found))


def modes(model: Model, state: Mapping[str, float], inputs: Mapping[str, float], names: Sequence[str]) -> Array:
    """Eigenvalues (1/s) of the linearised equations of the named states, largest real part first."""
    h = 1e-6
    matrix = np.empty((len(names), len(names)))
    for column, name in enumerate(names):
        ahead, behind = (rates(model, {**state, name: state.get(name, 0.0) + step}, inputs) for step in (h, -h))
        matrix[:, column] = [(ahead[row] - behind[row]) / (2 * h) for row in names]
    values = np.linalg.eigvals(matrix)
    return np.asarray(values[np.argsort(-values.real)])


def balance(
    model: Model, guess: Mapping[str, float], inputs: Mapping[str, float], names: Sequence[str]
) -> dict[str, float]:
    """States that stay as they are: those named are solved for, the others keep the guess."""

    def residual(x: Array) -> Array:
        found = rates(model, {**guess, **dict(zip(names, x.tolist()))}, inputs)
        return np.array([found[name] for name in names])

    solved = root(residual, [guess.get(name, 0.0) for name in names], tol=1e-13)
    assert solved.success
    return {**guess, **dict(zip(names, solved.x.tolist()))}
