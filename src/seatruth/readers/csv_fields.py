"""Counts the fields of each line of a text file, so that no line with too few or too many passes."""

from __future__ import annotations

import csv

import numpy as np
from numpy.typing import NDArray

from seatruth.errors import BadInput
from seatruth.readers.csv_dialect import SEPARATOR_NAMES, SPACES

_LINE_END, _QUOTE = 10, 34


def check_fields(
    source: str, text: bytes, width: int, first: int, separator: str, *, last_piece: bool
) -> NDArray[np.bool_]:
    """Which lines are blank; BadInput for a line that has not `width` fields.

    Args:
        source: the file, for messages.
        text: whole lines in UTF-8, the last one ended.
        width: fields of the header.
        first: number of the first of these lines.
        separator: what stands between fields.
        last_piece: whether the file ends with these lines.
    """
    array = np.frombuffer(text, dtype=np.uint8)
    ends = np.flatnonzero(array == _LINE_END)
    starts = np.concatenate([[0], ends[:-1] + 1])
    space = (array == 32) | (array == 9) | (array == 13) | (array == 11) | (array == 12)
    hollow = space | (array == _LINE_END)
    if separator != SPACES:
        hollow |= array == ord(separator)
    blank: NDArray[np.bool_] = np.add.reduceat((~hollow).astype(np.int32), starts) == 0
    if separator == SPACES:
        inside = ~(space | (array == _LINE_END))
        before = np.concatenate([[False], inside[:-1]])
        counts = np.add.reduceat((inside & ~before).astype(np.int32), starts)
        trailing = np.zeros_like(counts)
    else:
        counts = np.add.reduceat((array == ord(separator)).astype(np.int32), starts) + 1
        last = np.maximum(ends - 1, 0)
        while True:  # a line may end in spaces after its last separator
            shrink = space[last] & (last > starts)
            if not shrink.any():
                break
            last = np.where(shrink, last - 1, last)
        trailing = (array[last] == ord(separator)).astype(np.int32)
    if b'"' in text:
        for line in np.unique(np.searchsorted(ends, np.flatnonzero(array == _QUOTE))).tolist():
            content = text[starts[line] : ends[line]].decode("utf-8", "replace")
            counts[line], trailing[line] = _quoted(source, content, separator, first + line)
    wrong = ~blank & (counts != width) & (counts - trailing != width)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        others = int(wrong.sum()) - 1
        more = f" ({others} more lines like it)" if others else ""
        hint = (
            "If the recording was cut off there, delete that line."
            if last_piece and (row == counts.size - 1 or blank[row + 1 :].all())
            else f"Check the separator ({SEPARATOR_NAMES[separator]}) and the decimal mark."
        )
        raise BadInput(
            f"it has {int(counts[row])} fields and the header has {width}{more}",
            where=f"{source}, line {first + row}",
            do=hint,
        )
    return blank


def _quoted(source: str, line: str, separator: str, number: int) -> tuple[int, int]:
    """Fields of a line with quotes, and 1 if the last is empty; separators between quotes do not count."""
    if separator == SPACES:
        line, separator = " ".join(line.split()), " "
    try:
        rows = list(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True))
    except csv.Error:
        raise BadInput(
            "its quotes do not match", where=f"{source}, line {number}", do="Remove the quotes, or close them."
        ) from None
    return len(rows[0]), int(not rows[0][-1].strip())
