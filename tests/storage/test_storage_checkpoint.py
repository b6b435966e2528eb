"""The checkpoint of finished jobs: resume, damage, files of others, full disks, two runs at once."""

from __future__ import annotations

import errno
import math
import os
import re
import threading
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth.errors import BadInput, SeatruthWarning
from seatruth.storage.checkpoint import Checkpoint, StaleCheckpoint, jobs_file

VALUES: dict[str, Any] = {"a": 1.5, "b": {"x": math.inf, "y": 0.1}, "c": [1, None, "text"]}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file with three finished jobs."""
    place = tmp_path / "below" / "run.jobs"
    with Checkpoint(place, "work 1") as checkpoint:
        for name, value in VALUES.items():
            checkpoint.put(name, value)
    return place


def jobs(path: Path, work: str = "work 1") -> dict[str, Any]:
    with Checkpoint(path, work) as checkpoint:
        return {name: checkpoint.get(name) for name in "abc" if name in checkpoint}


def test_finished_jobs_are_read_again(path: Path) -> None:
    assert jobs(path) == VALUES
    with Checkpoint(path, "work 1") as checkpoint:
        assert len(checkpoint) == 3
        assert checkpoint.get("d") is None
        assert checkpoint.get("d", 7) == 7
        checkpoint.put("a", 2.5)
        checkpoint.put("d", np.arange(3.0))
    with Checkpoint(path, "work 1") as checkpoint:
        assert checkpoint.get("a") == 2.5  # the later value
        np.testing.assert_array_equal(checkpoint.get("d"), [0.0, 1.0, 2.0])


def test_a_resumed_run_and_one_in_memory_see_the_same_values() -> None:
    checkpoint = Checkpoint(None, "work")
    checkpoint.put("a", (np.float64(0.1), 2))
    assert checkpoint.get("a") == [0.1, 2]
    checkpoint.close()
    checkpoint.put("b", 1)
    assert checkpoint.get("b") == 1


def test_no_job_no_file(tmp_path: Path) -> None:
    with Checkpoint(tmp_path / "run.jobs", "work"):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("cut", range(1, 400, 7))
def test_a_file_torn_by_a_kill_is_continued(path: Path, cut: int) -> None:
    whole = path.read_bytes()
    path.write_bytes(whole[: max(0, len(whole) - cut)])
    with Checkpoint(path, "work 1") as checkpoint:
        for name, value in VALUES.items():
            assert name not in checkpoint or checkpoint.get(name) == value
            if name not in checkpoint:
                checkpoint.put(name, value)
    assert jobs(path) == VALUES
    assert path.read_bytes() == whole


def test_a_changed_digit_is_noticed_and_its_job_done_again(path: Path) -> None:
    path.write_text(path.read_text().replace('"value": 1.5', '"value": 1.6'))
    with pytest.warns(SeatruthWarning, match="1 record is damaged"):
        checkpoint = Checkpoint(path, "work 1")
    with checkpoint:
        assert "a" not in checkpoint
        assert checkpoint.get("b") == VALUES["b"]
        checkpoint.put("a", 1.5)
    assert jobs(path) == VALUES  # without a second warning


def test_no_flipped_bit_gives_a_wrong_value(path: Path) -> None:
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for place in range(len(whole)):
        content = bytearray(whole)
        content[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeatruthWarning)
            try:
                found = jobs(path)
            except (StaleCheckpoint, BadInput):
                assert path.read_bytes() == content  # left as it was
                continue
        assert found.items() <= VALUES.items(), place


def test_a_record_of_other_work_does_not_fit(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.jobs"
    with Checkpoint(other, "work 2") as checkpoint:
        checkpoint.put("a", 99.0)
    spliced = path.read_text() + other.read_text().splitlines(keepends=True)[1]
    path.write_text(spliced)
    with pytest.warns(SeatruthWarning, match="damaged"):
        assert jobs(path) == VALUES


def test_other_work_is_refused_or_dropped(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(StaleCheckpoint, match="other work"):
        Checkpoint(path, "work 2")
    assert path.read_bytes() == before
    with Checkpoint(path, "work 2", drop_other_work=True) as checkpoint:
        assert len(checkpoint) == 0
        checkpoint.put("a", 2)
    assert jobs(path, "work 2") == {"a": 2}


@pytest.mark.parametrize(
    "content", [b"t,u,v\n0,1,2\n", b"\x00" * 300, b"\xff\xfe\n", b"seatruth jobs\n", b"seatruth jobs one two\n", b"{}"]
)
def test_foreign_files_are_left_alone(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "log.csv"
    file.write_bytes(content)
    with pytest.raises(StaleCheckpoint, match="not a seatruth checkpoint"):
        Checkpoint(file, "work", drop_other_work=True)
    assert file.read_bytes() == content


def test_another_format_version_is_refused(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"seatruth jobs 1 ", b"seatruth jobs 2 ", 1))
    with pytest.raises(StaleCheckpoint, match="format 2"):
        Checkpoint(path, "work 1", drop_other_work=True)


def test_two_runs_do_not_share_a_file(path: Path) -> None:
    with Checkpoint(path, "work 1"), pytest.raises(BadInput, match="another run"):
        Checkpoint(path, "work 1")
    first, second = (Checkpoint(path.with_name("new.jobs"), "work") for _ in range(2))
    first.put("a", 1)
    second.put("a", 2)
    assert not first.write_error
    assert "another run" in second.write_error
    assert second.get("a") == 2
    first.close()
    assert jobs(path.with_name("new.jobs"), "work") == {"a": 1}


def test_a_full_disk_costs_the_checkpoint_and_not_the_run(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with Checkpoint(path, "work 1") as checkpoint:
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            checkpoint.put("d", 1)
        checkpoint.put("e", 2)
        assert "no space left" in checkpoint.write_error
        assert (checkpoint.get("d"), checkpoint.get("e")) == (1, 2)
    assert jobs(path) == VALUES


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    for wrong in (tmp_path, Path(os.devnull)):
        with pytest.raises(BadInput, match="must be a file"):
            Checkpoint(wrong, "work")
    (tmp_path / "file").write_text("")
    checkpoint = Checkpoint(tmp_path / "file" / "run.jobs", "work")
    checkpoint.put("a", 1)
    assert checkpoint.get("a") == 1
    assert "a file stands where a folder should be" in checkpoint.write_error


def test_threads_may_share_it(tmp_path: Path) -> None:
    place = tmp_path / "run.jobs"

    def work(checkpoint: Checkpoint, number: int) -> None:
        for n in range(20):
            checkpoint.put(f"{number} {n}", [number, n])

    with Checkpoint(place, "work") as checkpoint:
        threads = [threading.Thread(target=work, args=(checkpoint, number)) for number in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    with Checkpoint(place, "work") as checkpoint:
        assert len(checkpoint) == 80
        assert checkpoint.get("3 19") == [3, 19]


def test_the_file_is_text_that_states_version_and_work(path: Path) -> None:
    first, second, *_ = path.read_text().splitlines()
    assert re.fullmatch(r"seatruth jobs 1 [0-9a-f]{64}", first)
    assert re.fullmatch(r'[0-9a-f]{32} \{"name": "a", "value": 1\.5\}', second)
    assert jobs_file("result/checkpoint.journal") == Path("result/checkpoint.journal.jobs")
