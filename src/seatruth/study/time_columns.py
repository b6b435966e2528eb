"""Finds a log's time: by the words of its column's name, or as the column whose cells are dates with a time of day."""

from __future__ import annotations

import pandas as pd

from seatruth.readers.tables import as_text
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import InferredColumn

_DATED = r"(\d{4}[-./]\d{1,2}[-./]\d{1,2}|\d{1,2}[-./]\d{1,2}[-./]\d{4})[ T]+\d{1,2}:\d{2}.*|\d{8}T\d{4,6}.*"
"""A day and a time of day, as ISO 8601 and others write them. What it says exactly is read later."""
_LOOKED_AT = 200
"""Cells that show whether a column holds dates, spread over the log. Chosen here [S]."""


def dated_column(fields: Fields) -> InferredColumn | None:
    """The column of dates with times of day that run on, whatever it is called; None where the log has none.

    Of several it is the one with the most different dates, as a logger's clock moves with each sample.
    """
    best, most = None, 1
    for title, (_, table, column) in fields.places.items():
        series = table.columns[column]
        if pd.api.types.is_numeric_dtype(series.dtype):
            continue
        cells = series.iloc[:: max(1, len(series) // _LOOKED_AT)].dropna()
        if not pd.api.types.is_datetime64_any_dtype(cells.dtype):
            cells = as_text(cells, column)
            cells = cells[cells != ""]
            if cells.empty or not bool(cells.str.fullmatch(_DATED).all()):
                continue
        if cells.nunique() > most:
            best, most = title, cells.nunique()
    return None if best is None else InferredColumn("t", best, "s", "its cells are dates")
