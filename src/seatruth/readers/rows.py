"""Columns that grow message by message, without holding more than a block of them as Python objects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from seatruth.readers.base import Column

_BLOCK = 4096
"""Rows held as Python objects, of which each takes about six times the memory of its numbers (chosen here [S])."""
_LONGEST_TEXT = 64
"""Characters of a text that are kept: flags and names of frames, no payloads (chosen here [S])."""


class Rows:
    """Rows of fixed fields that become columns.

    Example:
        >>> from seatruth.readers.rows import Rows
        >>> rows = Rows(["t", "u"])
        >>> rows.add((0, 1.5))
        >>> rows.add((1, None))
        >>> rows.columns()["u"].tolist()
        [1.5, nan]
    """

    def __init__(self, fields: Sequence[str]) -> None:
        self.fields = tuple(fields)
        self.count = 0
        self._rows: list[Sequence[Any]] = []
        self._blocks: list[list[Column]] = []

    def add(self, row: Sequence[Any]) -> None:
        """Adds one value for each field; None where there is none."""
        self._rows.append(row)
        self.count += 1
        if len(self._rows) >= _BLOCK:
            self._flush()

    def columns(self) -> dict[str, Column]:
        """The columns; a field that is a number in some rows and text in others is text."""
        self._flush()
        columns = {}
        for k, field in enumerate(self.fields):
            parts = [block[k] for block in self._blocks]
            if any(part.dtype.kind == "U" for part in parts):
                parts = [part if part.dtype.kind == "U" else part.astype(np.str_) for part in parts]
            columns[field] = parts[0] if len(parts) == 1 else np.concatenate(parts) if parts else np.empty(0)
        return columns

    def _flush(self) -> None:
        if self._rows:
            self._blocks.append([_column(values) for values in zip(*self._rows, strict=True)])
            self._rows = []


def _column(values: Sequence[Any]) -> Column:
    if any(isinstance(value, (str, bytes)) for value in values):
        texts = [value.decode("utf-8", "replace") if isinstance(value, bytes) else value for value in values]
        return np.array(["" if text is None else str(text)[:_LONGEST_TEXT] for text in texts], dtype=np.str_)
    if any(value is None for value in values):
        return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
    column = np.array(values)
    return column if column.dtype.kind in "biuf" else column.astype(np.float64)
