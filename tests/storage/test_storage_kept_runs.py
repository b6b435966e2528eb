"""Runs on disk: whole or not at all, in a folder of bounded size."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth.storage import kept_runs
from seatruth.storage.cache_folder import CACHE
from seatruth.storage.kept_runs import KeptRuns


def test_a_run_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    y = np.random.default_rng(1).normal(size=(7, 3))
    y[2, 1] = np.nan
    KeptRuns(tmp_path).put("abcd", y)
    found = KeptRuns(tmp_path).get("abcd")
    assert found is not None
    assert found.tobytes() == y.tobytes()
    assert KeptRuns(tmp_path).get("ffff") is None


def test_a_damaged_file_is_no_run(tmp_path: Path) -> None:
    kept = KeptRuns(tmp_path)
    kept.put("abcd", np.ones((4, 2)))
    (file,) = tmp_path.glob("*/*.run")
    file.write_bytes(file.read_bytes()[:-3])
    assert kept.get("abcd") is None
    file.write_bytes(b"")
    assert kept.get("abcd") is None


def test_those_not_used_for_longest_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_runs, "MOST_BYTES", 2000)
    monkeypatch.setattr(kept_runs, "_TRIM_EVERY", 1)
    kept = KeptRuns(tmp_path)
    for number in range(8):
        kept.put(f"{number:02d}", np.full((10, 5), float(number)))
    assert kept.get("07") is not None
    assert kept.get("00") is None
    assert sum(file.stat().st_size for file in tmp_path.glob("*/*.run")) <= 2000


def test_without_a_folder_nothing_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE, "off")
    kept = KeptRuns()
    kept.put("abcd", np.ones((4, 2)))
    assert kept.get("abcd") is None
    monkeypatch.setenv(CACHE, str(tmp_path / "mine"))
    kept = KeptRuns()
    kept.put("abcd", np.ones((4, 2)))
    assert kept.get("abcd") is not None
    assert (tmp_path / "mine" / "runs" / "ab" / "abcd.run").exists()
