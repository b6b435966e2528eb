"""Installed models, listed through the entry points of every package, and models from a user's file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from seatruth.errors import BadInput, PluginError, SeatruthError, nearest
from seatruth.models.base import Model
from seatruth.models.fmu import load_fmu
from seatruth.models.user_file import is_file, load_object
from seatruth.plugins import load_plugin, points_by_name

GROUP = "seatruth.models"


def available() -> dict[str, type[Model]]:
    """Installed model classes by name; those that cannot be loaded are in `broken()`."""
    result = {}
    for name in sorted(points_by_name(GROUP)):
        try:
            result[name] = _load(name)
        except PluginError:
            continue
    return result


def broken() -> dict[str, str]:
    """Installed models that cannot be loaded, each with the reason."""
    reasons = {}
    for name in sorted(points_by_name(GROUP)):
        try:
            _load(name)
        except PluginError as problem:
            reasons[name] = problem.message
    return reasons


def load_model(spec: str, base_dir: str | Path | None = None, parameter_set: str | None = None) -> Model:
    """A model by its installed name, or from a user's file.

    Args:
        spec: a name of `seatruth list models`, "path.py:ClassName", or "path.fmu" (`load_fmu` takes its options).
        base_dir: folder to which that path is relative; None takes the working directory.
        parameter_set: one of the sets of values that the model offers in `sets`; None takes its own.

    Returns:
        The model.

    Raises:
        BadInput: no model or parameter set has this name; the message names the nearest one.
        PluginError: the plug-in or the file raised.

    Example:
        >>> from seatruth import load_model
        >>> [channel.name for channel in load_model("mmg", parameter_set="KVLCC2").inputs]
        ['delta', 'n']
    """
    if spec.endswith(".fmu"):
        if parameter_set is not None:
            raise BadInput("an FMU offers no parameter sets", where=spec, do="Leave out `set`.")
        return load_fmu((Path(base_dir) if base_dir is not None else Path.cwd()) / spec)
    if is_file(spec):
        result, where = load_object(spec, Path(base_dir) if base_dir is not None else Path.cwd()), spec
    else:
        known = points_by_name(GROUP)
        if spec not in known:
            raise BadInput(
                f"there is no model {spec!r}",
                do=f'{nearest(spec, known)} Your own: "file.py:ClassName", or "file.fmu".',
            )
        result, where = _load(spec), f"model {spec!r}"
    if parameter_set is None:
        return _instance(result, (), where)
    sets = tuple(getattr(result, "sets", ()))
    if parameter_set not in sets:
        what = f"there is no parameter set {parameter_set!r}" if sets else "it offers no parameter sets"
        raise BadInput(what, where=where, do=nearest(parameter_set, sets))
    return _instance(result, (parameter_set,), where)


def _load(name: str) -> type[Model]:
    """The model class behind an installed name, or PluginError."""
    plugin, where = load_plugin("model", name, points_by_name(GROUP)[name])
    if not (isinstance(plugin, type) and issubclass(plugin, Model)):
        raise PluginError("it is not a Model", where=where, do="Derive the class from seatruth.models.Model.")
    return plugin


def _instance(result: Any, arguments: tuple[str, ...], where: str) -> Model:
    """A model from a Model class, a Model, or a function that makes one."""
    made = result
    if callable(result) and not isinstance(result, Model):
        try:
            made = result(*arguments)
        except SeatruthError:
            raise
        except Exception as problem:
            raise PluginError(
                f"making it raised {type(problem).__name__}: {problem}", where=where, do="Correct the model file."
            ) from problem
    if not isinstance(made, Model):
        raise BadInput("it is no Model", where=where, do="Derive the class from seatruth.models.Model.")
    return made
