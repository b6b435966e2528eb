"""Workbooks of Excel and LibreOffice: each sheet is a table."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seatruth.errors import BadInput
from seatruth.readers.base import Column, Content, Progress, Reader, Topic
from seatruth.readers.headers import MISSING, named
from seatruth.units import is_unit

_ZIP, _OLE = b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"


@dataclass(frozen=True)
class Excel(Reader):
    """Sheets with a header line, perhaps a line of units, and one line a sample; read by calamine.

    Formulas count by the value that the program stored with them. Sheets without columns of numbers are left out.
    """

    name: ClassVar[str] = "excel"
    title: ClassVar[str] = "Excel and OpenDocument workbooks"
    suffixes: ClassVar[tuple[str, ...]] = (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods")
    modules: ClassVar[tuple[str, ...]] = ("python_calamine",)
    extra: ClassVar[str] = "seatruth[excel]"

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        named_so = path.suffix.lower() in cls.suffixes
        inside = b"[Content_Types].xml" in head or b"opendocument.spreadsheet" in head[:200]
        return (head.startswith(_ZIP) and (named_so or inside)) or (head.startswith(_OLE) and named_so)

    def read(self, path: Path, progress: Progress) -> Content:
        import python_calamine

        with open(path, "rb") as stream:
            book = python_calamine.CalamineWorkbook.from_filelike(stream)
            topics, notes = [], []
            for k, sheet in enumerate(book.sheet_names):
                topic = _topic(sheet, book.get_sheet_by_name(sheet).to_python(skip_empty_area=False), str(path))
                if topic is None:
                    notes.append(f"Sheet {sheet!r} holds no columns of numbers and is left out.")
                else:
                    topics.append(topic)
                progress((k + 1) / len(book.sheet_names))
        if not topics:
            raise BadInput("no sheet holds a header and columns of numbers", where=str(path), do="Check the workbook.")
        return Content(topics, notes)


def _topic(sheet: str, rows: Sequence[Sequence[Any]], source: str) -> Topic | None:
    """One sheet; its header is the first line with two texts or more, below which the samples stand."""
    filled = [(number, row) for number, row in enumerate(rows, 1) if any(cell != "" for cell in row)]
    start = next((k for k, (_, row) in enumerate(filled) if _is_header(row)), None)
    if start is None or len(filled) < start + 2:
        return None
    used = [k for k, cell in enumerate(filled[start][1]) if cell != ""]
    names, units = named([str(filled[start][1][k]) for k in used], f"{source}, sheet {sheet!r}")
    body = filled[start + 1 :]
    below = [body[0][1][k] for k in used]
    if any(below) and all(isinstance(cell, str) and (cell in ("", "-") or is_unit(cell)) for cell in below):
        units.update({name: cell for name, cell in zip(names, below, strict=True) if cell not in ("", "-")})
        body = body[1:]
    columns = {name: _column([row[k] for _, row in body]) for name, k in zip(names, used, strict=True)}
    if not body or not any(values.dtype.kind in "fM" for values in columns.values()):
        return None
    return Topic(sheet, columns, units, lines=np.array([number for number, _ in body], dtype=np.int64))


def _is_header(row: Sequence[Any]) -> bool:
    cells = [cell for cell in row if cell != ""]
    return len(cells) > 1 and all(isinstance(cell, str) for cell in cells)


def _column(cells: Sequence[Any]) -> Column:
    """Numbers, dates (ms) or texts; a column that mixes them is text, so that the user is told which cell is wrong."""
    cells = [None if isinstance(cell, str) and cell.strip() in MISSING else cell for cell in cells]
    filled = [cell for cell in cells if cell is not None]
    if all(isinstance(cell, (int, float)) for cell in filled):
        return np.array([np.nan if cell is None else float(cell) for cell in cells])
    if all(isinstance(cell, datetime.date) for cell in filled):  # a datetime is a date
        return np.array(["NaT" if cell is None else cell.isoformat() for cell in cells], dtype="datetime64[us]")
    if all(isinstance(cell, datetime.timedelta) for cell in filled):
        spans = [np.timedelta64("NaT") if cell is None else np.timedelta64(cell) for cell in cells]
        return np.array(spans, dtype="timedelta64[us]")
    return np.array(["" if cell is None else str(cell) for cell in cells], dtype=np.str_)
