"""Where a channel is found in a file, and its values from there: units, signs, codes and flags of missing samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.readers import Table
from seatruth.trials.attitude import from_quaternion, from_vector
from seatruth.trials.channel import Channel, Hold
from seatruth.trials.condition import rows_where
from seatruth.trials.frames import Frames
from seatruth.trials.geodesy import from_ddmm
from seatruth.trials.missing_codes import missing_codes
from seatruth.trials.pressure import GRAVITY, SEA_WATER, is_depth, is_pressure
from seatruth.trials.pressure import conversion as to_channel
from seatruth.trials.standard_channels import STANDARD_CHANNELS
from seatruth.units import PULSES, Conversion, inside_unit, to_si

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
    w, x, y, z of the turn from body axes to earth axes. `mean` names columns in one unit whose mean the channel is, as
    twin rudders; a sample that one of them lacks is missing. `declination` (rad, east positive) turns a magnetic
    heading or course to the true one. `time` names the column with the channel's own clock, where it has one. `value`,
    in place of all that, is the number that the channel has in the whole file, in `unit`. `hold` says how samples of an
    input with a clock of its own are joined, "foh" or "zoh"; None as those of the others.
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
    value: float | None = None
    mean: tuple[str, ...] = ()
    hold: Hold | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Every column that the channel is computed from, its clock included."""
        return (*self.values_in, *([self.time] if self.time else []))

    @property
    def values_in(self) -> tuple[str, ...]:
        """The columns of its values; none for one that is constant."""
        return () if self.value is not None else self.quaternion or self.vector or self.mean or (self.column,)


def channel_values(
    table: Table, name: str, spec: ColumnSpec, channels: Mapping[str, Channel], frames: Frames
) -> tuple[Array, str, list[float]]:
    """The channel's values in its unit inside seatruth, what was done to them in words, and codes for "no value"."""
    known = channels.get(name) or STANDARD_CHANNELS.get(name)
    if spec.mean and known is not None and known.angle:
        raise BadInput(
            f"channel {name!r} has no mean of columns: angles that wrap have none",
            where=table.source,
            do="Name one column.",
        )
    raw, where, stated, codes, missing, invalid = _numbers(table, name, spec)
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
    done = [] if spec.value is None else [f"{spec.value:g} throughout, as stated"]
    weighed = known is not None and is_depth(known) and is_pressure(spec.unit or stated or "")
    if weighed:
        said = f"a depth from a pressure in {spec.unit or stated}, by {SEA_WATER:g} kg/m3 and {GRAVITY:g} m/s2"
        done.append(said)
    elif conversion != (1.0, 0.0):
        done.append(f"converted from {spec.unit or stated}")
    if factor != 1.0:
        done.append("sign changed" if factor == -1.0 else f"multiplied by {factor:g}")
    if spec.offset != 0.0:
        done.append(f"{spec.offset:g} added")
    if codes:
        done.append(f"{missing} of {values.size} samples missing, written as {_listed(codes)}")
    if spec.vector is not None or spec.quaternion is not None:
        done.append(f"computed from {'a quaternion' if spec.quaternion else 'its cosine and sine'}")
    if spec.mean:
        done.append(f"mean of {len(spec.mean)} columns")
    if spec.declination != 0.0:
        values = values + (spec.declination if frames.earth == "NED" or name != "psi" else -spec.declination)
        done.append(f"magnetic to true with a declination of {np.degrees(spec.declination):+.4g} deg")
    if weighed and name == "z" and frames.earth == "ENU":
        values = -values  # a pressure grows downward whatever the log's axes are, which are turned later
    if spec.invalid_where:
        done.append(f"{invalid} of {values.size} samples not valid where {spec.invalid_where}")
    return values, f"{name}: {', '.join(done)}" if done else "", list(codes)


class _Raw(NamedTuple):
    """Numbers of a channel (n,) without those that stand for no value, and what is known of them."""

    values: Array
    where: str
    unit: str | None
    codes: Sequence[float]
    """Numbers that stood for no value."""
    missing: int
    """How often they did."""
    invalid: int
    """Samples that the study's `invalid_where` takes out."""


def _numbers(table: Table, name: str, spec: ColumnSpec) -> _Raw:
    """The channel's numbers as the file has them, where they are, and their unit if that is known."""
    if spec.unit is not None and (spec.vector is not None or spec.quaternion is not None):
        raise BadInput(
            f"channel {name!r} has a unit beside columns that give an angle in rad",
            where=table.source,
            do="Remove the unit.",
        )
    bad = rows_where(table, spec.invalid_where) if spec.invalid_where else np.zeros(len(table), dtype=np.bool_)
    if spec.value is not None:
        values = np.where(bad, np.nan, spec.value)
        return _Raw(values, f"{table.source}, channel {name!r}", None, [], 0, int(bad.sum()))
    parts = [table.numbers(column) for column in spec.values_in]
    invalid = int((bad & np.isfinite(parts).all(axis=0)).sum())
    # Before codes are looked for: what the study takes out already is no finding.
    parts = [np.where(bad, np.nan, part) for part in parts]
    missing = np.zeros(len(table), dtype=np.bool_)
    codes: list[float] = []
    for k, part in enumerate(parts):
        empty, found = missing_codes(part)
        if found:
            parts[k] = np.where(empty, np.nan, part)
            missing |= empty
            codes += [code for code in found if code not in codes]
    columns = ", ".join(map(repr, spec.values_in))
    where = f"{table.source}, column{'s' if len(parts) > 1 else ''} {columns}"
    values, unit = parts[0], table.unit(spec.column) or table.unit(spec.column.strip())
    if spec.quaternion is not None:
        values, unit = from_quaternion(table, spec.quaternion, parts, name), "rad"
    elif spec.vector is not None:
        values, unit = from_vector(table, spec.vector, parts), "rad"
    elif spec.mean:
        values, unit = np.mean(parts, axis=0), _unit_of_all(table, spec.mean, where)
    elif spec.unit == DDMM:
        values, unit = from_ddmm(values), "deg"
    return _Raw(values, where, unit, codes, int(missing.sum()), invalid)


def _unit_of_all(table: Table, columns: Sequence[str], where: str) -> str | None:
    """The unit that the headers state for columns which are averaged."""
    units = {unit for column in columns if (unit := table.unit(column)) is not None}
    if len(units) > 1:
        said = " and ".join(sorted(map(repr, units)))
        raise BadInput(f"their headers say {said}", where=where, do="The mean needs columns in one unit.")
    return next(iter(units), None)


def _listed(codes: Sequence[float]) -> str:
    return " and ".join(f"{code:.10g}" for code in codes)


def _conversion(
    name: str, spec: ColumnSpec, stated: str | None, channels: Mapping[str, Channel], where: str
) -> Conversion:
    if stated in PULSES and spec.scale != 1.0:
        stated = None  # the study says what a pulse commands: an angle, a share of full power
    try:
        if spec.unit is not None and stated is not None and _contradict(stated, spec.unit):
            raise BadInput(
                f"its header says {stated!r} and the study says {spec.unit!r}",
                do="Correct the one that is wrong, or leave the unit out of the study to go by the header.",
            )
        unit = spec.unit or stated
        channel = channels.get(name) or STANDARD_CHANNELS.get(name)
        if unit is None:
            return Conversion(1.0, 0.0)
        return to_si(unit, inside_unit(unit)) if channel is None else to_channel(unit, channel)
    except BadInput as problem:
        raise BadInput(f"channel {name!r}: {problem.what}", where=where, do=problem.do) from None


def _contradict(stated: str, unit: str) -> bool:
    """Whether two units of the same numbers differ. A pressure is no length here, though a depth can be either."""
    if stated == unit:
        return False
    return is_pressure(stated) != is_pressure(unit) or to_si(stated, unit) != (1.0, 0.0)
