"""Counts the fields of each line of a text file, so that no line with too few or too many passes."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from seatruth.errors import BadInput
from seatruth.readers.csv_dialect import SEPARATOR_NAMES, SPACES

_LINE_END, _QUOTE = 10, 34
CUT_OFF = "was cut off"
"""In the note of a file whose last line is left out."""


def check_fields(
    source: str, text: bytes, width: int, first: int, separator: str, *, last_piece: bool
) -> tuple[NDArray[np.bool_], str]:
    """Which lines are blank, or the one in which a recording was cut off, and what is said of that.

    Raises BadInput for any other line that has not `width` fields.

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
    if not wrong.any():
        return blank, ""
    row, others = int(np.flatnonzero(wrong)[0]), int(wrong.sum()) - 1
    if last_piece and not others and counts[row] < width and blank[row + 1 :].all():
        blank[row] = True
        short = f"line {first + row}, its last, has {int(counts[row])} of {width} fields and is left out."
        return blank, f"{Path(source).name} {CUT_OFF}: {short}"
    more = f" ({others} more lines like it)" if others else ""
    raise BadInput(
        f"it has {int(counts[row])} fields and the header has {width}{more}",
        where=f"{source}, line {first + row}",
        do=f"Check the separator ({SEPARATOR_NAMES[separator]}) and the decimal mark.",
    )


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
