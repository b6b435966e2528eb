"""JSON that a file holds, whoever wrote it."""

from __future__ import annotations

import json
from typing import Any


def parsed(text: bytes | str) -> Any:
    """The values of a JSON text.

    Raises:
        ValueError: It is no JSON, or its brackets stand deeper in each other than can be read.

    Example:
        >>> parsed("[" * 100_000)
        Traceback (most recent call last):
            ...
        ValueError: it is nested too deeply
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
