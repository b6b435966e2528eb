"""A library that crashes, hangs or eats all memory takes nothing with it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.processes import search_path, started
from seatruth.readers import Content, child, isolation
from seatruth.readers.base import Progress, no_progress


def read(folder: Path, does: str, progress: Progress = no_progress) -> Content:
    file = folder / "log"
    file.write_bytes(b"x")
    return isolation.read_isolated("wicked_reader:Wicked", {"does": does}, file, progress)


@pytest.mark.parametrize("does", ["crash", "eat", "panic", "strange"])
def test_whatever_happens_is_a_message(tmp_path: Path, does: str) -> None:
    with pytest.raises(BadInput, match=r"damaged|memory") as caught:
        read(tmp_path, does)
    assert "log" in str(caught.value)
    assert caught.value.do


def test_a_hang_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolation, "SECONDS", 1.0)
    with pytest.raises(BadInput, match="too much processor time"):
        read(tmp_path, "hang")


def test_a_refusal_keeps_its_words(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"line 7: it is wrong. Mend it."):
        read(tmp_path, "refuse")


def test_all_kinds_of_columns_come_back(tmp_path: Path) -> None:
    parts: list[float] = []
    content = read(tmp_path, "", parts.append)
    first, second = content.topics
    assert parts == [0.5]
    assert (first.name, first.time, dict(first.units)) == ("a", "t", {"t": "s"})
    assert [values.tolist() for values in first.columns.values()][:2] == [[1, 2], ["a", "é"]]
    assert np.isnat(first.columns["day"]).tolist() == [False, True]
    assert first.columns["flag"].dtype == bool
    assert first.lines is not None
    assert first.lines.tolist() == [3, 4]
    assert second.columns["none"].size == 0
    assert (list(content.notes), content.start) == (["A note."], (1.0, "2025-07-31"))


def test_modules_of_the_working_directory_are_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "json.py").write_text("raise SystemExit('run!')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")
    assert read(tmp_path, "").topics


def told(folder: Path, does: str) -> tuple[list[dict[str, Any]], bytes, int]:
    """The lines that the script of the process writes, the bytes after them, and the code with which it ends."""
    file = folder / "log"
    file.write_bytes(b"x")
    order = {"reader": "wicked_reader:Wicked", "options": {"does": does}, "path": str(file)}
    bounds = {"memory": isolation.MEMORY_BYTES, "seconds": 30, "modules": search_path()}
    with started(child.__file__) as process:
        answer, _ = process.communicate(json.dumps({**order, **bounds}).encode(), timeout=60.0)
    lines = []
    while answer.startswith(b"{"):
        line, _, answer = answer.partition(b"\n")
        lines.append(json.loads(line))
    return lines, answer, process.returncode


def test_the_process_says_how_far_it_is_and_what_it_read_and_ends(tmp_path: Path) -> None:
    (part, head), numbers, code = told(tmp_path, "")
    assert part == {"part": 0.5}
    columns = {name: (kind, count) for topic in head["topics"] for name, kind, count in topic["columns"]}
    assert columns == {
        "t": ("<i4", 2),
        "note": ("<U1", 2),
        "day": ("<M8[us]", 2),
        "flag": ("|b1", 2),
        "none": ("<f8", 0),
    }
    assert head["topics"][0]["lines"] == ["<i8", 2]
    # Nothing but the columns and the numbers of lines: what the library printed is not among them.
    assert len(numbers) == 2 * (4 + 4 + 8 + 1) + 2 * 8
    assert np.frombuffer(numbers[:8], "<i4").tolist() == [1, 2]
    assert code == 0


@pytest.mark.parametrize(
    ("does", "what", "where"),
    [
        ("refuse", "it is wrong", "line 7"),
        ("panic", "it is damaged (no Exception at all)", None),
        ("strange", "it is damaged (a column of kind complex128 with 1 dimensions)", None),
        ("eat", "reading it would take more memory than a file of its size can need", None),
    ],
)
def test_the_process_refuses_in_words_and_ends(tmp_path: Path, does: str, what: str, where: str | None) -> None:
    (answer,), rest, code = told(tmp_path, does)
    assert (answer["what"], answer["where"]) == (what, where or str(tmp_path / "log"))
    assert answer["do"] == ("Mend it." if does == "refuse" else "Copy or export it again.")
    assert (rest, code) == (b"", 0)
