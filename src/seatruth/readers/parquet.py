"""Parquet files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seatruth.errors import BadInput
from seatruth.readers.base import Column, Content, Progress, Reader, Topic
from seatruth.readers.headers import named


@dataclass(frozen=True)
class Parquet(Reader):
    """Columns of a Parquet file; units are those of the header ("u [kn]") or of the field's metadata `unit`."""

    name: ClassVar[str] = "parquet"
    title: ClassVar[str] = "Parquet"
    suffixes: ClassVar[tuple[str, ...]] = (".parquet", ".pq")
    modules: ClassVar[tuple[str, ...]] = ("pyarrow",)

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        return head.startswith(b"PAR1")

    def read(self, path: Path, progress: Progress) -> Content:
        import pyarrow.parquet

        with pyarrow.parquet.ParquetFile(path) as file:
            schema = file.schema_arrow
            names, units = named(schema.names, str(path))
            for name, field in zip(names, schema, strict=True):
                unit = (field.metadata or {}).get(b"unit")
                if unit and name not in units:
                    units[name] = unit.decode("utf-8", "replace")
            columns: dict[str, Column] = {}
            for k, name in enumerate(names):  # one by one, so that Arrow's copy of each goes at once
                content = file.read(columns=[schema.names[k]], use_threads=False)
                values = content.column(schema.names[k])
                columns[name] = _values(values)
                if str(getattr(values.type, "tz", None) or ""):
                    units[name] = "UTC"
                progress((k + 1) / len(names))
        if not columns or not len(columns[names[0]]):
            raise BadInput("it has no rows", where=str(path), do="Check how it was exported.")
        return Content([Topic("", columns, units)])


def _values(column: Any) -> Column:
    import pyarrow as pa

    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
        kind = kind.value_type
    if pa.types.is_decimal(kind) or (pa.types.is_boolean(kind) and column.null_count):
        column = column.cast(pa.float64())
    if pa.types.is_date(kind):
        column = column.cast(pa.timestamp("ns"))
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return np.array(["" if text is None else text for text in column.to_pylist()], dtype=np.str_)
    return np.asarray(column.to_numpy())
