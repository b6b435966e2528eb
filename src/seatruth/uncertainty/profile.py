"""Profile likelihood: the cost with one parameter fixed at each of several values and all others fitted."""

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
from seatruth.storage.checkpoint import Checkpoint
from seatruth.uncertainty.refits import refit, run_in_order

PROFILE_POINTS = 9
"""Values at which a parameter is fixed. Chosen here [S]: enough to see a curve, few enough for slow models."""
PROFILE_HALF_WIDTH = 3.0
"""Standard errors to either side of the estimate: 99.7 % of a normal distribution."""
_BUDGET = Budget(evaluations=50_000)
"""Far more than a local fit from a good start needs: a limit for fits that do not converge. Chosen here [S]."""


class FixedParameterCost(Cost):
    """A cost of which one parameter is fixed at a value; the others start at `start` (K,)."""

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


def profile_values(value: float, stderr: float, low: float, high: float) -> Array:
    """Values at which a parameter is fixed: PROFILE_HALF_WIDTH standard errors to either side, inside the bounds.

    Where there is no standard error, a tenth of the value (or of 1) stands for it.
    """
    spread = stderr if math.isfinite(stderr) and stderr > 0 else 0.1 * (abs(value) or 1.0)
    points = value + PROFILE_HALF_WIDTH * spread * np.linspace(-1.0, 1.0, PROFILE_POINTS)
    return np.unique(np.clip(points, low, high))


def profiles(
    study: EstimationProblem,
    names: Sequence[str],
    x: Array,
    stderr: Array,
    *,
    checkpoint: Checkpoint,
    progress: Progress,
    threads: int | None,
    workers: int,
) -> dict[str, pd.DataFrame]:
    """Profiles of the named free parameters around the estimate.

    Args:
        study: The study.
        names: Free parameters to profile.
        x: (K,), the estimate.
        stderr: (K,), its standard errors.
        checkpoint: Finished points are read from it and stored in it.
        progress: Called with a `ProgressEvent` after each point.
        threads: Threads of a simulation; None for all processors.
        workers: Points that are fitted at once; the result does not depend on it.

    Returns:
        By parameter a table with the columns value (in its unit) and cost (half of chi-square).
    """
    cost = cost_of(study, threads=threads)
    places = {parameter.name: k for k, parameter in enumerate(cost.parameters)}
    points = []
    for name in names:
        k = places[name]
        parameter = cost.parameters[k]
        values = profile_values(float(x[k]), float(stderr[k]), parameter.min, parameter.max)
        points += [(name, k, float(value)) for value in values]
    missing = [(name, k, value) for name, k, value in points if _key(name, value) not in checkpoint]

    def cost_at(name: str, k: int, value: float) -> tuple[str, float]:
        # Each point has a cost of its own: a cost that estimates its noise depends on where it was last evaluated.
        fixed = FixedParameterCost(cost_of(study, threads=threads), k, value, x)
        if not fixed.parameters:
            return _key(name, value), float(fixed.values(np.zeros((1, 0)))[0])
        return _key(name, value), refit(fixed, _BUDGET).value

    began = time.perf_counter()
    for done, (key, value) in enumerate(run_in_order(cost_at, missing, workers), 1):
        checkpoint.put(key, value)
        left = remaining(done, len(missing), time.perf_counter() - began)
        progress(ProgressEvent("Profile", done, len(missing), "points", remaining_s=left))
    return {
        name: pd.DataFrame(
            {
                "value": [value for other, _, value in points if other == name],
                "cost": [float(checkpoint.get(_key(name, value))) for other, _, value in points if other == name],
            }
        )
        for name in names
    }


def _key(name: str, value: float) -> str:
    return f"profile {name} {value!r}"
