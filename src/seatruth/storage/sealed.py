"""JSON objects with a version and a checksum of their own content: a result that something has changed is noticed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from seatruth.storage.checksum import checksum
from seatruth.storage.parsing import parsed

_VERSION, _CHECKSUM = "format", "checksum"


class OtherVersion(ValueError):
    """The object has another layout, or is none of seatruth's."""


def sealed(content: Mapping[str, Any], version: int) -> str:
    """The JSON text of an object: "format" first, then the content, then the checksum of both.

    Args:
        content: What JSON knows: finite numbers, texts, lists and mappings; no key "format" or "checksum".
        version: Version of the layout.

    Example:
        >>> unsealed(sealed({"value": 1.5}, 1), 1)
        {'value': 1.5}
        >>> try:
        ...     unsealed(sealed({"value": 1.5}, 1).replace("1.5", "1.6"), 1)
        ... except ValueError as problem:
        ...     print(problem)
        its checksum does not fit: something has changed it
    """
    whole = {_VERSION: version, **content}
    return json.dumps({**whole, _CHECKSUM: _checksum(whole)}, indent=1, ensure_ascii=False, allow_nan=False)


def unsealed(text: bytes | str, version: int) -> dict[str, Any]:
    """The content that `sealed` wrote.

    Raises:
        OtherVersion: It is a JSON object of another layout.
        ValueError: It is nothing that `sealed` wrote, or something has changed it.
    """
    try:
        whole = parsed(text)
        if not isinstance(whole, dict) or whole.get(_VERSION) != version:
            raise OtherVersion("it has another layout")
        digits = whole.pop(_CHECKSUM, "")
        if digits != _checksum(whole):
            raise ValueError("its checksum does not fit: something has changed it")
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    del whole[_VERSION]
    return whole


def _checksum(content: Mapping[str, Any]) -> str:
    """Of the values alone, whatever the spaces and the order of the keys."""
    return checksum(json.dumps(content, sort_keys=True, ensure_ascii=True))
