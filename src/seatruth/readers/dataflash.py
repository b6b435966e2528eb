"""Logs of the ArduPilot autopilot (DataFlash, .BIN and .log)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from seatruth.readers.base import Content, Progress, Reader, Topic
from seatruth.readers.rows import Rows
from seatruth.units import is_unit

_CLOCK = "TimeUS"
_DESCRIPTIONS = {"FMT", "FMTU", "UNIT", "MULT", "PARM", "FILE"}
"""Messages that describe the log, not the vehicle."""
_SCALARS = (int, float, str, bytes)
"""What a field of a message holds; arrays of raw samples are left out."""
_SPELLINGS = {"deglatitude": "deg", "deglongitude": "deg", "degheading": "deg"}
"""Units of ArduPilot that name the quantity too."""


@dataclass(frozen=True)
class DataFlash(Reader):
    """Messages as pymavlink reads them, each with TimeUS (us since the autopilot started) as its clock.

    A message of several sensors is one topic for each: "IMU[0]", "IMU[1]". Units are those that the log states.
    """

    name: ClassVar[str] = "dataflash"
    title: ClassVar[str] = "ArduPilot DataFlash"
    suffixes: ClassVar[tuple[str, ...]] = (".bin", ".log")
    modules: ClassVar[tuple[str, ...]] = ("pymavlink",)
    extra: ClassVar[str] = "seatruth[ardupilot]"

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        return head.startswith(b"\xa3\x95\x80") or head.startswith(b"FMT, 128, 89, FMT,")

    def read(self, path: Path, progress: Progress) -> Content:
        from pymavlink import DFReader

        with open(path, "rb") as stream:
            binary = stream.read(1) == b"\xa3"
        log: Any = (DFReader.DFReader_binary if binary else DFReader.DFReader_text)(str(path), zero_time_base=True)
        found: dict[str, Rows] = {}
        units: dict[str, dict[str, str]] = {}
        while (message := log.recv_msg()) is not None:
            kind = message.get_type()
            if kind in _DESCRIPTIONS or _CLOCK not in message.fmt.columns:
                continue
            instance = message.fmt.instance_field
            name = kind if instance is None else f"{kind}[{getattr(message, instance)}]"
            values = {field: getattr(message, field) for field in message.fmt.columns}
            if name not in found:
                found[name] = Rows([field for field, value in values.items() if isinstance(value, _SCALARS)])
                stated = {field: _unit(message.fmt.get_unit(field)) for field in found[name].fields}
                units[name] = {field: unit for field, unit in stated.items() if unit} | {_CLOCK: "us"}
            if set(found[name].fields) <= set(values):
                found[name].add([values[field] for field in found[name].fields])
            progress(log.percent / 100)
        notes = [] if found else ["The log holds no message with a time."]
        return Content(
            [Topic(name, rows.columns(), units[name], _CLOCK) for name, rows in sorted(found.items())], notes
        )


def _unit(text: str) -> str:
    text = _SPELLINGS.get(text, text)
    return text if is_unit(text) else ""
