"""The model that a study file names: an installed one, or a class in a user's file."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from seatruth.errors import BadInput, PluginError, nearest
from seatruth.models.base import Model
from seatruth.studyfile import model_file

GROUP = "seatruth.models"


def load(use: str, folder: Path, parameter_set: str | None = None) -> Model:
    """A model by its installed name or as "file.py:ClassName" relative to `folder`, with one of its parameter sets."""
    if model_file.is_file(use):
        found, where = model_file.load(use, folder), use
    else:
        found, where = plugin(use), f"model {use!r}"
    if parameter_set is None:
        return model_file.instance(found, where)
    sets = parameter_sets(found)
    if parameter_set not in sets:
        hint = nearest(parameter_set, sets) if sets else "Remove `set`, or give the values in [parameters]."
        what = f"has no parameter set {parameter_set!r}" if sets else "offers no parameter sets"
        raise BadInput(f"{where} {what}", do=hint)
    return model_file.instance(lambda: found(parameter_set), where)


def names() -> dict[str, EntryPoint]:
    """Installed models by name."""
    return {point.name: point for point in entry_points(group=GROUP)}


def plugin(name: str) -> Any:
    """The installed model class of this name; BadInput if there is none, PluginError if it cannot be loaded."""
    known = names()
    if name not in known:
        raise BadInput(f"there is no model {name!r}", do=f'{nearest(name, known)} Your own: "file.py:ClassName".')
    try:
        return known[name].load()
    except Exception as problem:
        raise PluginError(
            f"it cannot be loaded ({type(problem).__name__}: {problem})", where=f"model {name!r}"
        ) from problem


def parameter_sets(found: Any) -> list[str]:
    """Names of the parameter sets that a model class offers in its attribute `sets`."""
    return list(getattr(found, "sets", ()))
