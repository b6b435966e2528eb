"""Locks on files, so that two processes do not write to one file."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from seatruth.errors import BadInput

if sys.platform == "win32":  # each system has one of the two modules
    import msvcrt

    _BEYOND = 1 << 40
    """Where the lock stands: far behind the file's end, since Windows lets nobody read or write locked bytes."""

    def _lock(handle: int) -> None:
        here = os.lseek(handle, 0, os.SEEK_CUR)
        os.lseek(handle, _BEYOND, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(handle, here, os.SEEK_SET)

else:
    import fcntl

    def _lock(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


_LOCK_FILE = ".seatruth.lock"
"""What is locked instead of its folder on Windows, which opens no folders."""
_HELD = (errno.EACCES, errno.EAGAIN, errno.EWOULDBLOCK, errno.EDEADLK)
"""Error numbers by which systems say that another holds the lock."""


def lock_file(stream: IO[Any]) -> bool:
    """Locks an open file for this process. The lock ends when the file is closed, however the process ends.

    Returns:
        False where another process (or another open file of this process) holds the lock. True otherwise, also on
        file systems that have no locks.
    """
    return _locked(stream.fileno())


@contextmanager
def locked_folder(folder: str | Path) -> Iterator[None]:
    """Keeps a folder to this run. Nothing is left in it; on Windows a file stands in it meanwhile.

    Raises:
        BadInput: Another run is writing into this folder.
        OSError: The folder cannot be read, or on Windows not be written to.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder, locked_folder(folder):
        ...     pass
    """
    file: Path | None = Path(folder) / _LOCK_FILE if sys.platform == "win32" else None
    handle = os.open(folder, os.O_RDONLY) if file is None else os.open(file, os.O_RDWR | os.O_CREAT)
    held = False
    try:
        held = _locked(handle)
        if not held:
            raise BadInput(
                "another run is writing into this folder",
                where=str(folder),
                do="Wait for it, or name another folder with --out.",
            )
        yield
    finally:
        os.close(handle)
        if held and file is not None:
            with suppress(OSError):  # Windows removes no file that another run has opened: that one removes it
                file.unlink(missing_ok=True)


def _locked(handle: int) -> bool:
    try:
        _lock(handle)
    except OSError as problem:
        return problem.errno not in _HELD
    return True
