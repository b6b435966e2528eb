"""Profile likelihood: the cost with one parameter held at each of several values and all others fitted."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.base import Ability, Cost
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.optimizers import Budget
from seatruth.progress import Progress, ProgressEvent, remaining
from seatruth.storage.checkpoint import Pieces, in_order, refit

POINTS = 9
REACH = 3.0
"""Standard errors to either side."""
_BUDGET = Budget(evaluations=50_000)


class Held(Cost):
    """A cost with one of its parameters held at a value."""

    def __init__(self, cost: StudyCost, index: int, value: float, start: Array) -> None:
        self._cost, self._index, self._value = cost, index, value
        self.parameters = tuple(
            parameter.replace(value=float(np.clip(start[k], parameter.min, parameter.max)))
            for k, parameter in enumerate(cost.parameters)
            if k != index
        )
        self.gives = frozenset[Ability]({"values", "residuals", "derivatives"}) & cost.gives
        self.noise_known = cost.noise_known
        self.description = {**cost.description, "held": cost.parameters[index].name, "at": value}

    def values(self, X: Array) -> Array:
        return self._cost.values(np.insert(X, self._index, self._value, axis=1))

    def residuals(self, x: Array) -> Array:
        return self._cost.residuals(np.insert(x, self._index, self._value))

    def jacobian(self, x: Array) -> Array:
        return np.delete(self._cost.jacobian(np.insert(x, self._index, self._value)), self._index, axis=1)

    def reweight(self, x: Array) -> bool:
        return self._cost.reweight(np.insert(x, self._index, self._value))

    def value_of(self, residuals: Array) -> float:
        return self._cost.value_of(residuals)


def grid_of(value: float, stderr: float, low: float, high: float) -> Array:
    """Values at which a parameter is held: up to REACH standard errors to either side, inside the bounds."""
    spread = stderr if math.isfinite(stderr) and stderr > 0 else 0.1 * (abs(value) or 1.0)
    points = value + REACH * spread * np.linspace(-1.0, 1.0, POINTS)
    return np.unique(np.clip(points, low, high))


def profiles(
    study: EstimationProblem,
    names: Sequence[str],
    x: Array,
    stderr: Array,
    *,
    pieces: Pieces,
    progress: Progress,
    threads: int | None,
    workers: int,
) -> dict[str, pd.DataFrame]:
    """Curves (value, cost) of the named free parameters around the estimate x (K,), with standard errors (K,)."""
    first = cost_of(study, threads=threads)
    places = {parameter.name: k for k, parameter in enumerate(first.parameters)}
    wanted = []
    for name in names:
        k = places[name]
        parameter = first.parameters[k]
        wanted += [(name, k, float(v)) for v in grid_of(float(x[k]), float(stderr[k]), parameter.min, parameter.max)]
    ahead = [(name, k, v) for name, k, v in wanted if _key(name, v) not in pieces]

    def one(name: str, k: int, value: float) -> tuple[str, float]:
        # Each point on a cost of its own: a cost that estimates its noise remembers the last one.
        held = Held(cost_of(study, threads=threads), k, value, x)
        if not held.parameters:
            return _key(name, value), float(held.values(np.zeros((1, 0)))[0])
        return _key(name, value), refit(held, _BUDGET).value

    began = time.perf_counter()
    for done, (key, value) in enumerate(in_order(one, ahead, workers), 1):
        pieces.add(key, value)
        left = remaining(done, len(ahead), time.perf_counter() - began)
        progress(ProgressEvent("Profile", done, len(ahead), "points", remaining_s=left))
    return {
        name: pd.DataFrame(
            {
                "value": [v for other, _, v in wanted if other == name],
                "cost": [float(pieces[_key(name, v)]) for other, _, v in wanted if other == name],
            }
        )
        for name in names
    }


def _key(name: str, value: float) -> str:
    return f"profile {name} {value!r}"
