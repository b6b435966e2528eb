"""Profile likelihood: the cost with one parameter fixed at each of several values and all others fitted.

A profile starts with values around the estimate and walks on, twice as far each time, until the cost has risen by the
threshold of the 95 % interval or a bound is reached. On which sides it rises says whether the data bound the parameter
(Raue and others 2009).
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

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
DROP_95 = 1.9207
"""Rise of the cost at the ends of a 95 % interval: half the 95 % quantile of chi-square with one degree of freedom."""
_WALK = 10
"""Rounds in which a profile is extended or refined: to 3 * 2^10 standard errors. What is flat there stays flat. Chosen
here [S]."""
_STEEP = 4.0
"""Rise over the threshold, right outside an end of the interval, up to which the end can be interpolated: the roots are
then within a factor of two. Chosen here [S]."""
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
    """Values at which a parameter is fixed: up to PROFILE_HALF_WIDTH standard errors to either side, inside the bounds.

    Where there is no standard error, a tenth of the value (or of 1) stands for it.
    """
    spread = stderr if math.isfinite(stderr) and stderr > 0 else 0.1 * (abs(value) or 1.0)
    ends = np.clip(value + PROFILE_HALF_WIDTH * spread * np.array([-1.0, 1.0]), low, high)
    half = np.linspace(0.0, 1.0, PROFILE_POINTS // 2 + 1)
    return np.unique(np.concatenate([value + half * (end - value) for end in ends]))


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
    curves: dict[str, dict[float, float]] = {name: {} for name in names}

    def cost_at(name: str, value: float) -> tuple[str, float, float]:
        # Each point has a cost of its own: a cost that estimates its noise depends on where it was last evaluated.
        fixed = FixedParameterCost(cost_of(study, threads=threads), places[name], value, x)
        if not fixed.parameters:
            return name, value, float(fixed.values(np.zeros((1, 0)))[0])
        return name, value, refit(fixed, _BUDGET).value

    began, made, asked = time.perf_counter(), 0, 0

    def fit(points: Sequence[tuple[str, float]]) -> None:
        nonlocal made, asked
        missing = [(name, value) for name, value in points if _key(name, value) not in checkpoint]
        asked += len(missing)
        for name, value, least in run_in_order(cost_at, missing, workers):
            checkpoint.put(_key(name, value), least)
            made += 1
            left = remaining(made, asked, time.perf_counter() - began)
            progress(ProgressEvent("Profile", made, asked, "points", remaining_s=left))
        for name, value in points:
            curves[name][value] = float(checkpoint.get(_key(name, value)))

    first = []
    for name, k in ((name, places[name]) for name in names):
        parameter = cost.parameters[k]
        values = profile_values(float(x[k]), float(stderr[k]), parameter.min, parameter.max)
        first += [(name, float(value)) for value in values]
    fit(first)
    for _ in range(_WALK):
        further = []
        for name, k in ((name, places[name]) for name in names):
            parameter = cost.parameters[k]
            outward = _next(curves[name], float(x[k]), parameter.min, parameter.max)
            further += [(name, value) for value in outward]
        if not further:
            break
        fit(further)
    return {name: _table(curve) for name, curve in curves.items()}


def _table(curve: dict[float, float]) -> pd.DataFrame:
    values = sorted(curve)
    return pd.DataFrame({"value": values, "cost": [curve[value] for value in values]})


def _next(curve: dict[float, float], centre: float, low: float, high: float) -> list[float]:
    """Further values of a profile, at most one a side: outward where it has not risen, else between steep points."""
    found = []
    verdict = profile_verdict(_table(curve))
    values = np.array(sorted(curve))
    for end, crossing in ((values[0], verdict.lower), (values[-1], verdict.upper)):
        if not math.isfinite(crossing):
            further = float(np.clip(centre + 2.0 * (end - centre), low, high))
            if further not in curve:
                found.append(further)
            continue
        inside = values[np.abs(values - centre) < abs(crossing - centre)]
        outside = values[(np.sign(values - centre) == np.sign(crossing - centre)) & ~np.isin(values, inside)]
        if not len(outside):
            continue
        beyond = float(outside[np.argmin(np.abs(outside - crossing))])
        rise = curve[beyond] - min(curve.values())
        near = inside[np.sign(inside - centre) == np.sign(crossing - centre)]
        before = float(near[np.argmax(np.abs(near - centre))]) if len(near) else centre
        if rise > _STEEP * DROP_95 and 0.5 * (before + beyond) not in curve:
            found.append(0.5 * (before + beyond))
    return found


@dataclass(frozen=True)
class ProfileVerdict:
    """What a profile says of its parameter.

    Attributes:
        kind: "bounded" (the data limit it on both sides), "half bounded" (on one) or "flat" (on none).
        lower, upper: ends of its 95 % interval; not finite where the data give none.
    """

    kind: Literal["bounded", "half bounded", "flat"]
    lower: float
    upper: float


def profile_verdict(curve: pd.DataFrame) -> ProfileVerdict:
    """The verdict of a profile with the columns value and cost.

    The ends are found where the square root of the rise, which is a straight line for a linear model, passes that of
    the threshold. A value whose fit diverged counts as excluded.

    Example:
        >>> import pandas as pd
        >>> value = pd.Series([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
        >>> found = profile_verdict(pd.DataFrame({"value": value, "cost": 0.5 * value**2}))
        >>> found.kind, round(found.lower, 2), round(found.upper, 2)
        ('bounded', -1.96, 1.96)
        >>> profile_verdict(pd.DataFrame({"value": value, "cost": 0.5 * value.clip(lower=0.0) ** 2})).kind
        'half bounded'
    """
    ordered = curve.sort_values("value")
    values, costs = ordered["value"].to_numpy(dtype=float), ordered["cost"].to_numpy(dtype=float)
    finite = np.isfinite(costs)
    if not finite.any():
        return ProfileVerdict("flat", -math.inf, math.inf)
    root = np.sqrt(np.clip(np.where(finite, costs, np.inf) - costs[finite].min(), 0.0, None))
    least = int(np.argmin(root))
    lower = _crossing(values[least::-1], root[least::-1], -math.inf)
    upper = _crossing(values[least:], root[least:], math.inf)
    sides = math.isfinite(lower) + math.isfinite(upper)
    kinds: tuple[Literal["flat", "half bounded", "bounded"], ...] = ("flat", "half bounded", "bounded")
    return ProfileVerdict(kinds[sides], lower, upper)


def _crossing(values: Array, root: Array, none: float) -> float:
    """Where the root of the rise first passes the threshold on the way outward; `none` if it never does."""
    threshold = math.sqrt(DROP_95)
    beyond = np.flatnonzero(root > threshold)
    if not beyond.size:
        return none
    k = int(beyond[0])
    if k == 0 or not math.isfinite(root[k]):
        return float(values[max(k - 1, 0)])
    part = (threshold - root[k - 1]) / (root[k] - root[k - 1])
    return float(values[k - 1] + part * (values[k] - values[k - 1]))


def _key(name: str, value: float) -> str:
    return f"profile {name} {value!r}"
