"""A library that crashes, hangs or eats all memory takes nothing with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.readers import Content, isolation
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
