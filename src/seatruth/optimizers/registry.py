"""The optimizers that are installed: found through the entry points of every installed package."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from typing import Any

from seatruth.costs.base import Ability
from seatruth.errors import BadInput, PluginError, nearest
from seatruth.optimizers.base import Optimizer, with_options
from seatruth.optimizers.chain import Chain
from seatruth.plugins import load_plugin, packages, points_by_name

GROUP = "seatruth.optimizers"


@dataclass(frozen=True)
class OptionInfo:
    """One option of an optimizer, for lists and help texts."""

    name: str
    kind: str
    default: Any
    doc: str


@dataclass(frozen=True)
class OptimizerInfo:
    """One installed optimizer; `error` says why it cannot be used, "" if it can."""

    name: str
    title: str
    needs: frozenset[Ability]
    options: tuple[OptionInfo, ...]
    package: str
    doc: str = ""
    error: str = ""


def available() -> dict[str, OptimizerInfo]:
    """All installed optimizers by name. A plug-in that cannot be loaded is listed with its error; the others work."""
    return {name: _describe(name, points) for name, points in sorted(points_by_name(GROUP).items())}


def names() -> list[str]:
    """Names of all installed optimizers; none of them is loaded."""
    return sorted(points_by_name(GROUP))


def describe(name: str) -> OptimizerInfo:
    """One installed optimizer of `names()`; no other is loaded."""
    return _describe(name, points_by_name(GROUP)[name])


def _describe(name: str, points: Sequence[EntryPoint]) -> OptimizerInfo:
    package = packages(points)
    try:
        plugin = _load(name, points)
    except PluginError as problem:
        return OptimizerInfo(name, "", frozenset(), (), package, error=problem.message)
    kind = plugin if isinstance(plugin, type) else type(plugin)
    options = () if isinstance(plugin, Optimizer) else tuple(_info(field) for field in dataclasses.fields(kind))
    return OptimizerInfo(name, plugin.title, plugin.needs, options, package, inspect.getdoc(kind) or "")


def make(name: str, **options: Any) -> Optimizer:
    """The installed optimizer of this name with these options; wrong names are refused with the nearest one."""
    points = points_by_name(GROUP)
    if name not in points:
        raise BadInput(f"no optimizer {name!r} is installed", where="optimizer", do=nearest(name, points))
    plugin = _load(name, points[name])
    if isinstance(plugin, type):
        return with_options(plugin, options)
    if options:
        raise BadInput("it takes no options", where=f"optimizer {name!r}")
    return plugin


def as_optimizer(given: str | Optimizer | Sequence[str | Optimizer]) -> Optimizer:
    """An optimizer from a name, an optimizer, or a list of these (a hybrid, run in turn)."""
    if isinstance(given, str):
        return make(given)
    if isinstance(given, Optimizer):
        return given
    if isinstance(given, Sequence) and given:
        stages = tuple(as_optimizer(stage) for stage in given)
        return stages[0] if len(stages) == 1 else Chain(stages)
    raise BadInput(
        f"{given!r} is not an optimizer", where="optimizer", do="Give a name, an optimizer or a list of them."
    )


def fitting(gives: frozenset[Ability]) -> list[str]:
    """Names of the installed optimizers that need no more than this."""
    return [info.name for info in available().values() if not info.error and info.needs <= gives]


def _load(name: str, points: Sequence[EntryPoint]) -> type[Optimizer] | Optimizer:
    """The plug-in behind a name, or PluginError."""
    plugin, where = load_plugin("optimizer", name, points)
    if isinstance(plugin, Optimizer):
        return plugin
    if not (isinstance(plugin, type) and issubclass(plugin, Optimizer)):
        raise PluginError("it is not an Optimizer", where=where, do="Derive it from seatruth.optimizers.Optimizer.")
    if inspect.isabstract(plugin):
        raise PluginError("it has no method `run`", where=where)
    if not isinstance(getattr(plugin, "name", None), str):
        raise PluginError("it has no `name`", where=where)
    return plugin


def _info(field: dataclasses.Field[Any]) -> OptionInfo:
    kind = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", str(field.type))
    default = None if field.default is dataclasses.MISSING else field.default
    doc = str(field.metadata.get("doc", ""))
    if field.metadata.get("choices"):
        doc = f"{doc} ({', '.join(field.metadata['choices'])})"
    return OptionInfo(field.name, kind, default, doc)
