"""Columns of a file or of one of its topics as they stand, before any meaning is given to them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.readers.headers import MISSING, name_and_unit


@dataclass(frozen=True)
class Table:
    """Columns of one file, or of one topic of a file, all of the same length.

    `columns` holds numbers, text or dates as the file gives them. `units` are those that the header states.
    `lines` (n,) numbers the lines of a text file (1 is the first); None where a file has rows and no lines. `name` is
    the topic, "" where the file is one table; `time` the column that the format says is its clock.
    """

    source: str
    columns: dict[str, pd.Series[Any]]
    units: dict[str, str] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None
    decimal: str = "."
    name: str = ""
    time: str | None = None

    @property
    def where(self) -> str:
        """The file, and the topic where there is one."""
        return f"{self.source}, {self.name}" if self.name else self.source

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def place(self, row: int) -> str:
        """Where a row (0 is the first) stands in the file: "line 12" or "row 12"."""
        return f"row {row + 1}" if self.lines is None or not self.lines[row] else f"line {int(self.lines[row])}"

    def places(self, rows: Iterable[int]) -> str:
        """Where several rows stand, as runs: "lines 12-14, 20 and 3 more"."""
        numbers = [row + 1 if self.lines is None else int(self.lines[row]) for row in rows]
        return f"{'row' if self.lines is None else 'line'}{'s' if len(numbers) > 1 else ''} {runs(numbers)}"

    def rows(self, chosen: NDArray[np.bool_]) -> Table:
        """The rows (n,) that are chosen, as a table; messages still name their lines in the file."""
        numbers = np.arange(1, len(self) + 1, dtype=np.int64) if self.lines is None else self.lines
        columns = {name: series[chosen].reset_index(drop=True) for name, series in self.columns.items()}
        return replace(self, columns=columns, lines=numbers[chosen])

    def called(self, name: str) -> str | None:
        """The table's own name of a column that is named with or without the unit that its header states."""
        return next((one for one in (name, name_and_unit(name)[0]) if one in self.columns), None)

    def has(self, name: str) -> bool:
        """Whether `column` finds this name."""
        return self.called(name) is not None

    def column(self, name: str) -> pd.Series[Any]:
        """A column by its name, with or without the unit that its header states."""
        own = self.called(name)
        if own is None:
            raise BadInput(f"no column {name!r}", where=self.where, do=nearest(name, self.columns))
        return self.columns[own]

    def unit(self, name: str) -> str | None:
        """The unit that the header states for the column which `column` finds; None where it states none."""
        return self.units.get(self.called(name) or name)

    def numbers(self, name: str) -> Array:
        """A column as numbers (n,), NaN where nothing is given; BadInput names the line of anything else."""
        series = self.column(name)
        where = f"{self.where}, column {name!r}"
        if pd.api.types.is_datetime64_any_dtype(series.dtype) or pd.api.types.is_timedelta64_dtype(series.dtype):
            raise BadInput("it holds dates, not numbers", where=where, do="Choose another column.")
        if pd.api.types.is_complex_dtype(series.dtype):
            raise BadInput("it holds complex numbers", where=where, do="Store real numbers.")
        if not pd.api.types.is_numeric_dtype(series.dtype):
            series = self._from_text(series, name)
        values = series.to_numpy(dtype=np.float64, na_value=np.nan)
        infinite = np.flatnonzero(np.isinf(values))
        if infinite.size:
            raise BadInput(
                f"{infinite.size} value(s) are infinite",
                where=f"{self.where}, {self.places(infinite)}, column {name!r}",
                do="Leave a missing value empty or write nan.",
            )
        return values

    def _from_text(self, series: pd.Series[Any], name: str) -> pd.Series[Any]:
        text = as_text(series, f"{self.source}, column {name!r}")
        if self.decimal != ".":
            text = text.str.replace(self.decimal, ".", regex=False)
        numbers = pd.to_numeric(text, errors="coerce")
        wrong = np.flatnonzero((numbers.isna() & text.notna() & ~text.isin(MISSING)).to_numpy(dtype=bool))
        if wrong.size:
            more = f" (and {wrong.size - 1} more like it)" if wrong.size > 1 else ""
            raise BadInput(
                f"{_short(str(series.iloc[int(wrong[0])]))} is not a number{more}",
                where=f"{self.where}, {self.place(int(wrong[0]))}, column {name!r}",
                do="Correct it, or leave a missing value empty.",
            )
        return numbers.astype("Float64")


def as_text(series: pd.Series[Any], where: str) -> pd.Series[Any]:
    """A column as text without blanks around it; BadInput where it holds bytes that are none."""
    try:
        return series.astype("string").str.strip()
    except (UnicodeError, ValueError, TypeError):
        raise BadInput("it holds bytes, neither numbers nor text", where=where, do="Choose another column.") from None


def runs(numbers: Iterable[int], most: int = 5) -> str:
    """Whole numbers as runs: "3-7, 12 and 4 more"."""
    ordered = sorted(numbers)
    ranges: list[list[int]] = []
    for number in ordered:
        if ranges and number <= ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    shown = ", ".join(f"{a}" if a == b else f"{a}-{b}" for a, b in ranges[:most])
    rest = sum(b - a + 1 for a, b in ranges[most:])
    return f"{shown} and {rest} more" if rest else shown


def _short(text: str, most: int = 40) -> str:
    return repr(text if len(text) <= most else text[: most - 3] + "...")
