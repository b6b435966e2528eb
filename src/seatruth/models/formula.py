"""A static formula as a model: y = f(columns, parameters), from a text (parsed, never run as code) or a callable."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, PluginError, nearest
from seatruth.expression import Expression, equation, names_in
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

Callback = Callable[[Mapping[str, Array], Mapping[str, float]], Any]


class Formula(BlackBox):
    """y = f(columns, parameters) on the rows of a table; a trial is a table, its "time" counts the rows.

    `formula` is an equation as "D = (a1*Fr**3 + a2*Fr) / (a4*delta + a5)", whose names are parameters or columns, or a
    callable f(columns, parameters) -> (n,) of arrays and numbers by name. `output` names y (an equation names it
    itself), `columns` the inputs, `units` of columns and output where they are not 1. `weight` names a column of
    relative weights: the noise of a row is sigma / weight.
    """

    def __init__(
        self,
        formula: str | Callback,
        parameters: Sequence[Parameter],
        columns: Sequence[str] | None = None,
        *,
        output: str | None = None,
        name: str = "formula",
        units: Mapping[str, str] | None = None,
        weight: str | None = None,
        title: str = "",
        source: str = "",
    ) -> None:
        units = dict(units or {})
        self.expression: Expression | None = None
        self.callback: Callback | None = None
        known = [parameter.name for parameter in parameters]
        if isinstance(formula, str):
            left, right = equation(formula) if "=" in formula else (output or "y", formula)
            if output is not None and output != left:
                raise BadInput(f"the formula gives {left!r}, not {output!r}", where=f"formula {name!r}")
            if left in known:
                raise BadInput(f"{left!r} is a parameter and cannot be what the formula gives", where="formula")
            allowed = [*known, *(columns if columns is not None else _columns_in(right, known))]
            self.expression = Expression(right, allowed, what="parameter or column")
            wanted = [column for column in self.expression.names if column not in known]
            self.text, output = f"{left} = {right}", left
        else:
            if columns is None:
                raise BadInput("a callable formula needs the names of its columns", where=f"formula {name!r}")
            self.callback, wanted, self.text = formula, list(columns), ""
        if self.expression is not None:
            # A parameter that only expressions use is used too.
            used = {*self.expression.names}.union(*(names_in(q.expr) for q in parameters if q.expr is not None))
            unused = [known_name for known_name in known if known_name not in used]
            if unused:
                hint = nearest(unused[0], self.expression.names).split("Known:")[0].strip()
                do = hint or "Use it in the expression, or take it out of the parameters."
                raise BadInput(f"it has no parameter {unused[0]!r}", where=f"formula {self.text!r}", do=do)
        self.weight = weight
        if weight is not None and weight not in wanted:
            wanted.append(weight)
        clash = sorted({*wanted} & {*known, output or "y"})
        if clash:
            raise BadInput(f"{clash[0]!r} is both a column and something else", where=f"formula {name!r}")
        super().__init__(
            name,
            self._on_trial,
            inputs=[Channel(column, units.get(column, "1")) for column in wanted],
            outputs=[Channel(output or "y", units.get(output or "y", "1"))],
            parameters=parameters,
            kind="formula",
            title=title or self.text or f"formula {name}",
            source=source,
        )

    def evaluate(self, columns: Mapping[str, Array], parameters: Mapping[str, Any]) -> Array:
        """y (n,), or (P, n) where parameters are (P, 1) (expressions only); not finite where it has no value."""
        rows = len(next(iter(columns.values()))) if columns else 1
        if self.expression is not None:
            result = self.expression.evaluate({**columns, **parameters})
            sizes = [np.shape(value)[0] for value in parameters.values() if np.ndim(value) == 2]
            shape = (max(sizes), rows) if sizes else (rows,)
            return np.asarray(np.broadcast_to(np.asarray(result, dtype=np.float64), shape))
        assert self.callback is not None
        where = f"model {self.name!r}"
        try:
            with np.errstate(all="ignore"):
                y = np.asarray(self.callback(dict(columns), dict(parameters)), dtype=np.float64)
        except Exception as problem:
            raise PluginError(
                f"the formula raised {type(problem).__name__}: {problem}", where=where, do="Correct it."
            ) from problem
        if y.shape not in ((rows,), ()):
            raise PluginError(f"the formula returned shape {y.shape} for {rows} rows", where=where, do="Correct it.")
        return np.asarray(np.broadcast_to(y, (rows,)))

    def derivatives(self, columns: Mapping[str, Array], parameters: Mapping[str, float], free: Sequence[str]) -> Array:
        """Derivatives (n, K) by the named parameters: exact of an expression, central differences of a callable."""
        rows = len(next(iter(columns.values()))) if columns else 1
        result = np.empty((rows, len(free)))
        for k, name in enumerate(free):
            if self.expression is not None:
                result[:, k] = self.expression.derivative({**columns, **parameters}, name)
            else:
                step = 6e-6 * max(abs(parameters[name]), abs(self.parameter(name).value), 1e-3)
                ahead, behind = (
                    self.evaluate(columns, {**parameters, name: parameters[name] + sign * step}) for sign in (1, -1)
                )
                result[:, k] = (ahead - behind) / (2 * step)
        return result

    def _on_trial(
        self, trial: Trial, parameters: dict[str, float], first_state: dict[str, float] | None
    ) -> dict[str, Array]:
        columns = {channel.name: np.asarray(trial.inputs[channel.name]) for channel in self.inputs}
        result = self.evaluate(columns, parameters)
        return {self.outputs[0].name: np.broadcast_to(result, (len(trial),)) if result.shape == (1,) else result}


def _columns_in(text: str, known: Sequence[str]) -> list[str]:
    """Names in an expression that are no parameters: its columns."""
    return [name for name in names_in(text) if name not in known]
