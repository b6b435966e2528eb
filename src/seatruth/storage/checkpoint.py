"""A resumable store of finished jobs: an interrupted run reads what it has done, and does the rest.

The file is text, one record a line. The first line is `seatruth jobs VERSION HASH`, with the hash of the work that the
jobs belong to. Each later line is a checksum and a JSON object {"name": ..., "value": ...}. A record whose checksum
does not fit (a changed digit, a bit error) is dropped with a warning and its job is done again; a last line that a kill
has torn is dropped without one.
"""

from __future__ import annotations

import errno
import hashlib
import io
import os
import threading
import warnings
from pathlib import Path
from types import TracebackType
from typing import Any

from seatruth.errors import BadInput, SeatruthError, SeatruthWarning
from seatruth.storage.atomic import cannot_write
from seatruth.storage.checksum import checksum
from seatruth.storage.lock import lock_file
from seatruth.storage.values import from_text, to_text

FORMAT_VERSION = 1
_MAGIC = "seatruth jobs "


class StaleCheckpoint(SeatruthError):
    """A checkpoint belongs to another run than the one that should continue it (exit code 2)."""

    exit_code = 2


class Checkpoint:
    """Finished jobs by name. Values are what `storage.values` stores: JSON values and NumPy arrays, without loss.

    The file is made with the first job. It is locked while the checkpoint is open. A disk that is full or read-only
    ends the checkpoint, not the run: jobs are then kept in memory only, and `write_error` says why. Threads may
    share it.

    Args:
        path: The file; None keeps the jobs in memory only.
        work: What the jobs belong to: any text that changes when their results may change (hashes of the data, the
            settings, the seed). Only its hash is stored.
        drop_other_work: Whether a file of other work is overwritten. Otherwise it is refused.

    Raises:
        StaleCheckpoint: The file belongs to other work, another version of seatruth wrote it, or it is no checkpoint.
            It is left as it was.
        BadInput: Another run is using the file, or it is a folder or a device.

    Warns:
        SeatruthWarning: Records are damaged.

    Example:
        >>> with Checkpoint(None, "study 1") as checkpoint:
        ...     if "fold 1" not in checkpoint:
        ...         checkpoint.put("fold 1", {"rmse": 0.1})
        ...     checkpoint.get("fold 1")
        {'rmse': 0.1}
    """

    def __init__(self, path: str | Path | None, work: str, *, drop_other_work: bool = False) -> None:
        self.path = None if path is None else Path(path)
        self.write_error = ""
        """Why jobs are no longer written to the file; empty while they are."""
        self._work = hashlib.sha256(work.encode("utf-8")).hexdigest()
        self._header = f"{_MAGIC}{FORMAT_VERSION} {self._work}\n".encode()
        self._jobs: dict[str, Any] = {}
        self._file: io.FileIO | None = None
        self._mutex = threading.Lock()
        self._closed = False
        if self.path is not None and os.path.lexists(self.path):
            self._open_existing(self.path, drop_other_work)

    def __enter__(self) -> Checkpoint:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def __contains__(self, name: str) -> bool:
        return name in self._jobs

    def __len__(self) -> int:
        return len(self._jobs)

    def get(self, name: str, default: Any = None) -> Any:
        """The value of a finished job, or `default`."""
        return self._jobs.get(name, default)

    def put(self, name: str, value: Any) -> None:
        """Keeps a finished job; a later value of the same name replaces the earlier.

        Raises TypeError for a value that cannot be stored without loss.
        """
        text = to_text({"name": name, "value": value})
        with self._mutex:
            # Read back from the text: a run that is resumed and one that is not then see the same value.
            self._jobs[name] = from_text(text)["value"]
            if self.path is not None and not self.write_error and not self._closed:
                self._append(self.path, self._record(text))

    def close(self) -> None:
        """Releases the file. Jobs can still be read; later ones are kept in memory only."""
        if self._file is not None:
            self._file.close()
            self._file = None
        self._closed = True

    def _record(self, text: str) -> bytes:
        return f"{checksum(text, self._work)} {text}\n".encode()

    def _append(self, path: Path, record: bytes) -> None:
        try:
            if self._file is None:
                path.parent.mkdir(parents=True, exist_ok=True)
                if os.path.lexists(path):
                    self._stop(f"{path}: another run has made this file meanwhile.")
                    return
                self._file = open(path, "x+b", buffering=0)  # noqa: SIM115 - closed by close()
                lock_file(self._file)
                record = self._header + record
            self._write(record)
        except OSError as problem:
            self._stop(cannot_write(problem, path).message)

    def _write(self, data: bytes) -> None:
        assert self._file is not None
        written = self._file.write(data)
        if written != len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        os.fsync(self._file.fileno())

    def _stop(self, reason: str) -> None:
        self.write_error = f"The checkpoint could not be continued; the run went on without it. {reason}"

    def _open_existing(self, path: Path, drop_other_work: bool) -> None:
        if not path.is_file():
            # A device or a pipe may be endless to read; a folder cannot be opened at all.
            raise BadInput("the checkpoint must be a file", where=str(path), do="Name another one.")
        try:
            self._file = open(path, "r+b", buffering=0)  # noqa: SIM115 - closed by close()
        except OSError as problem:
            self._stop(cannot_write(problem, path).message)
            return
        try:
            if not lock_file(self._file):
                raise BadInput(
                    "another run is using this checkpoint", where=str(path), do="Wait for it or name another file."
                )
            self._read(path, self._file, drop_other_work)
        except OSError as problem:
            self._file.close()
            self._file = None
            self._stop(cannot_write(problem, path).message)
        except BaseException:
            self._file.close()
            self._file = None
            raise

    def _read(self, path: Path, file: io.FileIO, drop_other_work: bool) -> None:
        content = file.readall()
        head, newline, body = content.partition(b"\n")
        if not newline and self._header.startswith(content):  # empty, or killed within the first line
            self._start_afresh(file)
            return
        if head + newline != self._header:
            self._check_header(path, head, drop_other_work)
            self._start_afresh(file)
            return
        lines = body.split(b"\n")
        torn = lines.pop()  # empty after a whole last line
        kept, damaged = [], 0
        for line in lines:
            if self._take(line):
                kept.append(line + b"\n")
            else:
                damaged += 1
        if damaged or torn:
            self._start_afresh(file, b"".join(kept))
        if damaged:
            warnings.warn(
                f"{path}: {damaged} record{'s are' if damaged > 1 else ' is'} damaged. What they held is computed "
                "again. Check the disk.",
                SeatruthWarning,
                stacklevel=5,
            )

    def _check_header(self, path: Path, head: bytes, drop_other_work: bool) -> None:
        """Refuses what is not ours to overwrite."""
        words = head.decode("ascii", errors="replace").removeprefix(_MAGIC).split(" ")
        if not head.startswith(_MAGIC.encode()) or len(words) != 2 or not words[0].isdigit():
            raise StaleCheckpoint(
                "this file is not a seatruth checkpoint of jobs; it is left as it was",
                where=str(path),
                do="Name another file.",
            )
        if words[0] != str(FORMAT_VERSION):
            raise StaleCheckpoint(
                f"another version of seatruth wrote this checkpoint (format {words[0]}; this one has {FORMAT_VERSION})",
                where=str(path),
                do="Use that version, delete the file, or name another.",
            )
        if not drop_other_work:
            raise StaleCheckpoint(
                "this checkpoint belongs to other work (other data, settings or seed)",
                where=str(path),
                do="Delete it to start afresh, or name another file.",
            )

    def _take(self, line: bytes) -> bool:
        """Reads one record; False where it is damaged."""
        digits, _, data = line.partition(b" ")
        if digits.decode("ascii", errors="replace") != checksum(data, self._work):
            return False
        try:
            record = from_text(data.decode("utf-8"))
            self._jobs[str(record["name"])] = record["value"]
        except (ValueError, KeyError, TypeError):
            return False
        return True

    def _start_afresh(self, file: io.FileIO, records: bytes = b"") -> None:
        file.seek(0)
        file.truncate()
        self._write(self._header + records)


def jobs_file(checkpoint: str | Path) -> Path:
    """The file of the jobs that follow a search, beside the search's own checkpoint."""
    return Path(f"{checkpoint}.jobs")


def starts_file(checkpoint: str | Path) -> Path:
    """The file of a multi-start's further searches, beside the first search's own checkpoint."""
    return Path(f"{checkpoint}.starts")
