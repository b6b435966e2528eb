"""From a file or a table of columns to a Trial, and a clear message for anything that does not make one.

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
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.progress import Progress, silent
from seatruth.readers import Log, Table, read_log
from seatruth.trials.channel import Channel, Hold
from seatruth.trials.columns import ColumnSpec, channel_values
from seatruth.trials.condition import columns_of, rows_where
from seatruth.trials.frames import Frames, in_our_axes
from seatruth.trials.join import on_one_clock
from seatruth.trials.own_clocks import Parts, on_own_clocks
from seatruth.trials.places import place
from seatruth.trials.time_axis import Clock, TimeAxis, time_axis
from seatruth.trials.trial import Step, Trial


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
        {column: spec.hold or hold for spec in specs["inputs"] for column in spec.values_in},
        [
            *(column for spec in specs["outputs"] for column in spec.values_in),
            *(spec.time for spec in every if spec.time is not None),
        ],
        flags={
            flag: spec.columns[0] for spec in every if spec.invalid_where for flag in columns_of(spec.invalid_where)
        },
        marks=[] if where is None else columns_of(where),
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
        own_times=joined.own_times,
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
    own_times: bool = False,
) -> Trial:
    """The same as read_trial for a table that is already in memory; `notes` go on record with what is done here.

    `own_times` says that each output has values at its own times alone.
    """
    clock, frames, notes = _clock(time), frames or Frames(), list(notes)
    missing: dict[str, list[float]] = {}
    specs = {kind: {c: _spec(spec) for c, spec in named.items()} for kind, named in _kinds(inputs, outputs)}
    clocks = {c: spec.time for named in specs.values() for c, spec in named.items() if spec.time is not None}
    axis = None if clocks else time_axis(table, clock)
    columns: dict[str, dict[str, Array]] = {"inputs": {}, "outputs": {}}
    for kind, named in specs.items():
        for channel, spec in named.items():
            values, note, codes = channel_values(table, channel, spec, channels or {}, frames)
            values.setflags(write=False)  # so that the trial need not copy it
            columns[kind][channel] = values
            if codes:
                missing[channel] = codes
            if note:
                notes.append(note)
    lines = np.arange(1, len(table) + 1, dtype=np.int64) if table.lines is None else table.lines
    if axis is None:
        holds = {channel: spec.hold or hold for channel, spec in specs["inputs"].items()}
        t, columns, rows, about, said = on_own_clocks(table, clock, clocks, columns, repeated_time, holds)
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
        own = list(outputs) if own_times or clocks else []
        units = {channel: spec.unit for named in specs.values() for channel, spec in named.items() if spec.unit}
        known = {"missing_codes": missing, "own_clocks": own, "stated_units": units}
        trial = trial.with_step(Step("read", {key: value for key, value in known.items() if value}, "; ".join(notes)))
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
    same = _repeats_whole(axis.t, columns)
    keep = _time_order(table, axis.t, "first" if same and repeated == "refuse" else repeated)
    if keep is not None:
        fewer = axis.t.size - keep.size
        how = "rows that repeat the one before" if same else f"of samples with the same time the {repeated}"
        notes.append(f"left out {how}, {fewer} of them" if same else f"kept {how}, {fewer} fewer")
        rows = keep.astype(np.intp)
        columns = {kind: {c: v[rows] for c, v in named.items()} for kind, named in columns.items()}
    return axis.t[rows], columns, rows, axis.about, notes


def _repeats_whole(t: Array, columns: dict[str, dict[str, Array]]) -> bool:
    """Whether every row that repeats the time of the one before repeats all its values: nothing is lost without it."""
    again = np.flatnonzero(np.diff(t) == 0) + 1
    values = [one for named in columns.values() for one in named.values()]
    return all(np.array_equal(one[again], one[again - 1], equal_nan=True) for one in values)


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
