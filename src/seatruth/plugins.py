"""Plug-ins: what the installed packages name in their entry points, and the loading of one of them."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from seatruth.errors import PluginError


def points_by_name(group: str) -> dict[str, list[EntryPoint]]:
    """Entry points of a group by name; the same object registered twice (a package seen on two paths) counts once."""
    points: dict[str, list[EntryPoint]] = {}
    for point in entry_points(group=group):
        same = points.setdefault(point.name, [])
        if all(point.value != other.value for other in same):
            same.append(point)
    return points


def load_plugin(kind: str, name: str, points: Sequence[EntryPoint]) -> tuple[Any, str]:
    """What the entry points of a name lead to, and what to call it in messages.

    Args:
        kind: what it is, for messages ("reader").
        name: its name.
        points: its entry points, of `points_by_name`.

    Raises:
        PluginError: several packages provide it, or it cannot be imported.
    """
    where = f"{kind} {name!r} ({points[0].value})"
    if len(points) > 1:
        several = ", ".join(point.value for point in points)
        raise PluginError(f"several packages provide it: {several}", where=where, do="Uninstall one.")
    try:
        return points[0].load(), where
    except Exception as problem:
        raise PluginError(f"it cannot be loaded ({type(problem).__name__}: {problem})", where=where) from problem


def packages(points: Sequence[EntryPoint]) -> str:
    """The packages that provide a plug-in, in words."""
    return ", ".join(dict.fromkeys(point.dist.name if point.dist else "?" for point in points))
