"""A log is split by events, pauses and columns, with every sample in one part at most."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.readers import read_log
from seatruth.trials.stretches import by_column, by_events, by_pauses


def test_events_cut_between_samples() -> None:
    t = np.arange(0, 10, 0.5)
    parts = by_events(t, [7.0, 2.2])
    assert [(p.start, p.end, p.name) for p in parts] == [(0, 2, "part_1"), (2.5, 6.5, "part_2"), (7, 9.5, "part_3")]
    with pytest.raises(BadInput, match=r"an event at 12 s is outside the log, which lasts from 0 to 9.5 s"):
        by_events(t, [12.0])


def test_pauses_end_a_part() -> None:
    t = np.concatenate([np.arange(0, 10, 0.5), np.arange(60, 70, 0.5)])
    assert [(p.start, p.end) for p in by_pauses(t)] == [(0, 9.5), (60, 69.5)]


def log(folder: Path, runs: list[str]) -> Path:
    file = folder / "log.csv"
    rows = [f"{k % 5},{run},{k}" for k, run in enumerate(runs)]
    file.write_text("\n".join(["t,run,psi", *rows]) + "\n")
    return file


def test_a_column_tells_the_runs(tmp_path: Path) -> None:
    table = read_log(log(tmp_path, ["1"] * 5 + [""] * 5 + ["2"] * 5)).table()
    runs = by_column(table, "run", table.numbers("t"))
    assert [(r.name, r.where, r.start, r.end) for r in runs] == [
        ("run_1", "run == 1", 0, 4),
        ("run_2", "run == 2", 0, 4),
    ]


def test_runs_may_have_names(tmp_path: Path) -> None:
    table = read_log(log(tmp_path, ["zig zag"] * 5 + ["O'Hara"] * 5)).table()
    runs = by_column(table, "run", table.numbers("t"))
    assert {(r.name, r.where) for r in runs} == {("zig_zag", "run == 'zig zag'"), ("O_Hara", 'run == "O\'Hara"')}


def test_a_column_that_tells_no_runs_is_refused(tmp_path: Path) -> None:
    table = read_log(log(tmp_path, ["1"] * 60)).table()
    with pytest.raises(BadInput, match="different values"):
        by_column(table, "psi", table.numbers("t"))
    with pytest.raises(BadInput, match="no column 'rum'"):
        by_column(table, "rum", table.numbers("t"))
