"""A log as a whole, before it is cut into trials: read with a study's columns, or with inferred ones."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.study.infer_columns import infer_columns
from seatruth.study.load import parse, read_text
from seatruth.study.trial_files import clock, column_spec, stated_frames
from seatruth.trials import STANDARD_CHANNELS, Channel, Clock, ColumnSpec, Frames, Trial
from seatruth.trials.frames import POSITIONS
from seatruth.trials.read import trial_from_table
from seatruth.trials.read_table import read_table
from seatruth.trials.tables import Table

_INPUTS = ("delta", "delta_s", "n")
_UTM = ("northing", "easting")
"""Channels that need a zone, which no header states."""


def read_log(path: Path, study: Path | None = None) -> Trial:
    """The log with whatever standard channels it has; inputs may have gaps here, as the parts that are taken may not.

    Args:
        path: the file.
        study: a study file, whose [time], [channels] and [files] say how the log is read; without one the columns are
            inferred from their names and units, as `seatruth init` does.

    Raises:
        BadInput: the file cannot be read, has no time, or holds none of the standard channels.
    """
    if study is None:
        table = read_table(path)
        (time, specs), frames = _inferred(table), Frames()
    else:
        file, _ = parse(read_text(study), str(study))
        given = file.files
        table = read_table(
            path, table=given.variable, separator=given.separator, decimal=given.decimal, encoding=given.encoding
        )
        time, frames = clock(file.time), stated_frames(file)
        specs = {name: column_spec(name, file.channels) for name in (*STANDARD_CHANNELS, *file.channels)}
        specs = {name: spec for name, spec in specs.items() if all(_has(table, column) for column in spec.columns)}
        specs = _with_one_position(specs, file.channels)
    if not specs:
        raise BadInput(
            "no column was recognised as a channel",
            where=str(path),
            do="Name the columns in the [channels] of a study (`seatruth init`), and give it with --study.",
        )
    log = trial_from_table(table, time=time, inputs={}, outputs=specs, name=path.stem, frames=frames)
    inputs = {name: log.outputs[name] for name in _INPUTS if name in log.outputs}
    outputs = {name: values for name, values in log.outputs.items() if name not in inputs}
    return Trial(log.name, log.t, inputs, outputs, log.conditions, log.steps, log.source, _synthetic(path), log.lines)


def row_times(path: Path, study: Path | None = None) -> tuple[Table, Array]:
    """The log's table and the time of each row, s, which may start anew with each run; NaN where it is no number."""
    table = read_table(path)
    column = parse(read_text(study), str(study))[0].time.column if study is not None else _inferred(table)[0].column
    series = table.column(column)
    numbers = pd.to_numeric(series, errors="coerce") if pd.api.types.is_numeric_dtype(series.dtype) else None
    if numbers is None:
        return table, np.arange(len(table), dtype=np.float64)
    return table, np.asarray(numbers.to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)


def _with_one_position(specs: Mapping[str, ColumnSpec], named: Collection[str] = ()) -> dict[str, ColumnSpec]:
    """The channels with the position given once: as the study names it, else as x and y, else by satellites."""
    pairs = [pair for pair in (("x", "y"), *POSITIONS) if specs.keys() >= {*pair}]
    pairs.sort(key=lambda pair: pair[0] not in named)
    other = {name for pair in (*pairs[1:], *POSITIONS) for name in pair} - {*(pairs[0] if pairs else ())}
    return {name: spec for name, spec in specs.items() if name not in other}


def _inferred(table: Table) -> tuple[Clock, dict[str, ColumnSpec]]:
    titled = {name: f"{name} [{table.units[name]}]" if name in table.units else name for name in table.columns}
    back = {title: name for name, title in titled.items()}
    numbers = {titled[name]: _numbers(series) for name, series in table.columns.items()}
    channels = [channel for name, channel in STANDARD_CHANNELS.items() if name not in _UTM]
    found = infer_columns(numbers, [Channel("t", "s"), *channels])
    if "t" not in found:
        raise BadInput(
            "no time column was recognised",
            where=table.source,
            do="Name it in the [time] of a study (`seatruth init`), and give it with --study.",
        )
    time = found.pop("t")
    specs = {name: ColumnSpec(back[hit.column], hit.unit) for name, hit in found.items()}
    return Clock(back[time.column]), _with_one_position(specs)


def _numbers(series: pd.Series[float]) -> Array:
    if pd.api.types.is_datetime64_any_dtype(series.dtype):
        return np.full(len(series), np.nan)
    numbers = pd.to_numeric(series, errors="coerce")
    return np.asarray(numbers.to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)


def _has(table: Table, column: str) -> bool:
    try:
        table.column(column)
    except BadInput:
        return False
    return True


def _synthetic(path: Path) -> bool:
    """Whether a text file says in its first comment that a simulator made it."""
    try:
        with path.open("rb") as file:
            head = file.read(400).decode("utf-8", "replace").lower()
    except OSError:
        return False
    return head.lstrip().startswith(("#", "%", "//")) and "synthetic" in head.splitlines()[0]
