"""Time in NMEA 0183: the stamps of loggers, UTC of fixes, and the sentences that have neither."""

from __future__ import annotations

import datetime
import re

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array

_TAG = re.compile(rb"\\[^\\]*?c:(\d+)[^\\]*\\")
_EPOCH = re.compile(rb"\b(\d{9,10}(?:\.\d+)?|\d{12,13})\b")
_ISO = re.compile(rb"(\d{4}-\d\d-\d\d)[T ,;](\d\d:\d\d:\d\d(?:[.,]\d+)?)(Z|[+-]\d\d:?\d\d)?")
_MILLISECONDS = 1e11
"""An epoch beyond this (the year 5138 in s, 1973 in ms) counts milliseconds."""
_HALF_DAY, _DAY = 43200.0, 86400.0


def stamp_of(prefix: bytes) -> float:
    """Seconds since 1970 from what a logger wrote before a sentence; NaN where it wrote none.

    Example:
        >>> from seatruth.readers.nmea_clock import stamp_of
        >>> stamp_of(b"2025-07-31T12:00:00.5Z "), stamp_of(b"1753963200.5;"), stamp_of(b"")
        (1753963200.5, 1753963200.5, nan)
    """
    if not prefix.strip():
        return float("nan")
    if found := _ISO.search(prefix):
        text = f"{found[1].decode()}T{found[2].decode().replace(',', '.')}{(found[3] or b'+00:00').decode()}"
        return datetime.datetime.fromisoformat(text).timestamp()
    if found := _TAG.search(prefix) or _EPOCH.search(prefix):
        value = float(found[1])
        return value / 1000 if value > _MILLISECONDS else value
    return float("nan")


def seconds_of_day(text: str) -> float:
    """Seconds since midnight from hhmmss.ss; ValueError for anything else."""
    if not re.fullmatch(r"\d{6}(\.\d*)?", text):
        raise ValueError(text)
    hours, minutes, seconds = int(text[:2]), int(text[2:4]), float(text[4:])
    if hours > 23 or minutes > 59 or seconds >= 61:
        raise ValueError(text)
    return hours * 3600 + minutes * 60 + seconds


def day_of(text: str) -> float:
    """Seconds from 1970 to the beginning of the day ddmmyy; years from 80 on are of the last century."""
    if not re.fullmatch(r"\d{6}", text):
        raise ValueError(text)
    year = int(text[4:])
    date = datetime.datetime(year + (1900 if year >= 80 else 2000), int(text[2:4]), int(text[:2]), tzinfo=datetime.UTC)
    return date.timestamp()


def unwrapped(times: Array) -> Array:
    """Times of day (n,) s that go on after midnight."""
    return times + _DAY * np.concatenate([[0], np.cumsum(np.diff(times) < -_HALF_DAY)])


def spread(lines: NDArray[np.int64], fix_lines: NDArray[np.int64], fix_times: Array) -> Array:
    """Times of sentences without any from the fixes around them, s; NaN before the first fix.

    Args:
        lines: line (n,) of each sentence, increasing.
        fix_lines: line (m,) of each fix, increasing.
        fix_times: time (m,) of each fix, s.

    Returns:
        The time of the fix before, where one sentence follows it; several are spread evenly up to the next fix.
    """
    new = np.concatenate([[True], np.diff(fix_times) > 0])  # several sentences tell the time of one fix
    begins, times = fix_lines[new], fix_times[new]
    interval = np.searchsorted(begins, lines) - 1
    step = np.append(np.diff(times), np.median(np.diff(times)) if times.size > 1 else 0.0)
    count = np.bincount(interval[interval >= 0], minlength=times.size)
    first = np.searchsorted(interval, interval)
    order = np.arange(lines.size) - first
    result = times[interval] + order * step[interval] / np.maximum(count[interval], 1)
    return np.where(interval < 0, np.nan, result)
