"""Atomic writes: a reader finds the old file or the new one, and an error says what to do."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from seatruth.errors import BadInput
from seatruth.storage import atomic
from seatruth.storage.atomic import CannotWrite, DiskFull, cannot_write, write_file, write_files


def failing(monkeypatch: pytest.MonkeyPatch, name: str, number: int, call: int = 1) -> None:
    """Makes the n-th call of a function of `os` fail with this error number."""
    plain, calls = getattr(os, name), [0]

    def fails(*arguments: object) -> object:
        calls[0] += 1
        if calls[0] == call:
            raise OSError(number, os.strerror(number))
        return plain(*arguments)

    monkeypatch.setattr(os, name, fails)


def test_text_and_bytes_replace_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "new" / "folder" / "note.txt"
    write_file(target, "first\r\nline\n")
    assert target.read_bytes() == b"first\r\nline\n"
    write_file(target, b"\x00\xff")
    assert target.read_bytes() == b"\x00\xff"
    assert [path.name for path in target.parent.iterdir()] == ["note.txt"]


@pytest.mark.skipif(os.name == "nt", reason="rights of files are POSIX")
def test_rights_follow_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_file(tmp_path / "shared", "")
        write_file(tmp_path / "private", "", mode=0o600)
    finally:
        os.umask(before)
    assert (tmp_path / "shared").stat().st_mode & 0o777 == 0o640
    assert (tmp_path / "private").stat().st_mode & 0o777 == 0o600


def test_the_longest_name_can_be_written(tmp_path: Path) -> None:
    write_file(tmp_path / ("n" * 255), "")
    assert [len(path.name) for path in tmp_path.iterdir()] == [255]


@pytest.mark.parametrize("step", ["fsync", "replace"])
@pytest.mark.parametrize(
    ("number", "kind", "code"),
    [(errno.ENOSPC, DiskFull, 1), (errno.EROFS, CannotWrite, 2), (errno.EIO, CannotWrite, 2)],
)
def test_a_failure_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str, number: int, kind: type[CannotWrite], code: int
) -> None:
    target = tmp_path / "kept"
    target.write_text("before")
    failing(monkeypatch, step, number)
    with pytest.raises(kind) as problem:
        write_file(target, "after")
    assert isinstance(problem.value, BadInput)
    assert problem.value.exit_code == code
    assert problem.value.where == str(target)
    assert problem.value.do
    assert target.read_text() == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


def test_what_a_killed_process_left_is_removed(tmp_path: Path) -> None:
    """Not what a living one is writing, nor what a process of another machine may still write."""
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    name = ".0123456789abcdef-{}-{}.part"
    abandoned = name.format(atomic._HOST, ended.pid)
    kept = {name.format(atomic._HOST, os.getpid()), name.format("00000000", ended.pid), "mine.part"}
    for file in (abandoned, *kept):
        (tmp_path / file).write_text("")
    write_files(tmp_path, {"a": "1"})
    assert {path.name for path in tmp_path.iterdir()} == {*kept, "a"}


def test_several_files_change_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "result"
    write_files(folder, {"a": b"1", "b": "1"})
    with monkeypatch.context() as patch:
        failing(patch, "fsync", errno.ENOSPC, call=2)
        with pytest.raises(DiskFull, match="no space left") as problem:
            write_files(folder, {"a": b"2", "b": "2"})
    assert problem.value.where == str(folder / "b")
    assert {path.name: path.read_text() for path in folder.iterdir()} == {"a": "1", "b": "1"}
    write_files(folder, {"a": b"2", "b": "2"})
    assert {path.name: path.read_text() for path in folder.iterdir()} == {"a": "2", "b": "2"}


def test_places_that_are_no_files(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    with pytest.raises(CannotWrite, match="a folder stands where the file should be"):
        write_file(tmp_path / "folder", "")
    for wrong in (tmp_path / "file" / "below", tmp_path / "file" / "below" / "more"):
        with pytest.raises(CannotWrite, match="a file stands where a folder should be"):
            write_file(wrong, "")
    with pytest.raises(CannotWrite):
        write_files(tmp_path / "file", {"a": ""})
    assert (tmp_path / "file").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_device_is_written_to_and_not_replaced() -> None:
    with pytest.raises(DiskFull):
        write_file("/dev/full", "text")
    write_file(os.devnull, "text")
    assert not Path("/dev/full").is_file()


@pytest.mark.parametrize(
    ("number", "words"),
    [(errno.ENOSPC, "no space"), (errno.EDQUOT, "no space"), (errno.EROFS, "read-only"), (errno.EACCES, "no right")],
)
def test_the_reason_is_said_in_words(number: int, words: str) -> None:
    message = cannot_write(OSError(number, os.strerror(number)), "result/report.html").message
    assert message.startswith("result/report.html: ")
    assert words in message
