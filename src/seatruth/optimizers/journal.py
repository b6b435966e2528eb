"""The checkpoint: a journal of every population evaluation, from which any solver can be replayed.

The file opens with one JSON line that says which study, optimizer and seed it belongs to. Each record after it holds a
hash of the candidates, the elapsed seconds and their values. A resumed run starts the solver again from the same
seed and takes the values from the journal. The solver then makes the same decisions and goes on as if it had never
stopped; its state need not be stored. Each record is appended by one write and carries a checksum: whatever ends the
process, only the last record can be damaged, and a damaged record is dropped.
"""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import hashlib
import json
import os
import struct
import time
import zlib
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.base import Cost
from seatruth.errors import BadInput
from seatruth.storage.checkpoint import StaleCheckpoint
from seatruth.storage.lock import lock_file
from seatruth.storage.parsing import parsed

FORMAT = "seatruth checkpoint 1"
_RECORD_HEAD = struct.Struct("<4sI16sd")
_RECORD_CHECKSUM = struct.Struct("<I")
_RECORD_MARK = b"strR"
_SYNC_S = 2.0
"""s of work that a power failure may cost at most; writing to the disk more often slows fast costs. Chosen here [S]."""


@dataclass(frozen=True)
class Record:
    """The values of some candidates, evaluated in one call; `key` is the hash of the candidates."""

    key: bytes
    seconds: float
    values: Array


class Journal:
    """The checkpoint file of one run.

    `replay` holds the records that an earlier run left; `write_error` says why writing failed, "" while it has not.
    """

    def __init__(self, path: Path, identity: Mapping[str, Any]) -> None:
        self.path = path
        self.write_error = ""
        self.replay: deque[Record] = deque()
        self._synced = time.monotonic()
        header = json.dumps({"format": FORMAT, **identity}, sort_keys=True).encode() + b"\n"
        if path.exists() and not path.is_file():
            # A device or a pipe may be endless to read; a folder cannot be opened at all.
            raise BadInput("the checkpoint must be a file", where=str(path), do="Name another one.")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open(path, "a+b", buffering=0)  # noqa: SIM115 - closed by close()
        except OSError as problem:
            raise BadInput(
                f"the checkpoint cannot be opened ({problem.strerror})", where=str(path), do="Choose another file."
            ) from problem
        try:
            self._lock()
            self._open(header, identity)
        except OSError as problem:
            self.close()
            raise BadInput(
                f"the checkpoint cannot be written ({problem.strerror})",
                where=str(path),
                do="Free some space or choose another file.",
            ) from problem
        except BaseException:
            self.close()
            raise

    def replay_next(self, Z: Array) -> Record | None:
        """The record of the first of these candidates, or None if the earlier run did not come so far."""
        if not self.replay:
            return None
        record = self.replay.popleft()
        n = len(record.values)
        if n > len(Z) or hash_of(Z[:n]) != record.key:
            raise StaleCheckpoint(
                "the checkpoint does not fit: the optimizer proposes other candidates than in the earlier run",
                where=str(self.path),
                do="The data, the versions of the libraries or the budget of a hybrid have changed, or the optimizer "
                "is not repeatable. Delete the file or name another.",
            )
        return record

    def append(self, Z: Array, values: Array, seconds: float) -> None:
        """Writes the values of these candidates. A full disk ends the checkpoint, not the run: see `write_error`."""
        if self.write_error:
            return
        body = _RECORD_HEAD.pack(_RECORD_MARK, len(values), hash_of(Z), seconds) + values.tobytes()
        body += _RECORD_CHECKSUM.pack(zlib.crc32(body))
        try:
            if self._file.write(body) != len(body):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            now = time.monotonic()
            if now - self._synced > _SYNC_S:
                os.fsync(self._file.fileno())
                self._synced = now
        except OSError as problem:
            self.write_error = (
                f"The checkpoint {self.path} could not be continued ({problem.strerror}); the run went on without it. "
                "Free some space before the next one."
            )

    def close(self) -> None:
        """Writes what is left to the disk and closes the file."""
        with contextlib.suppress(OSError):
            os.fsync(self._file.fileno())
        self._file.close()

    def _lock(self) -> None:
        if not lock_file(self._file):
            raise BadInput(
                "another run is using this checkpoint", where=str(self.path), do="Wait for it or name another file."
            )

    def _open(self, header: bytes, identity: Mapping[str, Any]) -> None:
        self._file.seek(0)
        content = self._file.read()
        end = content.find(b"\n") + 1
        if not end and header.startswith(content):
            # New, or killed within the very first write.
            self._file.truncate(0)
            if self._file.write(header) != len(header):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return
        self._check_header(content[:end], identity)
        good = end
        while (record := _record_at(content, good)) is not None:
            self.replay.append(record)
            good += _RECORD_HEAD.size + 8 * len(record.values) + _RECORD_CHECKSUM.size
        self._file.truncate(good)

    def _check_header(self, line: bytes, identity: Mapping[str, Any]) -> None:
        try:
            header = parsed(line)
        except ValueError:
            header = None
        if not isinstance(header, dict) or header.get("format") != FORMAT:
            raise StaleCheckpoint(
                "this file is not a seatruth checkpoint; it is left as it was",
                where=str(self.path),
                do="Name another file.",
            )
        names = {"study": "study (data, model, parameters or cost)", "optimizer": "optimizer", "seed": "seed"}
        wrong = [names.get(key, key) for key in identity if header.get(key) != identity[key]]
        if wrong:
            raise StaleCheckpoint(
                f"this checkpoint belongs to another run: its {' and its '.join(wrong)} differ"
                f"{'s' if len(wrong) == 1 else ''}",
                where=str(self.path),
                do="Delete it to start afresh, or name another file.",
            )


def identity_of(cost: Cost, optimizer: Mapping[str, Any], seed: int, start: Array | None = None) -> dict[str, Any]:
    """What a checkpoint belongs to: hashes of the cost with its parameters, of the optimizer and of a start of its own,
    and the seed."""
    parameters = [dataclasses.asdict(p) for p in cost.parameters]
    study: dict[str, Any] = {
        "kind": type(cost).__qualname__,
        "description": dict(cost.description),
        "parameters": parameters,
    }
    if start is not None:
        study["start"] = [float(value) for value in start]
    return {"study": _digest(study), "optimizer": _digest(optimizer), "seed": int(seed)}


def hash_of(Z: Array) -> bytes:
    """Hash of candidates."""
    return hashlib.blake2b(np.ascontiguousarray(Z).tobytes(), digest_size=16).digest()


def _record_at(content: bytes, at: int) -> Record | None:
    """The record at this place, or None where the journal ends or is damaged."""
    if len(content) < at + _RECORD_HEAD.size:
        return None
    mark, rows, key, seconds = _RECORD_HEAD.unpack_from(content, at)
    end = at + _RECORD_HEAD.size + 8 * rows
    if mark != _RECORD_MARK or len(content) < end + _RECORD_CHECKSUM.size:
        return None
    if _RECORD_CHECKSUM.unpack_from(content, end)[0] != zlib.crc32(content[at:end]):
        return None
    return Record(
        key, seconds, np.frombuffer(content, dtype="<f8", count=rows, offset=at + _RECORD_HEAD.size).astype(float)
    )


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(_canonical(content), sort_keys=True).encode()).hexdigest()


def _canonical(content: Any) -> Any:
    """Content as JSON whose text depends on the content alone."""
    if isinstance(content, Mapping):
        return {str(key): _canonical(value) for key, value in content.items()}
    if isinstance(content, np.ndarray):
        data = np.ascontiguousarray(content)
        return [str(data.dtype), list(data.shape), hashlib.sha256(data.tobytes()).hexdigest()]
    if isinstance(content, np.generic):
        return _canonical(content.item())
    if isinstance(content, list | tuple):
        return [_canonical(value) for value in content]
    if isinstance(content, set | frozenset):
        return sorted(json.dumps(_canonical(value), sort_keys=True) for value in content)
    if content is None or isinstance(content, str | int | bool):
        return content
    if isinstance(content, float):
        return content.hex()
    if dataclasses.is_dataclass(content) and not isinstance(content, type):
        return [type(content).__qualname__, _canonical(dataclasses.asdict(content))]
    if isinstance(content, Path):
        return str(content)
    raise BadInput(
        f"a {type(content).__name__} in the description of a cost or an optimizer has no fixed form",
        do="Describe it by numbers, texts, lists, mappings or arrays.",
    )
