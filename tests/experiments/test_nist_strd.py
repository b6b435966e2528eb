"""NIST's files are read as they are, and digits are counted."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))
sys.path.insert(0, str(ROOT / "tests" / "optimizers"))

import nist_strd  # noqa: E402
from test_certified import MISRA1A  # noqa: E402


def test_a_file_of_nist_is_read_and_fitted(tmp_path: Path) -> None:
    head = ["NIST/ITL StRD", "Data:          1 Response Variable  (y = volume)", "", "        Start 1     Start 2"]
    errors = ("2.7070075241E+00", "7.2668688436E-06")
    head += [
        f"  b{k + 1} = {MISRA1A.starts[0][k]} {MISRA1A.starts[1][k]} {MISRA1A.b[k]:.10E} {errors[k]}" for k in range(2)
    ]
    rows = [f"      {y}E0      {x}E0" for x, y in zip(MISRA1A.x, MISRA1A.y)]
    path = tmp_path / "Misra1a.dat"
    path.write_text("\n".join([*head, "", "Data:   y               x", *rows]) + "\n")
    known = nist_strd.read(path)
    assert known.table["x"].tolist() == list(MISRA1A.x)
    for start in range(2):
        row = nist_strd.run("Misra1a", known, start)
        assert row["right"], row
        assert row["digits of errors"] > 5  # degrees of freedom count in them


def test_the_picture_has_every_run_and_leaves_those_open_that_miss() -> None:
    rows = [("A", 1, 11.0, 9.0), ("A", 2, 10.0, 3.0), ("B", 1, 0.0, 0.0), ("B", 2, 6.5, 4.5)]
    figure = nist_strd.picture(pd.DataFrame(rows, columns=["data set", "start", "digits", "digits of errors"]))
    for axes, missed in zip(figure.axes, (1, 2), strict=True):
        marks = [line for line in axes.lines if line.get_linestyle() == "None"]
        assert sum(len(line.get_xdata()) for line in marks) == 4
        assert sum(len(line.get_xdata()) for line in marks if line.get_markerfacecolor() == "white") == missed


def test_digits_are_those_of_the_worst() -> None:
    assert nist_strd.digits([1.0, 2.0002], [1.0, 2.0]) == pytest.approx(4.0)
    assert nist_strd.digits([1.0], [1.0]) == 11.0
    assert nist_strd.digits([float("nan")], [1.0]) == 0.0
    assert len(nist_strd.FORMULAS) == 27
