"""The readers that are installed: found through the entry points of every installed package."""

from __future__ import annotations

import dataclasses
import importlib.util
import inspect
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint
from typing import Any

from seatruth import plugins
from seatruth.errors import BadInput, PluginError, nearest
from seatruth.readers.base import Reader

GROUP = "seatruth.readers"


@dataclass(frozen=True)
class ReaderInfo:
    """One installed reader; `error` says why it cannot be used, "" if it can.

    `missing` names the modules that are not installed, and `extra` what to install for them.
    """

    name: str
    title: str = ""
    suffixes: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    extra: str = ""
    missing: tuple[str, ...] = ()
    package: str = ""
    doc: str = ""
    error: str = ""


def available() -> dict[str, ReaderInfo]:
    """All installed readers by name. A plug-in that cannot be loaded is listed with its error; the others work.

    Example:
        >>> from seatruth.readers import available
        >>> available()["csv"].suffixes[:2]
        ('.csv', '.txt')
    """
    found = {}
    for name, points in sorted(points_by_name().items()):
        package = plugins.packages(points)
        try:
            kind = load(name, points)
        except PluginError as problem:
            found[name] = ReaderInfo(name, package=package, error=problem.message)
            continue
        found[name] = ReaderInfo(
            name,
            kind.title,
            kind.suffixes,
            option_names(kind),
            kind.extra,
            missing_modules(kind),
            package,
            inspect.getdoc(kind) or "",
        )
    return found


def points_by_name() -> dict[str, list[EntryPoint]]:
    """Entry points of readers by name."""
    return _points(tuple(sys.path))


@cache
def _points(path: tuple[str, ...]) -> dict[str, list[EntryPoint]]:
    """The same for the places where Python looks for packages: to ask them all takes longer than to read a file."""
    return plugins.points_by_name(GROUP)


def load(name: str, points: Sequence[EntryPoint]) -> type[Reader]:
    """The class behind a name, or PluginError."""
    kind, where = plugins.load_plugin("reader", name, points)
    if not (isinstance(kind, type) and issubclass(kind, Reader)):
        raise PluginError("it is not a Reader", where=where, do="Derive it from seatruth.readers.Reader.")
    if inspect.isabstract(kind) or not dataclasses.is_dataclass(kind):
        raise PluginError("it lacks `recognises` or `read`, or is no dataclass", where=where)
    return kind


def option_names(kind: type[Reader]) -> tuple[str, ...]:
    """What a study may set of a reader, in [files]."""
    checked: Any = kind  # `load` has seen that it is a dataclass, which its type cannot say
    return tuple(field.name for field in dataclasses.fields(checked))


def missing_modules(kind: type[Reader]) -> tuple[str, ...]:
    """Modules that a reader imports and that are not installed."""
    return tuple(name for name in kind.modules if importlib.util.find_spec(name) is None)


def require(kind: type[Reader], where: str) -> None:
    """BadInput with the command to run if a module that the reader imports is not installed."""
    missing = missing_modules(kind)
    if missing:
        install = kind.extra or " ".join(missing)
        raise BadInput(
            f"it is {kind.title}; reading it needs {' and '.join(missing)}, which is not installed",
            where=where,
            do=f'Run: pip install "{install}"',
        )


def chosen(name: str) -> tuple[type[Reader], str]:
    """The reader of this name and where it is ("module:Class"); wrong names are refused with the nearest one."""
    points = points_by_name()
    if name not in points:
        raise BadInput(f"no reader {name!r} is installed", where="reader", do=nearest(name, points))
    return load(name, points[name]), points[name][0].value
