"""Files of IOHprofiler as its readers take them, and lists of targets."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from small_comparison import small, stumble

from seatruth import BadInput
from seatruth.comparison import Results, compare
from seatruth.comparison.export import read_targets, write_ioh
from seatruth.optimizers import from_callable, make


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    solvers = {"swarm": make("particle_swarm", particles=10), "stumble": from_callable(stumble)}
    return compare(small(solvers=solvers, seeds=2, budgets=[20, 100]), tmp_path_factory.mktemp("compared"))


def test_every_run_is_there_with_its_history(results: Results, tmp_path: Path) -> None:
    written = write_ioh(results, tmp_path)
    assert len(written) == 2  # one solver (the other failed) on two conditions
    for path in written:
        described = json.loads(path.read_text())
        assert described["algorithm"]["name"] == "swarm"
        assert described["maximization"] is False
        (scenario,) = described["scenarios"]
        assert scenario["dimension"] == 2
        parts = (path.parent / scenario["path"]).read_text().split("evaluations raw_y\n")[1:]
        assert len(parts) == len(scenario["runs"]) == 2
        for part, run in zip(parts, scenario["runs"]):
            rows = [[float(word) for word in line.split()] for line in part.splitlines()]
            assert [row[0] for row in rows] == sorted(row[0] for row in rows)
            assert [row[1] for row in rows] == sorted((row[1] for row in rows), reverse=True)
            assert rows[-1] == [run["best"]["evals"], pytest.approx(run["best"]["y"])]
            assert run["evals"] == 100
            assert len(run["best"]["x"]) == 2
        assert [run["instance"] for run in scenario["runs"]] == [1, 2]


def test_targets_of_coco(tmp_path: Path) -> None:
    path = tmp_path / "targets.txt"
    path.write_text("% bbob precisions\n[1e2, 1.0\t1e-8]\n# none here\n\n10 # and one\n")
    assert read_targets(path) == (100.0, 10.0, 1.0, 1e-8)


@pytest.mark.parametrize(
    ("text", "said"), [("", "no target"), ("1 two", "'two' is no target"), ("1\n-1", "line 2"), ("nan", "no target")]
)
def test_what_is_no_list_of_targets_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "targets.txt"
    path.write_text(text)
    with pytest.raises(BadInput, match=said):
        read_targets(path)
    with pytest.raises(BadInput, match="cannot be read"):
        read_targets(tmp_path / "absent.txt")
