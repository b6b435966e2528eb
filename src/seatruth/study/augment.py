"""A study file with named effects at their reported values added to its model, and no other change."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from seatruth.models.parameter import Prior
from seatruth.models.user_file import is_file

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def augmented(
    source: Path,
    folder: Path,
    name: str,
    effects: Mapping[str, str],
    values: Mapping[str, float],
    priors: Mapping[str, Prior],
) -> str:
    """The text of a study file for `folder` that holds what the one at `source` holds, with effects added.

    Args:
        source: the study file.
        folder: where the text is to be written: files are named relative to it.
        name: name of the new study.
        effects: effects to add, by name, each as `[model] effects` takes it (a file relative to `source`).
        values: values of their parameters, SI units.
        priors: priors of their parameters, which a fit of the new study frees.
    """
    place = source.parent
    data: dict[str, Any] = tomllib.loads(source.read_text(encoding="utf-8-sig"))
    model: dict[str, Any] = data.setdefault("model", {})
    if is_file(model.get("use", "")):
        model["use"] = _moved(model["use"], place, folder)
    present = [_moved(spec, place, folder) if is_file(spec) else spec for spec in model.get("effects", [])]
    added = [_moved(spec, place, folder) if is_file(spec) else spec for spec in effects.values()]
    if present or added:
        model["effects"] = [*present, *added]
    if effects:
        model["vary"] = [*model.get("vary", []), *(f"{effect}_*" for effect in effects)]
    parameters: dict[str, Any] = data.setdefault("parameters", {})
    for parameter, value in values.items():
        stated = parameters.get(parameter)
        table = dict(stated) if isinstance(stated, dict) else {}
        table["value"] = value
        if parameter in priors:
            table["prior"] = {"mean": priors[parameter].mean, "sd": priors[parameter].sd}
        parameters[parameter] = table
    for trial in data.get("trials", []):
        trial["file"] = _moved(trial["file"], place, folder)
    data["study"] = {**data.get("study", {}), "name": name}
    data.get("output", {}).pop("folder", None)
    return _written(data)


def _moved(path: str, old: Path, new: Path) -> str:
    """A path relative to a folder, or absolute, as another folder names it."""
    return Path(os.path.relpath(old.resolve() / path, new.resolve())).as_posix()


def _written(data: Mapping[str, Any]) -> str:
    """A study file's tables as TOML: one heading each, what lies deeper in braces."""
    lines: list[str] = []
    for key, table in data.items():
        if isinstance(table, Mapping):
            if table:
                lines += [f"[{_key(key)}]", *_entries(table), ""]
        elif isinstance(table, list) and table and all(isinstance(entry, Mapping) for entry in table):
            for entry in table:
                lines += [f"[[{_key(key)}]]", *_entries(entry), ""]
        else:
            lines.insert(0, f"{_key(key)} = {_value(table)}")
    return "\n".join(lines)


def _entries(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_value(value)}" for key, value in table.items()]


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _text(name)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(_entries(value)) + " }" if value else "{}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(_value(entry) for entry in value) + "]"
    return _text(str(value))


def _text(value: str) -> str:
    """A TOML string: JSON's escapes are TOML's, but that TOML escapes the character 127 as well."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
