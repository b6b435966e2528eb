"""Text files of columns, as loggers, spreadsheets and MATLAB write them, read piece by piece.

A piece is some megabytes of whole lines. Each is cut into numbers at once and its text forgotten, so that a log takes
little more memory than its numbers.
"""

from __future__ import annotations

import codecs
import io
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from seatruth.errors import BadInput
from seatruth.readers.base import Column, Content, Progress, Reader, Topic, no_progress
from seatruth.readers.csv_dialect import Dialect, first_lines, guess, without_comments
from seatruth.readers.csv_fields import check_fields
from seatruth.readers.headers import MISSING

_PIECE = 2**22
"""Bytes that are decoded at once: far more than a line, far less than a log (chosen here [S])."""
_LONGEST_LINE = 2**24
"""Characters of a line; a longer one is no line of samples (chosen here [S])."""
_HEAD_LINES = 60
_ALL_DIGITS: dict[str, Any] = {} if int(pd.__version__.split(".")[0]) >= 3 else {"float_precision": "round_trip"}
"""What makes pandas 2 read numbers to the last digit, as pandas 3 does by itself."""


@dataclass(frozen=True)
class CSV(Reader):
    """Comma, semicolon, tab, bar or spaces; point or comma; with or without header, units, comments and quotes."""

    separator: str | None = field(default=None, metadata={"doc": '"," ";" "|" "tab" or "space"; default: guessed.'})
    decimal: str | None = field(default=None, metadata={"doc": "Decimal mark; default: guessed."})
    encoding: str | None = field(default=None, metadata={"doc": 'As "utf-8" or "latin-1"; default: guessed.'})

    name: ClassVar[str] = "csv"
    title: ClassVar[str] = "CSV and other text of columns"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".txt", ".dat", ".tsv", ".asc")
    isolated: ClassVar[bool] = False

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        wide = head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        binary_name = path.suffix.lower() in (".parquet", ".pq", ".mat", ".bag", ".mcap", ".ulg", ".xlsx", ".h5")
        return bool(head) and (wide or b"\0" not in head) and not head.startswith(_NOT_TEXT) and not binary_name

    def read(self, path: Path, progress: Progress) -> Content:
        encodings = [_encoding(path)] if self.encoding is None else [_known_encoding(self.encoding, str(path))]
        if encodings == ["utf-8"] and self.encoding is None:
            # Loggers on older machines write degree signs in Latin-1, in which every byte is a character.
            encodings.append("latin-1")
        for encoding in encodings:
            try:
                topic, notes = self._read(path, encoding, progress)
                return Content([topic], notes)
            except UnicodeError as problem:
                reason = problem
        raise BadInput(f"it is not {encodings[0]} text ({reason})", where=str(path), do="Correct the encoding.")

    def _read(self, path: Path, encoding: str, progress: Progress) -> tuple[Topic, list[str]]:
        dialect = self._dialect(path, encoding)
        columns = _Columns(dialect)
        for text, first, last, share in _pieces(path, encoding, progress):
            columns.add(str(path), text, first, last, share)
        if columns.pieces > 1 and columns.texts:
            # A column that is numbers in some pieces and text in others is text, so it is read once more as such.
            again = _Columns(dialect, columns.texts)
            for text, first, last, share in _pieces(path, encoding, no_progress):
                again.add(str(path), text, first, last, share)
            columns.values.update(again.values)
        if not columns.lines.count:
            raise BadInput("it has a header and no samples", where=str(path), do="Check how it was exported.")
        values = {name: columns.values[name].values for name in dialect.names}
        return Topic("", values, dialect.units, None, columns.lines.values, dialect.decimal), columns.notes

    def _dialect(self, path: Path, encoding: str) -> Dialect:
        head = b""
        for text, _, last, _ in _pieces(path, encoding, no_progress, 2**16):
            head += text
            if len(first_lines(without_comments(head))) >= _HEAD_LINES or last or len(head) > _LONGEST_LINE:
                break
        return guess(head, str(path), self.separator, self.decimal)


_NOT_TEXT = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"\x1f\x8b", b"%PDF", b"#ROSBAG", b"SQLite format 3", b"\x89")


def _encoding(path: Path) -> str:
    with open(path, "rb") as stream:
        mark = stream.read(3)
    if mark.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    return "utf-8-sig" if mark == codecs.BOM_UTF8 else "utf-8"


def _known_encoding(name: str, source: str) -> str:
    try:
        info = codecs.lookup(name)
    except (LookupError, ValueError):
        raise BadInput(f"unknown encoding {name!r}", where=source, do="Use utf-8, latin-1 or utf-16.") from None
    if not getattr(info, "_is_text_encoding", True):
        raise BadInput(f"{name!r} is no encoding of text", where=source, do="Use utf-8, latin-1 or utf-16.")
    return info.name


def _pieces(
    path: Path, encoding: str, progress: Callable[[float], None], size: int = _PIECE
) -> Iterator[tuple[bytes, int, bool, float]]:
    """Whole lines in UTF-8 with "\\n" at the end, the number of the first, whether they are the last, their share."""
    whole = max(path.stat().st_size, 1)
    decoder = io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(encoding)(), translate=True)
    rest, line = "", 1
    with open(path, "rb") as stream:
        while True:
            block = stream.read(size)
            text = rest + decoder.decode(block, final=not block)
            text = text.removeprefix("\ufeff") if line == 1 else text
            if "\0" in text:
                raise BadInput("it looks like a binary file", where=str(path), do="Export it as CSV.")
            if not block:
                if text:
                    yield (text if text.endswith("\n") else text + "\n").encode(), line, True, 1.0
                elif line == 1:
                    raise BadInput("the file is empty", where=str(path), do="Check how it was exported.")
                return
            cut = text.rfind("\n") + 1
            rest = text[cut:]
            ended = text.count("\n", 0, cut)
            if len(rest) > _LONGEST_LINE:
                where = f"{path}, line {line + ended}"
                raise BadInput(f"it has over {_LONGEST_LINE} characters", where=where, do="Check the file.")
            if cut:
                progress(stream.tell() / whole)
                last = stream.tell() >= whole and not rest
                yield text[:cut].encode(), line, last, min(1.0, size / whole)
                line += ended


class _Columns:
    """Collects the columns of piece after piece; `as_text` reads these columns alone, and as text."""

    def __init__(self, dialect: Dialect, as_text: frozenset[str] = frozenset()) -> None:
        self.dialect = dialect
        self.as_text = as_text
        self.values = {name: _Growing() for name in as_text or dialect.names}
        self.lines = _Growing()
        self.pieces = 0
        self.notes: list[str] = []

    @property
    def texts(self) -> frozenset[str]:
        """Columns that are text, or words like "True", in some piece and not in all."""
        kinds = {name: column.kinds for name, column in self.values.items()}
        return frozenset(name for name, seen in kinds.items() if len(seen) > 1 and not seen <= set("iuf"))

    def add(self, source: str, text: bytes, first: int, last: bool, share: float) -> None:
        """Cuts lines into columns; the lines before the samples are skipped. `share` of the file are these lines."""
        dialect = self.dialect
        text = without_comments(text)
        while first < dialect.first and text:
            text = text[text.index(b"\n") + 1 :]
            first += 1
        if not text:
            return
        blank, note = check_fields(source, text, len(dialect.names), first, dialect.separator, last_piece=last)
        self.notes += [note] if note else []
        if blank.all():
            return
        frame = self._frame(source, text)
        if len(frame) != blank.size:
            what = f"its {blank.size} lines hold {len(frame)} rows"
            raise BadInput(what, where=f"{source}, line {first}", do="Remove the quotes.")
        kept = slice(None) if not blank.any() else ~blank
        room = int(blank.size / share * 1.02)
        for name, column in self.values.items():
            column.add(frame[name].to_numpy()[kept], room)
        self.lines.add(np.arange(first, first + blank.size, dtype=np.int64)[kept], room)
        self.pieces += 1

    def _frame(self, source: str, text: bytes) -> pd.DataFrame:
        options: dict[str, Any] = {"sep": self.dialect.separator, "decimal": self.dialect.decimal}
        if self.as_text:
            options.update(usecols=sorted(self.as_text), dtype=str)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # field counts, which the warnings are about, are checked before
                frame: pd.DataFrame = pd.read_csv(
                    io.BytesIO(text),
                    header=None,
                    names=list(self.dialect.names),
                    index_col=False,
                    skip_blank_lines=False,
                    skipinitialspace=True,
                    low_memory=False,
                    encoding="utf-8",
                    encoding_errors="replace",
                    na_values=list(MISSING),
                    **_ALL_DIGITS,
                    **options,
                )
                return frame
        except (pd.errors.EmptyDataError, pd.errors.ParserError, ValueError, OverflowError) as problem:
            raise BadInput(f"it cannot be read as columns ({problem})", where=source, do="Check the file.") from None


class _Growing:
    """A column that grows piece by piece in one array.

    Room for the whole file is taken at once: memory that is not written to costs nothing, and no copy is made later.
    """

    def __init__(self) -> None:
        self.kinds: set[str] = set()
        self.count = 0
        self._room: Column = np.empty(0)

    def add(self, part: Column, room: int) -> None:
        """Adds a piece; `room` is how many values the whole file may hold."""
        self.kinds.add(part.dtype.kind)
        kind = np.result_type(self._room.dtype, part.dtype) if self.count else part.dtype
        if self.count + part.size > self._room.size or kind != self._room.dtype:
            larger = np.empty(max(room, 2 * self.count, self.count + part.size), dtype=kind)
            larger[: self.count] = self._room[: self.count]
            self._room = larger
        self._room[self.count : self.count + part.size] = part
        self.count += part.size

    @property
    def values(self) -> Column:
        """What was added."""
        return self._room[: self.count]
