"""Locks on files, so that two processes do not write to one file."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
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
    """Keeps a folder to this run. Nothing is left in it. Windows has no such lock, so nothing is noticed there.

    Raises:
        BadInput: Another run is writing into this folder.
        OSError: The folder cannot be read.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder, locked_folder(folder):
        ...     pass
    """
    if sys.platform == "win32":
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        if not _locked(handle):
            raise BadInput(
                "another run is writing into this folder",
                where=str(folder),
                do="Wait for it, or name another folder with --out.",
            )
        yield
    finally:
        os.close(handle)


def _locked(handle: int) -> bool:
    try:
        _lock(handle)
    except OSError as problem:
        return problem.errno not in _HELD
    return True
