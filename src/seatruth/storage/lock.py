"""Locks on files and folders, so that two processes do not write to one. They end with the process, however it ends."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from seatruth.errors import BadInput

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
    return _locked(stream.fileno())


@contextmanager
def locked_folder(folder: str | Path) -> Iterator[None]:
    """Keeps a folder to this run. Nothing is left in it.

    Raises:
        BadInput: Another run is writing into this folder.
        OSError: The folder cannot be read.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder, locked_folder(folder):
        ...     pass
    """
    if fcntl is None:
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
    if fcntl is None:
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True
