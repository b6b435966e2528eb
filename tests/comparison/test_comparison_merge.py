"""Several machines make parts of a comparison; their stores become one without loss."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pandas as pd
import pytest
from small_comparison import numbers, small, stumble

from seatruth import BadInput
from seatruth.comparison import compare, merge, standing
from seatruth.comparison.runner import STORE
from seatruth.errors import SeatruthWarning
from seatruth.optimizers import from_callable, make


def test_parts_of_several_machines_are_the_whole(tmp_path: Path) -> None:
    whole = compare(small(), tmp_path / "whole")
    parts = [compare(small(), tmp_path / f"{k}", part=(k, 3)) for k in (1, 2, 3)]
    assert sum(len(part.runs) for part in parts) == len(whole.runs)
    assert all(len(part.runs) and part.left for part in parts)
    copied = merge(tmp_path / "1", [tmp_path / "2", tmp_path / "3"])
    assert copied == len(parts[1].runs) + len(parts[2].runs) + len(parts[1].fits) + len(parts[2].fits)
    found = standing(small(), tmp_path / "1")
    assert found.left == 0
    pd.testing.assert_frame_equal(numbers(found), numbers(whole), check_exact=True)
    pd.testing.assert_frame_equal(found.accuracy, whole.accuracy, check_exact=True)
    assert merge(tmp_path / "1", [tmp_path / "2"]) == 0  # again changes nothing
    assert compare(small(), tmp_path / "1").left == 0  # and the checksums hold


def test_a_done_run_replaces_a_failed_one_and_never_the_other_way(tmp_path: Path) -> None:
    solvers = {"stumble": from_callable(stumble), "swarm": make("particle_swarm", particles=10)}
    made = small(solvers=solvers)
    good, bad = compare(made, tmp_path / "good"), compare(made, tmp_path / "bad")
    with sqlite3.connect(tmp_path / "bad" / STORE) as base:
        base.execute("DELETE FROM estimates")
    assert merge(tmp_path / "good", [tmp_path / "bad"]) == 0
    pd.testing.assert_frame_equal(numbers(standing(made, tmp_path / "good")), numbers(good), check_exact=True)
    with pytest.warns(SeatruthWarning, match="damaged"):
        merge(tmp_path / "bad", [tmp_path / "good"])
    pd.testing.assert_frame_equal(numbers(standing(made, tmp_path / "bad")), numbers(bad), check_exact=True)
    assert len(standing(made, tmp_path / "bad").estimates) == len(good.estimates)


def test_what_cannot_be_merged_is_refused(tmp_path: Path) -> None:
    compare(small(seeds=1), tmp_path / "here")
    with pytest.raises(BadInput, match="no such store"):
        merge(tmp_path / "here", [tmp_path / "nowhere"])
    with pytest.raises(BadInput, match="no part 3 of 2"):
        compare(small(), tmp_path / "here", part=(3, 2))
