"""A static formula fitted to a table, behind the same interface as a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.base import Regression
from seatruth.costs.linear import SAME, SAME_BY_DIFFERENCES, Linear, blocks_of
from seatruth.costs.noise import Noise
from seatruth.costs.options import FormulaOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.study_cost import ResidualBlock, StudyCost, prior_blocks
from seatruth.errors import BadInput
from seatruth.models.formula import Formula
from seatruth.trials.places import place
from seatruth.trials.trial import Trial

_MAX_NUMBERS = 8_000_000
"""Most numbers of a population in memory at a time (chosen here [S]: 64 MB)."""


class FormulaCost(StudyCost):
    """Minus the log-likelihood of a column given a formula of the others: least squares, with known noise or not.

    The problem's model is a `Formula`; its trials are tables. Candidates for which the formula has no finite value in
    every valid row cost inf. `seatruth.study.formula_study` makes the study from a table in one call.
    """

    gives = frozenset({"values", "residuals", "derivatives", "regression"})

    def __init__(self, problem: EstimationProblem) -> None:
        where = f"study {problem.name!r}"
        problem.options(FormulaOptions)
        if not isinstance(problem.model, Formula):
            raise BadInput(f"model {problem.model.name!r} is no formula", where=where, do="Use another kind of cost.")
        self.problem, self.space, self._formula = problem, problem.space, problem.model
        self.trials = tuple(problem.trials)
        self.parameters = self.space.free
        inputs = [channel.name for channel in problem.model.inputs]
        self._columns = {name: np.concatenate([trial.inputs[name] for trial in self.trials]) for name in inputs}
        output = problem.model.outputs[0].name
        self._measured = np.concatenate([trial.outputs[output] for trial in self.trials])[:, None]
        self._weight = self._weights(where)
        valid = np.isfinite(self._measured) & (self._weight > 0)
        self._rows = np.flatnonzero(valid[:, 0])
        known = {name: float(value) for name, value in problem.noise.items() if value != "estimate"}
        self._noise = Noise([output], self._measured * self._weight, valid, known, where=where)
        self._same = SAME if problem.model.expression is not None else SAME_BY_DIFFERENCES
        self.residual_blocks = self._residual_blocks(output)

    @cached_property
    def linear(self) -> Linear | None:
        """The formula as a linear function of x, or None where a parameter enters another way."""
        return Linear.of(self._weighted_errors, self._weighted_derivatives, self.space, self._same)

    def values(self, X: Array) -> Array:
        """Cost of each candidate: (P, K) -> (P,)."""
        X = np.asarray(X, dtype=np.float64)
        squares = np.empty(len(X))
        size = max(1, _MAX_NUMBERS // len(self._measured))
        weights = self._noise.weights[:, 0] * self._weight[:, 0]
        with np.errstate(all="ignore"):
            for k in range(0, len(X), size):
                error = (self._measured[:, 0] - self._predicted(X[k : k + size]))[:, self._rows] * weights[self._rows]
                squares[k : k + size] = np.einsum("pn,pn->p", error, error)
            found = self._noise.cost_of_squares(squares[:, None])
        return self._with_priors(found, X)

    def jacobian(self, x: Array) -> Array:
        """Derivative of `residuals`, (M, K): exact for an expression, by differences for a callable."""
        x = np.asarray(x, dtype=np.float64)
        return np.concatenate([self._noise.derivatives(-self._derivatives(x)), self.space.prior_jacobian(x)])

    def regression(self) -> Regression:
        """The formula as one linear regression. Raises BadInput naming a parameter that does not enter linearly."""
        if self.linear is None:
            culprits = Linear.culprits(self._weighted_derivatives, self.space, self._same)
            which = ", ".join(repr(name) for name in culprits[:5]) or "the parameters together"
            raise BadInput(
                f"{which} do{'es' if len(culprits) == 1 else ''} not enter the formula linearly",
                where=f"study {self.problem.name!r}",
                do="Fix those, or use an optimizer that takes residuals (least_squares).",
            )
        names = [self._formula.text or self._formula.name]
        return Regression(blocks_of(names, self._weighted_errors, self._weighted_derivatives, self.space, self._noise))

    def errors(self, x: Array) -> Array:
        """(Measured minus computed) times the row's weight: (N, 1)."""
        with np.errstate(all="ignore"):
            return np.asarray((self._measured[:, 0] - self._predicted(np.asarray(x)[None])[0])[:, None] * self._weight)

    def predict(self, x: Array, trials: Sequence[Trial] | None = None) -> list[Array]:
        """Computed values (n, 1) of each table."""
        parameters = self.space.by_name(np.asarray(x, dtype=np.float64))
        chosen = self.trials if trials is None else tuple(trials)
        return [self._formula.run(trial, parameters, None) for trial in chosen]

    def require_values(self) -> None:
        """Raises BadInput where a measured row has no finite value at the start nor at twenty other candidates."""
        rng = np.random.default_rng(0)
        low, high = self.bounds
        spread = np.where(self.start == 0, 1.0, np.abs(self.start)) * rng.standard_normal((20, len(self.start)))
        with np.errstate(all="ignore"):
            between = low + (high - low) * rng.random((20, len(low)))
            others = np.where(np.isfinite(high - low), between, np.clip(self.start + spread, low, high))
            lost = ~np.isfinite(self._predicted(np.vstack([self.start, others])))[:, self._rows]
        bad = self._rows[lost.all(axis=0)]
        if not len(bad):
            return
        sizes = np.cumsum([0, *(len(trial) for trial in self.trials)])
        which = int(np.searchsorted(sizes, bad[0], side="right")) - 1
        samples = bad[(bad >= sizes[which]) & (bad < sizes[which + 1])] - sizes[which]
        raise BadInput(
            "the formula has no finite value there, whatever its parameters",
            where=place(self.trials[which], samples),
            do="Look for a division by zero, a root or logarithm of a negative number, or a power without end.",
        )

    def slopes(self, x: Array, trial: Trial) -> Array:
        """Derivatives (n, K) of the computed values on the rows of a table, by x."""
        columns = {channel.name: np.asarray(trial.inputs[channel.name]) for channel in self._formula.inputs}
        found = self._formula.derivatives(columns, self.space.by_name(x), self.space.varying)
        if found.shape[0] != len(trial):  # a formula without columns
            found = np.broadcast_to(found, (len(trial), found.shape[1]))
        with np.errstate(invalid="ignore"):
            return np.asarray(found @ self.space.varying_jacobian(x))

    def weight_of(self, trial: Trial) -> Array:
        """Relative weights (n,) of the rows of a table: the noise of a row is sigma / weight."""
        name = self._formula.weight
        return np.ones(len(trial)) if name is None else np.asarray(trial.inputs[name])

    def _predicted(self, X: Array) -> Array:
        """Computed values of candidates (P, K): (P, N)."""
        values = self.space.values(X)
        if self._formula.expression is not None:
            parameters: dict[str, Any] = {name: values[:, [k]] for k, name in enumerate(self.space.names)}
            return np.broadcast_to(self._formula.evaluate(self._columns, parameters), (len(X), len(self._measured)))
        found = np.empty((len(X), len(self._measured)))
        for candidate, row in enumerate(values):
            found[candidate] = self._formula.evaluate(self._columns, dict(zip(self.space.names, row.tolist())))
        return found

    def _derivatives(self, x: Array) -> Array:
        """Derivatives (N, 1, K) of the computed values, times the row's weight."""
        found = np.concatenate([self.slopes(x, trial) for trial in self.trials])
        return np.asarray(found[:, None, :] * self._weight[:, :, None])

    def _weighted_errors(self, x: Array) -> Array:
        weights = self._noise.weights
        return np.where(weights > 0, self.errors(x) * weights, 0.0)

    def _weighted_derivatives(self, x: Array) -> Array:
        weights = self._noise.weights[:, :, None]
        return np.where(weights > 0, -self._derivatives(x) * weights, 0.0)

    def _weights(self, where: str) -> Array:
        """Relative weights of the rows (N, 1)."""
        if self._formula.weight is None:
            return np.ones((len(self._measured), 1))
        found = self._columns[self._formula.weight]
        if (found < 0).any() or not (found > 0).any():
            raise BadInput(
                f"column {self._formula.weight!r} holds weights below zero, or none above it",
                where=where,
                do="Weights are 1 / standard deviation, up to a factor.",
            )
        return found[:, None]

    def _residual_blocks(self, output: str) -> tuple[ResidualBlock, ...]:
        found: list[ResidualBlock] = []
        first = 0
        for trial in self.trials:
            inside = (self._noise.rows >= first) & (self._noise.rows < first + len(trial))
            places: NDArray[np.intp] = np.flatnonzero(inside)
            if places.size:
                sample = self._noise.rows[places] - first
                t = np.asarray(trial.t)[sample]
                found.append(ResidualBlock("data", trial.name, output, places, t, sample, ordered=False))
            first += len(trial)
        return (*found, *prior_blocks(self.space.priors, self._noise.size))
