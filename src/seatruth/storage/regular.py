"""Reading files that somebody else may have named: only plain files, and never more than they said to hold.

A device, a pipe or a file of the kernel (/proc) has no size, may never end, or waits for somebody; a file that is too
large is refused before it is read.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from seatruth.errors import BadInput

_PLAIN_READ = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
"""O_NONBLOCK: opening a pipe does not wait for its other end."""


def read_regular(path: str | Path, most: int | None = None) -> bytes:
    """All bytes of a plain file.

    Args:
        path: The file.
        most: Largest size in bytes that makes sense for it; None for no limit but the machine's memory.

    Raises:
        BadInput: It is a folder, a device, a pipe, too large, or its name is no valid text.
        OSError: It is missing or cannot be read.

    Example:
        >>> try:
        ...     read_regular("/dev/null")
        ... except BadInput as problem:
        ...     print(problem)
        /dev/null: it is no plain file. It is a device or a pipe: name a file.
    """
    with _opened(path) as (stream, size):
        if most is not None and size > most:
            raise BadInput(
                f"it has {size} bytes, too many for a file of this kind (at most {most})",
                where=os.fspath(path),
                do="Check the path.",
            )
        try:
            return stream.read(size)
        except MemoryError:
            raise BadInput(
                f"it has {size} bytes, more than this machine has memory for",
                where=os.fspath(path),
                do="Cut it into shorter files.",
            ) from None


def read_start(path: str | Path, most: int) -> bytes:
    """The first bytes of a plain file, `most` of them or fewer; raises what `read_regular` does."""
    with _opened(path) as (stream, size):
        return stream.read(min(most, size))


@contextmanager
def _opened(path: str | Path) -> Iterator[tuple[BinaryIO, int]]:
    """A plain file and the bytes it says to hold. A file of the kernel says 0, and may block or never end."""
    name = os.fspath(path)
    check_name(name)
    handle = os.open(name, _PLAIN_READ)
    with os.fdopen(handle, "rb") as stream:
        status = os.fstat(handle)
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), name)
        if not stat.S_ISREG(status.st_mode):
            raise BadInput("it is no plain file", where=name, do="It is a device or a pipe: name a file.")
        yield stream, status.st_size


def check_name(path: str | Path) -> None:
    """Raises BadInput for the path of a file that no text can hold: a null character, or bytes that are not UTF-8."""
    text = os.fspath(path)
    if "\0" in text:
        raise BadInput("the name of the file holds a null character", where=text, do="Name the file.")
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise BadInput("the name of the file is not UTF-8 text", where=text, do="Rename it.") from None
