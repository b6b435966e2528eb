"""Conditions on a file's columns ("pos_hold == 1", "sat < 4 or fix == 0"): compared, never run as code."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.errors import BadInput
from seatruth.readers.tables import Table, as_text

_COMPARE: dict[str, Callable[[Any, float], Any]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
    "=": operator.eq,
}
_TERM = re.compile(r"^\s*(?P<column>.+?)\s*(?P<sign>==|!=|<=|>=|<|>|=)\s*(?P<number>[-+.\deE]+)\s*$")
_TEXT_TERM = re.compile(r"""^\s*(?P<column>.+?)\s*(?P<sign>==|!=|=)\s*(?P<quote>['"])(?P<text>.*)(?P=quote)\s*$""")


def rows_where(table: Table, condition: str) -> NDArray[np.bool_]:
    """Which rows (n,) fulfil a condition: comparisons of a column with a number, joined by "and" and "or".

    "and" binds closer than "or". A column's bare name is true where it is not zero. A missing value fulfils nothing. A
    text in quotes is compared with a column of texts: run == 'zigzag 2'.
    """
    result: NDArray[np.bool_] = np.zeros(len(table), dtype=np.bool_)
    for alternative in _split(condition.strip(), "or"):
        every: NDArray[np.bool_] = np.ones(len(table), dtype=np.bool_)
        for term in _split(alternative, "and"):
            every &= _term(table, term, condition)
        result |= every
    return result


def columns_of(condition: str) -> list[str]:
    """The columns that a condition names."""
    terms = [term for alternative in _split(condition.strip(), "or") for term in _split(alternative, "and")]
    matches = [(_TEXT_TERM.match(term) or _TERM.match(term), term) for term in terms if term.strip()]
    return [_bare(match["column"] if match else term) for match, term in matches]


def _split(text: str, word: str) -> list[str]:
    """The parts of a condition between the word, which inside quotes is text like any other."""
    parts, start = [], 0
    for match in re.finditer(rf"'[^']*'|\"[^\"]*\"|\s+{word}\s+", text):
        if match.group()[0] not in "'\"":
            parts.append(text[start : match.start()])
            start = match.end()
    return [*parts, text[start:]]


def _term(table: Table, term: str, condition: str) -> NDArray[np.bool_]:
    where = f"{table.source}, condition {condition!r}"
    text = _TEXT_TERM.match(term)
    if text is not None:
        return _same_text(table, text, where)
    match = _TERM.match(term)
    if match is None:
        if re.search(r"[<>=!]", term) or not term.strip():
            raise BadInput(f"{term!r} is no comparison", where=where, do="Write it as COLUMN == NUMBER.")
        values = _flags(table, _bare(term), where)
        return np.asarray(np.isfinite(values) & (values != 0), dtype=np.bool_)
    try:
        number = float(match["number"])
    except ValueError:
        raise BadInput(f"{match['number']!r} is not a number", where=where, do="Write COLUMN == NUMBER.") from None
    values = _flags(table, _bare(match["column"]), where)
    return np.asarray(np.isfinite(values) & _COMPARE[match["sign"]](values, number), dtype=np.bool_)


def _same_text(table: Table, match: re.Match[str], where: str) -> NDArray[np.bool_]:
    try:
        series = table.column(_bare(match["column"]))
    except BadInput as problem:
        raise BadInput(problem.what, where=where, do=problem.do) from None
    words = as_text(series, where)
    same = words == match["text"].strip()
    if match["sign"] == "!=":
        same = ~same
    return np.asarray((same & words.notna()).to_numpy(dtype=bool, na_value=False), dtype=np.bool_)


def _bare(column: str) -> str:
    return column.strip().strip("`'\"")


def _flags(table: Table, column: str, where: str) -> NDArray[np.float64]:
    try:
        series = table.column(column)
    except BadInput as problem:
        raise BadInput(problem.what, where=where, do=problem.do) from None
    if not pd.api.types.is_numeric_dtype(series.dtype):
        words = as_text(series, where).str.lower()
        if bool(words.dropna().isin(["true", "false"]).all()):
            flags = words.map({"true": 1.0, "false": 0.0})
            return np.asarray(flags.to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)
    return table.numbers(column)
