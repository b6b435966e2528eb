"""The helper that all experiments share: stages resume, results are complete, nothing leaks."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments"))

import common
import provenance

from seatruth.errors import BadInput


def options(folder: Path, *more: str) -> common.Options:
    return common.arguments("trial_run", "a test", ["--out", str(folder), "--workers", "2", *more])


def test_a_finished_stage_is_not_done_again_unless_its_definition_changes(tmp_path: Path) -> None:
    calls: list[int] = []

    def work() -> dict[str, object]:
        calls.append(1)
        return {"x": np.arange(3), "worst": math.inf}

    for _ in range(2):
        outcome = common.Results("trial_run", options(tmp_path)).stage("first", {"seed": 1}, work)
        assert outcome == {"x": [0, 1, 2], "worst": None}
    assert len(calls) == 1
    common.Results("trial_run", options(tmp_path)).stage("first", {"seed": 2}, work)
    common.Results("trial_run", options(tmp_path, "--fresh")).stage("first", {"seed": 2}, work)
    assert len(calls) == 3


def test_a_stage_that_was_cut_or_damaged_is_done_again(tmp_path: Path) -> None:
    def stopped() -> None:
        raise KeyboardInterrupt

    results = common.Results("trial_run", options(tmp_path))
    with pytest.raises(KeyboardInterrupt):
        results.stage("one", {}, stopped)
    assert results.stage("one", {}, lambda: 5) == 5
    kept = tmp_path / "stages" / "one.json"
    kept.write_text(kept.read_text()[:20])
    assert common.Results("trial_run", options(tmp_path)).stage("one", {}, lambda: 6) == 6


def test_result_is_complete_and_names_no_folder(tmp_path: Path) -> None:
    results = common.Results("trial_run", options(tmp_path), seeds={"noise": 7})
    results.stage("one", {}, lambda: 1)
    results.add_figure("rmse of u", np.float64(0.25), "m/s", goal="<= 1", met=True)
    results.add_figure("not there", None, "s", "peer not installed")
    results.add_table("errors", pd.DataFrame({"a": [0.1 + 0.2]}, index=pd.Index(["t1"], name="trial")))
    results.add_text("What this shows.")
    results.finish()
    record = json.loads((tmp_path / "result.json").read_text())
    assert record["figures"]["rmse of u"] == {"value": 0.25, "unit": "m/s", "note": "", "goal": "<= 1", "met": True}
    assert record["figures"]["not there"]["value"] is None
    assert record["seeds"] == {"noise": 7}
    assert record["versions"]["numpy"] == np.__version__
    assert {"commit", "dirty", "machine", "stages", "failures", "wall_s"} <= set(record)
    assert (tmp_path / "errors.csv").read_text().split() == ["trial,a", "t1,0.30000000000000004"]
    text = (tmp_path / "result.json").read_text() + (tmp_path / "summary.md").read_text()
    assert str(provenance.ROOT) not in text
    assert str(tmp_path) not in text
    assert not list(tmp_path.rglob("*.part"))


def test_a_figure_without_value_says_why(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no note"):
        common.Results("trial_run", options(tmp_path)).add_figure("x", math.nan, "s")


def test_quick_and_full_results_stay_apart_and_bad_options_are_refused() -> None:
    assert common.arguments("n", "", ["--quick"]).out.name == "n-quick"
    assert common.arguments("n", "", []).out.name == "n"
    with pytest.raises(BadInput, match="workers"):
        common.arguments("n", "", ["--workers", "0"])
    with pytest.raises(BadInput, match="--data"):
        common.arguments("n", "", ["--data", "/nowhere"]).trials()


def test_help_shows_a_per_cent_sign_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        common.arguments("n", "Noise of 1 and 10 %", ["--help"], {"kinds": "noise at 3 %"})
    shown = capsys.readouterr().out
    assert "Noise of 1 and 10 %" in shown
    assert "noise at 3 %\n" in shown
    assert "%%" not in shown
