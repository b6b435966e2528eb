"""Values as JSON text that gives them back without loss, NumPy arrays included. Nothing is pickled.

Numbers that JSON does not know and arrays become objects with one key that begins with "$": {"$number": "inf"},
{"$array": {"dtype": "<f8", "shape": [2], "data": "(base64)"}}.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from seatruth.storage.parsing import parsed

_NUMBERS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
_KINDS = "biufcSUmM"
"""NumPy kinds of arrays whose bytes are their value: no Python objects, no records."""


def to_text(value: Any) -> str:
    """One line of strict JSON for None, bool, int, float, str, arrays, and lists and mappings of them.

    Tuples come back as lists and NumPy scalars as Python numbers; everything else comes back equal, to the last bit.

    Raises:
        TypeError: The value contains something else, such as an array of objects or a key that is not a text.

    Example:
        >>> from_text(to_text({"x": [1.5, float("inf")]}))
        {'x': [1.5, inf]}
    """
    return json.dumps(_encoded(value), allow_nan=False, ensure_ascii=True)


def from_text(text: str) -> Any:
    """The value that `to_text` wrote. Arrays are new and can be changed. Raises ValueError for other text."""
    try:
        return _decoded(parsed(text))
    except (KeyError, TypeError, AttributeError, RecursionError) as problem:
        raise ValueError(f"it is not a stored value ({problem})") from None


def _encoded(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in _KINDS:
            raise TypeError(f"an array of {value.dtype} cannot be stored")
        data = np.ascontiguousarray(value)
        text = base64.b64encode(data.tobytes()).decode("ascii")
        return {"$array": {"dtype": value.dtype.str, "shape": list(value.shape), "data": text}}
    if isinstance(value, np.generic):
        return _encoded(value.item())
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"the key {key!r} is not a text")
        if any(key.startswith("$") for key in value):
            return {"$mapping": [[key, _encoded(entry)] for key, entry in value.items()]}
        return {key: _encoded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_encoded(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return {"$number": "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"}
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a {type(value).__name__} cannot be stored")


def _decoded(value: Any) -> Any:
    if isinstance(value, list):
        return [_decoded(entry) for entry in value]
    if not isinstance(value, dict):
        return value
    if set(value) == {"$number"}:
        return _NUMBERS[value["$number"]]
    if set(value) == {"$mapping"}:
        return {key: _decoded(entry) for key, entry in value["$mapping"]}
    if set(value) == {"$array"}:
        parts = value["$array"]
        data = base64.b64decode(parts["data"], validate=True)
        return np.frombuffer(data, dtype=np.dtype(parts["dtype"])).reshape(parts["shape"]).copy()
    return {key: _decoded(entry) for key, entry in value.items()}
