"""One table from the topics of a log, each of which has a clock of its own.

The rows are all times at which an output was measured. An output has values at its own times and none at the others; an
input, which a simulation needs at all times, is linear between its samples, or held after each where the simulation
holds it. Nothing is extrapolated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.readers import Log, Table
from seatruth.text import listed
from seatruth.trials.channel import Hold
from seatruth.trials.own_clocks import interpolated
from seatruth.trials.time_axis import Clock

CLOCK = "time of the log"
"""Column that holds the time, in s, of a table that this module makes."""


class Joined(NamedTuple):
    """A table, the clock of its rows, the date of its zero if known, and what was done in sentences.

    `own_times` says that its rows are the times of several clocks, so that an output has values in some of them alone.
    """

    table: Table
    clock: Clock
    start: str | None
    notes: list[str]
    own_times: bool = False


def on_one_clock(
    log: Log,
    clock: Clock,
    inputs: Mapping[str, Hold],
    others: Sequence[str],
    *,
    flags: Mapping[str, str],
    marks: Sequence[str] = (),
) -> Joined:
    """The fields of a log as one table.

    Args:
        log: the file.
        clock: column of the time and how it is written. A table that lacks it goes by its own clock.
        inputs: fields that are interpolated, and how: on straight lines ("foh"), or held ("zoh").
        others: fields that keep their own times.
        flags: field of a condition -> field that it speaks about, in whose table it is looked for first.
        marks: fields that tell which rows belong to the trial; each holds from one sample to the next.

    Returns:
        The table; its columns have the names that were asked for. A file that is one table without a clock of its own
        comes back as it is.

    Raises:
        BadInput: a field is not there, a table has no clock, or its time runs back.
    """
    found = {name: log.find(name) for name in dict.fromkeys([*inputs, *others])}
    for flag, about in flags.items():
        table = found[about][0]
        found.setdefault(flag, (table, flag) if table.has(flag) else log.find(flag))
    held = [mark for mark in marks if mark not in found]
    found |= {mark: log.find(mark) for mark in held}
    used = {table.name: table for table, _ in found.values()} or dict(list(log.tables.items())[:1])
    first = next(iter(used.values()))
    if len(used) == 1 and (first.time is None or (clock.as_text and first.has(clock.column))):
        renamed = {name: first.column(column) for name, (_, column) in found.items() if name not in first.columns}
        units = {name: first.units[column] for name, (_, column) in found.items() if column in first.units}
        table = Table(
            log.source, {**first.columns, **renamed}, {**first.units, **units}, first.lines, first.decimal, first.name
        )
        return Joined(table, clock, None, [])
    if clock.as_text:
        raise BadInput(
            "its topics have clocks of their own, which count seconds",
            where=log.source,
            do="Leave dates, date, jumps and the units date and hhmmss out of [time].",
        )
    clocks = {name: _clock(log, table, clock.column, clock.unit) for name, table in used.items()}
    start = log.start(clock.column)
    if len(used) == 1:
        columns = {name: table.column(column) for name, (table, column) in found.items()}
        columns[CLOCK] = pd.Series(clocks[first.name], copy=False)
        table = Table(log.source, columns, _units(found), first.lines, first.decimal, first.name)
        return Joined(table, Clock(CLOCK, "s"), start, [])
    return _several(log, found, clocks, inputs, held, start)


def _several(
    log: Log,
    found: Mapping[str, tuple[Table, str]],
    clocks: Mapping[str, Array],
    inputs: Mapping[str, Hold],
    held: list[str],
    start: str | None,
) -> Joined:
    own = {table.name for name, (table, _) in found.items() if name not in inputs and name not in held}
    rows_of = [topic for topic in clocks if topic in own]
    t, rows = _union({topic: clocks[topic] for topic in rows_of or clocks})
    kept = np.ones(t.size, dtype=bool)
    notes: list[str] = []
    columns: dict[str, pd.Series[Any]] = {}
    for name, (table, column) in found.items():
        if name in inputs:
            values, inside, longest = _interpolated(table.numbers(column), clocks[table.name], t, inputs[name])
            kept &= inside
            if not np.isin(t[inside], clocks[table.name]).all():
                how = "linear between" if inputs[name] == "foh" else "held after"
                notes.append(f"{name}: {how} its samples, which are at most {longest:.3g} s apart")
        elif name in held:
            last = np.searchsorted(clocks[table.name], t, side="right") - 1
            values = table.column(column).reset_index(drop=True).reindex(last).to_numpy()
        else:
            series = table.column(column)
            values = series.reset_index(drop=True).reindex(_source_rows(rows, table.name, t.size)).to_numpy()
        columns[name] = pd.Series(values, copy=False)
    if not kept.all():
        notes.append(f"{int((~kept).sum())} of {t.size} times left out, at which an input was not recorded")
    if kept.sum() < 2:
        raise BadInput(
            f"the topics {listed(list(clocks))} were hardly recorded at the same time",
            where=log.source,
            do="Choose topics that overlap, or another clock in [time].",
        )
    notes.append(f"each output at its own times: {t.size} times of {len(rows)} topics ({listed(list(rows))})")
    columns = {name: series[kept].reset_index(drop=True) for name, series in columns.items()}
    columns[CLOCK] = pd.Series(t[kept], copy=False)
    table = Table(log.source, columns, _units(found), np.zeros(int(kept.sum()), dtype=np.int64))
    return Joined(table, Clock(CLOCK, "s"), start, notes, own_times=True)


def _units(found: Mapping[str, tuple[Table, str]]) -> dict[str, str]:
    return {**{n: t.units[c] for n, (t, c) in found.items() if c in t.units}, CLOCK: "s"}


def _clock(log: Log, table: Table, time: str, unit: str | None) -> Array:
    clock = log.clock(table, time, unit)
    if clock is None:
        raise BadInput(
            f"it has no clock and no column {time!r}", where=table.where, do="Name its time in [time], as column = ..."
        )
    gone = np.flatnonzero(~np.isfinite(clock))
    if gone.size:
        raise BadInput(
            f"{gone.size} sample(s) have no time",
            where=f"{table.where}, {table.places(gone)}",
            do="Choose another clock.",
        )
    back = np.flatnonzero(np.diff(clock) < 0) + 1
    if back.size:
        row = int(back[0])
        raise BadInput(
            f"time runs back, from {clock[row - 1]:g} s to {clock[row]:g} s",
            where=f"{table.where}, {table.place(row)}",
            do="Name another clock of the log in [time], or give each recording a file of its own.",
        )
    return clock


def _union(clocks: Mapping[str, Array]) -> tuple[Array, dict[str, NDArray[np.intp]]]:
    """All times (n,) in their order, and for each clock which of them its samples are.

    A time that one clock repeats stays as often as it does, for the study says what to do with it.
    """
    times = np.concatenate(list(clocks.values()))
    again = np.concatenate([_occurrence(clock) for clock in clocks.values()])
    order = np.lexsort((again, times))
    fresh = np.ones(times.size, dtype=bool)
    fresh[1:] = (np.diff(times[order]) != 0) | (np.diff(again[order]) != 0)
    place = np.empty(times.size, dtype=np.intp)
    place[order] = np.cumsum(fresh) - 1
    ends = np.cumsum([clock.size for clock in clocks.values()])
    parts = np.split(place, ends[:-1])
    return times[order][fresh], dict(zip(clocks, parts, strict=True))


def _occurrence(clock: Array) -> NDArray[np.int64]:
    """How many samples before each one have the same time."""
    index = np.arange(clock.size)
    new = np.concatenate([[True], np.diff(clock) != 0])
    return index - np.maximum.accumulate(np.where(new, index, 0))


def _source_rows(rows: Mapping[str, NDArray[np.intp]], topic: str, size: int) -> NDArray[np.int64]:
    """Row of a topic at each of all times, -1 (which no row has) where it has none."""
    source = np.full(size, -1, dtype=np.int64)
    if topic in rows:
        source[rows[topic]] = np.arange(rows[topic].size)
    return source


def _interpolated(values: Array, clock: Array, t: Array, hold: Hold) -> tuple[Array, NDArray[np.bool_], float]:
    """Values at times t, which of these lie within the samples, and the longest time between samples."""
    valid = np.isfinite(values)
    if valid.sum() < 2:
        return np.full(t.size, np.nan), np.ones(t.size, dtype=bool), float("inf")
    clock, values = clock[valid], values[valid]
    inside = (t >= clock[0]) & (t <= clock[-1])
    return interpolated(clock, values, t, hold), inside, float(np.diff(clock).max())
