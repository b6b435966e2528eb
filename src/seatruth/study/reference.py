"""The reference of the study file in docs/study-file.md, generated from the descriptions in the schema."""

from __future__ import annotations

import inspect
import types
import typing
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from seatruth.study import schema, schema_trials
from seatruth.trials.prepare import STEPS

_TABLES: tuple[tuple[str, type[BaseModel]], ...] = (
    ("[study]", schema.StudyTable),
    ("[model]", schema.ModelTable),
    ("[model.actuators.NAME]", schema.ModelActuatorTable),
    ("[formula]", schema.FormulaTable),
    ("[parameters.NAME]", schema.ParameterTable),
    ("prior = { ... } of a parameter", schema.PriorTable),
    ("[actuators.NAME]", schema_trials.ActuatorTable),
    ("[time]", schema_trials.TimeTable),
    ("[channels.NAME]", schema_trials.ChannelTable),
    ("[frames]", schema_trials.FramesTable),
    ("[files]", schema_trials.FilesTable),
    ("[[trials]]", schema_trials.TrialTable),
    ("[[prepare]]", schema_trials.PrepareTable),
    ("[noise]", schema.StudyFile),
    ("[cost]", schema.CostTable),
    ("[optimizer]", schema.OptimizerTable),
    ("[budget]", schema.BudgetTable),
    ("[output]", schema.OutputTable),
)

NOISE = (
    'One entry for each channel: its standard deviation as a number in SI units, as text with a unit ("0.1 deg"), or '
    '"estimate" (the default), which estimates it from the residuals. That of latitude and longitude is read in '
    'metres, "0.1 m": it is that of x and y, which they become. To `identify` it is all that model and sensors miss, '
    "by which channels and priors are weighed; `diagnose` takes it for the white part, as a data sheet has it, and "
    "finds slow errors beside it. So leave a data sheet's value out for `identify`, unless the model is as good as "
    "that: it draws coefficients far from their priors to fit what a model of another form cannot."
)


def markdown() -> str:
    """The tables of docs/study-file.md, from the heading "Reference" on."""
    parts = ["## Reference", ""]
    for title, table in _TABLES:
        parts += [f"### `{title}`" if title.startswith("[") else f"### {title}", ""]
        if title == "[noise]":
            parts += [NOISE, ""]
            continue
        parts += [inspect.cleandoc(table.__doc__ or "").replace("\n", " "), "", "| key | is | means |", "|---|---|---|"]
        parts += rows(table)
        parts.append("")
        if title == "[[prepare]]":
            parts += _steps()
    return "\n".join(parts).rstrip() + "\n"


def rows(table: type[BaseModel]) -> list[str]:
    """One row of Markdown for each key of a table."""
    return [_row(name, field) for name, field in table.model_fields.items()]


def _steps() -> list[str]:
    """The preparation steps and their options, from the registry."""
    parts = ["The steps and their options:", "", "| step | does | options |", "|---|---|---|"]
    for name, step in sorted(STEPS.items()):
        about = " ".join(inspect.cleandoc(step.options.__doc__ or "").split()).replace("|", "\\|")
        options = [
            f"`{key}` {kind(field.annotation)}{_default(field)}" for key, field in step.options.model_fields.items()
        ]
        parts.append(f"| `{name}` | {step.summary} {about} | {'; '.join(options)} |")
    return [*parts, ""]


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return ", required"
    default = field.get_default(call_default_factory=True)
    return "" if default in (None, {}, []) else f" = `{_toml(default)}`"


def _row(name: str, field: FieldInfo) -> str:
    text = (field.description or "").replace("|", "\\|")
    default = field.get_default(call_default_factory=True) if not field.is_required() else None
    if field.is_required():
        text += " **Required.**"
    elif default not in (None, "", [], {}) and not isinstance(default, BaseModel):
        text += f" Default: `{_toml(default)}`."
    return f"| `{name}` | {kind(field.annotation)} | {text} |"


def kind(annotation: Any) -> str:
    """A type in plain words: "number", "true or false", "list of texts", or the allowed words."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is typing.Annotated:
        return kind(arguments[0])
    if origin is Literal:
        return " or ".join(f"`{_toml(a)}`" for a in arguments)
    if origin in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(kind(a) for a in arguments if a is not type(None)))
    if origin is list:
        of = kind(arguments[0])
        words = of.split(" or ") if get_origin(arguments[0]) is not Literal else []
        return f"list of {' or '.join(f'{one}s' for one in words) or of}"
    if origin is dict:
        return f"table; each entry: {kind(arguments[1])}"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "table"
    return {bool: "true or false", int: "whole number", float: "number", str: "text"}.get(annotation, "value")


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else f"{value}"
