"""The model's parameters with what the study file says of them."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence
from typing import Any

from seatruth.errors import nearest
from seatruth.models.parameter import Parameter, Prior
from seatruth.study.schema import ModelTable, ParameterTable
from seatruth.study.validation import Problems

_COPIED = ("value", "min", "max", "scale", "expr", "vary")


def merged(
    declared: Sequence[Parameter], model: ModelTable, tables: Mapping[str, ParameterTable], problems: Problems
) -> tuple[Parameter, ...]:
    """All parameters of a model in its order, changed as the file says.

    Bounds that a model offers for a parameter hold unless the file gives others. A value that the file gives outside
    the model's own bounds is an error like any other: nothing is widened silently.
    """
    known = [parameter.name for parameter in declared]
    for name in tables:
        if name not in known:
            problems.add(("parameters", name), f"the model has no parameter {name!r}", nearest(name, known))
    freed = expand(model.vary, known, ("model", "vary"), "parameter", problems)
    result = []
    for parameter in declared:
        table = tables.get(parameter.name, ParameterTable())
        changes = _changes(parameter, table, parameter.name in freed, problems)
        with problems.at("parameters", parameter.name):
            parameter = parameter.replace(**changes)
        result.append(parameter)
    return tuple(result)


def free_of_model(tables: Mapping[str, ParameterTable], problems: Problems) -> tuple[Parameter, ...]:
    """The parameters of a formula, which the study file alone declares."""
    result = []
    for name, table in tables.items():
        with problems.at("parameters", name):
            plain = Parameter(name, 0.0, unit=table.unit or "1")
            result.append(plain.replace(**_changes(plain, table, False, problems, unit_allowed=True)))
    return tuple(result)


def expand(
    patterns: Sequence[str], known: Sequence[str], path: tuple[str, ...], what: str, problems: Problems
) -> list[str]:
    """The known names that the patterns take, in their order; a pattern that takes none is a problem."""
    taken: set[str] = set()
    for position, pattern in enumerate(patterns):
        matching = [name for name in known if fnmatch.fnmatchcase(name, pattern)]
        if not matching:
            problems.add((*path, position), f"no {what} {pattern!r}", nearest(pattern, known))
        taken.update(matching)
    return [name for name in known if name in taken]


def _changes(
    parameter: Parameter, table: ParameterTable, freed: bool, problems: Problems, *, unit_allowed: bool = False
) -> dict[str, Any]:
    stated = table.model_dump(exclude_none=True)
    changes: dict[str, Any] = {key: stated[key] for key in _COPIED if key in stated}
    if freed and "vary" not in changes and "expr" not in changes:
        changes["vary"] = True
    if "expr" in changes and parameter.vary and "vary" not in changes:
        changes["vary"] = False
    if table.prior is not None:
        changes["prior"] = Prior(table.prior.mean, table.prior.sd)
        if "expr" not in changes and parameter.expr is None:
            changes.setdefault("value", table.prior.mean)  # whoever states what is believed means to begin there
    if table.start is not None:
        changes["start"] = (table.start[0], table.start[1])
    if "value" in changes:
        changes["source"] = "study file"
    if table.unit is not None and not unit_allowed and table.unit != parameter.unit:
        problems.add(
            ("parameters", parameter.name, "unit"),
            f"{parameter.name} is in {parameter.unit!r}; the unit of a model's parameter cannot be changed",
            "Convert the numbers and remove `unit`.",
        )
    return changes
