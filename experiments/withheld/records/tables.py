"""Recorded runs as columns, and back into files with as many digits as they came with."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seatruth.errors import BadInput
from withheld.records.injected import Columns
from withheld.seal import ROOT

DATA = ROOT.parent / "shared" / "data"
"""The folder of real trials, where it is not told."""


@dataclass(frozen=True)
class Table:
    """A run's columns (n,), and how many decimals the file gives of each."""

    columns: Columns
    decimals: Mapping[str, int]


def folder_of(data: Path, name: str) -> Path:
    """A folder of the real trials; BadInput where it is not there."""
    place = data / name
    if not place.is_dir():
        raise BadInput(
            "the real trials are not there",
            where=str(place),
            do="Give their folder with --data FOLDER; they are not part of this repository.",
        )
    return place


def read(file: Path) -> Table:
    """A recorded run; BadInput where the file is missing or holds what is no number."""
    try:
        with file.open(encoding="utf-8") as stream:
            names, *rows = list(csv.reader(stream))
        values = np.array(rows, dtype=np.float64)
    except (OSError, ValueError) as problem:
        raise BadInput(f"it cannot be read ({problem})", where=str(file), do="Fetch the trials anew.") from None
    decimals = {name: max(_decimals(row[k]) for row in rows) for k, name in enumerate(names)}
    return Table({name: values[:, k] for k, name in enumerate(names)}, decimals)


def text(columns: Columns, decimals: Mapping[str, int]) -> str:
    """The columns as CSV, rounded to these decimals: a changed sensor is not known by its digits."""
    names = list(columns)
    # Adding zero turns -0.0 into 0.0.
    cells = [
        [f"{value:.{decimals[name]}f}" for value in np.round(columns[name], decimals[name]) + 0.0] for name in names
    ]
    return "\n".join([",".join(names), *(",".join(row) for row in zip(*cells, strict=True))]) + "\n"


def _decimals(cell: str) -> int:
    """Digits behind the point of a number as it is written."""
    digits, _, power = cell.lower().partition("e")
    return max(0, len(digits.partition(".")[2]) - int(power or 0))
