"""Reads a file of columns: the format is recognised by its content."""

from __future__ import annotations

from pathlib import Path

from seatruth.errors import BadInput, nearest
from seatruth.storage.regular import read_regular
from seatruth.trials import binary_files, csv_file
from seatruth.trials.tables import Table


def read_table(
    path: str | Path,
    *,
    table: str | None = None,
    separator: str | None = None,
    decimal: str | None = None,
    encoding: str | None = None,
) -> Table:
    """Reads a CSV, Parquet or MATLAB file (recognised by its content). BadInput for anything that is not one.

    `table` names the variable of a MATLAB file that holds the columns; `separator`, `decimal` and `encoding` settle
    what is otherwise guessed from a text file.
    """
    file = Path(path)
    data = _bytes_of(file)
    if not data.strip():
        raise BadInput("the file is empty", where=str(file), do="Check how it was exported.")
    kind = _kind(data, file.suffix.lower())
    if kind in ("parquet", "mat"):
        return binary_files.parquet(file, data) if kind == "parquet" else binary_files.matlab(file, data, table)
    if kind != "text":
        raise BadInput(f"it looks like {kind}", where=str(file), do="Export it as CSV, Parquet or MATLAB (-v7).")
    return csv_file.read(file, data, separator=separator, decimal=decimal, encoding=encoding)


def _bytes_of(file: Path) -> bytes:
    try:
        return read_regular(file)
    except FileNotFoundError:
        raise _not_found(file) from None
    except IsADirectoryError:
        raise BadInput("it is a folder", where=str(file), do="Name one file in it.") from None
    except PermissionError:
        raise BadInput("no permission to read it", where=str(file), do="Change its permissions.") from None
    except OSError as problem:
        raise BadInput(f"it cannot be read ({problem.strerror})", where=str(file), do="Check the path.") from None


def _not_found(file: Path) -> BadInput:
    try:
        neighbours = [entry.name for entry in file.parent.iterdir()][:500] if file.parent.is_dir() else []
    except OSError:
        neighbours = []
    hint = nearest(file.name, neighbours).split(" Known:")[0] if neighbours else ""
    hint = "" if hint.startswith("Known:") else hint
    folder = "" if file.parent.is_dir() else f"The folder {str(file.parent)!r} does not exist."
    return BadInput("no such file", where=str(file), do=hint or folder or "Check the path.")


_MAGIC = (
    (b"PAR1", "parquet"),
    (b"MATLAB 5.0 MAT-file", "mat"),
    (b"MATLAB 7.3 MAT-file", "mat"),
    (b"\x89HDF", "mat"),
    (b"PK\x03\x04", "a spreadsheet or a zip archive"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"%PDF", "a PDF document"),
    (b"#ROSBAG", "a ROS bag"),
    (b"SQLite format 3", "a database"),
)


def _kind(data: bytes, suffix: str) -> str:
    for magic, kind in _MAGIC:
        if data.startswith(magic):
            return kind
    if suffix in (".parquet", ".pq"):
        return "no Parquet file, though its name says so"
    if suffix == ".mat" and b"\0" in data[:4096]:
        return "mat"
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    if not wide and b"\0" in data:
        return "a binary file"
    return "text"
