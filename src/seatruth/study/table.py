"""A study of a static formula from a table in memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.costs.options import FormulaOptions
from seatruth.costs.problem import Deviation
from seatruth.errors import BadInput, nearest
from seatruth.models.formula import Callback, Formula
from seatruth.models.parameter import Parameter
from seatruth.study.study import Study
from seatruth.trials.trial import Trial, Trials


def formula_study(
    formula: str | Callback,
    data: pd.DataFrame | Mapping[str, Any],
    parameters: Sequence[Parameter],
    *,
    output: str | None = None,
    columns: Sequence[str] | None = None,
    noise: Deviation = "estimate",
    weight: str | None = None,
    units: Mapping[str, str] | None = None,
    constraints: Sequence[str] = (),
    name: str = "formula",
    synthetic: bool = False,
    source: str = "",
) -> Study:
    """The study of fitting a formula to a table: `cost_of(formula_study("D = a*Fr + b", table, parameters))`.

    `data` holds columns by name; `output`, `columns`, `units` and `weight` are those of `Formula`. `noise` is the
    standard deviation of the output, or "estimate". Rows whose output is not a number do not count.
    """
    model = Formula(formula, parameters, columns, output=output, name=name, units=units, weight=weight)
    trial = table_trial(model, data, name, synthetic=synthetic, source=source)
    return Study(
        name=name,
        model=model,
        trials=Trials([trial]),
        parameters=tuple(parameters),
        constraints=tuple(constraints),
        cost=FormulaOptions(),
        noise={model.outputs[0].name: noise},
    )


def table_trial(
    model: Formula, data: pd.DataFrame | Mapping[str, Any], name: str, *, synthetic: bool = False, source: str = ""
) -> Trial:
    """A table as the trial of a formula; its time counts the rows. Raises BadInput for columns that are missing."""
    known = [str(column) for column in data]
    columns = {}
    for channel in (*model.inputs, *model.outputs):
        if channel.name not in known:
            raise BadInput(
                f"the table has no column {channel.name!r}", where=f"formula {name!r}", do=nearest(channel.name, known)
            )
        try:
            columns[channel.name] = np.asarray(data[channel.name], dtype=np.float64).ravel()
        except (TypeError, ValueError):
            raise BadInput(
                f"column {channel.name!r} holds something that is no number", where=f"formula {name!r}"
            ) from None
    rows = len(columns[model.outputs[0].name])
    output = model.outputs[0].name
    return Trial(
        name,
        np.arange(rows, dtype=np.float64),
        {channel.name: columns[channel.name] for channel in model.inputs},
        {output: columns[output]},
        synthetic=synthetic,
        source=source,
    )
