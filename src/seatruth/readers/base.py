"""What a reader is: a class that recognises a format and turns a file into topics of plain NumPy columns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from numpy.typing import NDArray

Column = NDArray[Any]
"""Values (n,) of one field: numbers, bools, dates (datetime64, UTC), time spans (timedelta64), texts (str)
or bytes, which are text if they are UTF-8."""

Progress = Callable[[float], None]
"""Called with the part of the file that is read, from 0 to 1."""


def no_progress(part: float) -> None:
    """Shows nothing."""


@dataclass(frozen=True)
class Topic:
    """Fields that a log holds together, sample by sample: a ROS topic, an NMEA sentence, a sheet, a struct.

    Args:
        name: the format's own name for it; "" where a file is one table.
        columns: field name -> values (n,), all of one length.
        units: units that the file states, by field.
        time: the field that is the topic's clock, where the format says so; None leaves it to the study. It holds
            integers or numbers in the unit of `units` (s where there is none), or dates.
        lines: line (n,) of a text file of each sample; None where a file has no lines.
        decimal: decimal mark of numbers that are still text.

    Example:
        >>> import numpy as np
        >>> from seatruth.readers import Topic
        >>> gps = Topic("GPS", {"TimeUS": np.array([0, 200_000])}, units={"TimeUS": "us"}, time="TimeUS")
    """

    name: str
    columns: Mapping[str, Column]
    units: Mapping[str, str] = field(default_factory=dict)
    time: str | None = None
    lines: Column | None = None
    decimal: str = "."


@dataclass(frozen=True)
class Content:
    """All that a reader found in a file.

    Args:
        topics: the topics that hold samples.
        notes: what the reader had to assume or leave out, as sentences for the user.
        start: what the clocks' zero is in UTC as (clock value in s, ISO date), where the file says so although its
            clocks count from elsewhere.
    """

    topics: Sequence[Topic]
    notes: Sequence[str] = ()
    start: tuple[float, str] | None = None


class Reader(ABC):
    """Reads one format. A subclass is a frozen dataclass whose fields are the reader's options.

    A reader may raise anything for a damaged file: whoever calls it (`read_log`) turns that into a clear message,
    bounds memory and processor time, and checks what comes back. Say `BadInput` where you can name the place.

    Attributes:
        name: name in study files.
        title: the format in a few words.
        suffixes: endings of such files, in lower case with the point.
        modules: modules beyond seatruth's own that it imports; where one is missing, the user is told `extra`.
        extra: what to install for them, as "seatruth[ros]".
        isolated: read in a process of its own. Leave it True where code that is not Python's sees the file.

    Example:
        >>> import numpy as np
        >>> from dataclasses import dataclass
        >>> from seatruth.readers import Content, Reader, Topic
        >>> @dataclass(frozen=True)
        ... class Pairs(Reader):
        ...     name = "pairs"
        ...     title = "one 'time value' pair a line, after a line that says PAIRS"
        ...     @classmethod
        ...     def recognises(cls, head, path):
        ...         return head.startswith(b"PAIRS")
        ...     def read(self, path, progress):
        ...         t, u = np.loadtxt(path, skiprows=1, unpack=True)
        ...         return Content([Topic("", {"t": t, "u": u}, time="t")])
    """

    name: ClassVar[str]
    title: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]] = ()
    modules: ClassVar[tuple[str, ...]] = ()
    extra: ClassVar[str] = ""
    isolated: ClassVar[bool] = True

    @classmethod
    @abstractmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        """Whether the first bytes of a file (up to 64 KiB; b"" for a folder) are of this format. Imports nothing."""

    @abstractmethod
    def read(self, path: Path, progress: Progress) -> Content:
        """Reads the file."""
