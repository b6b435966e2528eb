"""The comparison file, the command and the report: what is said when something is wrong, and what is written."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
from documents import ROOT
from small_comparison import small, solvers

from seatruth import BadInput, ProgressEvent, cli
from seatruth.comparison import Comparison, Noise, compare
from seatruth.comparison.file import read_comparison, reference
from seatruth.report.comparison import render_comparison, write_tables
from seatruth.sample import copy_to

TABLE = "x,y\n" + "".join(f"{0.1 * k},{0.1 * k}\n" for k in range(30))
STUDY = """
[formula]
expression = "y = a*x + b*x**2"
file = "table.csv"
[parameters]
a = { value = 2.0, min = 0.0, max = 5.0, vary = true }
b = { value = -0.5, min = -2.0, max = 2.0, vary = true }
"""
GOOD = """
[comparison]
seeds = 2
budgets = [40, 80]
[[problems]]
study = "line.toml"
truth = "study"
[[solvers]]
use = "least_squares"
[[solvers]]
name = "swarm first"
stages = [{ use = "particle_swarm", particles = 8 }, { use = "least_squares" }]
[[noise]]
levels = [0, 0.05]
[[noise]]
kind = "outliers"
levels = [0.05]
share = 0.1
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "table.csv").write_text(TABLE)
    (tmp_path / "line.toml").write_text(STUDY)
    (tmp_path / "c.toml").write_text(GOOD)
    return tmp_path


def test_reading_a_file_tells_how_far_its_logs_are_read(folder: Path) -> None:
    events: list[ProgressEvent] = []
    read_comparison("c.toml", progress=events.append)
    assert (events[-1].stage, events[-1].left) == ("Reading table.csv", 0)


def test_a_file_is_read(folder: Path) -> None:
    made, where = read_comparison("c.toml")
    assert where == Path("c-result")
    assert list(made.solver) == ["least_squares", "swarm first"]
    assert [noise.label for noise in made.noise] == ["white", "white", "outliers (share 0.1)"]
    assert len(made.runs) == 2 * 2 * 2 * 3
    assert len({run.key for run in made.runs}) == len(made.runs)
    assert made.problems[0].truth == {"a": 2.0, "b": -0.5}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('use = "least_squares"', 'use = "least_sqares"', r"no optimizer 'least_sqares'.*Did you mean 'least_squares'"),
        ('kind = "outliers"', 'kind = "outlier"', r"no noise 'outlier'.*Did you mean 'outliers'"),
        ("share = 0.1", "shape = 0.1", r"no option 'shape'.*Did you mean 'share'"),
        ("share = 0.1", "share = 2.0", r"share = 2.0 is out of range"),
        ("levels = [0, 0.05]", "levels = []", "list of levels is empty"),
        ("levels = [0, 0.05]", "levels = [-0.1]", "0 or more"),
        ("levels = [0, 0.05]", "levels = [0.05, 0.05]", "is repeated"),
        ("budgets = [40, 80]", "budgets = []", "list of budgets is empty"),
        ("budgets = [40, 80]", "budgets = [40, 40]", "'40' is repeated among its budgets"),
        ("budgets = [40, 80]", "budgets = [0]", "greater than 0"),
        ("seeds = 2", "seeds = 0", "greater than 0"),
        ("seeds = 2", "sed = 2", r"unknown key 'sed'.*Did you mean 'seed"),
        ("seeds = 2", 'seeds = 2\ncosts = ["trajektory"]', "not 'trajectory' or 'regression'"),
        ("seeds = 2", "seeds = 2\ntargets = [-1.0]", "targets must be above 0"),
        ('study = "line.toml"', 'study = "lime.toml"', r"no such study file.*line.toml"),
        ('truth = "study"', "truth = { a = 1.0 }", "the truth of 'b' is missing"),
        ('truth = "study"', "truth = { a = 1.0, b = 7.0 }", "outside its bounds"),
        ('truth = "study"', "truth = { a = 1.0, B = 1.0 }", "'B', which is no free parameter"),
        ('truth = "study"', 'costs = ["trajectory"]', "a formula study has no trajectory cost"),
        ('name = "swarm first"', 'name = "least_squares"', "second solver is called 'least_squares'"),
        ("stages = [", 'use = "newton"\nstages = [', "either `use` or `stages`"),
        ("[[solvers]]", "[[solver]]", "unknown key 'solver'"),
        ('name = "swarm first"', 'name = "swarm first"\nparticles = 3', "'particles'. Options belong to the stages"),
        ('name = "swarm first"', 'name = "f"\nsweep = { particles = [3, 4] }', "no options to sweep. Sweep a single"),
        ("[[noise]]", '[[solvers]]\nname = "b"\nuse = "least_squares"\n[[noise]]', "'b' is the same as a solver above"),
        ("[[noise]]", '[[problems]]\nstudy = "line.toml"\n[[noise]]', "a second problem is called 'line'"),
        ('[[problems]]\nstudy = "line.toml"\ntruth = "study"\n', "", r"names no problems. Add \[\[problems\]\]"),
    ],
)
def test_each_mistake_is_one_clear_message(folder: Path, old: str, new: str, message: str, capsys: Any) -> None:
    (folder / "c.toml").write_text(GOOD.replace(old, new, 1))
    assert cli.run(["compare", "c.toml", "--quiet"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(message, said), said
    assert "Traceback" not in said
    assert not (folder / "c-result").exists()


def test_comparisons_that_say_nothing_are_refused() -> None:
    for key in ("problems", "solvers", "noise", "budgets"):
        with pytest.raises(BadInput, match=f"it has no {key}"):
            small(**{key: []})
    with pytest.raises(BadInput, match="is repeated"):
        small(noise=[Noise(), Noise()])
    for change, says in (
        ({"seeds": 0}, "0 seeds are not possible. Give 1 or more"),
        ({"seeds": True}, "True seeds are not possible"),
        ({"costs": ["trajektory"]}, "no cost 'trajektory' for all. Did you mean 'trajectory'"),
        ({"targets": [0.0]}, "targets must be above 0"),
        ({"rope": 0.5}, "rope is 0.5. Give a factor of 1 or more"),
        ({"stop": "budjet"}, "a search cannot stop at 'budjet'. Did you mean 'budget'"),
        ({"solvers": "least_squares"}, "solvers is a text. Give a list of them"),
        ({"solvers": ["least_squares", "least_squares"]}, "two solvers are called 'least_squares'"),
    ):
        with pytest.raises(BadInput) as caught:
            small(**change)
        assert says in str(caught.value)
        assert "comparison 'small'" in str(caught.value)
    for workers in (0, 1_000_000):
        with pytest.raises(BadInput, match=f"{workers} workers are not possible"):
            compare(small(), "nowhere", workers=workers)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"seeds": 10**23}, r"runs, and 200,000 are possible"),
        ({"budgets": range(1, 1_002)}, "1001 budgets are too many. Give at most 1000"),
        ({"noise": [Noise("white", 1e-6 * k) for k in range(1, 50_000)]}, "runs, and 200,000 are possible"),
        ({"budgets": [10**30]}, "Give whole numbers, 1 to 1,000,000,000,000"),
    ],
)
def test_more_than_can_be_named_or_stored_is_refused_before_it_is_made(change: dict[str, Any], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        small(**change)


def test_workers_that_would_not_fit_into_memory_are_not_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("seatruth.memory.psutil.virtual_memory", lambda: SimpleNamespace(available=3e8))
    with pytest.raises(BadInput, match=r"2 workers need 0\.4 GB of memory"):
        compare(small(), tmp_path, workers=2)


def test_the_command_compares_resumes_and_reports(folder: Path, capsys: Any) -> None:
    assert cli.run(["compare", "c.toml", "--workers", "1", "--json", "out.json"]) == 0
    said = capsys.readouterr()
    assert "24 runs" in said.err
    data = json.loads((folder / "out.json").read_text())["result"]
    assert (data["runs"], data["left"], data["failed"]) == (24, 0, 0)
    assert {row["solver"] for row in data["overall"]} == {"least_squares", "swarm first"}
    page = (folder / "c-result" / "report.html").read_text()
    assert "SYNTHETIC" in page
    assert "://" not in re.sub(r"http://www.w3.org/\S+", "", page)  # it loads nothing from anywhere
    assert str(folder) not in page
    first = (folder / "c-result" / "tables" / "runs.csv").read_text()
    assert cli.run(["compare", "c.toml", "--workers", "1"]) == 0
    assert (folder / "c-result" / "tables" / "runs.csv").read_text() == first
    assert cli.run(["compare", "c.toml", "--ranking"]) == 0
    assert "Mean ranks, formula cost" in capsys.readouterr().out
    assert cli.run(["compare", "c.toml", "--dask", "tcp://127.0.0.1:1", "--quiet"]) == 2


def test_tables_are_whole_as_csv_and_latex(tmp_path: Path) -> None:
    results = compare(small(), tmp_path)
    files = {path.name for path in write_tables(results, tmp_path / "tables")}
    assert {"overall.csv", "overall.tex", "accuracy.csv", "runs.csv", "success.csv"} <= files
    back = pd.read_csv(tmp_path / "tables" / "overall.csv")
    assert back["error_percent"].to_numpy() == pytest.approx(results.overall["error_percent"].to_numpy())
    text = (tmp_path / "tables" / "ranking_by_accuracy__formula.tex").read_text()
    assert "\\begin{tabular}" in text
    assert "mean rank" in text


@pytest.mark.slow
def test_the_report_is_the_same_each_time_and_says_what_is_missing(tmp_path: Path) -> None:
    results = compare(small(), tmp_path)
    page = render_comparison(results)
    assert page == render_comparison(results)
    assert page.count("<svg") >= 6
    for title in ("In short", "Accuracy against noise", "Ranks", "Reaching the best fit", "What was compared"):
        assert title in page
    more = small(seeds=5)
    from seatruth.comparison import standing

    partly = standing(more, tmp_path)
    assert partly.left == 12
    assert "12 runs are not done yet" in render_comparison(partly)


def test_a_solver_that_fits_no_cost_is_named() -> None:
    from small_comparison import line

    from seatruth.comparison import Problem
    from seatruth.models import BlackBox
    from seatruth.optimizers import make

    assert small(solvers={**solvers(), "svm": make("ls_svm")}).fitting["line", "formula"][-1] == "svm"
    box = Problem("box", _black_box(BlackBox))
    with pytest.raises(BadInput, match="no solver fits"):
        Comparison(problems=[box], solvers=["ls_svm"])
    assert line().name == "line"


def _black_box(kind: Any) -> Any:
    import known_glide

    from seatruth.study import Study

    def run(trial: Any, parameters: Any, x0: Any) -> Any:
        return {"v": trial.t * parameters["a"], "s": trial.t}

    model = known_glide.Glide()
    box = kind("box", run, states=model.states, inputs=model.inputs, outputs=model.outputs, parameters=model.parameters)
    return Study("box", box, known_glide.sailed(1)[:1], noise=known_glide.NOISE)


@pytest.mark.slow
def test_the_document_is_the_schema_and_its_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "docs" / "compare.md").read_text()
    assert text.endswith(reference()), "write docs/compare.md again from seatruth.comparison.file.reference"
    monkeypatch.chdir(tmp_path)
    copy_to(tmp_path)
    example = re.search(r"```toml\n(.*?)```", text, re.DOTALL)
    assert example is not None
    (tmp_path / "comparison.toml").write_text(example[1])
    assert len(read_comparison("comparison.toml")[0].runs) == 20 * 3 * 2 * 2 * 5
    block = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    assert block is not None
    code = block[1].replace("workers=2", "workers=1")
    exec(compile(code, "docs/compare.md", "exec"), {"__name__": "document"})
    assert (tmp_path / "tanker-result" / "report.html").stat().st_size > 100_000
