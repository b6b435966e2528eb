"""Which of two formulas predicts better, and how sure that is: the same rows left out of both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from seatruth.arrays import Array
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.errors import BadInput
from seatruth.optimizers import Budget
from seatruth.storage.checkpoint import refit
from seatruth.trials.trial import Trials

Rows = NDArray[np.intp]
_BUDGET = Budget(evaluations=20_000)


@dataclass(frozen=True)
class Preference:
    """Mean squared error of the first less that of the second, when left out, and whether it could be chance."""

    difference: float
    low: float
    high: float
    """95 % interval of the difference."""
    p: float
    """Chance of a difference at least this large, either way, if both were equally good."""
    first_better: float
    """Part of the comparisons in which the first had the smaller error."""
    comparisons: int


def folds(n: int, parts: int, repeats: int, rng: np.random.Generator) -> list[list[Rows]]:
    """For each repeat, n rows cut at random into parts of nearly equal size (each sorted)."""
    if not 2 <= parts <= n:
        raise BadInput(f"{n} rows cannot be cut into {parts} parts", do="Ask for 2 parts or more, none of them empty.")
    return [[np.sort(part) for part in np.array_split(rng.permutation(n), parts)] for _ in range(repeats)]


def left_out_errors(study: EstimationProblem, parts: Sequence[Rows], start: dict[str, float] | None = None) -> Array:
    """Measured less predicted (n,) of a formula's table, each part predicted by a fit to the other rows.

    Rows in no part, and those without a measurement, are NaN. Fits are local ones from `start` (the study's values).
    """
    if study.cost.kind != "formula" or len(study.trials) != 1:
        raise BadInput("rows are left out of the one table of a formula", where=f"study {study.name!r}")
    table, output = study.trials[0], study.model.outputs[0].name
    parameters = tuple(
        p.replace(value=float(np.clip(start[p.name], p.min, p.max))) if start and p.name in start else p
        for p in study.parameters
    )
    found = np.full(len(table), math.nan)
    for part in parts:
        others = np.setdiff1d(np.arange(len(table)), part)
        cost = cost_of(study.replace(trials=Trials([table.samples(others)]), parameters=parameters), threads=1)
        predicted = cost.predict(refit(cost, _BUDGET).x, [table.samples(part)])[0][:, 0]
        found[part] = table.outputs[output][part] - predicted
    return found


def prefer(first: Array, second: Array, tested: float = 0.0) -> Preference:
    """Compares squared errors of two formulas that were left out alike: scores (J,), one a fold or a condition.

    With `tested`, rows left out over rows fitted, the scores are those of repeated folds, which share most of their
    rows: the variance is widened as Nadeau and Bengio (2003) do. Without it scores count as independent.
    """
    gaps = np.asarray(first, dtype=np.float64) - np.asarray(second, dtype=np.float64)
    count = len(gaps)
    if count < 2 or not np.isfinite(gaps).all():
        raise BadInput("two formulas are compared on two scores or more, all of them numbers")
    mean = float(gaps.mean())
    error = math.sqrt(float(gaps.var(ddof=1)) * (1.0 / count + tested))
    half = float(student.ppf(0.975, count - 1)) * error
    p = float(2 * student.sf(abs(mean) / error, count - 1)) if error > 0 else float(mean == 0)
    return Preference(mean, mean - half, mean + half, p, float((gaps < 0).mean()), count)
