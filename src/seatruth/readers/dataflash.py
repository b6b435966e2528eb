"""Logs of the ArduPilot autopilot (DataFlash, .BIN and .log)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seatruth.readers.base import Column, Content, Progress, Reader, Topic
from seatruth.units import is_unit

_CLOCK = "TimeUS"
_DESCRIPTIONS = {"FMT", "FMTU", "UNIT", "MULT", "PARM", "FILE"}
"""Messages that describe the log, not the vehicle."""
_BLOCK = 8192
"""Messages that are held as Python objects before they become arrays (chosen here [S])."""
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
        found: dict[str, _Messages] = {}
        while (message := log.recv_msg()) is not None:
            kind = message.get_type()
            fields = message.fmt.columns
            if kind in _DESCRIPTIONS or _CLOCK not in fields:
                continue
            instance = message.fmt.instance_field
            name = kind if instance is None else f"{kind}[{getattr(message, instance)}]"
            if name not in found:
                found[name] = _Messages(message.fmt)
            if fields == found[name].fields:
                found[name].add([getattr(message, field) for field in fields])
            progress(log.percent / 100)
        notes = [] if found else ["The log holds no message with a time."]
        return Content([messages.topic(name) for name, messages in sorted(found.items())], notes)


class _Messages:
    """Messages of one kind, as columns that grow."""

    def __init__(self, description: Any) -> None:
        self.fields: list[str] = list(description.columns)
        self.units = {field: _unit(description.get_unit(field)) for field in self.fields}
        self.units[_CLOCK] = "us"
        self._rows: list[Sequence[Any]] = []
        self._blocks: list[list[Column]] = []

    def add(self, row: Sequence[Any]) -> None:
        self._rows.append(row)
        if len(self._rows) == _BLOCK:
            self._flush()

    def topic(self, name: str) -> Topic:
        self._flush()
        parts = [[block[k] for block in self._blocks] for k in range(len(self.fields))]
        columns = {field: np.concatenate(part) for field, part in zip(self.fields, parts) if part[0].ndim == 1}
        return Topic(name, columns, {f: unit for f, unit in self.units.items() if unit and f in columns}, _CLOCK)

    def _flush(self) -> None:
        if self._rows:
            self._blocks.append([np.array(values) for values in zip(*self._rows)])
            self._rows = []


def _unit(text: str) -> str:
    text = _SPELLINGS.get(text, text)
    return text if is_unit(text) else ""
