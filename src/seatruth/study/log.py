"""A log as a whole, before it is cut into trials: read with a study's columns, or with inferred ones."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from seatruth import readers
from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.models import Model
from seatruth.progress import Progress, silent
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import FROM_HEADER, InferredColumn, infer_columns
from seatruth.study.load import parse, read_text
from seatruth.study.simulators import model_of
from seatruth.study.time_columns import dated_column
from seatruth.study.trial_files import clock, column_spec, stated_frames
from seatruth.trials import STANDARD_CHANNELS, Channel, Clock, ColumnSpec, Frames, Trial
from seatruth.trials.check.helpers import at_all_times, on_own_clock
from seatruth.trials.frames import POSITIONS
from seatruth.trials.read import trial_from_log

_INPUTS = ("delta", "delta_s", "n")
_THRUSTERS = {"n_port": "port", "n_starboard": "starboard"}
"""The inputs of two thrusters that steer a vehicle without a rudder, by their sides."""
_UTM = ("northing", "easting")
"""Channels that need a zone, which no header states."""


def read_log(path: Path, study: Path | None = None, progress: Progress = silent) -> Trial:
    """The log with whatever standard channels it has; inputs may have gaps here, as the parts that are taken may not.

    Args:
        path: the file.
        study: a study file, whose [time], [channels] and [files] say how the log is read; without one the columns are
            inferred from their names and units, as `seatruth init` does.
        progress: is told how far the reading has come.

    Raises:
        BadInput: the file cannot be read, has no time, or holds none of the standard channels.
    """
    if study is None:
        log = readers.read_log(path, progress=progress)
        (time, specs), frames, channels = _inferred(log), Frames(), {}
    else:
        file, _ = parse(read_text(study), str(study))
        log = readers.read_log(path, progress=progress, **file.files.reading)
        time, frames = clock(file.time), stated_frames(file)
        model = vehicle_of(study)
        # What only the model knows has its unit there: a pulse in us is no time in s.
        known = () if model is None else (*model.inputs, *model.outputs)
        channels = {channel.name: channel for channel in known if channel.name not in STANDARD_CHANNELS}
        specs = {name: column_spec(name, file.channels) for name in (*STANDARD_CHANNELS, *file.channels)}
        specs = {name: spec for name, spec in specs.items() if all(_has(log, column) for column in spec.columns)}
        specs = _with_one_position(specs, file.channels)
    if not specs:
        raise BadInput(
            "no column was recognised as a channel",
            where=str(path),
            do="Name the columns in the [channels] of a study (`seatruth init`), and give it with --study.",
        )
    read = trial_from_log(log, time=time, inputs={}, outputs=specs, name=path.stem, frames=frames, channels=channels)
    whole = _on_one_clock(read)
    inputs = {name: whole.outputs[name] for name in (*_INPUTS, *_THRUSTERS) if name in whole.outputs}
    outputs = {name: values for name, values in whole.outputs.items() if name not in inputs}
    return replace(whole, inputs=inputs, outputs=outputs, synthetic=_synthetic(path))


def vehicle_of(study: Path) -> Model | None:
    """The model that a study file names, without its effects and actuators; None where it cannot be had.

    Raises:
        BadInput: the file is no study.
    """
    file, problems = parse(read_text(study), str(study))
    with problems.at("model", "use"):
        return None if file.model is None else model_of(file.model, file.cost.hold, study.parent, problems)
    return None


def _on_one_clock(whole: Trial) -> Trial:
    """The log at the times of its quickest channel, the others between their samples: for looking at, never to fit."""
    own = [name for name in whole.outputs if on_own_clock(whole, name)]
    if not own:
        return whole
    quickest = max(own, key=lambda name: int(np.isfinite(whole.outputs[name]).sum()))
    rows = np.flatnonzero(np.isfinite(whole.outputs[quickest]))
    outputs = {name: at_all_times(whole, name)[rows] for name in whole.outputs}
    return replace(whole.samples(rows), outputs=outputs)


def row_times(
    path: Path, told_by: str, study: Path | None = None, progress: Progress = silent
) -> tuple[readers.Table, Array]:
    """The log's table and the time of each row, s, which may start anew with each run; NaN where it is no number.

    `told_by` is the column that tells the runs: of a log of several topics, its topic is the table.
    """
    if study is None:
        log = readers.read_log(path, progress=progress)
        column = _inferred(log)[0].column if len(log.tables) == 1 else ""
    else:
        file, _ = parse(read_text(study), str(study))
        log, column = readers.read_log(path, progress=progress, **file.files.reading), file.time.column
    if len(log.tables) > 1:
        topic, field = log.find(told_by)
        clock = log.clock(topic, column)
        alone = readers.Table(log.source, {told_by: topic.column(field)}, {}, topic.lines, topic.decimal, topic.name)
        return alone, np.arange(len(topic), dtype=np.float64) if clock is None else clock
    table = log.table()
    series = table.column(table.time if table.time is not None and not table.has(column) else column)
    if not pd.api.types.is_numeric_dtype(series.dtype):
        return table, np.arange(len(table), dtype=np.float64)
    return table, np.asarray(series.to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)


def _with_one_position(specs: Mapping[str, ColumnSpec], named: Collection[str] = ()) -> dict[str, ColumnSpec]:
    """The channels with the position given once: as the study names it, else as x and y, else by satellites."""
    pairs = [pair for pair in (("x", "y"), *POSITIONS) if specs.keys() >= {*pair}]
    pairs.sort(key=lambda pair: pair[0] not in named)
    other = {name for pair in (*pairs[1:], *POSITIONS) for name in pair} - {*(pairs[0] if pairs else ())}
    return {name: spec for name, spec in specs.items() if name not in other}


def _inferred(log: readers.Log) -> tuple[Clock, dict[str, ColumnSpec]]:
    fields = Fields(log)
    channels = [channel for name, channel in STANDARD_CHANNELS.items() if name not in _UTM]
    clocks = all(table.time is not None for table in log.tables.values())
    channels += [] if clocks else [Channel("t", "s")]
    found = infer_columns(fields, channels, orders=_INPUTS)
    if not {"delta", "delta_s"} & found.keys():
        channels += [Channel(name, "rev/s") for name in _THRUSTERS]
        found = infer_columns(fields, channels, orders=[*_INPUTS, *_THRUSTERS], thrusters=_THRUSTERS)
    dated = None if "t" in found or clocks else dated_column(fields)
    found |= {} if dated is None else {"t": dated}
    if "t" not in found and not clocks:
        raise BadInput(
            "no time column was recognised",
            where=log.source,
            do="Name it in the [time] of a study (`seatruth init`), and give it with --study.",
        )
    time = Clock() if clocks else _clock(fields, found.pop("t"))
    specs = {
        name: ColumnSpec(
            fields.name(hit.column), hit.unit, mean=tuple(map(fields.name, hit.columns)) if hit.others else ()
        )
        for name, hit in found.items()
    }
    return time, _with_one_position(specs)


def _clock(fields: Fields, hit: InferredColumn) -> Clock:
    """The clock of a column, whose unit may stand in its name: "TimeUS"."""
    _, content, column = fields.places[hit.column]
    named = column not in content.units and hit.why == FROM_HEADER
    return Clock(fields.name(hit.column), unit=hit.unit if named else None)


def _has(log: readers.Log, column: str) -> bool:
    try:
        log.find(column)
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
