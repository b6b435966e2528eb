"""Locks on files, so that two processes do not write to one file."""

from __future__ import annotations

from typing import IO, Any

try:
    import fcntl
except ImportError:  # Windows has no fcntl: there, two processes on one file are not noticed
    fcntl = None  # type: ignore[assignment]


def lock_file(stream: IO[Any]) -> bool:
    """Locks an open file for this process. The lock ends when the file is closed, however the process ends.

    Returns:
        False where another process (or another open file of this process) holds the lock. True otherwise, also on
        systems and file systems that have no locks.
    """
    if fcntl is None:
        return True
    try:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True
