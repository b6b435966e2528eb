"""Compiled kernels on disk.

A file carries the checksum of its own content: a torn or damaged one is compiled again.
"""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from pathlib import Path

from seatruth.storage.atomic import write_file

CACHE = "SEATRUTH_CACHE"
"""Environment variable: folder of the compiled kernels, or "off"."""
_MOST_FILES = 400
"""Kernels that are kept, those used last. A model takes about five files of 20 to 100 kB. Chosen here [S]."""
_FORMAT = b"seatruth kernel 1\n"


def folder() -> Path | None:
    """The folder of compiled kernels; None where the user turned the cache off, or has no home folder."""
    chosen = os.environ.get(CACHE)
    if chosen is not None:
        return None if chosen.strip().lower() in ("", "off", "0") else Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or (os.environ.get("LOCALAPPDATA") if os.name == "nt" else None)
    try:
        return (Path(base) if base else Path.home() / ".cache") / "seatruth"
    except RuntimeError:
        return None


def read(path: Path) -> bytes | None:
    """The machine code in a file; None where there is no file, or its checksum does not hold."""
    try:
        data = path.read_bytes()
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
