"""Conditions on a file's columns: what they choose, and what is said of those that mean nothing."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from seatruth.errors import BadInput
from seatruth.readers.tables import Table
from seatruth.trials.condition import columns_of, rows_where


def table(**columns: Any) -> Table:
    return Table("run.csv", {name: pd.Series(values) for name, values in columns.items()})


LOG = table(
    sat=[3, 6, None, 9],
    fix=[0, 1, 1, 0],
    hold=["true", "False", None, "TRUE"],
    run=["zigzag 2", "turn or stop", None, " zigzag 2 "],
)


@pytest.mark.parametrize(
    ("condition", "chosen"),
    [
        ("sat < 9", [0, 1]),  # a missing value fulfils nothing
        ("sat >= 6 and fix == 1", [1]),
        ("sat < 4 or sat > 8 and fix = 0", [0, 3]),
        ("fix", [1, 2]),
        ("`fix` != 1", [0, 3]),
        ("hold", [0, 3]),
        ("hold == 0", [1]),
        ("run == 'zigzag 2'", [0, 3]),
        ("run != 'zigzag 2'", [1]),
        ("run = 'turn or stop'", [1]),  # a word in quotes joins nothing
    ],
)
def test_the_rows_that_a_condition_chooses(condition: str, chosen: list[int]) -> None:
    assert rows_where(LOG, condition).nonzero()[0].tolist() == chosen


@pytest.mark.parametrize(
    ("condition", "says"),
    [
        ("sat <", "'sat <' is no comparison. Write it as COLUMN == NUMBER."),
        ("sat == ", "'sat ==' is no comparison"),
        ("sat < 4 and ", "is no comparison"),
        ("sat < 1-2", "'1-2' is not a number"),
        ("sats < 4", "no column 'sats'. Did you mean 'sat'?"),
        ("rum == 'zigzag'", "no column 'rum'. Did you mean 'run'?"),
        ("run == 3", "'zigzag 2' is not a number"),
    ],
)
def test_what_no_condition_is_says_so_with_its_file(condition: str, says: str) -> None:
    with pytest.raises(BadInput) as caught:
        rows_where(LOG, condition)
    assert says in str(caught.value)
    assert "run.csv" in str(caught.value)


def test_the_columns_that_a_condition_names() -> None:
    assert columns_of("sat < 4 or run == 'a and b' and `pos hold`") == ["sat", "run", "pos hold"]
