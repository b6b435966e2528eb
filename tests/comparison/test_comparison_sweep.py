"""A sweep over a solver's options: one entry of the file, one solver for each combination."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_comparison import TRUTH

from seatruth import BadInput
from seatruth.comparison.file import read_comparison
from seatruth.comparison.sweep import swept

FILE = """
[comparison]
seeds = 1
budgets = [40]
[[problems]]
study = "line.toml"
truth = "study"
[[solvers]]
use = "particle_swarm"
"""
STUDY = f"""
[formula]
expression = "y = a*x + b*x**2"
file = "table.csv"
[parameters]
a = {{ value = {TRUTH["a"]}, min = 0.0, max = 5.0, vary = true }}
b = {{ value = {TRUTH["b"]}, min = -2.0, max = 2.0, vary = true }}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "table.csv").write_text("x,y\n" + "".join(f"{0.1 * k},{0.1 * k}\n" for k in range(30)))
    (tmp_path / "line.toml").write_text(STUDY)
    return tmp_path / "c.toml"


def test_every_combination_is_a_solver(file: Path) -> None:
    file.write_text(FILE + "inertia = 0.5\nsweep = { particles = [5, 10], social = [1.0, 2.0, 3.0] }\n")
    made, _ = read_comparison(file)
    assert len(made.solver) == 6
    label = "particle_swarm, particles = 10, social = 2.0"
    options = made.solver[label].describe()["options"]
    assert (options["particles"], options["social"], options["inertia"]) == (10, 2.0, 0.5)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("sweep = { particles = [] }", "has no list of values"),
        ("sweep = { particels = [5, 10] }", "particles"),
        ("sweep = { particles = [5, 5] }", "second solver"),
        (f"sweep = {{ particles = {list(range(2, 300))} }}", "makes 298 solvers"),
    ],
)
def test_what_cannot_be_swept_is_refused(file: Path, line: str, said: str) -> None:
    file.write_text(FILE + line + "\n")
    with pytest.raises(BadInput, match=said):
        read_comparison(file)


def test_a_hybrid_is_not_swept(file: Path) -> None:
    stages = 'stages = [{ use = "cma_es" }, { use = "least_squares" }]\nsweep = { sigma = [0.1, 0.2] }'
    file.write_text(FILE.replace('use = "particle_swarm"', stages))
    with pytest.raises(BadInput, match="no options to sweep"):
        read_comparison(file)
    with pytest.raises(BadInput, match="makes 0 solvers"):
        swept({})
