"""Every field of a log as numbers, by the name and the unit that the file gives it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.readers import Log, Table
from seatruth.readers.listing import names

Numbers = NDArray[np.float64]


class Fields(Mapping[str, Numbers]):
    """Every field of a log as numbers, made when asked for: most fields of a large log are no channel.

    Fields that have no value in any sample, as NMEA's of a speed that the instrument lacks, are not among them.

    A field's key is the name that a study gives it, with its unit: "ATT.Yaw [deg]".
    """

    def __init__(self, log: Log) -> None:
        self.places: dict[str, tuple[str, Table, str]] = {
            _titled(name, table.units.get(column)): (name, table, column)
            for name, (table, column) in names(log).items()
            if not _empty(table.columns[column])
        }

    def __getitem__(self, title: str) -> Numbers:
        _, table, column = self.places[title]
        return _numbers(table.columns[column])

    def __iter__(self) -> Iterator[str]:
        return iter(self.places)

    def __len__(self) -> int:
        return len(self.places)

    def name(self, title: str) -> str:
        """The field's name in a study."""
        return self.places[title][0]


def _empty(column: pd.Series[float]) -> bool:
    return pd.api.types.is_numeric_dtype(column.dtype) and bool(column.isna().all())


def _numbers(column: pd.Series[float]) -> Numbers:
    numbers = pd.to_numeric(column, errors="coerce") if not pd.api.types.is_datetime64_any_dtype(column.dtype) else None
    if numbers is None:
        return np.full(len(column), np.nan)
    return np.asarray(numbers.to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)


def _titled(name: str, unit: str | None) -> str:
    return f"{name} [{unit}]" if unit else name
