"""Time as a log writes it, as seconds from the start of the trial.

Numbers with a unit, epochs from seconds to nanoseconds, dates in several orders and with zones, times of day through
midnight, NMEA's hhmmss, and clocks that jump. What was assumed is said in the notes; what can be read in two ways is
refused with both readings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.readers.tables import Table, as_text
from seatruth.trials.dates import DATED, Stamps, read_dates
from seatruth.units import to_si

DATE, HHMMSS = "date", "hhmmss"
DAY = 86400.0
EPOCH_SECONDS = 1e7
"""A time axis that starts later than this (116 days) counts from a calendar's zero: seatruth counts from its start,
because seconds since 1970 leave a double only 0.2 microseconds."""
_FIRST_EPOCH, _LAST_EPOCH = 315532800.0, 4102444800.0
"""s since 1970: the years 1980 (when satellite time begins) and 2100, between which recorded epochs lie. As the four
units differ by a thousand and these by 13, a number fits one unit at most."""
_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_LONG_STEP = 20.0
"""s: no manoeuvre is sampled so rarely, so that a unit must be stated from here on (chosen here [S])."""
_HALF_A_DAY = 0.5 * DAY


@dataclass(frozen=True)
class Clock:
    """Which column holds the time, and how it is written.

    Args:
        column: the column.
        unit: unit of its numbers, "date" or "hhmmss"; None goes by the header, or by what the numbers can be.
        dates: order of day and month in dates such as 03.07.2025, where the file does not show it.
        date: column with the date, where `column` has the time of day alone.
        jumps: s; where time runs back, or on by more than this, the clock was set: the jump is replaced by the usual
            step. None refuses a time that runs back.
    """

    column: str = "t"
    unit: str | None = None
    dates: Literal["day-first", "month-first"] | None = None
    date: str | None = None
    jumps: float | None = None

    @property
    def as_text(self) -> bool:
        """Whether it is read as dates or times of day, or has jumps, which the clocks of a log's topics have not."""
        return self.unit in (DATE, HHMMSS) or any(x is not None for x in (self.dates, self.date, self.jumps))


class TimeAxis(NamedTuple):
    """Times t (n,) s, NaN where a row has none; `zero` s since 1970 where the calendar is known, which `t` counts from;
    else `zero` is the number in s that was taken off. `dated` says which. `notes` are sentences for the record, `unit`
    what the column was read as, in the words of `Clock.unit`.
    """

    t: Array
    zero: float
    dated: bool
    notes: tuple[str, ...]
    unit: str

    @property
    def about(self) -> dict[str, Any]:
        """What the trial's conditions say of its start."""
        if self.dated:
            # Seconds since 1970 are a double of 0.2 us: digits beyond are rounding.
            return {"start": str(pd.Timestamp(round(self.zero * 1e6), unit="us", tz="UTC").isoformat())}
        return {"start_s": self.zero} if self.zero else {}


def time_axis(table: Table, clock: Clock) -> TimeAxis:
    """The times of a table's rows; BadInput for a column that cannot be read as time, with what to do."""
    where = f"{table.source}, column {clock.column!r}"
    series = table.column(clock.column)
    if clock.date is not None:
        stamps = read_dates(_joined(table, clock), table, clock.column, clock.dates)
        if stamps is None:
            raise BadInput("its dates and times cannot be read together", where=where, do=DATED)
        return _dated(stamps, clock, where)
    if pd.api.types.is_timedelta64_dtype(series.dtype):
        return _axis(_seconds(series), (), clock, where)
    if pd.api.types.is_numeric_dtype(series.dtype):
        return _numbers(table, clock, where)
    if clock.unit in (None, DATE):
        of_day = _times_of_day(series, where)
        if of_day is not None:
            return _axis(*_through_midnight(of_day), clock, where)
        stamps = read_dates(series, table, clock.column, clock.dates)
        if stamps is not None:
            return _dated(stamps, clock, where)
        if clock.unit == DATE:
            raise BadInput("its dates cannot be read", where=where, do=DATED)
    return _numbers(table, clock, where)


def _dated(stamps: Stamps, clock: Clock, where: str) -> TimeAxis:
    finite = stamps.seconds[np.isfinite(stamps.seconds)]
    if not finite.size:
        raise BadInput("it holds no time", where=where, do="Choose another column.")
    t, closed = _without_jumps(stamps.seconds, clock, where)
    first = float(t[np.isfinite(t)][0])
    return TimeAxis(t - first, stamps.zero + first, True, (*stamps.notes, *closed), DATE)


def _numbers(table: Table, clock: Clock, where: str) -> TimeAxis:
    if clock.unit == DATE:
        raise BadInput("it holds numbers, not dates", where=where, do="State their unit, as unit = 's'.")
    values = table.numbers(clock.column)
    stated = clock.unit or table.unit(clock.column)
    if clock.unit == HHMMSS:
        return _axis(*_through_midnight(_from_hhmmss(values, table, clock.column)), clock, where, unit=HHMMSS)
    if stated is None and _counts_minutes(values):
        notes = ("time read as hhmmss, as NMEA writes it: its seconds and minutes end at 59",)
        t, more = _through_midnight(_from_hhmmss(values, table, clock.column))
        return _axis(t, (*notes, *more), clock, where, unit=HHMMSS)
    epoch = _epoch_unit(values)
    if stated is None:
        stated = epoch or "s"
        _refuse_long_steps(values, stated, where)
        if epoch not in (None, "s"):
            notes = (f"time read as {epoch} since 1970, from {_date(values * _UNITS[stated])} on",)
            return _axis(values * _UNITS[stated], notes, clock, where, unit=stated, dated=True)
    try:
        conversion = to_si(stated, "s")
    except BadInput as problem:
        raise BadInput(f"time: {problem.what}", where=where, do=problem.do) from None
    t = conversion(values)
    if epoch is not None and stated in _UNITS and float(np.nanmin(t)) > _LAST_EPOCH:
        raise BadInput(
            f"time: in {stated} these numbers are dates of the year {_year(t)}; in {epoch} they begin on "
            f"{_date(values * _UNITS[epoch])}",
            where=where,
            do=f'Set unit = "{epoch}", or another column.',
        )
    return _axis(t, (), clock, where, unit=stated, dated=epoch is not None and stated == epoch)


def _refuse_long_steps(values: Array, unit: str, where: str) -> None:
    """Without a unit, steps of many seconds are more likely milliseconds or microseconds."""
    steps = np.diff(values[np.isfinite(values)])
    step = float(np.median(np.abs(steps))) * _UNITS[unit] if steps.size else 0.0
    if step >= _LONG_STEP:
        others = [u for u, k in _UNITS.items() if k < _UNITS[unit] and step * k / _UNITS[unit] < _LONG_STEP][:2]
        readings = " or ".join(f"{step * _UNITS[u] / _UNITS[unit]:g} s (in {u})" for u in [unit, *others])
        raise BadInput(
            f"time has no unit, and its usual step can be {readings}",
            where=where,
            do='State it in [time], as unit = "ms".',
        )


def _axis(
    t: Array, notes: Sequence[str], clock: Clock, where: str, *, unit: str = DATE, dated: bool = False
) -> TimeAxis:
    t, closed = _without_jumps(t, clock, where)
    finite = t[np.isfinite(t)]
    zero = float(finite[0]) if finite.size and abs(finite[0]) > EPOCH_SECONDS else 0.0
    return TimeAxis(t - zero if zero else t, zero, dated and zero != 0.0, (*notes, *closed), unit)


def _joined(table: Table, clock: Clock) -> pd.Series[Any]:
    """Dates and times of day as one text."""
    assert clock.date is not None
    names = (clock.date, clock.column)
    both = [as_text(table.column(name), f"{table.source}, column {name!r}") for name in names]
    return both[0] + " " + both[1]


def _times_of_day(series: pd.Series[Any], where: str) -> Array | None:
    """Seconds (n,) of times such as 23:59:58.5, None where the column holds something else."""
    text = as_text(series, where)
    if text.isna().all() or not bool(text.dropna().str.fullmatch(r"\d{1,2}:\d{2}:\d{2}([.,]\d+)?").all()):
        return None
    spans = pd.to_timedelta(text.str.replace(",", ".", regex=False), errors="coerce")
    return _seconds(spans)


def _seconds(spans: pd.Series[Any]) -> Array:
    return np.asarray(spans.dt.total_seconds().to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)


def _through_midnight(t: Array) -> tuple[Array, tuple[str, ...]]:
    """Times of day with a day added wherever they fall by more than half a day."""
    ok = np.isfinite(t)
    days = np.concatenate([[0.0], np.cumsum(np.diff(t[ok]) < -_HALF_A_DAY)]) if ok.any() else np.zeros(0)
    if not days.any():
        return t, ()
    whole = t.copy()
    whole[ok] += DAY * days
    return whole, (f"time of day goes through midnight {int(days[-1])} time(s)",)


def _digits(values: Array) -> tuple[Array, Array, Array]:
    """Hours, minutes and seconds of numbers that are written hhmmss.ss."""
    whole = np.floor(values)
    return whole // 10000, whole // 100 % 100, whole % 100 + (values - whole)


def _from_hhmmss(values: Array, table: Table, column: str) -> Array:
    hours, minutes, seconds = _digits(values)
    wrong = np.flatnonzero(np.isfinite(values) & ~((hours < 24) & (minutes < 60) & (seconds < 61) & (values >= 0)))
    if wrong.size:
        raise BadInput(
            f"{values[wrong[0]]:.10g} is no time of day written hhmmss",
            where=f"{table.source}, {table.places(wrong)}, column {column!r}",
            do='Correct it, or state another unit, as unit = "s".',
        )
    return hours * 3600.0 + minutes * 60.0 + seconds


def _counts_minutes(values: Array) -> bool:
    """Whether numbers are times of day as hhmmss: read so, they run on evenly through minutes in which they jump."""
    finite = values[np.isfinite(values)]
    if finite.size < 3 or finite.min() < 0 or finite.max() >= 240000:
        return False
    hours, minutes, seconds = _digits(finite)
    if not bool(((minutes < 60) & (seconds < 60)).all()):
        return False
    t, _ = _through_midnight(hours * 3600.0 + minutes * 60.0 + seconds)
    jumps = np.diff(finite) - np.diff(t)
    # A minute ends: the numbers jump by 40 more than the time does (by 4040 where an hour ends).
    return bool((jumps != 0.0).any() and (np.diff(t) >= 0).all() and np.diff(t).max() < 40.0)


def _epoch_unit(values: Array) -> str | None:
    """The unit in which numbers are seconds since 1970 between the years 1980 and 2100; None if in none."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return None
    low, high = float(finite.min()), float(finite.max())
    return next((u for u, k in _UNITS.items() if low * k > _FIRST_EPOCH and high * k < _LAST_EPOCH), None)


def _date(t: Array) -> str:
    first = float(t[np.isfinite(t)][0])
    return str(pd.Timestamp(round(first), unit="s", tz="UTC").isoformat())


def _year(t: Array) -> str:
    return f"{1970 + float(t[np.isfinite(t)][0]) / (365.2425 * DAY):.0f}"


def _without_jumps(t: Array, clock: Clock, where: str) -> tuple[Array, tuple[str, ...]]:
    """Times with the jumps of the clock replaced by the usual step, where the study asks for it."""
    if clock.jumps is None:
        return t, ()
    if not clock.jumps > 0.0:
        raise BadInput(f"jumps = {clock.jumps} is no time", where=where, do="Give seconds above zero.")
    ok = np.isfinite(t)
    steps = np.diff(t[ok])
    jumped = (steps < 0.0) | (steps > clock.jumps)
    if not jumped.any():
        return t, ()
    usual = float(np.median(steps[~jumped])) if (~jumped).any() else 0.0
    if usual <= 0.0:
        raise BadInput("its clock has no usual step", where=where, do="Give `jumps` as a longer time.")
    closed = t.copy()
    closed[ok] = t[ok][0] + np.concatenate([[0.0], np.cumsum(np.where(jumped, usual, steps))])
    sizes = ", ".join(f"{step - usual:+.6g} s" for step in steps[jumped][:3])
    more = f" and {int(jumped.sum()) - 3} more" if jumped.sum() > 3 else ""
    return closed, (f"clock set {int(jumped.sum())} time(s) during the run, by {sizes}{more}: taken off",)
