"""A file of columns as it stands: CSV, Parquet or MATLAB, before any meaning is given to the columns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.units import is_unit


@dataclass(frozen=True)
class Table:
    """Columns of one file, all of the same length.

    `columns` holds numbers, text or dates as the file gives them. `units` are those that the header states.
    `lines` (n,) numbers the lines of a text file (1 is the first); None where a file has rows and no lines.
    """

    source: str
    columns: dict[str, pd.Series[Any]]
    units: dict[str, str] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None
    decimal: str = "."

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def place(self, row: int) -> str:
        """Where a row (0 is the first) stands in the file: "line 12" or "row 12"."""
        return f"row {row + 1}" if self.lines is None else f"line {int(self.lines[row])}"

    def places(self, rows: Iterable[int]) -> str:
        """Where several rows stand, as runs: "lines 12-14, 20 and 3 more"."""
        numbers = [row + 1 if self.lines is None else int(self.lines[row]) for row in rows]
        return f"{'row' if self.lines is None else 'line'}{'s' if len(numbers) > 1 else ''} {runs(numbers)}"

    def column(self, name: str) -> pd.Series[Any]:
        """A column by its name, with or without the unit that its header states."""
        if name in self.columns:
            return self.columns[name]
        bare = name_and_unit(name)[0]
        if bare in self.columns:
            return self.columns[bare]
        raise BadInput(f"no column {name!r}", where=self.source, do=nearest(name, self.columns))

    def numbers(self, name: str) -> Array:
        """A column as numbers (n,), NaN where nothing is given; BadInput names the line of anything else."""
        series = self.column(name)
        where = f"{self.source}, column {name!r}"
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
                where=f"{self.source}, {self.places(infinite)}, column {name!r}",
                do="Leave a missing value empty or write nan.",
            )
        return values

    def _from_text(self, series: pd.Series[Any], name: str) -> pd.Series[Any]:
        text = as_text(series, f"{self.source}, column {name!r}").str.strip()
        if self.decimal != ".":
            text = text.str.replace(self.decimal, ".", regex=False)
        numbers = pd.to_numeric(text, errors="coerce")
        wrong = np.flatnonzero((numbers.isna() & text.notna() & ~text.isin(MISSING)).to_numpy(dtype=bool))
        if wrong.size:
            more = f" (and {wrong.size - 1} more like it)" if wrong.size > 1 else ""
            raise BadInput(
                f"{_short(str(series.iloc[int(wrong[0])]))} is not a number{more}",
                where=f"{self.source}, {self.place(int(wrong[0]))}, column {name!r}",
                do="Correct it, or leave a missing value empty.",
            )
        return numbers.astype("Float64")


def as_text(series: pd.Series[Any], where: str) -> pd.Series[Any]:
    """A column as text; BadInput where it holds bytes that are none."""
    try:
        return series.astype("string")
    except (UnicodeError, ValueError, TypeError):
        raise BadInput("it holds bytes, neither numbers nor text", where=where, do="Choose another column.") from None


MISSING = ("", "-", "--", "---", "NaN", "nan", "NAN", "NA", "N/A", "n/a", "null", "NULL", "None", "#N/A", "*")
"""Texts that mean that a value is missing."""


def name_and_unit(header: str) -> tuple[str, str | None]:
    """("u", "m/s") from "u [m/s]" or "u (m/s)"; no unit where the bracket holds none."""
    text = header.strip()
    for opening, closing in ("[]", "()"):
        if text.endswith(closing) and opening in text:
            head, _, inside = text[:-1].rpartition(opening)
            if head.strip() and (is_unit(inside) or opening == "["):
                return head.strip(), inside.strip()
    return text, None


def named(headers: Iterable[str], source: str) -> tuple[list[str], dict[str, str]]:
    """Column names without their units, and the units; names must differ."""
    names: dict[str, None] = {}
    units: dict[str, str] = {}
    for position, header in enumerate(headers, 1):
        name, unit = name_and_unit(header)
        name = name or f"column{position}"
        if name in names:
            raise BadInput(f"two columns are called {name!r}", where=source, do="Give each column its own name.")
        names[name] = None
        if unit:
            units[name] = unit
    return list(names), units


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
