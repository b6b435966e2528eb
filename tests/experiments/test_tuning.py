"""The tuning of the solvers: its problems are its own, its sweeps name options that exist, failures count."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

import common  # noqa: E402
import standard_comparison_systems  # noqa: E402
import tuning  # noqa: E402
import tuning_systems as systems  # noqa: E402

from seatruth.costs import cost_of  # noqa: E402
from seatruth.optimizers import make  # noqa: E402


def test_no_problem_is_tuned_on_and_checked_or_compared() -> None:
    models: list[set[object]] = []
    for group in (systems.TUNED_ON, systems.CHECKED_ON, standard_comparison_systems.SYNTHETIC):
        problems = [maker() for maker in group.values()]
        assert all(problem.synthetic for problem in problems)
        models.append({problem.study.model.title for problem in problems})
    assert not models[0] & models[1]
    assert not (models[0] | models[1]) & models[2]


@pytest.mark.parametrize("name", [*systems.TUNED_ON, *systems.CHECKED_ON])
def test_each_truth_lies_inside_its_bounds(name: str) -> None:
    problem = (systems.TUNED_ON | systems.CHECKED_ON)[name]()
    assert problem.truth is not None
    cost = cost_of(problem.study, threads=1)
    low, high = cost.bounds
    truth = [problem.truth[parameter] for parameter in cost.names]
    assert all(a < value < b for a, value, b in zip(low, truth, high))
    assert 3 <= len(truth) <= 12


@pytest.mark.parametrize("solver", list(tuning.FORMER))
def test_every_setting_of_a_sweep_is_one_that_the_solver_takes(solver: str) -> None:
    tried = tuning.settings(solver)
    assert next(iter(tried)) == "former defaults"
    assert len({make(solver, **options) for options in tried.values()}) >= 4


def test_a_setting_that_never_arrives_scores_worse_than_one_that_is_slow() -> None:
    rows = [
        {"setting": "slow", "problem": "a", "searches": 2, "arrived": 2, "evaluations": 900.0},
        {"setting": "slow", "problem": "b", "searches": 2, "arrived": 2, "evaluations": 400.0},
        {"setting": "never", "problem": "a", "searches": 2, "arrived": 0, "evaluations": 4000.0},
        {"setting": "never", "problem": "b", "searches": 2, "arrived": 2, "evaluations": 100.0},
    ]
    scored = tuning.scores(rows)
    assert list(scored.index) == ["slow", "never"]
    assert scored.loc["slow", "score"] == pytest.approx(600.0)
    assert scored.loc["never", "arrived"] == 2


@pytest.mark.slow
def test_quick_mode_leaves_a_whole_result(tmp_path: Path) -> None:
    options = common.arguments("tuning", "", ["--quick", "--out", str(tmp_path), "--workers", "1"])
    results = common.Results("tuning", options)
    tuning.body(options, results)
    record = results.finish()
    assert record["figures"]["genetic: gain of the defaults on other problems"]["value"] > 0
    assert (tmp_path / "gain.png").exists()
    assert "synthetic" in (tmp_path / "summary.md").read_text()
    assert json.loads((tmp_path / "result.json").read_text())["figures"] == record["figures"]
