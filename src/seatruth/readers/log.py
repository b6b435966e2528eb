"""A file that has been read: its tables by topic, how a field is found by its name, and clocks with one origin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.readers.tables import Table
from seatruth.text import listed

_NANOSECONDS = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}
_DATES_BEGIN = 1e8
"""Clocks in s that begin later count from 1970, as all formats with dates do: 1e8 s are three years, longer than any
vehicle runs after it was switched on (chosen here [S])."""


@dataclass(frozen=True)
class Log:
    """One file as it stands.

    Args:
        source: the file.
        tables: topic -> table; a file that is one table has it under "".
        notes: what the reader had to assume or leave out.
        reader: name of the reader.
        known_start: a clock value in s and the date (ISO, UTC) that it stands for, where the file states such a pair.
    """

    source: str
    tables: Mapping[str, Table]
    notes: tuple[str, ...] = ()
    reader: str = ""
    known_start: tuple[float, str] | None = None

    def table(self) -> Table:
        """The only table of the file; BadInput where there are several."""
        if len(self.tables) != 1:
            raise BadInput(
                f"it holds {len(self.tables)} tables ({listed([repr(name) for name in self.tables])})",
                where=self.source,
                do="Export the one that is needed as CSV.",
            )
        return next(iter(self.tables.values()))

    def find(self, name: str) -> tuple[Table, str]:
        """The table and the column of a field, by "TOPIC.FIELD", or by the bare field where one topic has it.

        Raises:
            BadInput: there is no such field, or several topics have it.
        """
        for topic in sorted(self.tables, key=len, reverse=True):
            field = name.removeprefix(f"{topic}.") if topic else name
            if (field != name or not topic) and self.tables[topic].has(field):
                return self.tables[topic], self.tables[topic].called(field) or field
        holders = [topic for topic, table in self.tables.items() if table.has(name)]
        if len(holders) > 1:
            raise BadInput(
                f"{name!r} is in {len(holders)} topics: {listed(holders)}",
                where=self.source,
                do=f'Write it with its topic, as "{holders[0]}.{name}".',
            )
        if not holders:
            known = [
                f"{topic}.{column}" if topic else column for topic, t in self.tables.items() for column in t.columns
            ]
            raise BadInput(f"no column {name!r}", where=self.source, do=nearest(name, known) or self._topics())
        return self.tables[holders[0]], self.tables[holders[0]].called(name) or name

    def clock(self, table: Table, column: str | None = None, unit: str | None = None) -> Array | None:
        """Time (n,) s of a table's samples since an origin that all tables of the log share.

        `column` names the clock if it is not the one that the format states, and `unit` its unit if the file does not
        state it. None where neither clock is there.
        """
        name = self._clock_column(table, column)
        if name is None:
            return None
        ticks, scale = _ticks(table, name, unit if name == column else None)
        origin = self._origin(column, unit)
        if ticks.dtype.kind == "i" and isinstance(origin, int):
            return np.asarray((ticks - origin) / scale, dtype=np.float64)
        return np.asarray(ticks / scale - _in_seconds(origin), dtype=np.float64)

    def start(self, column: str | None = None) -> str | None:
        """Date (ISO, UTC) of the clocks' origin, where the file knows it."""
        seconds = _in_seconds(self._origin(column))
        if self.known_start is not None:
            zero = pd.Timestamp(self.known_start[1]) + pd.Timedelta(seconds=seconds - self.known_start[0])
            return str(zero.isoformat())
        if not _DATES_BEGIN < seconds < 2**32:
            return None
        return str(pd.Timestamp(round(seconds * 1e9), unit="ns", tz="UTC").isoformat())

    def _clock_column(self, table: Table, column: str | None) -> str | None:
        return column if column is not None and table.has(column) else table.time

    def _origin(self, column: str | None, unit: str | None = None) -> int | float:
        """First time of all tables: whole ns as an int where every clock counts whole ticks, else s."""
        whole: list[int] = []
        rest: list[float] = []
        for table in self.tables.values():
            name = self._clock_column(table, column)
            if name is None or not len(table):
                continue
            first, scale = _ticks(table, name, unit if name == column else None, slice(0, 1))
            if first.dtype.kind == "i":
                whole.append(int(first[0]))
            elif np.isfinite(first[0]):
                rest.append(float(first[0]) / scale)
        return min([*rest, *(first / 1e9 for first in whole)]) if rest else min(whole, default=0)

    def _topics(self) -> str:
        return f"Topics: {listed(list(self.tables), 12)}. `seatruth init` lists their fields."


def _in_seconds(origin: int | float) -> float:
    return origin / 1e9 if isinstance(origin, int) else origin


def _ticks(table: Table, column: str, unit: str | None, rows: slice = slice(None)) -> tuple[NDArray[Any], float]:
    """A clock as whole ns with 1e9, or as numbers in s with 1."""
    series = table.column(column).iloc[rows]
    where = f"{table.where}, column {column!r}"
    if pd.api.types.is_datetime64_any_dtype(series.dtype):
        if series.isna().any():
            raise BadInput("some samples have no time", where=where, do="Choose another clock in [time].")
        naive = series.dt.tz_convert(None) if getattr(series.dtype, "tz", None) is not None else series
        return naive.to_numpy(dtype="datetime64[ns]").astype(np.int64), 1e9
    if pd.api.types.is_timedelta64_dtype(series.dtype):
        return series.to_numpy(dtype="timedelta64[ns]").astype(np.int64), 1e9
    unit = unit or table.unit(column) or "s"
    values = series.to_numpy() if pd.api.types.is_integer_dtype(series.dtype) else None
    if values is not None and unit in _NANOSECONDS and values.dtype.kind in "iu":
        factor = _NANOSECONDS[unit]
        most = np.iinfo(np.int64).max // factor
        if values.size == 0 or (int(values.max()) <= most and int(values.min()) >= -most):
            return values.astype(np.int64) * factor, 1e9
    from seatruth.units import to_si

    try:
        conversion = to_si(unit, "s")
    except BadInput as problem:
        raise BadInput(f"time: {problem.what}", where=where, do=problem.do) from None
    return conversion(table.numbers(column)[rows]), 1.0
