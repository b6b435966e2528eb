"""Logs of the PX4 autopilot (ULog)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from seatruth.readers.base import Content, Progress, Reader, Topic

_CLOCK = "timestamp"
_SAMPLED = "timestamp_sample"


@dataclass(frozen=True)
class ULog(Reader):
    """Topics of uORB as pyulog reads them, each with its timestamp (us since the autopilot started) as its clock.

    Instance 0 of a topic has the topic's name, others have their number behind it: "sensor_gyro", "sensor_gyro[1]".
    Arrays are fields with a number: "q[0]". Axes are PX4's own: north-east-down, and forward-right-down.
    """

    name: ClassVar[str] = "ulog"
    title: ClassVar[str] = "PX4 ULog"
    suffixes: ClassVar[tuple[str, ...]] = (".ulg",)
    modules: ClassVar[tuple[str, ...]] = ("pyulog",)
    extra: ClassVar[str] = "seatruth[px4]"

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        return head.startswith(b"ULog\x01\x12\x35")

    def read(self, path: Path, progress: Progress) -> Content:
        import pyulog

        log = pyulog.ULog(str(path))
        topics, start = [], None
        for data in sorted(log.data_list, key=lambda data: (data.name, data.multi_id)):
            columns = {name: np.asarray(values) for name, values in data.data.items()}
            if _CLOCK not in columns:
                continue
            name = data.name if data.multi_id == 0 else f"{data.name}[{data.multi_id}]"
            units = {field: "us" for field in (_CLOCK, _SAMPLED) if field in columns}
            # Fixes were whole numbers before PX4 1.14 (sensor_gps: lat, lon), degrees since (latitude_deg).
            units |= {field: "degE7" for field in ("lat", "lon") if _whole(columns.get(field))}
            topics.append(Topic(name, columns, units, _CLOCK))
            start = start or _start(columns)
        notes = ["The log is damaged: what could be read of it is shown."] if log.file_corruption else []
        if log.dropouts:
            lost = sum(dropout.duration for dropout in log.dropouts)
            notes.append(f"The logger dropped samples {len(log.dropouts)} times, {lost / 1000:.3g} s in all.")
        return Content(topics, notes, start)


def _whole(values: np.ndarray | None) -> bool:
    return values is not None and values.dtype.kind == "i"


def _start(columns: dict[str, np.ndarray]) -> tuple[float, str] | None:
    """A clock value and its date, from the first satellite fix that has one."""
    utc = columns.get("time_utc_usec")
    if utc is None or not (utc > 0).any():
        return None
    row = int(np.flatnonzero(utc > 0)[0])
    date = np.datetime64(int(utc[row]), "us")
    return float(columns[_CLOCK][row]) / 1e6, f"{date}+00:00"
