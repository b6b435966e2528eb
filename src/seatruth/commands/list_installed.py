"""`seatruth list models|effects|optimizers|costs|readers`: shows what is installed, plug-ins included."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from seatruth import models
from seatruth.commands.common import JsonFile, Result, console, say, table
from seatruth.costs.options import OPTIONS, option_names
from seatruth.errors import SeatruthError
from seatruth.models.parameter import Parameter
from seatruth.study.reference import kind
from seatruth.study.schema import CostTable
from seatruth.text import origin_legend

if TYPE_CHECKING:
    from seatruth.effects import Effect


class Kind(StrEnum):
    """Kinds of things that can be listed."""

    models = "models"
    effects = "effects"
    optimizers = "optimizers"
    costs = "costs"
    readers = "readers"


def list_installed(
    what: Annotated[Kind, typer.Argument(metavar="KIND", help="Kind of things to list.", show_choices=True)],
    long: Annotated[bool, typer.Option("--long", "-l", help="Also show parameters, options and sources.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """List what is installed, plug-ins included."""
    entries, columns = _LISTS[what]()
    shown = [column for column in columns if any(entry.get(column) for entry in entries)]
    rows = [[_cell(entry.get(column)) for column in shown] for entry in entries]
    titles = ["#" if column == "number" else column.capitalize() for column in shown]
    console().print(table(titles, rows, whole=("Name",)))
    if not entries:
        say(f"No {what.value} are installed.")
    for entry in entries:
        if entry.get("error"):
            say(f"! {entry['error']}", style="yellow")
    if long:
        for entry in entries:
            show_details(entry)
        if legend := origin_legend(_sources(entries)):
            say("")
            say(legend)
    return Result({what.value: entries})


def _sources(entries: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Every source that the details show: of entries and of their parameters."""
    for entry in entries:
        yield entry.get("source", "")
        yield from (parameter.get("source", "") for parameter in entry.get("parameters", ()))


def show_details(entry: Mapping[str, Any]) -> None:
    """Prints the description, parameters and options of one entry."""
    say("")
    say(f"{entry['name']}: {entry.get('title', '')}", style="bold")
    if entry.get("about"):
        say(entry["about"])
    for part in (
        "equation",
        "acts on",
        "source",
        "kinds",
        "never distinguished from",
        "confused with",
        "distinguished by",
    ):
        if entry.get(part):
            say(f"{part}: {_cell(entry[part])}")
    for part in ("parameters", "options", "sets"):
        values = entry.get(part)
        if not values:
            continue
        if not isinstance(values[0], dict):
            say(f"{part}: {', '.join(values)}")
            continue
        columns = list(values[0])
        console().print(table(columns, [[_cell(value[column]) for column in columns] for value in values]))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, (list, tuple)):
        return ", ".join(str(item) for item in value)
    return str(value)


def _optimizers() -> tuple[list[dict[str, Any]], Sequence[str]]:
    from seatruth.optimizers import available

    entries: list[dict[str, Any]] = [
        {
            "name": info.name,
            "title": info.title,
            "needs": sorted(info.needs),
            "package": info.package,
            "error": info.error,
            "about": info.doc,
            "options": [
                {"option": option.name, "is": option.kind, "default": _cell(option.default), "means": option.doc}
                for option in info.options
            ],
        }
        for info in available().values()
    ]
    return entries, ("name", "title", "needs")


def _costs() -> tuple[list[dict[str, Any]], Sequence[str]]:
    from seatruth.costs.registry import KINDS  # loads the engine, which no other list needs

    fields = CostTable.model_fields
    entries = [
        {
            "name": kind_of_cost.name,
            "title": kind_of_cost.title,
            "options": [
                {
                    "option": key,
                    "is": kind(fields[key].annotation).replace("`", ""),
                    "means": fields[key].description or "",
                }
                for key in option_names(OPTIONS[kind_of_cost.name])
            ],
        }
        for kind_of_cost in KINDS.values()
    ]
    return entries, ("name", "title")


def _models() -> tuple[list[dict[str, Any]], Sequence[str]]:
    entries: list[dict[str, Any]] = [{"name": name, "error": reason} for name, reason in models.broken().items()]
    for name in models.available():
        try:
            model = models.load_model(name)
        except SeatruthError as problem:
            entries.append({"name": name, "error": problem.message})
            continue
        entries.append(
            {
                "name": name,
                "title": model.title,
                "kind": model.kind,
                "states": [channel.name for channel in model.states],
                "inputs": [channel.name for channel in model.inputs],
                "outputs": [channel.name for channel in model.outputs],
                "source": model.source,
                "sets": list(getattr(model, "sets", ())),
                "parameters": [_parameter(parameter) for parameter in model.parameters],
            }
        )
    return sorted(entries, key=lambda entry: str(entry["name"])), ("name", "title", "kind", "inputs", "outputs")


def _readers() -> tuple[list[dict[str, Any]], Sequence[str]]:
    from seatruth.readers import available

    entries: list[dict[str, Any]] = [
        {
            "name": info.name,
            "title": info.title,
            "files": list(info.suffixes),
            "to install": f'pip install "{info.extra or " ".join(info.missing)}"' if info.missing else "",
            "package": info.package,
            "error": info.error,
            "about": info.doc,
            "options": list(info.options),
        }
        for info in available().values()
    ]
    return entries, ("name", "title", "files", "to install")


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "parameter": parameter.name,
        "value": parameter.value,
        "unit": parameter.unit,
        "means": parameter.description,
        "source": parameter.source,
    }


def effect_entry(effect: Effect) -> dict[str, Any]:
    """All that an effect declares, by what it is called in print."""
    return {
        "number": effect.number,
        "name": effect.name,
        "title": effect.title,
        "family": effect.family,
        "cause": effect.cause,
        "acts on": list(effect.acts_on),
        "about": inspect.getdoc(effect) or "",
        "equation": effect.equation,
        "source": effect.source,
        "kinds": list(effect.kinds),
        "never distinguished from": list(effect.equivalent),
        "confused with": list(effect.confused_with),
        "distinguished by": effect.distinguished_by,
        "black boxes": effect.suits_black_box,
        "parameters": [
            {
                "parameter": q.name,
                "null": float(effect.null[q.name]),
                "typical": abs(q.value - effect.null[q.name]) if q.prior is None else q.prior.sd,
                "shape": q.prior is not None,
                "unit": q.unit,
                "means": q.description,
            }
            for q in effect.parameters
        ],
    }


def _effects() -> tuple[list[dict[str, Any]], Sequence[str]]:
    from seatruth.effects import available, broken
    from seatruth.effects.reference import ordered

    entries = [effect_entry(effect) for effect in ordered(available().values())]
    entries += [{"name": name, "title": "cannot be loaded", "error": reason} for name, reason in broken().items()]
    return entries, ("number", "name", "title", "family")


_LISTS: dict[Kind, Callable[[], tuple[list[dict[str, Any]], Sequence[str]]]] = {
    Kind.models: _models,
    Kind.effects: _effects,
    Kind.optimizers: _optimizers,
    Kind.costs: _costs,
    Kind.readers: _readers,
}
