"""Finds the column of a pressure that shows the depth, where a log has no depth itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seatruth.study.column_spellings import spelt_out
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import FROM_HEADER, InferredColumn, split_header
from seatruth.trials.pressure import AIR, is_pressure
from seatruth.units import to_si

_PRESSURES = frozenset(("pressure", "press", "pres", "prs"))
"""Words of a pressure; one of them is in the name ..."""
_OF_WATER = frozenset(
    (
        *("water", "sea", "seawater", "depth", "hydrostatic", "ctd", "sci", "sensor", "transducer", "external", "ext"),
        *("outside", "gauge", "rel", "relative", "measured", "keller", "paro", "digiquartz", "data", "fluid"),
    )
)
"""... and these may stand beside it. Others, as hull, vacuum or air, say that it is the pressure of something else."""
_WITH_AIR = frozenset(("abs", "absolute"))
_SLOCUM = frozenset(("m_pressure", "sci_water_pressure"))
"""Fields of Slocum gliders, which are in bar. [L] Teledyne Webb Research, masterdata"""
_WEATHER = (8.5e4, 1.09e5)
"""Pa: a pressure that stays between these all the time is the weather's, not that of any depth."""


class Pressures(NamedTuple):
    """The column of a depth's pressure, and columns that may be one but do not state a unit."""

    found: InferredColumn | None
    open: tuple[str, ...]

    def notes(self, channel: str, fields: Fields) -> list[str]:
        """What the user should know of pressures without a unit."""
        if self.found is not None or not self.open:
            return []
        column = fields.name(self.open[0])
        what = f'{channel} = {{ column = "{column}", unit = "dbar" }}, or "bar"'
        return [f"The column {column!r} may be the pressure of the depth, but has no unit. If it is: {what}."]


def pressure_of_depth(fields: Fields, channel: str) -> Pressures:
    """The pressure among a log's fields that is the channel's depth.

    Example:
        >>> import pandas as pd
        >>> from seatruth.readers import Log, Table
        >>> log = Log("log.csv", {"": Table("log.csv", {"press_dbar": pd.Series([6.1, 6.3])}, {})})
        >>> pressure_of_depth(Fields(log), "z").found.unit
        'dbar'
    """
    unknown: list[str] = []
    for title in fields:
        name, unit = split_header(title.rpartition(".")[2])
        words = {*spelt_out(name).split()}
        if not words & _PRESSURES or not words <= _PRESSURES | _OF_WATER | _WITH_AIR:
            continue
        unit = unit or ("bar" if fields.name(title) in _SLOCUM else "")
        if not unit:
            unknown.append(title)
        elif is_pressure(unit) and not _is_weather(fields[title], unit):
            air = f"offset = {-AIR:.2f}"
            why = FROM_HEADER if title not in _SLOCUM else "a glider's unit"
            why += "; a depth in sea water; in fresh water add scale = 1.025"
            with_air = bool(words & _WITH_AIR)
            why += "; the offset takes off the air's" if with_air else f"; if it counts the air's, add {air}"
            return Pressures(InferredColumn(channel, title, unit, why, turned=air if with_air else ""), ())
    return Pressures(None, tuple(unknown))


def _is_weather(numbers: np.ndarray, unit: str) -> bool:
    pascals = to_si(unit, "Pa")(numbers[np.isfinite(numbers)])
    return bool(pascals.size) and _WEATHER[0] < float(pascals.min()) and float(pascals.max()) < _WEATHER[1]
