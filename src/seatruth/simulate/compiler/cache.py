"""Compiled kernels on disk.

A kernel is machine code that is run as it stands, so only files of this user in a folder of this user, to which nobody
else may write, are taken. A file also carries the checksum of its own content: a torn or damaged one is compiled again.
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
"""Environment variable: folder of the compiled kernels, or "off"."""
_MOST_FILES = 400
"""Kernels that are kept, those used last. A model takes about five files of 20 to 100 kB. Chosen here [S]."""
_LARGEST = 64 * 2**20
"""Bytes; a kernel has some 100 kB, so a larger file is none."""
_FORMAT = b"seatruth kernel 1\n"
_WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_PLAIN_READ = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Not through a link, and without waiting for the other end of a pipe."""
_refused: set[Path] = set()


def folder() -> Path | None:
    """The folder of compiled kernels; None where there is none that can be trusted.

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
            f"{chosen}: compiled kernels are not kept, because {trouble}. Models are compiled anew in each run. "
            f"`chmod 700` a folder of your own and name it in {CACHE}.",
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
        return _others(os.stat(place), "the folder")
    except OSError:
        return ""  # it cannot be made or read, so nothing will be found there or written


def _others(status: os.stat_result, what: str) -> str:
    """What lets somebody else change this file or folder; "" where nothing does. Windows has no such rights."""
    if os.name != "posix":
        return ""
    if status.st_uid != os.geteuid():
        return f"{what} belongs to another user"
    return f"others may write to {what}" if status.st_mode & _WRITABLE_BY_OTHERS else ""


def read(path: Path) -> bytes | None:
    """The machine code in a file; None where there is no file of this user's alone, or its checksum does not hold."""
    try:
        handle = os.open(path, _PLAIN_READ)
        with os.fdopen(handle, "rb") as stream:
            status = os.fstat(handle)
            if not stat.S_ISREG(status.st_mode) or status.st_size > _LARGEST or _others(status, "the file"):
                return None
            data = stream.read()
    except OSError:
        return None
    head, code = data[: len(_FORMAT) + 32], data[len(_FORMAT) + 32 :]
    if head != _FORMAT + hashlib.sha256(code).digest():
        return None
    with suppress(OSError):
        os.utime(path)
    return code


def write(path: Path, code: bytes) -> None:
    """Writes a file at once or not at all, then removes the kernels that were not used for longest.

    Raises CannotWrite where the disk is full or the folder is read-only.
    """
    # Not durable: a file that a power failure tears is noticed by its checksum and compiled again.
    write_file(path, _FORMAT + hashlib.sha256(code).digest() + code, mode=0o600, durable=False)
    _trim(path.parent)


def _trim(place: Path) -> None:
    """Keeps the `_MOST_FILES` kernels that were used last."""
    ages = []
    for path in place.glob("*.kernel"):
        with suppress(OSError):
            ages.append((path.stat().st_mtime, path))
    for _, path in sorted(ages)[: max(0, len(ages) - _MOST_FILES)]:
        with suppress(OSError):
            path.unlink()
