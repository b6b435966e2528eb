"""Files are read only if they are plain files of a sensible size."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from seatruth.errors import BadInput
from seatruth.storage.regular import read_regular, read_start


def test_a_plain_file_is_read_whole(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"1,2\r\n")
    (tmp_path / "link").symlink_to("a")
    assert read_regular(tmp_path / "a") == read_regular(str(tmp_path / "link")) == b"1,2\r\n"
    assert read_regular(tmp_path / "a", most=5) == b"1,2\r\n"
    assert (read_start(tmp_path / "a", 2), read_start(tmp_path / "a", 9)) == (b"1,", b"1,2\r\n")
    with pytest.raises(BadInput, match=r"5 bytes, too many .*at most 4"):
        read_regular(tmp_path / "a", most=4)


@pytest.mark.skipif(os.name != "posix", reason="devices and pipes are POSIX")
def test_what_may_never_end_is_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    for path in (tmp_path / "pipe", tmp_path / "zero"):
        with pytest.raises(BadInput, match="no plain file"):
            read_regular(path)
        with pytest.raises(BadInput, match="no plain file"):
            read_start(path, 1)
    with pytest.raises(IsADirectoryError):
        read_regular(tmp_path)
    with pytest.raises(FileNotFoundError):
        read_regular(tmp_path / "none")
    if Path(
        "/proc/self/status"
    ).exists():  # a plain file, says the kernel, of 0 bytes; others there wait without an end
        assert read_regular("/proc/self/status") == read_start("/proc/self/status", 9) == b""


def test_names_that_no_text_can_hold(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="null character"):
        read_regular(f"{tmp_path}/a\0b")
    with pytest.raises(BadInput, match="not UTF-8"):
        read_regular(os.fsdecode(os.fsencode(tmp_path) + b"/\xff.csv"))
