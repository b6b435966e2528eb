"""A hash of what decides a cost, so that a stored result is used again only for the same problem."""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.formula import Formula
from seatruth.models.isolated import IsolatedBlackBox
from seatruth.trials.trial import Trial


def hash_of(content: Mapping[str, Any]) -> str:
    """SHA-256 of nested mappings, lists, arrays and plain values."""
    return hashlib.sha256(json.dumps(_plain(content), sort_keys=True).encode()).hexdigest()


def of_trial(trial: Trial) -> dict[str, Any]:
    """Name and samples of a trial."""
    return {
        "name": trial.name,
        "t": np.asarray(trial.t),
        "inputs": {name: np.asarray(values) for name, values in trial.inputs.items()},
        "outputs": {name: np.asarray(values) for name, values in trial.outputs.items()},
    }


def of_model(model: Model) -> dict[str, Any]:
    """Declaration of a model, and its equations or the source of its function."""
    found: dict[str, Any] = {"name": model.name, "class": type(model).__qualname__}
    for part in ("states", "inputs", "outputs"):
        found[part] = [dataclasses.asdict(channel) for channel in getattr(model, part)]
    if not isinstance(model, BlackBox):
        # The engine takes half a second to import, and a study file is read without it.
        from seatruth.simulate import fingerprint

        found["equations"] = fingerprint(model)
        between = {"holds": dict(model.holds), "delays": dict(model.delays)}
        found |= {part: stated for part, stated in between.items() if stated}
    if isinstance(model, BlackBox) and model.base is not None:
        found["base"] = of_model(model.base)
    if isinstance(model, BlackBox) and model.servos:
        found["servos"] = [[servo.input, model.delays.get(servo.input, 0.0), model.hold] for servo in model.servos]
    if isinstance(model, IsolatedBlackBox) and model.identity is not None:
        found["identity"] = model.identity
    for part in ("initial_state", "function"):
        function = getattr(model, part, None)
        if function is not None:
            found[part] = _source(function)
    if isinstance(model, Formula):
        found["formula"] = model.text or _source(model.callback)
        found["weight"] = model.weight
    return found


def _source(function: Any) -> str:
    """The text of a function, or its name where the text cannot be read."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return str(getattr(function, "__qualname__", type(function).__qualname__))


def _plain(value: Any) -> Any:
    """A value as JSON whose text depends on the value alone."""
    if isinstance(value, np.ndarray):
        data = np.ascontiguousarray(value)
        return [str(data.dtype), list(data.shape), hashlib.sha256(data.tobytes()).hexdigest()]
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.generic):
        return value.item()
    return value
