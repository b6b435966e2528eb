"""ROS messages as rows of numbers: nested fields get the names by which ROS shows them ("twist.twist.linear.x")."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from typing import Any

import numpy as np

from seatruth.readers.base import Topic
from seatruth.readers.rows import Rows

CLOCK = "log_time"
"""Column of the time at which a message was recorded, ns since 1970."""
LONGEST_ARRAY = 16
"""Arrays up to this length become fields; longer ones (covariances, scans) are left out (chosen here [S])."""
_DEEPEST = 8
PAYLOADS = frozenset(
    f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "PointCloud", "PointCloud2", "LaserScan")
)
"""Types that hold pictures and scans: decoding them takes long and gives no channel."""
AXES = (
    "ROS counts y and v to port, z up, and yaw anticlockwise from east (REP 103): turn signs where the log follows it "
    "(sign = -1)."
)


class Messages:
    """The messages of one topic, as columns that grow. The first message says which fields there are."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self._rows: Rows | None = None
        self._scalars: list[str] = []
        self._stamps: list[str] = []
        self._arrays: list[tuple[str, int]] = []

    def add(self, time_ns: int, message: Any) -> None:
        """Adds a message that was recorded at a time (ns)."""
        if self._rows is None:
            self._begin(message)
        assert self._rows is not None
        row: list[Any] = [time_ns]
        row += [operator.attrgetter(path)(message) for path in self._scalars]
        for path in self._stamps:
            stamp = operator.attrgetter(path)(message)
            row.append(int(stamp.sec) * 10**9 + int(stamp.nanosec))
        for path, size in self._arrays:
            values = operator.attrgetter(path)(message)
            row += list(values) if len(values) == size else [None] * size
        self._rows.add(row)

    def result(self) -> Topic | None:
        """The topic in the order of recording, which files need not keep; None where it has no fields of numbers."""
        if self._rows is None or len(self._rows.fields) < 2:
            return None
        columns = self._rows.columns()
        order = np.argsort(columns[CLOCK], kind="stable")
        units = {CLOCK: "ns", **dict.fromkeys(self._stamps, "ns")}
        return Topic(self.topic, {name: values[order] for name, values in columns.items()}, units, CLOCK)

    def _begin(self, message: Any) -> None:
        for path, value in _fields(message):
            if isinstance(value, (bool, int, float, str, np.generic)):
                self._scalars.append(path)
            elif isinstance(value, np.ndarray):
                self._arrays.append((path, len(value)))
            else:
                self._stamps.append(path)
        names = [f"{path}[{k}]" for path, size in self._arrays for k in range(size)]
        self._rows = Rows([CLOCK, *self._scalars, *self._stamps, *names])


def _fields(message: Any, prefix: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    """All fields that hold a number, a text, a time or a short array of numbers, with their paths."""
    for name in getattr(message, "__dataclass_fields__", {}):
        if name.startswith("__"):
            continue  # the message's type
        value, path = getattr(message, name), f"{prefix}{name}"
        if isinstance(value, (bool, int, float, str, np.generic)) or (
            hasattr(value, "sec") and hasattr(value, "nanosec")
        ):
            yield path, value
        elif isinstance(value, np.ndarray):
            if value.ndim == 1 and 0 < len(value) <= LONGEST_ARRAY and value.dtype.kind in "biuf":
                yield path, value
        elif depth < _DEEPEST:
            yield from _fields(value, f"{path}.", depth + 1)


def problems(failed: dict[str, int]) -> list[str]:
    """Sentences on messages that could not be decoded, by topic."""
    return [f"{count} message(s) of {topic} could not be decoded and are left out." for topic, count in failed.items()]
