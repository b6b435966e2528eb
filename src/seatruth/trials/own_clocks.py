"""Channels with clocks of their own, joined without inventing samples.

The times of the trial are those of all samples. An output has its values at its own times and none at the others; an
input, which a simulation needs at every time, is interpolated as the simulation holds it. Times at which an input was
not yet or no more recorded are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.readers.tables import Table
from seatruth.trials.channel import Hold
from seatruth.trials.time_axis import Clock, time_axis

Channels = dict[str, dict[str, Array]]
"""Values by channel, of "inputs" and of "outputs"."""
Parts = tuple[Array, Channels, NDArray[np.intp], dict[str, Any], list[str]]
"""Times, channels, rows of the file, conditions, notes."""


@dataclass(frozen=True)
class Series:
    """Samples of one channel: times t (n,) s, values (n,), rows (n,) of the file."""

    t: Array
    values: Array
    rows: NDArray[np.intp]


@dataclass(frozen=True)
class Joined:
    """Channels over the times t (n,); `rows` (n,) of the file in which a time stands; notes for the record."""

    t: Array
    inputs: dict[str, Array]
    outputs: dict[str, Array]
    rows: NDArray[np.intp]
    notes: tuple[str, ...]


def joined(
    inputs: Mapping[str, Series], outputs: Mapping[str, Series], holds: Mapping[str, Hold], where: str
) -> Joined:
    """All channels over the times of all their samples; `holds` by input.

    Raises:
        BadInput: a clock runs back or repeats a time, or the channels were not recorded together.
    """
    for name, series in (*inputs.items(), *outputs.items()):
        back = np.flatnonzero(np.diff(series.t) <= 0.0)
        if back.size:
            raise BadInput(
                f"the clock of {name!r} does not increase after {series.t[back[0]]:g} s",
                where=where,
                do="Correct it, or set jumps in [time].",
            )
    every = [*inputs.values(), *outputs.values()]
    t, first = np.unique(np.concatenate([series.t for series in every]), return_index=True)
    rows = np.concatenate([series.rows for series in every])[first]
    inside = np.ones(t.size, dtype=np.bool_)
    for series in inputs.values():
        inside &= (t >= series.t[0]) & (t <= series.t[-1]) if series.t.size else False
    if inside.sum() < 2:
        raise BadInput("its channels were not recorded at the same time", where=where, do="Check their clocks.")
    notes = [f"{t.size} times of {len(every)} channels with clocks of their own"]
    if not inside.all():
        notes.append(f"{int((~inside).sum())} times left out, at which an input was not recorded")
    t, rows = t[inside], rows[inside]
    held = {name: interpolated(series.t, series.values, t, holds[name]) for name, series in inputs.items()}
    for hold, how in (("foh", "linear between"), ("zoh", "held after")):
        names = [name for name in inputs if holds[name] == hold]
        if names:
            which = "inputs" if len(names) == len(inputs) else ", ".join(names)
            notes.append(f"{which} {how} their samples")
    return Joined(t, held, {name: _at_own_times(series, t) for name, series in outputs.items()}, rows, tuple(notes))


def interpolated(clock: Array, values: Array, t: Array, hold: Hold) -> Array:
    """Values at times t (n,), which lie within the clock's: on straight lines, or held from the last sample."""
    if hold == "foh":
        return np.asarray(np.interp(t, clock, values), dtype=np.float64)
    return np.asarray(values[np.searchsorted(clock, t, side="right") - 1], dtype=np.float64)


def _at_own_times(series: Series, t: Array) -> Array:
    values = np.full(t.size, np.nan)
    at = np.searchsorted(t, series.t)
    there = (at < t.size) & (t[np.minimum(at, t.size - 1)] == series.t)
    values[at[there]] = series.values[there]
    return values


def on_own_clocks(
    table: Table,
    clock: Clock,
    clocks: Mapping[str, str],
    columns: Channels,
    repeated: str,
    holds: Mapping[str, Hold],
) -> Parts:
    """The channels of a table over the times of all their samples.

    `clocks` names the columns with the clocks of channels that have one; the others go by `clock`. Where a clock
    repeats a time, `repeated` says which sample is kept. `holds` says of each input how its samples are joined.
    """
    names = dict.fromkeys(clocks.get(channel, clock.column) for kind in columns.values() for channel in kind)
    axes = {name: time_axis(table, replace(clock, column=name)) for name in names}
    first = min(axes.values(), key=lambda axis: axis.zero)
    if any(axis.dated != first.dated for axis in axes.values()):
        raise BadInput(
            "some of its clocks have dates and others do not", where=table.source, do="Choose clocks of one kind."
        )
    times = {name: axis.t + (axis.zero - first.zero) for name, axis in axes.items()}
    series = {
        kind: {
            channel: _series(table, channel, name, times[name], values, repeated)
            for channel, values in named.items()
            for name in [clocks.get(channel, clock.column)]
        }
        for kind, named in columns.items()
    }
    whole = joined(series["inputs"], series["outputs"], holds, table.source)
    notes = [note for axis in axes.values() for note in axis.notes]
    return whole.t, {"inputs": whole.inputs, "outputs": whole.outputs}, whole.rows, first.about, [*notes, *whole.notes]


def _series(table: Table, channel: str, column: str, t: Array, values: Array, repeated: str) -> Series:
    """The samples of one channel at its own times; BadInput for a value without a time."""
    rows = np.flatnonzero(np.isfinite(values))
    gone = rows[~np.isfinite(t[rows])]
    if gone.size:
        raise BadInput(
            f"{gone.size} sample(s) of {channel!r} have no time",
            where=f"{table.source}, {table.places(gone)}, column {column!r}",
            do="Complete its clock.",
        )
    if repeated != "refuse" and rows.size:
        again, edge = np.diff(t[rows]) == 0.0, np.array([False])
        rows = rows[~np.concatenate([edge, again] if repeated == "first" else [again, edge])]
    return Series(t[rows], values[rows], rows)
