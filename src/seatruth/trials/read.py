"""From a table of columns to a Trial: units, signs, time and valid samples, and a clear message for anything else.

    trial = read_trial(
        "zigzag.csv",
        time=Clock("t"),
        inputs={"delta": ColumnSpec("rudder", unit="deg"), "n": ColumnSpec("rpm", unit="rpm")},
        outputs={"psi": ColumnSpec("heading", unit="deg"), "x": ColumnSpec("x", invalid_where="pos_hold == 1")},
    )

Rows are never dropped and samples never filled: what does not fit ends in BadInput, or is put right by a preparation
step that the user names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.progress import Progress, silent
from seatruth.readers import Log, Table, read_log
from seatruth.trials.attitude import from_quaternion, from_vector
from seatruth.trials.channel import Channel
from seatruth.trials.condition import columns_of, rows_where
from seatruth.trials.frames import Frames, in_our_axes
from seatruth.trials.geodesy import from_ddmm
from seatruth.trials.join import on_one_clock
from seatruth.trials.missing_codes import missing_codes
from seatruth.trials.own_clocks import Hold, Parts, on_own_clocks
from seatruth.trials.places import place
from seatruth.trials.standard_channels import STANDARD_CHANNELS
from seatruth.trials.time_axis import Clock, TimeAxis, time_axis
from seatruth.trials.trial import Step, Trial
from seatruth.units import Conversion, inside_unit, to_si

DDMM = "ddmm"
"""Unit of latitudes and longitudes as NMEA writes them: degrees and minutes in one number."""


@dataclass(frozen=True)
class ColumnSpec:
    """Where a channel is found in a file.

    `column` is the file's name for it (or its number, where the file has no header); `unit` the unit in the file: if
    None, the one that the header states, or else the channel's own. Values are multiplied by `sign * scale` and
    `offset` (in the channel's unit inside seatruth) is added. `invalid_where` marks samples that are not valid, as a
    condition on the file's columns: "pos_hold == 1", "sat < 4 or fix == 0", or a flag column's bare name.

    In place of its column, an angle can have `vector`, the columns of its cosine and sine, or `quaternion`, the columns
    w, x, y, z of the turn from body axes to earth axes. `declination` (rad, east positive) turns a magnetic heading or
    course to the true one. `time` names the column with the channel's own clock, where it has one.
    """

    column: str
    unit: str | None = None
    sign: float = 1.0
    scale: float = 1.0
    offset: float = 0.0
    invalid_where: str | None = None
    vector: tuple[str, str] | None = None
    quaternion: tuple[str, str, str, str] | None = None
    declination: float = 0.0
    time: str | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Every column that the channel is computed from, its clock included."""
        return (*self.values_in, *([self.time] if self.time else []))

    @property
    def values_in(self) -> tuple[str, ...]:
        """The columns of its values."""
        return self.quaternion or self.vector or (self.column,)


def read_trial(
    path: str | Path,
    *,
    time: Clock | str | None = None,
    inputs: Mapping[str, ColumnSpec | str],
    outputs: Mapping[str, ColumnSpec | str],
    channels: Mapping[str, Channel] | None = None,
    name: str | None = None,
    conditions: Mapping[str, Any] | None = None,
    synthetic: bool = False,
    repeated_time: Literal["refuse", "first", "last"] = "refuse",
    where: str | None = None,
    prepare: Sequence[tuple[str, Mapping[str, Any]]] = (),
    frames: Frames | None = None,
    hold: Hold = "foh",
    reader: str | None = None,
    progress: Progress = silent,
    **options: Any,
) -> Trial:
    """Reads one recorded run from a file of any format of `seatruth list readers`.

    Args:
        path: the file.
        time: column of the time, and how it is written; a log whose topics have no such column goes by its own clocks.
        inputs: channel name -> column; a bare name is a column in the channel's own unit, or in the one that the header
            states. In a log of several topics it is "TOPIC.FIELD". Inputs must be complete once the steps in `prepare`
            have run.
        outputs: the same for outputs; they may have missing samples (NaN).
        channels: the channels with their units inside seatruth, such as a model's; standard channels need no entry.
        name: name of the trial; None takes the file's name.
        conditions: what held during the run.
        synthetic: True if a simulator made it.
        repeated_time: samples with the same time: "refuse" the file, or keep the "first" or the "last".
        where: rows that belong to the trial, as a condition on the file's columns ("run == 2"); None takes all.
        prepare: preparation steps as (name, options), in their order.
        frames: axes of the log; None: seatruth's own. Outputs "latitude" and "longitude", or "northing" and "easting",
            become "x" and "y".
        hold: how inputs with clocks of their own are interpolated: "foh" (straight lines) or "zoh" (held).
        reader: name of the reader; None recognises the format.
        progress: is told how far the reading has come.
        options: options of readers, as `separator`, `decimal` and `encoding` of a CSV file; None where not given.

    Returns:
        The trial, in SI units. Where its columns come from topics with clocks of their own, its times are all those at
        which an output was measured, and inputs are interpolated as `hold` says.

    Raises:
        BadInput: the message names the file, the line and the column, and what to do.

    Example:
        >>> from pathlib import Path
        >>> from seatruth import read_trial
        >>> written = Path("run.csv").write_text("t,rudder,psi\\n0,0,0\\n1,10,1\\n2,10,3\\n")
        >>> run = read_trial("run.csv", inputs={"delta": "rudder"}, outputs={"psi": "psi"})
        >>> run.inputs["delta"].tolist()
        [0.0, 10.0, 10.0]
    """
    return trial_from_log(
        read_log(path, reader=reader, progress=progress, **options),
        time=time,
        inputs=inputs,
        outputs=outputs,
        channels=channels,
        name=Path(path).stem if name is None else name,
        conditions=conditions,
        synthetic=synthetic,
        repeated_time=repeated_time,
        where=where,
        prepare=prepare,
        frames=frames,
        hold=hold,
    )


def _spec(spec: ColumnSpec | str) -> ColumnSpec:
    return ColumnSpec(spec) if isinstance(spec, str) else spec


def trial_from_log(
    log: Log,
    *,
    time: Clock | str | None = None,
    inputs: Mapping[str, ColumnSpec | str],
    outputs: Mapping[str, ColumnSpec | str],
    name: str,
    conditions: Mapping[str, Any] | None = None,
    where: str | None = None,
    hold: Hold = "foh",
    **rest: Any,
) -> Trial:
    """The same as read_trial for a log that is already in memory; `rest` are the other arguments."""
    clock = _clock(time)
    specs = {"inputs": [_spec(spec) for spec in inputs.values()], "outputs": [_spec(s) for s in outputs.values()]}
    every = [spec for kind in specs.values() for spec in kind]
    joined = on_one_clock(
        log,
        clock,
        [column for spec in specs["inputs"] for column in spec.values_in],
        [
            *(column for spec in specs["outputs"] for column in spec.values_in),
            *(spec.time for spec in every if spec.time is not None),
        ],
        flags={
            flag: spec.columns[0] for spec in every if spec.invalid_where for flag in columns_of(spec.invalid_where)
        },
        marks=[] if where is None else columns_of(where),
        hold=hold,
    )
    table = joined.table
    if where is not None:
        chosen = rows_where(table, where)
        if not chosen.any():
            raise BadInput(f"no row fulfils {where!r}", where=log.source, do="Check the column and its values.")
        table = table.rows(chosen)
    return trial_from_table(
        table,
        time=joined.clock,
        inputs=inputs,
        outputs=outputs,
        name=name,
        conditions=conditions if joined.start is None else {**(conditions or {}), "start": joined.start},
        hold=hold,
        notes=[*log.notes, *joined.notes],
        **rest,
    )


def _clock(time: Clock | str | None) -> Clock:
    return time if isinstance(time, Clock) else Clock("t" if time is None else time)


def trial_from_table(
    table: Table,
    *,
    time: Clock | str | None = None,
    inputs: Mapping[str, ColumnSpec | str],
    outputs: Mapping[str, ColumnSpec | str],
    channels: Mapping[str, Channel] | None = None,
    name: str,
    conditions: Mapping[str, Any] | None = None,
    synthetic: bool = False,
    repeated_time: Literal["refuse", "first", "last"] = "refuse",
    prepare: Sequence[tuple[str, Mapping[str, Any]]] = (),
    frames: Frames | None = None,
    hold: Hold = "foh",
    notes: Sequence[str] = (),
) -> Trial:
    """The same as read_trial for a table that is already in memory; `notes` go on record with what is done here."""
    clock, frames, notes = _clock(time), frames or Frames(), list(notes)
    missing: dict[str, list[float]] = {}
    specs = {kind: {c: _spec(spec) for c, spec in named.items()} for kind, named in _kinds(inputs, outputs)}
    clocks = {c: spec.time for named in specs.values() for c, spec in named.items() if spec.time is not None}
    axis = None if clocks else time_axis(table, clock)
    columns: dict[str, dict[str, Array]] = {"inputs": {}, "outputs": {}}
    for kind, named in specs.items():
        for channel, spec in named.items():
            values, note, codes = _channel(table, channel, spec, channels or {}, frames)
            values.setflags(write=False)  # so that the trial need not copy it
            columns[kind][channel] = values
            if codes:
                missing[channel] = codes
            if note:
                notes.append(note)
    lines = np.arange(1, len(table) + 1, dtype=np.int64) if table.lines is None else table.lines
    if axis is None:
        t, columns, rows, about, said = on_own_clocks(table, clock, clocks, columns, repeated_time, hold)
    else:
        t, columns, rows, about, said = _one_clock(table, clock, axis, columns, repeated_time)
    trial = Trial(
        name=name,
        t=t,
        inputs=columns["inputs"],
        outputs=columns["outputs"],
        conditions={**(conditions or {}), **about},
        source=table.source,
        synthetic=synthetic,
        lines=lines[rows],
    )
    notes = [*said, *notes]
    if len(trial) < 2:
        raise BadInput("it holds fewer than two samples", where=table.source, do="A trial needs a time history.")
    if notes:
        trial = trial.with_step(Step("read", {"missing_codes": missing} if missing else {}, "; ".join(notes)))
    trial = in_our_axes(trial, frames)
    if prepare:
        from seatruth.trials.prepare import apply_steps

        trial = apply_steps(trial, prepare)
    require_complete_inputs(trial)
    return trial


def require_complete_inputs(trial: Trial) -> None:
    """BadInput if a sample of an input is missing: a simulation needs them all."""
    for name, values in trial.inputs.items():
        gone = np.flatnonzero(~np.isfinite(values))
        if gone.size:
            raise BadInput(
                f"input {name!r} has {gone.size} missing sample(s) of {values.size}",
                where=place(trial, gone),
                do="Fill short gaps with the preparation step 'fill_gaps', or leave the stretch out with 'cut'.",
            )


def _kinds(
    inputs: Mapping[str, ColumnSpec | str], outputs: Mapping[str, ColumnSpec | str]
) -> tuple[tuple[str, Mapping[str, ColumnSpec | str]], ...]:
    return ("inputs", inputs), ("outputs", outputs)


def _one_clock(
    table: Table, clock: Clock, axis: TimeAxis, columns: dict[str, dict[str, Array]], repeated: str
) -> Parts:
    gone = np.flatnonzero(~np.isfinite(axis.t))
    if gone.size:
        raise BadInput(
            f"{gone.size} sample(s) have no time",
            where=f"{table.source}, {table.places(gone)}, column {clock.column!r}",
            do="Complete the time column, or delete those lines.",
        )
    notes = list(axis.notes)
    rows = np.arange(axis.t.size)
    keep = _time_order(table, axis.t, repeated)
    if keep is not None:
        notes.append(f"kept the {repeated} of samples with the same time, {axis.t.size - keep.size} fewer")
        rows = keep.astype(np.intp)
        columns = {kind: {c: v[rows] for c, v in named.items()} for kind, named in columns.items()}
    return axis.t[rows], columns, rows, axis.about, notes


class _Raw(NamedTuple):
    """Numbers of a channel (n,) without those that stand for no value, and what is known of them."""

    values: Array
    where: str
    unit: str | None
    codes: Sequence[float] = ()
    """Numbers that stood for no value."""
    missing: int = 0
    """How often they did."""


def _numbers(table: Table, name: str, spec: ColumnSpec) -> _Raw:
    """The channel's numbers as the file has them, where they are, and their unit if that is known."""
    if spec.vector is not None or spec.quaternion is not None:
        if spec.unit is not None:
            raise BadInput(
                f"channel {name!r} has a unit beside columns that give an angle in rad",
                where=table.source,
                do="Remove the unit.",
            )
        columns = spec.quaternion or spec.vector or ()
        raw = from_quaternion(table, columns, name) if spec.quaternion else from_vector(table, columns)
        return _Raw(raw, f"{table.source}, columns {', '.join(map(repr, columns))}", "rad")
    raw = table.numbers(spec.column)
    empty, codes = missing_codes(raw)
    if codes:
        raw = np.where(empty, np.nan, raw)
    where = f"{table.source}, column {spec.column!r}"
    if spec.unit == DDMM:
        return _Raw(from_ddmm(raw), where, "deg", codes, int(empty.sum()))
    stated = table.units.get(spec.column) or table.units.get(spec.column.strip())
    return _Raw(raw, where, stated, codes, int(empty.sum()))


def _channel(
    table: Table, name: str, spec: ColumnSpec, channels: Mapping[str, Channel], frames: Frames
) -> tuple[Array, str, list[float]]:
    """The channel's values in its unit inside seatruth, what was done to them in words, and codes for "no value"."""
    raw, where, stated, codes, missing = _numbers(table, name, spec)
    if spec.unit == DDMM:
        spec = replace(spec, unit=None)
    conversion = _conversion(name, spec, stated, channels, where)
    for label in ("sign", "scale", "offset", "declination"):
        if not np.isfinite(getattr(spec, label)):
            raise BadInput(f"{label} is {getattr(spec, label)}", where=where, do="Give a finite number.")
    factor = spec.sign * spec.scale
    if factor == 0.0:
        raise BadInput("its scale is zero", where=where, do="Give a scale that is not zero.")
    values = conversion(raw)
    if factor != 1.0 or spec.offset != 0.0:
        values = values * factor + spec.offset
    done: list[str] = []
    if conversion != (1.0, 0.0):
        done.append(f"converted from {spec.unit or stated}")
    if factor != 1.0:
        done.append("sign changed" if factor == -1.0 else f"multiplied by {factor:g}")
    if spec.offset != 0.0:
        done.append(f"{spec.offset:g} added")
    if codes:
        done.append(f"{missing} of {values.size} samples missing, written as {_listed(codes)}")
    if spec.vector is not None or spec.quaternion is not None:
        done.append(f"computed from {'a quaternion' if spec.quaternion else 'its cosine and sine'}")
    if spec.declination != 0.0:
        values = values + (spec.declination if frames.earth == "NED" or name != "psi" else -spec.declination)
        done.append(f"magnetic to true with a declination of {np.degrees(spec.declination):+.4g} deg")
    if spec.invalid_where:
        bad = rows_where(table, spec.invalid_where) & np.isfinite(values)
        values = np.where(bad, np.nan, values)
        done.append(f"{int(bad.sum())} of {values.size} samples not valid where {spec.invalid_where}")
    return values, f"{name}: {', '.join(done)}" if done else "", list(codes)


def _listed(codes: Sequence[float]) -> str:
    return " and ".join(f"{code:.10g}" for code in codes)


def _conversion(
    name: str, spec: ColumnSpec, stated: str | None, channels: Mapping[str, Channel], where: str
) -> Conversion:
    try:
        if spec.unit is not None and stated is not None and to_si(stated, spec.unit) != (1.0, 0.0):
            raise BadInput(
                f"its header says {stated!r} and the study says {spec.unit!r}",
                do="Correct the one that is wrong, or leave the unit out of the study to go by the header.",
            )
        unit = spec.unit or stated
        channel = channels.get(name) or STANDARD_CHANNELS.get(name)
        if unit is None:
            return Conversion(1.0, 0.0)
        return to_si(unit, inside_unit(unit) if channel is None else channel.unit)
    except BadInput as problem:
        raise BadInput(f"channel {name!r}: {problem.what}", where=where, do=problem.do) from None


def _time_order(table: Table, t: Array, repeated: str) -> NDArray[np.int64] | None:
    """Which rows to keep where times repeat and the user said how; BadInput for any other disorder."""
    if repeated not in ("refuse", "first", "last"):
        raise BadInput(f"repeated_time = {repeated!r} is not known", do="Use 'refuse', 'first' or 'last'.")
    steps = np.diff(t)
    back = np.flatnonzero(steps < 0) + 1
    if back.size:
        row = int(back[0])
        more = f" ({back.size - 1} more times later on)" if back.size > 1 else ""
        raise BadInput(
            f"time runs back, from {t[row - 1]:g} s to {t[row]:g} s{more}",
            where=f"{table.source}, {table.place(row)}",
            do="Sort the file by time, give each recording a file of its own, or, if a clock was set, jumps in [time].",
        )
    again = np.flatnonzero(steps == 0) + 1
    if not again.size:
        return None
    if repeated == "refuse":
        raise BadInput(
            f"{again.size} sample(s) repeat the time of the sample before (first {t[again[0]]:g} s)",
            where=f"{table.source}, {table.places(again)}",
            do='Delete them, give time more digits, or set repeated = "first" or "last" in [time].',
        )
    keep = np.ones(t.size, dtype=bool)
    keep[again if repeated == "first" else again - 1] = False
    return np.flatnonzero(keep)
