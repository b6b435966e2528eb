"""The one place that writes whole files: a file is replaced completely, or it stays as it was.

The content goes to a temporary file in the same folder, is flushed to the disk (fsync), and takes the target's name in
one step (os.replace). Whatever ends the process or fills the disk, a reader finds the old file or the new one.

Example:
    >>> import tempfile
    >>> from pathlib import Path
    >>> from seatruth.storage.atomic import write_file
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_file(Path(folder) / "note.txt", "steady")
    ...     (Path(folder) / "note.txt").read_text()
    'steady'
"""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import re
import secrets
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from seatruth.errors import BadInput

_HOST = hashlib.sha256(platform.node().encode("utf-8", "replace")).hexdigest()[:8]
"""This machine: a folder may be shared with others, whose processes have the same numbers."""
_TEMPORARY = re.compile(r"\.[0-9a-f]{16}-(?P<host>[0-9a-f]{8})-(?P<process>\d{1,9})\.part")
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Error numbers of a full disk, a used-up quota and a file-size limit."""


class CannotWrite(BadInput):
    """A file cannot be written: a read-only place, missing rights, a folder in its place (exit code 2)."""


class DiskFull(CannotWrite):
    """A file cannot be written because no space is left. The input is not at fault (exit code 1)."""

    exit_code = 1


def write_file(path: str | Path, content: bytes | str, *, mode: int = 0o666, durable: bool = True) -> None:
    """Writes one file completely, or leaves what was there.

    Args:
        path: The file. Missing folders are made. A device or a pipe is written to directly.
        content: Bytes, or text that is written as UTF-8 with its line ends as they are.
        mode: Access rights of a new file; the process's umask is taken off.
        durable: Whether to wait until the content is on the disk. Leave it out only for files that carry a checksum
            and are quickly made again, such as a cache.

    Raises:
        DiskFull: No space is left.
        CannotWrite: The file cannot be written for another reason.
    """
    target = Path(path)
    data = _bytes(content)
    try:
        if target.exists() and not target.is_file() and not target.is_dir():
            target.write_bytes(data)
            return
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary = _write_beside(target, data, mode, durable)
        _replace(temporary, target)
    except OSError as problem:
        raise cannot_write(problem, target) from None
    if durable:
        _sync_folder(target.parent)


def write_files(folder: str | Path, files: Mapping[str, bytes | str]) -> None:
    """Writes several files into a folder: all contents are on the disk before the first file is replaced.

    The files are replaced in the mapping's order. Put the file that names or hashes the others last: a reader then
    notices a process that was killed between two replacements.

    Args:
        folder: Made if it is missing.
        files: Contents by file name.

    Raises:
        DiskFull: No space is left; no file has changed.
        CannotWrite: A file cannot be written for another reason.
    """
    place = Path(folder)
    written: dict[Path, Path] = {}
    target = place
    try:
        place.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            target = place / name
            written[target] = _write_beside(target, _bytes(content), 0o666, durable=True)
        for target, temporary in written.items():
            os.replace(temporary, target)
    except OSError as problem:
        raise cannot_write(problem, target) from None
    finally:
        for temporary in written.values():
            with suppress(OSError):
                temporary.unlink(missing_ok=True)  # those that were replaced are gone already
    _sync_folder(place)


def cannot_write(problem: OSError, path: str | Path) -> CannotWrite:
    """The error that tells a user why a file cannot be written, and what to do."""
    where = str(path)
    if problem.errno in FULL:
        return DiskFull("no space left on the disk", where=where, do="Free some space and run it again.")
    if problem.errno == errno.EROFS:
        return CannotWrite("the disk is read-only", where=where, do="Choose another folder.")
    if problem.errno in (errno.EACCES, errno.EPERM):
        return CannotWrite("there is no right to write here", where=where, do="Check the rights or choose another.")
    if problem.errno == errno.EISDIR:
        return CannotWrite("a folder stands where the file should be", where=where, do="Choose another name.")
    if problem.errno in (errno.EEXIST, errno.ENOTDIR):
        return CannotWrite("a file stands where a folder should be", where=where, do="Choose another folder.")
    return CannotWrite(f"the file cannot be written ({problem.strerror or problem})", where=where, do="Check the path.")


def _bytes(content: bytes | str) -> bytes:
    # Half characters, which names of files may hold, are written as their codes.
    return content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content


def _write_beside(target: Path, data: bytes, mode: int, durable: bool) -> Path:
    """A new temporary file with this content, in the folder of the target."""
    _remove_abandoned(target.parent)
    # The name does not contain the target's, which may already be as long as the file system allows. It says which
    # process writes, so that what a killed one leaves is known.
    temporary = target.with_name(f".{secrets.token_hex(8)}-{_HOST}-{os.getpid()}.part")
    handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            if durable:
                os.fsync(stream.fileno())
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return temporary


def _remove_abandoned(folder: Path) -> None:
    """Removes temporary files that killed processes of this machine left in a folder."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            found = _TEMPORARY.fullmatch(entry.name)
            if found and found["host"] == _HOST and not _runs(int(found["process"])):
                with suppress(OSError):
                    os.unlink(entry.path)


def _runs(process: int) -> bool:
    """Whether a process with this number runs; True where the system does not say."""
    if os.name != "posix":
        return True  # there, signal 0 would end it
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _replace(temporary: Path, target: Path) -> None:
    try:
        os.replace(temporary, target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _sync_folder(folder: Path) -> None:
    """Puts the new name on the disk too, where the system can (Windows cannot open a folder)."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
