"""Runs of a simulator on disk: what was simulated once is not simulated again, in this run or a later one."""

from __future__ import annotations

import struct
from contextlib import suppress
from pathlib import Path

import numpy as np

from seatruth.arrays import Array
from seatruth.storage.atomic import CannotWrite
from seatruth.storage.cache_folder import folder, read_kept, write_kept

MOST_BYTES = 2 * 2**30
"""Bytes of runs that are kept, those used last. A run of 2000 samples and six outputs takes 0.1 MB. Chosen here [S]."""
_LARGEST = 2**30
"""Bytes; a run has at most some megabytes, so a larger file is none."""
_HEAD = b"seatruth run 1\n"
_TRIM_EVERY = 500
"""Runs written between two looks at the size of all: a look takes milliseconds. Chosen here [S]."""


class KeptRuns:
    """The outputs (n, D) of runs by a key that says all that decides them.

    Args:
        place: the folder; None takes `runs` in the cache folder, and keeps nothing where there is none.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> import numpy as np
        >>> from seatruth.storage.kept_runs import KeptRuns
        >>> with tempfile.TemporaryDirectory() as place:
        ...     kept = KeptRuns(Path(place))
        ...     kept.put("ab12", np.ones((2, 3)))
        ...     kept.get("ab12").shape, kept.get("cd34")
        ((2, 3), None)
    """

    def __init__(self, place: Path | None = None) -> None:
        chosen = folder() if place is None else place
        self._place = chosen / "runs" if chosen is not None and place is None else chosen
        self._written = 0

    def get(self, key: str) -> Array | None:
        """A kept run, or None."""
        if self._place is None:
            return None
        data = read_kept(self._path(key), _HEAD, _LARGEST)
        if data is None or len(data) < 16:
            return None
        rows, columns = struct.unpack("<QQ", data[:16])
        if len(data) != 16 + 8 * rows * columns:
            return None
        return np.frombuffer(data, dtype="<f8", offset=16).reshape(rows, columns).astype(np.float64)

    def put(self, key: str, outputs: Array) -> None:
        """Keeps a run. A full or read-only disk keeps nothing: that costs time, not the result."""
        if self._place is None:
            return
        content = struct.pack("<QQ", *outputs.shape) + np.ascontiguousarray(outputs, dtype="<f8").tobytes()
        with suppress(CannotWrite):
            write_kept(self._path(key), _HEAD, content)
        if self._written % _TRIM_EVERY == 0:
            self._trim()
        self._written += 1

    def _path(self, key: str) -> Path:
        assert self._place is not None
        return self._place / key[:2] / f"{key}.run"

    def _trim(self) -> None:
        """Removes the runs that were not used for longest."""
        assert self._place is not None
        found, total = [], 0
        for path in self._place.glob("*/*.run"):
            with suppress(OSError):
                status = path.stat()
                found.append((status.st_mtime, status.st_size, path))
                total += status.st_size
        for _, size, path in sorted(found):
            if total <= MOST_BYTES:
                break
            with suppress(OSError):
                path.unlink()
                total -= size
