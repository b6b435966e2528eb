"""Compiled kernels on disk.

A kernel is machine code that is run as it stands, so only files of this user in a folder of this user, to which nobody
else may write, are taken. A file also carries the checksum of its own content: a torn or damaged one is compiled again.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from seatruth.storage.cache_folder import CACHE, folder, read_kept, write_kept

__all__ = ["CACHE", "folder", "read", "write"]

_MOST_FILES = 400
"""Kernels that are kept, those used last. A model takes about five files of 20 to 100 kB. Chosen here [S]."""
_LARGEST = 64 * 2**20
"""Bytes; a kernel has some 100 kB, so a larger file is none."""
_FORMAT = b"seatruth kernel 1\n"


def read(path: Path) -> bytes | None:
    """The machine code in a file; None where there is no file of this user's alone, or its checksum does not hold."""
    return read_kept(path, _FORMAT, _LARGEST)


def write(path: Path, code: bytes) -> None:
    """Writes a file at once or not at all, then removes the kernels that were not used for longest.

    Raises CannotWrite where the disk is full or the folder is read-only.
    """
    write_kept(path, _FORMAT, code)
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
