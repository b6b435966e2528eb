"""Effects that a model may have left out, one small class each, found through entry points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from seatruth.effects.base import EQUATIONS, Effect
from seatruth.effects.black_box import ExtendedBlackBox
from seatruth.effects.extended import ExtendedModel, with_effects
from seatruth.effects.vehicle import dimensions_of
from seatruth.errors import BadInput, PluginError, nearest
from seatruth.models.base import Model
from seatruth.models.user_file import is_file, load_object

GROUP = "seatruth.effects"


def available() -> dict[str, Effect]:
    """Installed effects by name; those that cannot be loaded are in `broken()`."""
    return _found()[0]


def available_on(model: Model) -> dict[str, Effect]:
    """Installed effects by name, and each on one of a model's actuators alone: "thruster_gain_port"."""
    return {form.name: form for effect in available().values() for form in (effect, *effect.variants(model))}


def broken() -> dict[str, str]:
    """Installed effects that cannot be loaded, each with the reason."""
    return _found()[1]


def load_effects(specs: Sequence[str], folder: str | Path | None = None, model: Model | None = None) -> list[Effect]:
    """Effects by their installed names, or from a user's files as "file.py:ClassName" relative to `folder`.

    With a model, the names of effects on one of its actuators alone are known too: "thruster_gain_port". BadInput names
    the nearest known one; PluginError says where a file raised.
    """
    place = Path(folder) if folder is not None else Path.cwd()
    known: Mapping[str, Effect] = {}
    if any(not is_file(spec) for spec in specs):
        known = available() if model is None else available_on(model)
    return [_of_file(spec, place) if is_file(spec) else effects_by_name([spec], known)[0] for spec in specs]


def effects_by_name(names: Sequence[str], known: Mapping[str, Effect]) -> list[Effect]:
    """Effects by name; BadInput names the nearest known one, or those on one actuator alone of which it may be one."""
    for name in names:
        if name not in known:
            whole = max((one for one in known if name.startswith(f"{one}_")), key=len, default="")
            forms = [one for one in known if whole and one.startswith(f"{whole}_") and known[one].which]
            do = f"On one actuator alone there are: {', '.join(forms)}." if forms else nearest(name, known)
            raise BadInput(f"there is no effect {name!r}", do=do)
    return [known[name] for name in names]


def _of_file(spec: str, folder: Path) -> Effect:
    result = load_object(spec, folder, "effect")
    try:
        effect = result() if isinstance(result, type) else result
    except PluginError:
        raise
    except Exception as problem:
        what = f"making it raised {type(problem).__name__}: {problem}"
        raise PluginError(what, where=spec, do="Correct the effect file.") from problem
    if not isinstance(effect, Effect):
        raise BadInput("it is no Effect", where=spec, do="Derive the class from seatruth.effects.Effect.")
    return effect


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
    "available_on",
    "broken",
    "dimensions_of",
    "effects_by_name",
    "load_effects",
    "with_effects",
]
