"""All parameters of a model, and the vector of the free ones that an optimizer moves."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.expression import Expression, Relation
from seatruth.models.parameter import Parameter


class ParameterSpace:
    """The free parameters x (K,) of `parameters` (n_all), with expressions, priors and constraints.

    Every parameter is free, fixed, or set from others by an arithmetic expression (`expr`). `free` are the free ones
    in their order. `varying` names those that depend on x (the free ones, then expressions that lead to a free one):
    a simulator must set these for each candidate. Raises BadInput for expressions and constraints that are not
    arithmetic over the parameters, and for circular expressions.
    """

    def __init__(self, parameters: Sequence[Parameter], constraints: Sequence[str] = ()) -> None:
        self.parameters = tuple(parameters)
        self.names = tuple(parameter.name for parameter in self.parameters)
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            raise BadInput(f"two parameters are called {twice[0]!r}")
        self.free = tuple(parameter for parameter in self.parameters if parameter.vary)
        self.free_names = tuple(parameter.name for parameter in self.free)
        self._place = {name: place for place, name in enumerate(self.names)}
        self._columns = np.array([self._place[name] for name in self.free_names], dtype=np.intp)
        self._expressions = self._ordered(self._read_expressions())
        self._nominal = self._with_expressions(np.array([parameter.value for parameter in self.parameters])[None])[0]
        if not np.isfinite(self._nominal).all():
            bad = self.names[int(np.flatnonzero(~np.isfinite(self._nominal))[0])]
            raise BadInput("its expression has no value at the start", where=f"parameter {bad!r}", do="Correct `expr`.")
        changed = set(self.free_names)
        dependent = []
        for name, expression in self._expressions:
            if changed & set(expression.names):
                changed.add(name)
                dependent.append(name)
        self.varying = (*self.free_names, *dependent)
        self._varying_columns = np.array([self._place[name] for name in self.varying], dtype=np.intp)
        self.constraints = tuple(Relation(text, self.names) for text in constraints)
        for relation in self.constraints:
            if not relation.holds(dict(zip(self.names, self._nominal))):
                raise BadInput(
                    "the start values break it", where=f"constraint {relation.text!r}", do="Change the start values."
                )
        with_prior = [place for place, parameter in enumerate(self.parameters) if self._counts(parameter)]
        self.priors = tuple(self.names[place] for place in with_prior)
        """Parameters whose prior counts: free ones, and expressions that vary with x."""
        self._prior_places = np.array(with_prior, dtype=np.intp)
        priors = [self.parameters[place].prior for place in with_prior]
        self._prior_mean = np.array([prior.mean for prior in priors if prior is not None])
        self._prior_sd = np.array([prior.sd for prior in priors if prior is not None])

    @property
    def start(self) -> Array:
        """The free parameters' values (K,)."""
        return np.array([parameter.value for parameter in self.free])

    def nominal(self) -> dict[str, float]:
        """All parameters by name at the start, expressions included."""
        return dict(zip(self.names, self._nominal.tolist()))

    def values(self, X: Any) -> Array:
        """All parameters of candidates: (P, K) -> (P, n_all)."""
        X = np.asarray(X, dtype=np.float64)
        found = np.broadcast_to(self._nominal, (len(X), len(self.names))).copy()
        found[:, self._columns] = X
        return self._with_expressions(found)

    def varying_values(self, X: Array) -> Array:
        """What a simulator whose free parameters are `varying` takes: (P, K) -> (P, len(varying))."""
        if not self.has_ties:
            return X
        return self.values(X)[:, self._varying_columns]

    @property
    def has_ties(self) -> bool:
        """Whether an expression varies with x."""
        return len(self.varying) > len(self.free)

    def by_name(self, x: Array) -> dict[str, float]:
        """All parameters of one candidate (K,) by name."""
        return dict(zip(self.names, self.values(np.asarray(x)[None])[0].tolist()))

    def jacobian(self, x: Array) -> Array:
        """Derivatives of all parameters by the free ones at x (K,): (n_all, K). Exact, through the expressions."""
        found = np.zeros((len(self.names), len(self.free)))
        found[self._columns, np.arange(len(self.free))] = 1.0
        if not self._expressions:
            return found
        values = dict(zip(self.names, self.values(np.asarray(x)[None])[0]))
        for name, expression in self._expressions:
            row = self._place[name]
            for used in expression.names:
                found[row] += float(expression.derivative(values, used)) * found[self._place[used]]
        return found

    def varying_jacobian(self, x: Array) -> Array:
        """Derivatives of the `varying` parameters by the free ones: (len(varying), K)."""
        return self.jacobian(x)[self._varying_columns]

    def feasible(self, X: Array) -> NDArray[np.bool_]:
        """Which candidates (P, K) keep every constraint: (P,)."""
        found = np.ones(len(X), dtype=np.bool_)
        if self.constraints:
            values = self.values(X)
            by_name = {name: values[:, place] for name, place in self._place.items()}
            for relation in self.constraints:
                found &= relation.holds(by_name)
        return found

    def prior_residuals(self, X: Array) -> Array:
        """(value - mean) / sd of every parameter with a prior that counts: (P, K) -> (P, n_priors)."""
        if not self.priors:
            return np.zeros((len(X), 0))
        return np.asarray((self.values(X)[:, self._prior_places] - self._prior_mean) / self._prior_sd)

    def prior_jacobian(self, x: Array) -> Array:
        """Derivative of `prior_residuals`: (n_priors, K)."""
        return np.asarray(self.jacobian(x)[self._prior_places] / self._prior_sd[:, None])

    def describe(self) -> dict[str, Any]:
        """Everything that makes this space what it is."""
        return {
            "parameters": [dataclasses.asdict(parameter) for parameter in self.parameters],
            "constraints": [relation.text for relation in self.constraints],
        }

    def _counts(self, parameter: Parameter) -> bool:
        return parameter.prior is not None and parameter.name in self.varying

    def _with_expressions(self, values: Array) -> Array:
        for name, expression in self._expressions:
            by_name = {used: values[:, self._place[used]] for used in expression.names}
            values[:, self._place[name]] = expression.evaluate(by_name)
        return values

    def _read_expressions(self) -> dict[str, Expression]:
        found = {}
        for parameter in self.parameters:
            if parameter.expr is not None:
                try:
                    found[parameter.name] = Expression(parameter.expr, self.names)
                except BadInput as problem:
                    where = f"parameter {parameter.name!r}, expr"
                    raise BadInput(problem.what, where=where, do=problem.do) from None
        return found

    def _ordered(self, expressions: dict[str, Expression]) -> list[tuple[str, Expression]]:
        """The expressions, each after those that it uses."""
        done: list[tuple[str, Expression]] = []
        waiting = dict(expressions)
        while waiting:
            ready = [name for name, expression in waiting.items() if not set(expression.names) & set(waiting)]
            if not ready:
                name = next(iter(waiting))
                raise BadInput(
                    "its expression leads back to itself",
                    where=f"parameter {name!r}",
                    do=f"Free one of {', '.join(waiting)}.",
                )
            done.extend((name, waiting.pop(name)) for name in ready)
        return done
