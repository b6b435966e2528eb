"""A formula in a study file: one line and a table, parsed and fitted; whatever is wrong has its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth import identify
from seatruth.analysis import check_study
from seatruth.costs import cost_of
from seatruth.costs.options import FormulaOptions
from seatruth.errors import BadInput
from seatruth.models.formula import Formula
from seatruth.optimizers import minimise
from seatruth.study import load_study

STUDY = """
[study]
synthetic = true

[formula]
expression = "D = (a * Fr + b) / (delta + c)"
file = "turns.csv"

[parameters]
a = { value = 1.0, min = 0.0, vary = true }
b = { value = 1.0, vary = true }
c = { expr = "2 * half" }
half = 5.0

[channels]
delta = { column = "rudder", unit = "deg" }

[noise]
D = 0.01
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    rng = np.random.default_rng(0)
    fr, delta = rng.uniform(0.2, 0.7, 40), rng.uniform(10, 35, 40)
    d = (300 * fr + 20) / (delta + 10) + 0.01 * rng.standard_normal(40)
    rows = "\n".join(",".join(f"{x:.9g}" for x in row) for row in zip(fr, delta, d))
    (tmp_path / "turns.csv").write_text(f"Fr,rudder,D\n{rows}\n")
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def test_a_formula_is_read_and_fitted(folder: Path) -> None:
    study = load_study(folder / "study.toml")
    assert isinstance(study.model, Formula)
    assert study.cost == FormulaOptions()
    assert study.synthetic
    assert [parameter.name for parameter in study.free] == ["a", "b"]
    assert [channel.unit for channel in study.model.inputs] == ["1", "deg"]
    # in the units of the file: degrees stay degrees
    assert 10 < study.trials[0].inputs["delta"].min() < study.trials[0].inputs["delta"].max() < 35
    cost = cost_of(study)
    for solver in (study.optimizer, "ls_svm"):
        np.testing.assert_allclose(minimise(cost, solver).x, [300, 20], rtol=0.02)
    assert study.provenance["file_sha256"].keys() == {"turns.csv"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(delta + c)", "(delt + c)", "no column 'delt'|no column 'delta'"),
        ("a * Fr", "__import__('os') * Fr", r"\[formula\] expression"),
        ("D = (a", "(a", "is no equation"),
        ("a * Fr", "a^2 * Fr", "more than arithmetic"),
        ("b = {", "bb = {", "no parameter 'bb'.*Did you mean 'b'"),
        ('"2 * half"', '"2 * c"', "no parameter 'half'"),
        ("half = 5.0", "half = { expr = 'c' }", "leads back"),
        ("turns.csv", "turn.csv", "Did you mean 'turns.csv'"),
        ("vary = true }", "vary = false }", "no parameter varies"),
        ("D = 0.01", "E = 0.01", "unknown channel 'E'"),
        ("delta = { column", "beta = { column", "no column 'beta'"),
        ("[noise]", "[[trials]]\nfile = 'x.csv'\n[noise]", "formula study has no \\[trials\\]"),
        ("[noise]", "[cost]\nkind = 'trajectory'\n[noise]", "a formula has no trajectory cost"),
        ("[noise]", "[cost]\nhold = 'zoh'\n[noise]", "no option of a formula cost"),
        ("[noise]", "[model]\nuse = 'mmg'\n[noise]", "both a model and a formula"),
    ],
)
def test_what_is_wrong_has_its_place(folder: Path, old: str, new: str, message: str) -> None:
    assert old in STUDY
    (folder / "study.toml").write_text(STUDY.replace(old, new))
    with pytest.raises(BadInput, match=message) as caught:
        load_study(folder / "study.toml")
    assert "study.toml" in str(caught.value)


def test_a_column_tells_trials_apart(folder: Path) -> None:
    lines = (folder / "turns.csv").read_text().splitlines()
    marked = [f"{line},{name}" for line, name in zip(lines, ["load", *["light", "deep", "light", "full"] * 10])]
    (folder / "turns.csv").write_text("\n".join(marked) + "\n")
    (folder / "study.toml").write_text(STUDY.replace('"turns.csv"', '"turns.csv"\ntrial = "load"'))
    study = load_study(folder / "study.toml")
    assert study.trials.names == ("load light", "load deep", "load full")
    assert [len(trial) for trial in study.trials] == [20, 10, 10]
    assert study.trials[0].t[:3].tolist() == [0, 2, 4]
    left = identify(study, threads=1, cross_validate=True).cross_validation
    assert left is not None
    assert left["trial"].tolist() == list(study.trials.names)
    assert (left["rmse"] < 0.02).all()


@pytest.mark.parametrize(("column", "message"), [("lod", "no column 'lod'"), ("D", "")])
def test_a_column_that_cannot_tell_trials_apart(folder: Path, column: str, message: str) -> None:
    (folder / "study.toml").write_text(STUDY.replace('"turns.csv"', f'"turns.csv"\ntrial = "{column}"'))
    if message:
        with pytest.raises(BadInput, match=message):
            load_study(folder / "study.toml")
    else:
        assert len(load_study(folder / "study.toml").trials) == 40


def test_rows_without_a_measurement_are_predicted(folder: Path) -> None:
    with (folder / "turns.csv").open("a") as file:
        file.write("0.5,20,\n0.5,20,\n")
    study = load_study(folder / "study.toml")
    assert any(finding.code == "rows-to-predict" for finding in check_study(study))
    rows = identify(study, threads=1).traces.tail(2)
    assert rows["measured"].isna().all()
    np.testing.assert_allclose(rows["fitted"], 170 / 30, rtol=0.01)
    assert (rows["upper"] - rows["fitted"]).between(0.015, 0.03).all()


def test_a_formula_cost_needs_a_formula(folder: Path) -> None:
    (folder / "study.toml").write_text("[model]\nuse = 'mmg'\n[cost]\nkind = 'formula'\n")
    with pytest.raises(BadInput, match="needs a formula"):
        load_study(folder / "study.toml")
