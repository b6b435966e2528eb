"""Which of two formulas predicts better, by cross-validation with the same rows held out of both.

The test is the corrected resampled t-test of Nadeau and Bengio (2003), "Inference for the generalization error",
Machine Learning 52.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from seatruth.arrays import Array, Indices
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.errors import BadInput
from seatruth.optimizers import Budget
from seatruth.trials.trial import Trials
from seatruth.uncertainty.refits import refit

_BUDGET = Budget(evaluations=20_000)
"""Far more than a local fit from a good start needs: a limit for fits that do not converge. Chosen here [S]."""


@dataclass(frozen=True)
class ModelComparison:
    """Two models compared by their squared errors on held-out rows.

    Attributes:
        difference: Mean squared error of the first less that of the second, in the output's unit squared.
        low: Lower end of its 95 % interval.
        high: Upper end of its 95 % interval.
        p: Two-sided p-value: the probability of so large a difference if both were equally good.
        first_better: Share of the scores in which the first had the smaller error.
        scores: How many scores were compared.
    """

    difference: float
    low: float
    high: float
    p: float
    first_better: float
    scores: int


def repeated_folds(n: int, parts: int, repeats: int, rng: np.random.Generator) -> list[list[Indices]]:
    """For each repeat, n rows split at random into parts of nearly equal size, each sorted.

    Raises BadInput for fewer than two parts or more parts than rows.

    Example:
        >>> import numpy as np
        >>> [len(part) for part in repeated_folds(10, 3, 1, np.random.default_rng(0))[0]]
        [4, 3, 3]
    """
    if not 2 <= parts <= n:
        raise BadInput(f"{n} rows cannot be split into {parts} parts", do="Ask for 2 parts or more, none empty.")
    return [[np.sort(part) for part in np.array_split(rng.permutation(n), parts)] for _ in range(repeats)]


def held_out_errors(study: EstimationProblem, parts: Sequence[Indices], start: dict[str, float] | None = None) -> Array:
    """Measured less predicted (n,) of a formula's table, each part predicted by a fit to the other rows.

    Args:
        study: A formula's study with one table of n rows.
        parts: Rows that are held out together, part by part.
        start: Parameter values where each local fit starts; the study's where None.

    Returns:
        (n,), in the output's unit; NaN for rows in no part and for those without a measurement.

    Raises:
        BadInput: The study is not a formula's, or has more than one table.
    """
    if study.cost.kind != "formula" or len(study.trials) != 1:
        raise BadInput("rows can be held out of one table of a formula only", where=f"study {study.name!r}")
    table, output = study.trials[0], study.model.outputs[0].name
    parameters = tuple(
        p.replace(value=float(np.clip(start[p.name], p.min, p.max))) if start and p.name in start else p
        for p in study.parameters
    )
    errors = np.full(len(table), math.nan)
    for part in parts:
        others = np.setdiff1d(np.arange(len(table)), part)
        cost = cost_of(study.replace(trials=Trials([table.samples(others)]), parameters=parameters), threads=1)
        predicted = cost.predict(refit(cost, _BUDGET).x, [table.samples(part)])[0][:, 0]
        errors[part] = table.outputs[output][part] - predicted
    return errors


def compare_models(first: Array, second: Array, test_train_ratio: float = 0.0) -> ModelComparison:
    """Compares two models by their held-out squared errors.

    Args:
        first: (J,), mean squared errors of the first model, one for each fold or condition.
        second: (J,), those of the second model on the same rows.
        test_train_ratio: Rows held out over rows fitted, for scores of repeated folds. Those share most of their rows,
            so the variance is widened as Nadeau and Bengio (2003) do. At 0 the scores count as independent.

    Raises:
        BadInput: There are fewer than two scores, or some are not finite.

    Example:
        >>> import numpy as np
        >>> compare_models(np.array([1.0, 1.1, 0.9]), np.array([2.0, 2.2, 1.9])).first_better
        1.0
    """
    gaps = np.asarray(first, dtype=np.float64) - np.asarray(second, dtype=np.float64)
    count = len(gaps)
    if count < 2 or not np.isfinite(gaps).all():
        raise BadInput("two models are compared by two scores or more, all of them finite")
    mean = float(gaps.mean())
    error = math.sqrt(float(gaps.var(ddof=1)) * (1.0 / count + test_train_ratio))
    half = float(scipy.special.stdtrit(count - 1, 0.975)) * error
    p = float(2 * scipy.special.stdtr(count - 1, -abs(mean) / error)) if error > 0 else float(mean == 0)
    return ModelComparison(mean, mean - half, mean + half, p, float((gaps < 0).mean()), count)
