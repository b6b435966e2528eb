"""The standard comparison in its quick version, and the problems of the full one."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

import common  # noqa: E402
import standard_comparison  # noqa: E402
import standard_comparison_systems as systems  # noqa: E402

from seatruth.comparison.realisation import NoisyProblem, RealisationSettings  # noqa: E402


@pytest.mark.slow
def test_quick_mode_leaves_a_whole_result(tmp_path: Path) -> None:
    options = common.arguments("standard_comparison", "", ["--quick", "--out", str(tmp_path), "--workers", "1"])
    results = common.Results("standard_comparison", options)
    standard_comparison.body(options, results)
    record = results.finish()
    assert record["figures"]["failed runs"]["value"] == 0
    assert record["figures"]["runs"]["value"] > 60
    text = (tmp_path / "summary.md").read_text() + (tmp_path / "report.html").read_text()
    assert "synthetic" in text
    assert str(ROOT) not in text
    assert (tmp_path / "tables" / "overall.tex").exists()
    assert json.loads((tmp_path / "result.json").read_text())["figures"] == record["figures"]


@pytest.mark.parametrize("name", list(systems.SYNTHETIC))
def test_each_published_system_can_be_told_from_its_trial(name: str) -> None:
    problem = systems.SYNTHETIC[name]()
    assert problem.synthetic
    assert problem.truth is not None
    noisy = NoisyProblem(problem, RealisationSettings(0, 0.01))
    assert all(width > 0 for width in noisy.ranges.values())
    assert len(noisy.holdout) == 1
    free = [q for q in problem.study.free if q.min < problem.truth[q.name] < q.max]
    assert len(free) == len(problem.truth)
