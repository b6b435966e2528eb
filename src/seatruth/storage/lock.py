"""Locks on files, so that two processes do not write to one file."""

from __future__ import annotations

import errno
import os
import sys
from typing import IO, Any

if sys.platform == "win32":  # each system has one of the two modules
    import msvcrt

    _BEYOND = 1 << 40
    """Where the lock stands: far behind the file's end, since Windows lets nobody read or write locked bytes."""

    def _lock(stream: IO[Any]) -> None:
        handle, here = stream.fileno(), os.lseek(stream.fileno(), 0, os.SEEK_CUR)
        os.lseek(handle, _BEYOND, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(handle, here, os.SEEK_SET)

else:
    import fcntl

    def _lock(stream: IO[Any]) -> None:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)


_HELD = (errno.EACCES, errno.EAGAIN, errno.EWOULDBLOCK, errno.EDEADLK)
"""Error numbers by which systems say that another holds the lock."""


def lock_file(stream: IO[Any]) -> bool:
    """Locks an open file for this process. The lock ends when the file is closed, however the process ends.

    Returns:
        False where another process (or another open file of this process) holds the lock. True otherwise, also on
        file systems that have no locks.
    """
    try:
        _lock(stream)
    except OSError as problem:
        return problem.errno not in _HELD
    return True
