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
    """The free parameters x (K,) of `parameters` (n_all), with ties, priors and constraints.

    Every parameter is free, fixed, or tied to others by an arithmetic expression. `free` are the free ones in their
    order; `moving` names those that depend on x (free ones first, then ties that lead to a free one), which is what a
    simulator must be able to set for each candidate. Raises BadInput for ties and constraints that are no arithmetic
    over the parameters and for ties that lead back to themselves.
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
        self._ties = self._ordered(self._read_ties())
        self._nominal = self._with_ties(np.array([parameter.value for parameter in self.parameters])[None])[0]
        if not np.isfinite(self._nominal).all():
            bad = self.names[int(np.flatnonzero(~np.isfinite(self._nominal))[0])]
            raise BadInput("its tie has no value at the start", where=f"parameter {bad!r}", do="Correct the tie.")
        moved = set(self.free_names)
        following = []
        for name, tie in self._ties:
            if moved & set(tie.names):
                moved.add(name)
                following.append(name)
        self.moving = (*self.free_names, *following)
        self._moving_columns = np.array([self._place[name] for name in self.moving], dtype=np.intp)
        self.constraints = tuple(Relation(text, self.names) for text in constraints)
        for relation in self.constraints:
            if not relation.holds(dict(zip(self.names, self._nominal))):
                raise BadInput(
                    "the start values break it", where=f"constraint {relation.text!r}", do="Change the start values."
                )
        with_prior = [place for place, parameter in enumerate(self.parameters) if self._counts(parameter)]
        self.priors = tuple(self.names[place] for place in with_prior)
        """Parameters whose prior counts: free ones, and tied ones that move with x."""
        self._prior_places = np.array(with_prior, dtype=np.intp)
        told = [self.parameters[place].prior for place in with_prior]
        self._prior_mean = np.array([prior.mean for prior in told if prior is not None])
        self._prior_sd = np.array([prior.sd for prior in told if prior is not None])

    @property
    def start(self) -> Array:
        """The free parameters' values (K,)."""
        return np.array([parameter.value for parameter in self.free])

    def nominal(self) -> dict[str, float]:
        """All parameters by name at the start, ties included."""
        return dict(zip(self.names, self._nominal.tolist()))

    def values(self, X: Any) -> Array:
        """All parameters of candidates: (P, K) -> (P, n_all)."""
        X = np.asarray(X, dtype=np.float64)
        found = np.broadcast_to(self._nominal, (len(X), len(self.names))).copy()
        found[:, self._columns] = X
        return self._with_ties(found)

    def moving_values(self, X: Array) -> Array:
        """What a simulator whose free parameters are `moving` takes: (P, K) -> (P, len(moving))."""
        if not self.follows:
            return X
        return self.values(X)[:, self._moving_columns]

    @property
    def follows(self) -> bool:
        """Whether a tie moves with x."""
        return len(self.moving) > len(self.free)

    def by_name(self, x: Array) -> dict[str, float]:
        """All parameters of one candidate (K,) by name."""
        return dict(zip(self.names, self.values(np.asarray(x)[None])[0].tolist()))

    def jacobian(self, x: Array) -> Array:
        """Derivatives of all parameters by the free ones at x (K,): (n_all, K). Exact, through the ties."""
        found = np.zeros((len(self.names), len(self.free)))
        found[self._columns, np.arange(len(self.free))] = 1.0
        if not self._ties:
            return found
        values = dict(zip(self.names, self.values(np.asarray(x)[None])[0]))
        for name, tie in self._ties:
            row = self._place[name]
            for used in tie.names:
                found[row] += float(tie.derivative(values, used)) * found[self._place[used]]
        return found

    def moving_jacobian(self, x: Array) -> Array:
        """Derivatives of the `moving` parameters by the free ones: (len(moving), K)."""
        return self.jacobian(x)[self._moving_columns]

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
        return parameter.prior is not None and parameter.name in self.moving

    def _with_ties(self, values: Array) -> Array:
        for name, tie in self._ties:
            by_name = {used: values[:, self._place[used]] for used in tie.names}
            values[:, self._place[name]] = tie.evaluate(by_name)
        return values

    def _read_ties(self) -> dict[str, Expression]:
        found = {}
        for parameter in self.parameters:
            if parameter.tie is not None:
                try:
                    found[parameter.name] = Expression(parameter.tie, self.names)
                except BadInput as problem:
                    where = f"parameter {parameter.name!r}, tie"
                    raise BadInput(problem.what, where=where, do=problem.do) from None
        return found

    def _ordered(self, ties: dict[str, Expression]) -> list[tuple[str, Expression]]:
        """The ties so that each stands after those it uses."""
        done: list[tuple[str, Expression]] = []
        waiting = dict(ties)
        while waiting:
            ready = [name for name, tie in waiting.items() if not set(tie.names) & set(waiting)]
            if not ready:
                name = next(iter(waiting))
                raise BadInput(
                    "its tie leads back to itself", where=f"parameter {name!r}", do=f"Free one of {', '.join(waiting)}."
                )
            done.extend((name, waiting.pop(name)) for name in ready)
        return done
