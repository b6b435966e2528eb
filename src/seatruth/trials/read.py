"""From a file of columns to a Trial: units, signs, time and valid samples, and a clear message for anything else.

    trial = read_trial(
        "zigzag.csv",
        time=ColumnSpec("t"),
        inputs={"delta": ColumnSpec("rudder", unit="deg"), "n": ColumnSpec("rpm", unit="rpm")},
        outputs={"psi": ColumnSpec("heading", unit="deg"), "x": ColumnSpec("x", invalid_where="pos_hold == 1")},
    )

Rows are never dropped and samples never filled: what does not fit ends in BadInput, or is put right by a preparation
step that the user names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.trials.channel import Channel
from seatruth.trials.condition import rows_where
from seatruth.trials.places import place
from seatruth.trials.read_table import read_table
from seatruth.trials.standard_channels import STANDARD_CHANNELS
from seatruth.trials.tables import Table, as_text
from seatruth.trials.trial import Step, Trial
from seatruth.units import Conversion, inside_unit, to_si

DATE = "date"
EPOCH_SECONDS = 1e7
"""A time axis that starts later than this (116 days) counts from a calendar's zero: seatruth counts from its start,
because seconds since 1970 leave a double only 0.2 microseconds."""


@dataclass(frozen=True)
class ColumnSpec:
    """Where a channel is found in a file.

    `column` is the file's name for it (or its number, where the file has no header); `unit` the unit in the file: if
    None, the one that the header states, or else the channel's own. Values are multiplied by `sign * scale` and
    `offset` (in the channel's unit inside seatruth) is added. `invalid_where` marks samples that are not valid, as a
    condition on the file's columns: "pos_hold == 1", "sat < 4 or fix == 0", or a flag column's bare name.
    """

    column: str
    unit: str | None = None
    sign: float = 1.0
    scale: float = 1.0
    offset: float = 0.0
    invalid_where: str | None = None


def read_trial(
    path: str | Path,
    *,
    time: ColumnSpec | str | None = None,
    inputs: Mapping[str, ColumnSpec | str],
    outputs: Mapping[str, ColumnSpec | str],
    channels: Mapping[str, Channel] | None = None,
    name: str | None = None,
    conditions: Mapping[str, Any] | None = None,
    synthetic: bool = False,
    table: str | None = None,
    separator: str | None = None,
    decimal: str | None = None,
    encoding: str | None = None,
    repeated_time: Literal["refuse", "first", "last"] = "refuse",
    prepare: Sequence[tuple[str, Mapping[str, Any]]] = (),
) -> Trial:
    """Reads one recorded run from a CSV, Parquet or MATLAB (-v7) file.

    Args:
        path: the file.
        time: column of the time, and its unit.
        inputs: channel name -> column; a bare name is a column in the channel's own unit, or in the one that the header
            states. Inputs must be complete once the steps in `prepare` have run.
        outputs: the same for outputs; they may have missing samples (NaN).
        channels: the channels with their units inside seatruth, such as a model's; standard channels need no entry.
        name: name of the trial; None takes the file's name.
        conditions: what held during the run.
        synthetic: True if a simulator made it.
        table: variable of a MATLAB file that holds the columns.
        separator, decimal, encoding: how a CSV file is written; None guesses.
        repeated_time: samples with the same time: "refuse" the file, or keep the "first" or the "last".
        prepare: preparation steps as (name, options), in their order.

    Returns:
        The trial, in SI units.

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
    content = read_table(path, table=table, separator=separator, decimal=decimal, encoding=encoding)
    return trial_from_table(
        content,
        time=time,
        inputs=inputs,
        outputs=outputs,
        channels=channels,
        name=Path(path).stem if name is None else name,
        conditions=conditions,
        synthetic=synthetic,
        repeated_time=repeated_time,
        prepare=prepare,
    )


def _spec(spec: ColumnSpec | str) -> ColumnSpec:
    return ColumnSpec(spec) if isinstance(spec, str) else spec


def trial_from_table(
    table: Table,
    *,
    time: ColumnSpec | str | None = None,
    inputs: Mapping[str, ColumnSpec | str],
    outputs: Mapping[str, ColumnSpec | str],
    channels: Mapping[str, Channel] | None = None,
    name: str,
    conditions: Mapping[str, Any] | None = None,
    synthetic: bool = False,
    repeated_time: Literal["refuse", "first", "last"] = "refuse",
    prepare: Sequence[tuple[str, Mapping[str, Any]]] = (),
) -> Trial:
    """The same as read_trial for a table that is already in memory."""
    t, about = _time(table, _spec("t" if time is None else time))
    notes: list[str] = []
    columns: dict[str, dict[str, Array]] = {"inputs": {}, "outputs": {}}
    for kind, specs in (("inputs", inputs), ("outputs", outputs)):
        for channel, spec in specs.items():
            values, note = _channel(table, channel, _spec(spec), channels or {})
            columns[kind][channel] = values
            if note:
                notes.append(note)
    keep = _time_order(table, t, repeated_time)
    if keep is not None:
        notes.append(f"kept the {repeated_time} of samples with the same time, {t.size - keep.size} fewer")
    rows = slice(None) if keep is None else keep
    lines = np.arange(1, len(table) + 1, dtype=np.int64) if table.lines is None else table.lines
    trial = Trial(
        name=name,
        t=t[rows],
        inputs={c: v[rows] for c, v in columns["inputs"].items()},
        outputs={c: v[rows] for c, v in columns["outputs"].items()},
        conditions={**(conditions or {}), **about},
        source=table.source,
        synthetic=synthetic,
        lines=lines[rows],
    )
    if len(trial) < 2:
        raise BadInput("it holds fewer than two samples", where=table.source, do="A trial needs a time history.")
    if notes:
        trial = trial.with_step(Step("read", {}, "; ".join(notes)))
    if prepare:
        from seatruth.trials.prepare import apply_steps

        trial = apply_steps(trial, prepare)
    require_complete_inputs(trial)
    return trial


def read_columns(
    path: str | Path,
    *,
    table: str | None = None,
    separator: str | None = None,
    decimal: str | None = None,
    encoding: str | None = None,
) -> pd.DataFrame:
    """All columns of a file as they stand, for a look at what it holds.

    The units that the header states are in `frame.attrs["units"]`, the file's name in `frame.attrs["source"]`.
    """
    content = read_table(path, table=table, separator=separator, decimal=decimal, encoding=encoding)
    frame = pd.DataFrame(content.columns)
    frame.attrs.update(units=dict(content.units), source=content.source)
    return frame


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


def _channel(table: Table, name: str, spec: ColumnSpec, channels: Mapping[str, Channel]) -> tuple[Array, str]:
    """The channel's values in its unit inside seatruth, and what was done to them in words."""
    raw = table.numbers(spec.column)
    where = f"{table.source}, column {spec.column!r}"
    stated = table.units.get(spec.column) or table.units.get(spec.column.strip())
    conversion = _conversion(name, spec, stated, channels, where)
    for label in ("sign", "scale", "offset"):
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
    if spec.invalid_where:
        bad = rows_where(table, spec.invalid_where) & np.isfinite(values)
        values = np.where(bad, np.nan, values)
        done.append(f"{int(bad.sum())} of {values.size} samples not valid where {spec.invalid_where}")
    return values, f"{name}: {', '.join(done)}" if done else ""


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


def _time(table: Table, spec: ColumnSpec) -> tuple[Array, dict[str, Any]]:
    """Time in seconds (n,), complete; and the calendar's start where the file has dates."""
    series = table.column(spec.column)
    where = f"{table.source}, column {spec.column!r}"
    stated = table.units.get(spec.column)
    numeric = pd.api.types.is_numeric_dtype(series.dtype)
    if numeric and spec.unit == DATE:
        raise BadInput("it holds numbers, not dates", where=where, do="State their unit, as unit = 's'.")
    about: dict[str, Any] = {}
    stamps = None if numeric or spec.unit not in (None, DATE) else _dates(series, where)
    if stamps is not None:
        t, start = stamps
        if start is not None:
            about["start"] = start
    else:
        if spec.unit == DATE:
            raise BadInput("its dates cannot be read", where=where, do="Write them as 2020-07-31T13:14:21.5.")
        unit = spec.unit or (stated if stated else "s")
        try:
            conversion = to_si(unit, "s")
        except BadInput as problem:
            raise BadInput(f"time: {problem.what}", where=where, do=problem.do) from None
        t = conversion(table.numbers(spec.column) * (spec.sign * spec.scale)) + spec.offset
    gone = np.flatnonzero(~np.isfinite(t))
    if gone.size:
        raise BadInput(
            f"{gone.size} sample(s) have no time",
            where=f"{table.source}, {table.places(gone)}, column {spec.column!r}",
            do="Complete the time column, or delete those lines.",
        )
    if t.size and abs(t[0]) > EPOCH_SECONDS:
        about["start_s"] = float(t[0])
        t = t - t[0]
    return t, about


def _dates(series: pd.Series[Any], where: str) -> tuple[Array, str | None] | None:
    """Seconds since the first date and that date; None if the column does not hold dates or times of day."""
    if pd.api.types.is_timedelta64_dtype(series.dtype):
        return _seconds(series), None
    if not pd.api.types.is_datetime64_any_dtype(series.dtype):
        text = as_text(series, where).str.strip()
        if bool(text.dropna().str.fullmatch(r"\d{1,2}:\d{2}:\d{2}([.,]\d+)?").all()):
            spans = pd.to_timedelta(text.str.replace(",", ".", regex=False), errors="coerce")
            return _seconds(spans), None
        series = pd.to_datetime(text, format="ISO8601", errors="coerce", utc=True)
        if bool(series.isna().any() and not text[series.isna()].isna().all()) or bool(series.isna().all()):
            return None
    first = series.dropna().iloc[0] if series.notna().any() else None
    if first is None:
        return None
    return _seconds(series - first), str(first.isoformat())


def _seconds(spans: pd.Series[Any]) -> Array:
    return np.asarray(spans.dt.total_seconds().to_numpy(dtype=np.float64, na_value=np.nan), dtype=np.float64)


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
            do="Sort the file by time, or give each recording a file of its own.",
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
