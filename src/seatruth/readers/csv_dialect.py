"""How a text file of columns is written: separator, decimal mark, header, row of units.

It is guessed from the first lines; what is guessed wrongly ends in a message that names a line, never in wrong numbers,
because every line must have as many fields as the header.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from seatruth.errors import BadInput
from seatruth.readers.headers import MISSING, named
from seatruth.units import is_unit

SPACES = r"\s+"
_SEPARATORS = ("\t", ";", "|", ",", SPACES)
SEPARATOR_NAMES = {"\t": "tab", ";": "semicolon", "|": "bar", ",": "comma", SPACES: "spaces"}
_COMMENT = re.compile(rb"^[ \t]*(?:#|%|//)[^\n]*", re.MULTILINE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_SAMPLE_LINES = 60
_MOST_COLUMNS = 10_000


@dataclass(frozen=True)
class Dialect:
    """How the lines of a file are cut into columns.

    `first` is the number (1 is the first) of the first line of samples.
    """

    names: tuple[str, ...]
    units: dict[str, str]
    separator: str
    decimal: str
    first: int


def without_comments(text: bytes) -> bytes:
    """The same lines, with those that are comments empty."""
    return _COMMENT.sub(b"", text) if b"#" in text or b"%" in text or b"//" in text else text


def guess(head: bytes, source: str, separator: str | None = None, decimal: str | None = None) -> Dialect:
    """The dialect of a file from its first whole lines in UTF-8; what is given is not guessed."""
    comments = [match.group().decode("utf-8", "replace") for match in _COMMENT.finditer(head)]
    data = without_comments(head)
    if data.lstrip().startswith((b"{", b"[", b"<")):
        raise BadInput("it looks like JSON, XML or HTML, not like columns", where=source, do="Export it as CSV.")
    sample = first_lines(data)
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
    return Dialect(tuple(names), units, separator, decimal, sample[skip][0])


def first_lines(data: bytes) -> list[tuple[int, str]]:
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
