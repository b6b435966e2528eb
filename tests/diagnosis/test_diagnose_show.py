"""What `seatruth diagnose` shows, keeps and gives back, with a diagnosis made by hand in place of the computation."""

from __future__ import annotations

import json
import shutil
import tomllib
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import fake_diagnosis
import one_story
import pytest

import seatruth.diagnosis
import seatruth.sample
from seatruth.cli import run
from seatruth.commands.diagnose import AUGMENTED, CHECKPOINT, REPORT, _say_errors, show
from seatruth.diagnosis.results import NAME, Diagnosis
from seatruth.progress import ProgressEvent
from seatruth.storage.checkpoint import StaleCheckpoint
from seatruth.study import load_study
from seatruth.trials.trial import Trials

Shown = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The sample without its current, and the command in its folder."""
    with resources.as_file(resources.files("seatruth") / "sample") as sample:
        for path in sample.iterdir():
            if path.suffix in (".csv", ".toml"):
                shutil.copy(path, tmp_path / path.name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[dict[str, Any]]]:
    """Puts a diagnosis of some kind, or an error, in the place of the computation; returns what it is called with."""

    def replace(kind: str = "effects", problem: Exception | None = None) -> list[dict[str, Any]]:
        made: list[dict[str, Any]] = []

        def fake(study: Any, effects: Any = None, **options: Any) -> Diagnosis:
            made.append({"study": study, "effects": effects, **options})
            options["progress"](ProgressEvent("Hypotheses", 1, 2, "fits"))
            Path(options["checkpoint"]).write_text("jobs")
            if problem is not None:
                raise problem
            return fake_diagnosis.diagnosis(kind)

        monkeypatch.setattr(seatruth.diagnosis, "diagnose", fake)
        return made

    return replace


@pytest.mark.parametrize("kind", fake_diagnosis.KINDS)
def test_the_terminal_says_what_the_report_says(kind: str, capsys: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    diagnosis = fake_diagnosis.diagnosis(kind)
    show(diagnosis)
    shown = capsys.readouterr().out
    assert max(len(line) for line in shown.splitlines()) <= 80
    flowing = " ".join(shown.split())
    assert "SYNTHETIC" in flowing
    assert diagnosis.verdict.sentence.replace("+-", "±") in flowing
    for title in ("Where:", "How far:", "Next trial:"):
        assert title in flowing
    if kind in ("unknown", "with_discrepancy"):
        assert "add to dr/dt: 0.250 v r / U^2" in flowing


def test_the_result_is_kept_and_tells_one_story(folder: Path, calls: Any, capsys: Shown) -> None:
    made = calls()
    assert run(["diagnose", "diagnose.toml", "--out", "done", "--json", "out.json", "--seed", "5", "--quiet"]) == 0
    (call,) = made
    assert call["seed"] == 5
    assert call["effects"] is None
    assert call["validate"] is call["suggest"] is True
    diagnosis = Diagnosis.load(folder / "done")
    report = (folder / "done" / REPORT).read_text()
    written = (folder / "done" / AUGMENTED).read_text()
    one_story.check(report, diagnosis, written)
    result = json.loads((folder / "out.json").read_text())["result"]
    assert result["verdict"]["causes"][0]["effects"] == ["current"]
    assert result["augmented_study"] == "done/augmented.toml"
    assert not (folder / "done" / CHECKPOINT).exists()
    assert "Report: done/report.html" in capsys.readouterr().out


def test_the_augmented_study_has_the_named_effects_at_the_reported_values_and_no_other_change(
    folder: Path, calls: Any
) -> None:
    calls()
    assert run(["diagnose", "diagnose.toml", "--out", "done", "--quiet"]) == 0
    before = tomllib.loads((folder / "diagnose.toml").read_text())
    after = tomllib.loads((folder / "done" / AUGMENTED).read_text())
    assert after["model"]["effects"] == ["current"]
    added = {name: after["parameters"].pop(name)["value"] for name in ("current_north", "current_east")}
    assert added == {"current_north": 0.157, "current_east": 0.132}
    assert after["parameters"] == before.get("parameters", {})
    study = load_study(folder / "done" / AUGMENTED)
    values = {parameter.name: parameter for parameter in study.parameters}
    assert values["current_north"].value == 0.157
    assert values["current_north"].vary
    assert values["current_north"].prior is not None
    assert values["current_north"].prior.sd == 0.3


def test_without_named_effects_the_augmented_study_is_the_study(folder: Path, calls: Any) -> None:
    calls("unknown")
    assert run(["diagnose", "diagnose.toml", "--out", "done", "--quiet"]) == 0
    before = tomllib.loads((folder / "diagnose.toml").read_text())
    after = tomllib.loads((folder / "done" / AUGMENTED).read_text())
    assert after["model"] == before["model"]
    assert after.get("parameters", {}) == before.get("parameters", {})


def test_options_reach_the_diagnosis(folder: Path, calls: Any) -> None:
    made = calls("interrupted")
    options = ["--effects", "current,heading_*", "--no-validation", "--no-next-trial", "--threads", "1", "--quiet"]
    run(["diagnose", "diagnose.toml", *options])
    (call,) = made
    assert {"current", "heading_bias"} <= {effect.name for effect in call["effects"]}
    assert call["validate"] is call["suggest"] is False
    assert call["threads"] == 1
    assert Path(call["checkpoint"]) == Path("diagnose-diagnosis") / CHECKPOINT


def test_an_interrupted_run_keeps_its_result_and_its_checkpoint(folder: Path, calls: Any, capsys: Shown) -> None:
    calls("interrupted")
    assert run(["diagnose", "diagnose.toml", "--out", "cut"]) == 130
    assert (folder / "cut" / CHECKPOINT).exists()
    assert (folder / "cut" / NAME).exists()
    assert "Run the same command again to go on" in " ".join(capsys.readouterr().out.split())
    calls()
    assert run(["diagnose", "diagnose.toml", "--out", "cut"]) == 0
    assert "Going on with the interrupted run in cut" in " ".join(capsys.readouterr().err.split())
    assert not (folder / "cut" / CHECKPOINT).exists()


def test_a_checkpoint_of_another_study_is_not_dropped(folder: Path, calls: Any, capsys: Shown) -> None:
    calls(problem=StaleCheckpoint("it belongs to another study", where="old"))
    assert run(["diagnose", "diagnose.toml", "--out", "old", "--quiet"]) == 2
    assert "--fresh drops it" in " ".join(capsys.readouterr().err.split())
    assert (folder / "old" / CHECKPOINT).exists()
    calls()
    (folder / "old" / CHECKPOINT).write_text("of another study")
    assert run(["diagnose", "diagnose.toml", "--out", "old", "--quiet", "--fresh"]) == 0


def test_a_result_that_cannot_be_written_is_shown(folder: Path, calls: Any, capsys: Shown) -> None:
    calls()
    (folder / "full" / REPORT).mkdir(parents=True)
    assert run(["diagnose", "diagnose.toml", "--out", "full", "--quiet"]) != 0
    shown = capsys.readouterr()
    assert "A cause is named" in shown.out
    assert "Traceback" not in shown.err


def test_what_makes_a_diagnosis_meaningless_is_said_before_it_begins(capsys: Shown) -> None:
    study = seatruth.sample.load("diagnose.toml")
    _say_errors(study, 1)
    assert capsys.readouterr().out == ""
    turned = [replace(trial, inputs={**trial.inputs, "delta": -trial.inputs["delta"]}) for trial in study.trials]
    _say_errors(study.replace(trials=Trials(turned)), 1)
    said = " ".join(capsys.readouterr().out.split())
    assert "channel 'delta': The model turns the other way than the record." in said
    assert "Correct this first" in said
