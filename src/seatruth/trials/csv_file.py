"""Text files of columns, as loggers, spreadsheets and MATLAB write them.

What is guessed (separator, decimal comma, header, row of units, encoding) is guessed from the first lines; what is
guessed wrongly ends in a message that names a line, never in wrong numbers: every line must have as many fields as
the header.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.errors import BadInput
from seatruth.trials.tables import MISSING, Table, named
from seatruth.units import is_unit

SPACES = r"\s+"
_SEPARATORS = ("\t", ";", "|", ",", SPACES)
_SEPARATOR_NAMES = {"\t": "tab", ";": "semicolon", "|": "bar", ",": "comma", SPACES: "spaces"}
_COMMENT = re.compile(rb"^[ \t]*(?:#|%|//)[^\n]*", re.MULTILINE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_SAMPLE_LINES = 60
_MOST_COLUMNS = 10_000


def read(
    file: Path, data: bytes, *, separator: str | None = None, decimal: str | None = None, encoding: str | None = None
) -> Table:
    """The table in a text file; BadInput naming the line for anything that does not fit."""
    source = str(file)
    data = _utf8(data, source, encoding)
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    comments = [match.group().decode() for match in _COMMENT.finditer(data[:65536])]
    if b"#" in data or b"%" in data or b"//" in data:
        data = _COMMENT.sub(b"", data)
    if data.lstrip().startswith((b"{", b"[", b"<")):
        raise BadInput("it looks like JSON, XML or HTML, not like columns", where=source, do="Export it as CSV.")
    sample = _first_lines(data)
    if not sample:
        raise BadInput("it holds only comments", where=source, do="Check how it was exported.")
    separator = _guess_separator(sample, source) if separator is None else _known_separator(separator, source)
    rows = [_split(text, separator) for _, text in sample]
    rows[0] = _without_last_empty(rows[0])
    rows[1:] = [row[: len(rows[0])] for row in rows[1:]]
    if len(rows[0]) > _MOST_COLUMNS:
        raise BadInput(f"it has {len(rows[0])} columns", where=source, do="Check the separator.")
    decimal = _guess_decimal(rows, separator) if decimal is None else decimal
    if decimal not in (".", ",") or decimal == separator:
        raise BadInput(
            f"decimal mark {decimal!r} cannot be used with separator {separator!r}", where=source, do="Use . or ,"
        )
    header, skip = _header(rows, comments, separator, decimal)
    names, units = named(header or [str(k + 1) for k in range(len(rows[0]))], source)
    if len(rows) > skip and header and _is_unit_row(rows[skip], decimal):
        units.update({name: unit for name, unit in zip(names, rows[skip], strict=False) if unit not in ("", "-")})
        skip += 1
    if len(rows) <= skip:
        raise BadInput("it has a header and no samples", where=source, do="Check how it was exported.")
    first = sample[skip][0]
    return _parse(source, data, names, units, first, separator, decimal)


def _utf8(data: bytes, source: str, encoding: str | None) -> bytes:
    """The same text in UTF-8 without a byte order mark."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    if encoding is None:
        if data.startswith(b"\xef\xbb\xbf"):
            return data[3:]
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            # Loggers on older machines write degree signs in Latin-1, in which every byte is a character.
            return data.decode("latin-1").encode()
        return data
    try:
        text = data.decode(encoding)
    except LookupError:
        raise BadInput(f"unknown encoding {encoding!r}", where=source, do="Use utf-8, latin-1 or utf-16.") from None
    except UnicodeError as problem:
        raise BadInput(f"it is not {encoding} text ({problem})", where=source, do="Correct the encoding.") from None
    if "\0" in text:
        raise BadInput("it looks like a binary file", where=source, do="Export it as CSV, Parquet or MATLAB (-v7).")
    return text.lstrip("\ufeff").encode()


def _first_lines(data: bytes) -> list[tuple[int, str]]:
    """The first lines with anything in them, as (line number, text)."""
    lines: list[tuple[int, str]] = []
    start = number = 0
    while start < len(data) and len(lines) < _SAMPLE_LINES:
        stop = data.find(b"\n", start)
        stop = len(data) if stop < 0 else stop
        number += 1
        text = data[start:stop].decode("utf-8", "replace")
        if text.strip(" \t,;|"):
            lines.append((number, text))
        start = stop + 1
    return lines


def _split(text: str, separator: str) -> list[str]:
    if separator == SPACES:
        return text.split()
    fields, quoted = [""], False
    if '"' not in text:
        fields = text.split(separator)
    else:
        for character in text:
            if character == '"':
                quoted = not quoted
            elif character == separator and not quoted:
                fields.append("")
            else:
                fields[-1] += character
    return [field.strip() for field in fields]


def _without_last_empty(fields: list[str]) -> list[str]:
    return fields[:-1] if len(fields) > 1 and not fields[-1] else fields


def _known_separator(separator: str, source: str) -> str:
    words = {"tab": "\t", "\\t": "\t", "space": SPACES, " ": SPACES, "spaces": SPACES, "comma": ",", "semicolon": ";"}
    separator = words.get(separator, separator)
    if separator not in _SEPARATORS:
        raise BadInput(f"separator {separator!r} is not known", where=source, do="Use one of , ; | tab space.")
    return separator


def _guess_separator(sample: Sequence[tuple[int, str]], source: str) -> str:
    """The separator that cuts the first lines into as many fields as the header has, in nearly all of them."""
    best, best_score = None, 0.0
    for candidate in _SEPARATORS:
        rows = [_split(text, candidate) for _, text in sample]
        width = len(_without_last_empty(rows[0]))
        fitting = sum(len(row) == width or (len(row) == width + 1 and not row[-1]) for row in rows)
        # A comma that is a decimal mark is missing in the header, and then no other line fits the header.
        score = fitting / len(rows) - _SEPARATORS.index(candidate) * 0.001
        if width > 1 and fitting >= 0.7 * len(rows) and score > best_score:
            best, best_score = candidate, score
    if best is None:
        if all(len(text.split()) == 1 for _, text in sample) and not any(
            mark in text for _, text in sample for mark in ",;|"
        ):
            raise BadInput("it has a single column", where=source, do="A trial needs time and at least one channel.")
        first = sample[0]
        raise BadInput(
            "no separator (comma, semicolon, tab, bar or spaces) cuts its lines into equally many fields",
            where=f"{source}, line {first[0]}",
            do="Write one header line and one line a sample, with one separator (not a comma if decimals have commas).",
        )
    return best


def _guess_decimal(rows: Sequence[Sequence[str]], separator: str) -> str:
    if separator == ",":
        return "."
    fields = [field for row in rows[1:] for field in row]
    commas = sum(bool(_COMMA_NUMBER.fullmatch(field)) for field in fields)
    points = sum("." in field and bool(_NUMBER.fullmatch(field)) for field in fields)
    return "," if commas > points else "."


def _is_number(field: str, decimal: str) -> bool:
    return bool(_NUMBER.fullmatch(field.replace(",", ".") if decimal == "," else field))


def _is_data(row: Sequence[str], decimal: str) -> bool:
    """A row of samples: nothing but numbers, dates and missing values, and at least one number."""
    filled = [field for field in row if field not in MISSING]
    return bool(filled) and all(_is_number(f, decimal) or re.match(r"\d{2,4}[-/:.]\d", f) for f in filled)


def _header(
    rows: Sequence[Sequence[str]], comments: Sequence[str], separator: str, decimal: str
) -> tuple[list[str], int]:
    """The column titles and how many of the first rows they take; no titles where the file has none."""
    if not _is_data(rows[0], decimal):
        return list(rows[0]), 1
    for comment in reversed(comments):
        titles = _split(comment.strip().lstrip("#%/").strip(), separator)
        if len(titles) == len(rows[0]) and not _is_data(titles, decimal):
            return titles, 0  # numpy.savetxt writes its titles as a comment
    return [], 0


def _is_unit_row(row: Sequence[str], decimal: str) -> bool:
    filled = [field for field in row if field not in ("", "-")]
    if not filled or any((_is_number(f, decimal) and f != "1") or f in MISSING for f in filled):
        return False
    return all(is_unit(f) for f in filled)


def _parse(
    source: str, data: bytes, names: list[str], units: dict[str, str], first: int, separator: str, decimal: str
) -> Table:
    start = 0
    for _ in range(first - 1):
        start = data.index(b"\n", start) + 1
    body = data[start:]
    blank = _check_fields(source, body, len(names), first, separator)
    frame = _frame(source, body, names, separator, decimal)
    lines = np.arange(first, first + len(frame), dtype=np.int64)
    if len(frame) != blank.size:
        raise BadInput(
            f"its {blank.size} lines hold {len(frame)} rows: a quoted text runs over several lines",
            where=source,
            do="Remove the quotes.",
        )
    if blank.any():
        frame, lines = frame[~blank], lines[~blank]
    if not len(frame):
        raise BadInput("it has a header and no samples", where=source, do="Check how it was exported.")
    columns = {name: frame[name].reset_index(drop=True) for name in names}
    return Table(source, columns, units, lines, decimal)


def _frame(source: str, body: bytes, names: list[str], separator: str, decimal: str) -> pd.DataFrame:
    options: dict[str, Any] = {"sep": separator, "decimal": decimal, "na_values": list(MISSING)}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # field counts, which the warnings are about, are checked before
            frame: pd.DataFrame = pd.read_csv(
                io.BytesIO(body),
                header=None,
                names=names,
                index_col=False,
                skip_blank_lines=False,
                skipinitialspace=True,
                low_memory=False,
                encoding="utf-8",
                encoding_errors="replace",
                **options,
            )
            return frame
    except pd.errors.EmptyDataError:
        raise BadInput("it has a header and no samples", where=source, do="Check how it was exported.") from None
    except (pd.errors.ParserError, ValueError, OverflowError) as problem:
        raise BadInput(f"it cannot be read as columns ({problem})", where=source, do="Check the file.") from None


def _check_fields(source: str, body: bytes, width: int, first: int, separator: str) -> NDArray[np.bool_]:
    """Which lines are blank; BadInput for a line with another number of fields than the header."""
    text = np.frombuffer(body if body.endswith(b"\n") else body + b"\n", dtype=np.uint8)
    ends = np.flatnonzero(text == 10)
    starts = np.concatenate([[0], ends[:-1] + 1])
    space = (text == 32) | (text == 9) | (text == 13) | (text == 11) | (text == 12)
    hollow = space | (text == 10)
    if separator != SPACES:
        hollow |= text == ord(separator)
    blank: NDArray[np.bool_] = np.add.reduceat((~hollow).astype(np.int64), starts) == 0
    if separator == SPACES:
        inside = ~(space | (text == 10))
        before = np.concatenate([[False], inside[:-1]])
        counts = np.add.reduceat((inside & ~before).astype(np.int64), starts)
        trailing = np.zeros_like(counts)
    elif b'"' in body:
        return blank  # separators inside quotes do not count; pandas sees to the fields
    else:
        counts = np.add.reduceat((text == ord(separator)).astype(np.int64), starts) + 1
        last = np.maximum(ends - 1, 0)
        while True:  # a line may end in spaces after its last separator
            shrink = space[last] & (last > starts)
            if not shrink.any():
                break
            last = np.where(shrink, last - 1, last)
        trailing = (text[last] == ord(separator)).astype(np.int64)
    wrong = ~blank & (counts != width) & (counts - trailing != width)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        others = int(wrong.sum()) - 1
        more = f" ({others} more lines like it)" if others else ""
        hint = (
            "If the recording was cut off there, delete that line."
            if row == counts.size - 1 or blank[row + 1 :].all()
            else f"Check the separator ({_SEPARATOR_NAMES[separator]}) and the decimal mark."
        )
        raise BadInput(
            f"it has {int(counts[row])} fields and the header has {width}{more}",
            where=f"{source}, line {first + row}",
            do=hint,
        )
    return blank
