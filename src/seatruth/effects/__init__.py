"""Effects that a model may have left out, one small class each, found through entry points."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

from seatruth.effects.base import EQUATIONS, Effect, dimensions_of, effects_by_name
from seatruth.effects.extended import ExtendedModel, with_effects
from seatruth.effects.outside import ExtendedBlackBox
from seatruth.errors import PluginError

GROUP = "seatruth.effects"


def available() -> dict[str, Effect]:
    """Installed effects by name; those that cannot be loaded are in `broken()`."""
    return _found()[0]


def broken() -> dict[str, str]:
    """Installed effects that cannot be loaded, each with the reason."""
    return _found()[1]


def _found() -> tuple[dict[str, Effect], dict[str, str]]:
    effects: dict[str, Effect] = {}
    reasons: dict[str, str] = {}
    for point in sorted(set(entry_points(group=GROUP))):
        try:
            effects[point.name] = _load(point)
        except PluginError as problem:
            reasons[point.name] = problem.message
    return effects, reasons


def _load(point: EntryPoint) -> Effect:
    where = f"effect {point.name!r} ({point.value})"
    try:
        plugin = point.load()
        effect = plugin() if isinstance(plugin, type) else plugin
    except Exception as problem:
        raise PluginError(f"it cannot be loaded ({type(problem).__name__}: {problem})", where=where) from problem
    if not isinstance(effect, Effect):
        raise PluginError("it is not an Effect", where=where, do="Derive the class from seatruth.effects.Effect.")
    return effect


__all__ = [
    "EQUATIONS",
    "Effect",
    "ExtendedBlackBox",
    "ExtendedModel",
    "available",
    "broken",
    "dimensions_of",
    "effects_by_name",
    "with_effects",
]
