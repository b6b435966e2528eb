"""The table for the README, and what keeps a score from being published."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld import commits as commits_module
from withheld.commits import commits, doubts, told
from withheld.diagnose import diagnose
from withheld.goals import measures
from withheld.markdown import markdown
from withheld.measures import Pair
from withheld.page import write_page
from withheld.score import encoded
from withheld.seal import note
from withheld.verdicts import verdict

from seatruth.errors import BadInput


def _line(step: str, commit: str, program: str = "") -> dict[str, Any]:
    return {"time": "2026-01-02T03:04:05+00:00", "step": step, "what": "end", "commit": commit, "program": program}


def _pairs() -> dict[str, list[Pair]]:
    truth = {
        "case": "c001", "family": "auv", "kind": "single", "effects": ["trim"], "lambda": {"trim": 150.0}, "pairs": {},
        "stratum": "100-400", "set": ["trim"], "places": ["pitch"],
        "oracle": {"closure": 0.9, "refit": 2.0, "floor": 1.0}, "form": None, "stated": True, "aside": False,
    }  # fmt: skip
    closure = {"value": 0.8, "lower": 0.7, "upper": 0.95}
    said = {
        "seatruth": verdict("c001", [(["trim"], 0.8), ([], 0.2)], places=["pitch"], closure=closure),
        "prior": verdict("c001", [([], 0.3), (["trim"], 0.1)]),
        "oracle": verdict("c001", [(["trim"], 1.0)]),
    }
    return {name: [(truth, own)] for name, own in said.items()}


def _scored(out: Path, log: list[dict[str, Any]]) -> dict[str, list[Pair]]:
    pairs = _pairs()
    rows = {name: encoded(measures(of, {})) for name, of in pairs.items()}
    parts = {key: {"all": rows["seatruth"]} for key in ("stratum", "family", "kind", "stated", "aside")}
    case = {"case": "c001", "family": "auv", "kind": "single", "stratum": "100-400", "effects": ["trim"],
            "set": ["trim"], "lambda": {"trim": 150.0}, "seatruth": "effects: trim (0.80)"}  # fmt: skip
    content = {
        "synthetic": True, "set": "test", "cases": [case], "sealed": 1, "seed": 1, "first": "seatruth",
        "programs": rows, "parts": parts, "doubts": doubts(log, ["seatruth", "prior"]), "log": log,
    }  # fmt: skip
    (out / "score.json").write_text(json.dumps(content))
    return pairs


CLEAN = [_line("generate", "aaaa"), _line("diagnose", "bbbb", "seatruth"), _line("diagnose", "bbbb", "prior")]


def test_the_table_names_commits_date_cases_and_that_they_are_synthetic(tmp_path: Path) -> None:
    _scored(tmp_path, CLEAN)
    text = markdown(tmp_path)
    assert "1 synthetic cases (auv)" in text
    assert all(word in text for word in ("commit aaaa", "commit bbbb", "2026-01-02", "SINDy was not run"))
    row = next(line for line in text.splitlines() if line.startswith("| named right, one effect, lambda >= 100"))
    assert row.split(" | ")[1:5] == [">= 0.9", "1.00 (0.21 to 1.00)", "1", "met (open)"]
    assert len({line.count("|") for line in text.splitlines() if line.startswith("|")}) == 1


def test_a_table_of_changed_trees_is_refused_or_marked(tmp_path: Path) -> None:
    _scored(tmp_path, [*CLEAN, _line("diagnose", "cccc+changes", "seatruth")])
    with pytest.raises(BadInput, match=r"cccc\+changes"):
        markdown(tmp_path)
    assert markdown(tmp_path, draft=True).startswith("**Draft, not to be published**")
    assert doubts(CLEAN, ["seatruth", "prior"]) == []
    assert len(doubts([*CLEAN, _line("generate", "dddd")], ["seatruth"])) == 1
    assert commits(CLEAN, "diagnose", "prior") == ["bbbb"]


def test_the_page_shows_everything_and_loads_nothing(tmp_path: Path) -> None:
    pairs = _scored(tmp_path, [*CLEAN, _line("diagnose", "cccc+changes", "seatruth")])
    write_page(tmp_path, pairs)
    text = (tmp_path / "score.html").read_text()
    for word in ("Not to be published", "Every case", "Confusion matrix", "Reliability diagram", "SYNTHETIC",
                 "Not run on this set: worst channel"):  # fmt: skip
        assert word in text, word
    assert 'src="http' not in text
    assert "<script src" not in text


def test_a_run_that_goes_on_with_another_commit_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "begun_with" not in told(tmp_path, "diagnose", "prior")
    note(tmp_path, "diagnose", "begin", {"program": "prior"})
    monkeypatch.setattr(commits_module, "commit", lambda: "another")
    assert len(told(tmp_path, "diagnose", "prior")["begun_with"]) == 1
    assert "goes on with another" in capsys.readouterr().out


def test_sindy_runs_or_refuses(tmp_path: Path) -> None:
    (tmp_path / "public").mkdir()
    (tmp_path / "public" / "seal.json").write_text('{"sealed": {}}')
    try:
        import pysindy  # noqa: F401
    except ImportError:
        with pytest.raises(BadInput, match="pysindy"):
            diagnose(tmp_path, "sindy", 1)
        pytest.skip("pysindy is not installed (the extra benchmark)")
    diagnose(tmp_path, "sindy", 1)
