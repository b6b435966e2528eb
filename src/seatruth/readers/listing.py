"""What a log holds: for each field its unit, how many samples, how fast, and between which values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from seatruth.errors import BadInput
from seatruth.readers.log import Log
from seatruth.readers.tables import Table


@dataclass(frozen=True)
class FieldInfo:
    """One field of a log.

    Args:
        topic: its topic, "" where the file is one table.
        field: its name; a study names it `name`.
        name: topic and field, or the field alone where the file is one table.
        unit: unit that the file states, "" where it states none.
        samples: how many values it has, missing ones not counted.
        rate: samples per second in the middle of the run (median), NaN where no clock is known.
        low, high: range of the numbers; NaN where it holds none.
        kind: "numbers", "dates" or "text".
    """

    topic: str
    field: str
    name: str
    unit: str
    samples: int
    rate: float
    low: float
    high: float
    kind: str


def names(log: Log) -> dict[str, tuple[Table, str]]:
    """Every field by the name that a study gives it."""
    alone = len(log.tables) == 1
    return {
        column if alone else f"{topic}.{column}": (table, column)
        for topic, table in log.tables.items()
        for column in table.columns
    }


def listing(log: Log, time: str | None = None, unit: str | None = None) -> list[FieldInfo]:
    """All fields of a log; `time` and `unit` describe the clock of tables that have none of their own.

    Example:
        >>> from pathlib import Path
        >>> from seatruth.readers import read_log
        >>> from seatruth.readers.listing import listing
        >>> written = Path("run.csv").write_text("t,u\\n0,1\\n0.5,3\\n1,2\\n")
        >>> [(field.name, field.samples, field.rate, field.high) for field in listing(read_log("run.csv"), "t")]
        [('t', 3, 2.0, 1.0), ('u', 3, 2.0, 3.0)]
    """
    rates = {name: _rate(log, table, None if table.time else time, unit) for name, table in log.tables.items()}
    fields = []
    for name, (table, column) in names(log).items():
        series = table.columns[column]
        low = high = float("nan")
        kind = "text"
        if pd.api.types.is_datetime64_any_dtype(series.dtype):
            kind = "dates"
        elif pd.api.types.is_numeric_dtype(series.dtype):
            kind = "numbers"
            finite = series[np.isfinite(series.to_numpy(dtype=np.float64, na_value=np.nan))]
            if len(finite):
                low, high = float(finite.min()), float(finite.max())
        unit_here = table.units.get(column, "")
        samples = int(series.notna().sum()) if kind != "text" else int((series.notna() & (series != "")).sum())
        fields.append(FieldInfo(table.name, column, name, unit_here, samples, rates[table.name], low, high, kind))
    return fields


def _rate(log: Log, table: Table, time: str | None, unit: str | None) -> float:
    try:
        clock = log.clock(table, time, unit)
    except BadInput:  # a column of dates in text, which a study reads and this list need not
        return float("nan")
    steps = np.empty(0) if clock is None else np.diff(clock)
    steps = steps[np.isfinite(steps) & (steps > 0)]
    return float(1 / np.median(steps)) if steps.size else float("nan")
