"""Locks: one holder at a time, on Linux and, as far as that can be tried here, on Windows."""

from __future__ import annotations

import errno
import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

from seatruth.errors import BadInput
from seatruth.storage import lock


def test_a_lock_has_one_holder_and_ends_with_its_file(tmp_path: Path) -> None:
    with open(tmp_path / "a", "a") as first, open(tmp_path / "a", "a") as second:
        assert lock.lock_file(first)
        assert not lock.lock_file(second)
        first.close()
        assert lock.lock_file(second)


def test_a_file_system_without_locks_is_written_to_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(stream: object) -> None:
        raise OSError(errno.ENOLCK, "no locks")

    monkeypatch.setattr(lock, "_lock", refuse)
    with open(tmp_path / "a", "a") as stream:
        assert lock.lock_file(stream)


class Windows:
    """msvcrt.locking as it is documented: it locks bytes from the file's position on, or raises EACCES."""

    LK_NBLCK = 2

    def __init__(self) -> None:
        self.held: dict[tuple[int, int], int] = {}

    def locking(self, handle: int, mode: int, count: int) -> None:
        place = (os.fstat(handle).st_ino, os.lseek(handle, 0, os.SEEK_CUR))
        assert (mode, count) == (self.LK_NBLCK, 1)
        if self.held.get(place, handle) != handle and is_open(self.held[place], place[0]):
            raise PermissionError(errno.EACCES, "Permission denied")
        self.held[place] = handle


def is_open(handle: int, number: int) -> bool:
    """Whether this handle is one of the file of this number."""
    try:
        return os.fstat(handle).st_ino == number
    except OSError:
        return False


def windows_lock(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module as Windows loads it: without fcntl, with msvcrt."""
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", Windows())  # stands in for a module
    monkeypatch.setattr(sys, "platform", "win32")
    specification = importlib.util.spec_from_file_location("lock_on_windows", lock.__file__)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_windows_locks_behind_the_end_of_the_file_and_leaves_the_position(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = windows_lock(monkeypatch)
    (tmp_path / "a").write_bytes(b"0123456789")
    with open(tmp_path / "a", "r+b", buffering=0) as first, open(tmp_path / "a", "r+b", buffering=0) as second:
        first.seek(4)
        assert module.lock_file(first)
        assert first.read(2) == b"45"
        assert not module.lock_file(second)
    assert (tmp_path / "a").stat().st_size == 10


def test_windows_locks_a_file_in_the_folder_and_leaves_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = windows_lock(monkeypatch)
    for _ in range(2):
        with module.locked_folder(tmp_path):
            for _ in range(2):  # a run that was refused takes nothing away
                with pytest.raises(BadInput, match="another run is writing"), module.locked_folder(str(tmp_path)):
                    pass
            assert [path.name for path in tmp_path.iterdir()] == [module._LOCK_FILE]
        assert list(tmp_path.iterdir()) == []
    (tmp_path / module._LOCK_FILE).touch()  # a killed run leaves it, unlocked
    with module.locked_folder(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_windows_leaves_the_file_to_a_run_that_has_opened_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Path, missing_ok: bool = False) -> None:
        raise PermissionError(errno.EACCES, "The process cannot access the file")

    module = windows_lock(monkeypatch)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", refuse)
        with module.locked_folder(tmp_path):
            pass
    assert [path.name for path in tmp_path.iterdir()] == [module._LOCK_FILE]
