"""The folder in which seatruth keeps what it can make again: compiled kernels, and the runs of simulators.

Kernels are machine code that is run as it stands, and a changed run would change a result: so only a folder of this
user is taken, to which nobody else may write.
"""

from __future__ import annotations

import hashlib
import os
import stat
import warnings
from contextlib import suppress
from pathlib import Path

from seatruth.errors import SeatruthWarning
from seatruth.storage.atomic import write_file

CACHE = "SEATRUTH_CACHE"
"""Environment variable: the folder, or "off"."""
_WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_PLAIN_READ = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Not through a link, and without waiting for the other end of a pipe."""
_refused: set[Path] = set()


def folder() -> Path | None:
    """The folder; None where there is none that can be trusted.

    That is so where the user turned the cache off or has no home folder, and where the folder belongs to someone else
    or others may write to it.

    Warns:
        SeatruthWarning: once, that the folder is not used because of its owner or its rights.
    """
    chosen = _chosen()
    if chosen is None:
        return None
    trouble = _trouble(chosen)
    if trouble and chosen not in _refused:
        _refused.add(chosen)
        warnings.warn(
            f"{chosen}: compiled kernels and runs of simulators are not kept, because {trouble}. They are made "
            f"anew. `chmod 700` a folder of your own and name it in {CACHE}.",
            SeatruthWarning,
            stacklevel=2,
        )
    return None if trouble else chosen


def _chosen() -> Path | None:
    chosen = os.environ.get(CACHE)
    if chosen is not None:
        return None if chosen.strip().lower() in ("", "off", "0") else Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or (os.environ.get("LOCALAPPDATA") if os.name == "nt" else None)
    try:
        return (Path(base) if base else Path.home() / ".cache") / "seatruth"
    except RuntimeError:
        return None


def _trouble(place: Path) -> str:
    """Why code in this folder must not be run; "" where it may be. A missing one is made for its owner only."""
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):
            place.mkdir(mode=0o700)
        return writable_by_others(os.stat(place), "the folder")
    except OSError:
        return ""  # it cannot be made or read, so nothing will be found there or written


def writable_by_others(status: os.stat_result, what: str) -> str:
    """What lets somebody else change this file or folder; "" where nothing does. Windows has no such rights."""
    if os.name != "posix":
        return ""
    if status.st_uid != os.geteuid():
        return f"{what} belongs to another user"
    return f"others may write to {what}" if status.st_mode & _WRITABLE_BY_OTHERS else ""


def read_kept(path: Path, head: bytes, largest: int) -> bytes | None:
    """The content of a kept file; None where there is no file of this user's alone, or its checksum does not hold.

    Args:
        path: the file.
        head: how a file of this kind begins; the checksum follows.
        largest: bytes beyond which it is no file of this kind.
    """
    try:
        handle = os.open(path, _PLAIN_READ)
        with os.fdopen(handle, "rb") as stream:
            status = os.fstat(handle)
            if not stat.S_ISREG(status.st_mode) or status.st_size > largest or writable_by_others(status, "the file"):
                return None
            data = stream.read()
    except OSError:
        return None
    start, content = data[: len(head) + 32], data[len(head) + 32 :]
    if start != head + hashlib.sha256(content).digest():
        return None
    with suppress(OSError):
        os.utime(path)
    return content


def write_kept(path: Path, head: bytes, content: bytes) -> None:
    """Writes a file that `read_kept` reads, at once or not at all.

    Raises CannotWrite where the disk is full or the folder is read-only.
    """
    # Not durable: a file that a power failure tears is noticed by its checksum and made anew.
    write_file(path, head + hashlib.sha256(content).digest() + content, mode=0o600, durable=False)
