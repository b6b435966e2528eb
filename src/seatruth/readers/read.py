"""Reads any file that an installed reader recognises: the one place that runs readers and checks what they give."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from seatruth.errors import BadInput, PluginError, nearest
from seatruth.progress import Progress, ProgressEvent, remaining, silent
from seatruth.readers import registry
from seatruth.readers.base import Content, Reader, Topic
from seatruth.readers.isolation import read_isolated
from seatruth.readers.log import Log
from seatruth.readers.tables import Table
from seatruth.storage.regular import check_name, read_start

_HEAD = 65536
_MOST_COLUMNS = 10_000
"""Columns of one topic; more come from a wrong separator or a damaged file (chosen here [S])."""


def read_log(path: str | Path, *, reader: str | None = None, progress: Progress = silent, **options: Any) -> Log:
    """Reads a file or log of any installed format, which is recognised by its content.

    Args:
        path: the file; a folder for a ROS 2 bag.
        reader: name of a reader of `seatruth list readers`; None recognises it.
        progress: is told how far the reading has come.
        options: options of readers, as `separator=";"`; those that the file's reader does not have are ignored, so
            that one set serves files of several formats. None stands for an option that is not given.

    Returns:
        The tables of the file.

    Raises:
        BadInput: nothing recognises the file, it is damaged, or an option does not exist; the message says what to do.

    Example:
        >>> from pathlib import Path
        >>> from seatruth.readers import read_log
        >>> written = Path("run.csv").write_text("t [s],u [kn]\\n0,1\\n1,2\\n")
        >>> table, column = read_log("run.csv").find("u")
        >>> table.numbers(column).tolist(), table.units["u"]
        ([1.0, 2.0], 'kn')
    """
    file = Path(path)
    head = _head(file)
    kind, where_found = registry.chosen(reader) if reader is not None else _recognised(head, file)
    registry.require(kind, str(file))
    given = _own_options(kind, {name: value for name, value in options.items() if value is not None})
    report = _Report(f"Reading {file.name}", progress)
    if kind.isolated:
        content = read_isolated(where_found, given, file, report)
    else:
        content = _read_here(kind(**given), file, report)
    return _log(kind, file, content)


def _read_here(reader: Reader, file: Path, report: _Report) -> Content:
    try:
        return reader.read(file, report)
    except (BadInput, KeyboardInterrupt):
        raise
    except MemoryError:
        raise BadInput("the machine has too little memory to read it", where=str(file), do="Split it.") from None
    except OSError as problem:
        raise BadInput(f"it cannot be read ({problem.strerror or problem})", where=str(file), do="Check it.") from None
    except Exception as problem:
        text = (str(problem).strip() or type(problem).__name__).splitlines()[0][:200]
        raise BadInput(f"it is damaged ({text})", where=str(file), do="Copy or export it again.") from None


class _Report:
    """Hands a reader's progress on, as an event."""

    def __init__(self, stage: str, progress: Progress) -> None:
        self._stage, self._progress, self._began = stage, progress, time.monotonic()

    def __call__(self, part: float) -> None:
        elapsed = time.monotonic() - self._began
        done = min(100, max(0, round(100 * part)))
        left = remaining(done, 100, elapsed)
        self._progress(ProgressEvent(self._stage, done, 100, "percent", elapsed_s=elapsed, remaining_s=left))


def _recognised(head: bytes, file: Path) -> tuple[type[Reader], str]:
    """The reader of a file. Binary formats are asked before text, which takes what is left."""
    broken: list[str] = []
    found: list[tuple[type[Reader], str]] = []
    for name, points in sorted(registry.points_by_name().items(), key=lambda item: (item[0] == "csv", item[0])):
        try:
            kind = registry.load(name, points)
        except PluginError as problem:
            broken.append(problem.message)
            continue
        if kind.recognises(head, file):
            found.append((kind, points[0].value))
    if not found:
        if not head:
            raise BadInput("it is a folder, and no ROS 2 bag", where=str(file), do="Name one file in it.")
        what = next((what for magic, what in _FOREIGN if head.startswith(magic)), None)
        what = what or ("a binary file that no installed reader knows" if b"\0" in head else None)
        what = f"it looks like {what}" if what else "no installed reader knows this format"
        known = ", ".join(info.title for info in registry.available().values() if not info.error)
        more = f" A reader could not be loaded: {broken[0]}" if broken else ""
        raise BadInput(what, where=str(file), do=f"Export it as one of: {known}.{more}")
    return found[0]


_FOREIGN = (
    (b"\x1f\x8b", "a gzip archive"),
    (b"BZh", "a bzip2 archive"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive"),
    (b"PK\x03\x04", "a zip archive"),
    (b"%PDF", "a PDF document"),
    (b"\x7fELF", "a program"),
    (b"\x89PNG", "a picture"),
    (b"\xff\xd8\xff", "a picture"),
)


def _own_options(kind: type[Reader], options: dict[str, Any]) -> dict[str, Any]:
    own = registry.option_names(kind)
    known = {name for info in registry.available().values() for name in info.options}
    for name in options:
        if name not in known and name not in own:
            raise BadInput(f"no installed reader has an option {name!r}", where="[files]", do=nearest(name, known))
    return {name: value for name, value in options.items() if name in own}


def _head(file: Path) -> bytes:
    """The first bytes of a file, or b"" for a folder; BadInput for what is neither."""
    check_name(file)
    try:
        if file.is_dir():
            if any(file.iterdir()):
                return b""
            raise BadInput("it is an empty folder", where=str(file), do="Name a file.")
        head = read_start(file, _HEAD)
    except FileNotFoundError:
        raise _not_found(file) from None
    except PermissionError:
        raise BadInput("no permission to read it", where=str(file), do="Change its permissions.") from None
    except OSError as problem:
        raise BadInput(f"it cannot be read ({problem})", where=str(file), do="Check the path.") from None
    if not head.strip() and len(head) < _HEAD:
        raise BadInput("the file is empty", where=str(file), do="Check how it was exported.")
    return head


def _not_found(file: Path) -> BadInput:
    try:
        neighbours = [entry.name for entry in file.parent.iterdir()][:500] if file.parent.is_dir() else []
    except OSError:
        neighbours = []
    hint = nearest(file.name, neighbours).split(" Known:")[0] if neighbours else ""
    hint = "" if hint.startswith("Known:") else hint
    folder = "" if file.parent.is_dir() else f"The folder {str(file.parent)!r} does not exist."
    return BadInput("no such file", where=str(file), do=hint or folder or "Check the path.")


def _log(kind: type[Reader], file: Path, content: Content) -> Log:
    tables: dict[str, Table] = {}
    for topic in content.topics:
        table = _table(kind, str(file), topic)
        if not len(table):
            continue
        if topic.name in tables:
            raise PluginError(f"it gave two topics {topic.name!r}", where=f"reader {kind.name!r}")
        tables[topic.name] = table
    if not tables:
        raise BadInput("it holds no samples", where=str(file), do="Check how it was recorded.")
    return Log(str(file), tables, tuple(content.notes), kind.name, content.start)


def _table(kind: type[Reader], source: str, topic: Topic) -> Table:
    where = f"reader {kind.name!r}, topic {topic.name!r}"
    sizes = {values.shape for values in topic.columns.values()}
    if len(sizes) > 1 or any(len(size) != 1 for size in sizes):
        raise PluginError(f"its columns have the shapes {sorted(sizes)}", where=where, do="Give columns of one length.")
    if topic.time is not None and topic.time not in topic.columns:
        raise PluginError(f"its clock {topic.time!r} is no column of it", where=where)
    if len(topic.columns) > _MOST_COLUMNS:
        named = f"{source}, {topic.name}" if topic.name else source
        raise BadInput(f"it has {len(topic.columns)} columns", where=named, do="Check how it was exported.")
    columns = {name: _series(values, topic.units.get(name)) for name, values in topic.columns.items()}
    units = {name: unit for name, unit in topic.units.items() if unit != UTC}
    lines = None if topic.lines is None else np.asarray(topic.lines, dtype=np.int64)
    return Table(source, columns, units, lines, topic.decimal, topic.name, topic.time)


UTC = "UTC"
"""In the place of a unit: the dates of this column are in UTC; other dates have no zone."""


def _series(values: Any, unit: str | None) -> pd.Series[Any]:
    if values.dtype.kind == "S":
        values = values.astype(object)  # pandas has no column of bytes
    series: pd.Series[Any] = pd.Series(values, copy=False)
    if unit == UTC and values.dtype.kind == "M":
        series = series.dt.tz_localize(UTC)
    return series
