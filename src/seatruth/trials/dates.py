"""Dates with times as logs write them: ISO 8601, day first, month first, with the month's name, with zones."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.readers.tables import Table, as_text

DATED = "Write dates as 2025-07-31T13:14:21.5, with Z or +02:00 where the zone is known."
_TIME = r"(?:[ T,]+(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2}(?:[.,]\d+)?))?)?"
_REST = r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}:?\d{2})?"
_PATTERNS = (
    r"(?P<year>\d{4})[-./](?P<month>\d{1,2})[-./](?P<day>\d{1,2})" + _TIME + _REST,
    r"(?P<first>\d{1,2})[-./ ](?P<other>\d{1,2})[-./ ](?P<year>\d{4})" + _TIME + _REST,
    r"(?P<day>\d{1,2})[-./ ](?P<name>[A-Za-z]{3})[A-Za-z]*\.?[-./, ]+(?P<year>\d{4})" + _TIME + _REST,
)
_SHORT_YEAR = r"\d{1,2}[-./]\d{1,2}[-./]\d{2}(\s.*)?"
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")


class Stamps(NamedTuple):
    """Times (n,) s from `zero` (s since 1970, UTC), NaN where a row has none, and notes for the record."""

    seconds: Array
    zero: float
    notes: tuple[str, ...]


def read_dates(series: pd.Series[Any], table: Table, column: str, order: str | None) -> Stamps | None:
    """The dates of a column; None where it holds none.

    Raises BadInput, with both readings, where days and months could be exchanged and `order` does not say which is
    first; also for years of two digits, and for zones in some rows only.
    """
    if pd.api.types.is_datetime64_any_dtype(series.dtype):
        zoned = getattr(series.dtype, "tz", None) is not None
        return _stamps(series.dt.tz_convert(None) if zoned else series, ())
    text = as_text(series, f"{table.source}, column {column!r}")
    text = text.where(text != "")
    if text.isna().all():
        return None
    given = text.dropna()
    where = f"{table.source}, column {column!r}"
    for pattern in _PATTERNS:
        if bool(given.str.fullmatch(pattern).all()):
            return _from_parts(text.str.extract(f"^{pattern}$"), table, column, order)
    if bool(given.str.fullmatch(_SHORT_YEAR).all()):
        raise BadInput(
            f"the year of {given.iloc[0]!r} has two digits, which can be read in three ways", where=where, do=DATED
        )
    stamps = pd.to_datetime(given, format="ISO8601", errors="coerce", utc=True)
    if stamps.isna().any():
        return None
    _refuse_mixed_zones(given.str.contains(r"(?:Z|[+-]\d{2}:?\d{2})$").to_numpy(dtype=bool), table, column)
    return _stamps(stamps.dt.tz_convert(None).reindex(text.index), ())


def _from_parts(parts: pd.DataFrame, table: Table, column: str, order: str | None) -> Stamps | None:
    notes: tuple[str, ...] = ()
    present = parts["year"].notna().to_numpy(dtype=bool)
    if "first" in parts:
        order, notes = _order(parts, table, column, order)
        day, month = ("first", "other") if order == "day-first" else ("other", "first")
        parts = parts.rename(columns={day: "day", month: "month"})
    elif "name" in parts:
        names = parts["name"].str.lower()
        parts = parts.assign(month=names.map({name: str(k) for k, name in enumerate(_MONTHS, 1)}))
        _refuse(present & parts["month"].isna().to_numpy(dtype=bool), table, column, "its month is not known", DATED)
    zoned = parts["zone"].notna().to_numpy(dtype=bool)
    _refuse_mixed_zones(zoned[present], table, column)
    hours, minutes = (_number(parts[name]) for name in ("hour", "minute"))
    half = parts["half"].str.lower().str[0]
    hours = hours.where(half.isna(), hours % 12 + 12.0 * (half == "p").fillna(False).astype("float64"))
    text = parts["year"] + "-" + parts["month"].str.zfill(2) + "-" + parts["day"].str.zfill(2)
    days = pd.to_datetime(text, format="%Y-%m-%d", errors="coerce")
    seconds = _number(parts["second"].str.replace(",", ".", regex=False))
    _refuse(present & days.isna().to_numpy(dtype=bool), table, column, "there is no such day", "Correct the date.")
    late = (hours > 23) | (minutes > 59) | (seconds >= 61)
    _refuse(present & late.to_numpy(dtype=bool), table, column, "there is no such time of day", DATED)
    of_day = hours * 3600.0 + minutes * 60.0 + seconds - _offset(parts["zone"])
    return _stamps(days + pd.to_timedelta(of_day, unit="s"), notes)


def _number(texts: pd.Series[Any]) -> pd.Series[Any]:
    """Texts of digits as numbers, zero where there is none."""
    return pd.to_numeric(texts, errors="coerce").astype("Float64").fillna(0.0).astype("float64")


def _order(parts: pd.DataFrame, table: Table, column: str, stated: str | None) -> tuple[str, tuple[str, ...]]:
    """ "day-first" or "month-first", and how that is known."""
    first, other = (
        pd.to_numeric(parts[name], errors="coerce").to_numpy(dtype=np.float64) for name in ("first", "other")
    )
    shown = {"day-first": bool((first > 12).any()), "month-first": bool((other > 12).any())}
    if stated is None and not any(shown.values()):
        row = int(np.flatnonzero(np.isfinite(first))[0])
        a, b, year = (int(float(parts[name].iloc[row])) for name in ("first", "other", "year"))
        raise BadInput(
            f"the date {a:02d}.{b:02d}.{year} can be {a} {_named(b)} {year} or {b} {_named(a)} {year}",
            where=f"{table.source}, {table.place(row)}, column {column!r}",
            do='Set dates = "day-first" or dates = "month-first" in [time].',
        )
    order = stated or next(name for name, is_so in shown.items() if is_so)
    wrong = other > 12 if order == "day-first" else first > 12
    _refuse(wrong, table, column, f"its date is not {order}", "Correct it, or set `dates` in [time].")
    return order, (f"dates read {order}",)


def _named(month: int) -> str:
    return _MONTHS[month - 1].capitalize()


def _offset(zones: pd.Series[Any]) -> pd.Series[Any]:
    """Seconds by which a zone's clock is ahead of UTC."""
    found = zones.str.extract(r"^([+-])(\d{2}):?(\d{2})$")
    size = pd.to_numeric(found[1], errors="coerce") * 3600.0 + pd.to_numeric(found[2], errors="coerce") * 60.0
    sign = found[0].map({"+": 1.0, "-": -1.0}).astype("float64")
    return (size * sign).fillna(0.0)


def _stamps(series: pd.Series[Any], notes: tuple[str, ...]) -> Stamps | None:
    valid = series.dropna()
    if valid.empty:
        return None
    first = valid.iloc[0]
    spans = (series - first).dt.total_seconds()
    seconds = np.asarray(spans.to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)
    return Stamps(seconds, float(first.timestamp()), notes)


def _refuse_mixed_zones(zoned: NDArray[np.bool_], table: Table, column: str) -> None:
    if zoned.any() and not zoned.all():
        raise BadInput(
            f"{int(zoned.sum())} of {zoned.size} dates state their zone and the others do not",
            where=f"{table.source}, column {column!r}",
            do="Write the zone in every row or in none.",
        )


def _refuse(wrong: NDArray[np.bool_], table: Table, column: str, what: str, do: str) -> None:
    rows = np.flatnonzero(wrong)
    if rows.size:
        value = table.column(column).iloc[int(rows[0])]
        raise BadInput(
            f"{value!r}: {what}", where=f"{table.source}, {table.place(int(rows[0]))}, column {column!r}", do=do
        )
