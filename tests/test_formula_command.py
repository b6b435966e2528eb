"""A user's own formula from the command line: fitted and predicted, or told in one line what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth import Estimate
from seatruth.cli import run

STUDY = """
[formula]
expression = "{formula}"
file = "{file}"

[parameters]
a = {{ value = 1, vary = true }}
b = {{ value = 1, vary = true }}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    rng = np.random.default_rng(0)
    lines = ["speed (m/s),rudder,diameter"]
    for _ in range(25):
        u, d = rng.uniform(1, 2), rng.uniform(10, 35)
        lines.append(f"{u:.4f},{d:.3f},{8 * u / (1 + 0.05 * d) + 0.05 * rng.standard_normal():.4f}")
    (tmp_path / "turns.csv").write_text("\n".join([*lines, "1.5,20,", ""]))
    (tmp_path / "gap.csv").write_text("\n".join([*lines[:5], ",20,3.1", *lines[5:], ""]))
    (tmp_path / "text.csv").write_text("\n".join([*lines[:5], "1.5,20,about 3", *lines[5:], ""]))
    return tmp_path


def told(folder: Path, formula: str, file: str = "turns.csv") -> int:
    (folder / "study.toml").write_text(STUDY.format(formula=formula, file=file))
    return run(["identify", str(folder / "study.toml"), "--quiet", "--fresh"])


def test_one_line_is_fitted_and_predicts(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert told(folder, "diameter = a*speed / (1 + b*rudder)") == 0
    estimate = Estimate.load(folder / "study-result")
    assert estimate.values["a"] == pytest.approx(8, rel=0.05)
    assert estimate.values["b"] == pytest.approx(0.05, rel=0.1)
    ahead = estimate.traces.iloc[-1]
    assert np.isnan(ahead["measured"])
    assert ahead["lower"] < 6.0 < ahead["upper"]
    assert ahead["upper"] - ahead["lower"] < 0.35
    page = (folder / "study-result" / "report.html").read_text()
    for words in ("Measured and computed", "95 % interval"):
        assert words in page
    for words in ("Time histories", "Residuals over time", "Error of the time step", "Open loop"):
        assert words not in page
    assert "converged" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("formula", "file", "words"),
    [
        ("diameter = a*spede + b", "turns.csv", ("no column 'spede'", "Did you mean 'speed'", "[parameters]")),
        ("diametr = a*speed + b", "turns.csv", ("no column 'diametr'", "Did you mean 'diameter'")),
        ("diameter = a*speed + c", "turns.csv", ("no parameter 'b'",)),
        ("diameter = a*speed/(b - b)", "turns.csv", ("no finite value", "division by zero", "lines 2-26")),
        ("diameter = a*log(-speed) + b", "turns.csv", ("no finite value", "logarithm")),
        ("diameter = a*speed +* b", "turns.csv", ("no arithmetic expression", "line 3")),
        ("diameter = a*sqr(speed) + b", "turns.csv", ("function 'sqr'", "sqrt")),
        ("diameter = a*speed^2 + b", "turns.csv", ("Write ** for powers",)),
        ("diameter = __import__('os').getcwd() + a*b", "turns.csv", ("more than arithmetic",)),
        ("diameter = (lambda: a)() + b", "turns.csv", ("more than arithmetic",)),
        ("diameter = a.__class__ + b", "turns.csv", ("more than arithmetic",)),
        ("diameter = [a for b in (1,)][0]", "turns.csv", ("more than arithmetic",)),
        ("diameter = a*speed + b", "gap.csv", ("gap.csv, line 6", "'speed' has no value")),
        ("diameter = a*speed + b", "text.csv", ("line 6", "about 3", "not a number")),
        ("diameter = a*speed + b", "turn.csv", ("no file 'turn.csv'", "Did you mean 'turns.csv'")),
    ],
)
def test_what_is_wrong_is_said_in_one_line(
    folder: Path, capfd: pytest.CaptureFixture[str], formula: str, file: str, words: tuple[str, ...]
) -> None:
    assert told(folder, formula, file) == 2
    said = capfd.readouterr().err
    assert "Traceback" not in said
    for word in words:
        assert word in " ".join(said.split())
    assert "row of the table" not in said


def test_towers_of_powers_and_deep_nests_end(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for formula in (
        "diameter = a**b**b**9**9**9*speed",
        f"diameter = {'(' * 90}a*b*speed{')' * 90}",
        "diameter = a*1e999*b",
    ):
        assert told(folder, formula) in (0, 1, 2)
        assert "fault in seatruth" not in capfd.readouterr().err
