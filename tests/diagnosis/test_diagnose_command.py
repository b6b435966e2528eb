"""`seatruth diagnose` from end to end on a small ship: what it says, writes and gives back, and on what it is asked."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import one_story
import pandas as pd
import pytest
import small_case as small
from documents import execute, install

from seatruth import Diagnosis, diagnose, load_study, write_report
from seatruth.cli import run
from seatruth.commands.diagnose import select_effects
from seatruth.diagnosis.results import NAME
from seatruth.errors import BadInput
from seatruth.models import load_model

EFFECTS = ",".join(small.EFFECTS)
OFFSET = 0.02


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's model, logs in which the rudder stands off, their study, and its diagnosis by the command line."""
    place = small.folder_with_model(tmp_path_factory.mktemp("diagnose"))
    small.files(place, small.trials(place, {"rudder_offset_angle": OFFSET}, specs=["rudder_offset"]))
    return place


@pytest.fixture(scope="module")
def done(folder: Path) -> subprocess.CompletedProcess[str]:
    return call(folder, "diagnose", "study.toml", "--effects", EFFECTS, "--threads", "1", "--json", "out.json")


def call(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(folder / "site"), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "COLUMNS": "100", "PYTHONPATH": path}
    command = [sys.executable, "-m", "seatruth", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=200)


@pytest.fixture(scope="module")
def diagnosis(folder: Path, done: subprocess.CompletedProcess[str]) -> Diagnosis:
    assert done.returncode == 0, done.stderr
    return Diagnosis.load(folder / "study-diagnosis")


@pytest.mark.essential
def test_the_cause_is_named_with_its_size(done: subprocess.CompletedProcess[str], diagnosis: Diagnosis) -> None:
    assert diagnosis.verdict.kind == "effects"
    assert diagnosis.named == ("rudder_offset",)
    (q,) = diagnosis.effect("rudder_offset").parameters
    assert q.value == pytest.approx(OFFSET, abs=4 * q.stderr)
    assert q.lower < q.value < q.upper
    for words in (
        "SYNTHETIC",
        "rudder zero offset",
        "Where",
        "actuator of delta",
        "How far",
        "Next trial",
        "report.html",
    ):
        assert words in done.stdout, words
    assert "Traceback" not in done.stderr


def test_json(folder: Path, done: subprocess.CompletedProcess[str]) -> None:
    content = json.loads((folder / "out.json").read_text())
    assert content["ok"] is True
    assert content["command"] == "diagnose"
    result = content["result"]
    assert [cause["effects"] for cause in result["verdict"]["causes"]] == [["rudder_offset"]]
    assert Path(result["report"]).name == "report.html"
    assert result["validation"]["gap_explained"] > 0.9


def test_saved_and_read_again_it_is_the_same(diagnosis: Diagnosis, tmp_path: Path) -> None:
    again = Diagnosis.load(diagnosis.save(tmp_path))
    assert again.content() == diagnosis.content()
    pd.testing.assert_frame_equal(again.traces, diagnosis.traces, check_exact=True)
    write_report(diagnosis, tmp_path / "a.html")
    write_report(again, tmp_path / "b.html")
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_the_same_seed_gives_the_same_diagnosis(
    folder: Path, diagnosis: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    again = diagnose(load_study("study.toml"), small.EFFECTS, seed=3, threads=2)
    changing = ("outcome", "provenance")
    for name, part in again.content().items():
        if name not in changing:
            assert json.dumps(part, default=str) == json.dumps(diagnosis.content()[name], default=str), name


@pytest.mark.slow
def test_the_augmented_study_simulates_and_identifies(folder: Path, diagnosis: Diagnosis) -> None:
    path = folder / "study-diagnosis" / "augmented.toml"
    study = load_study(path)
    values = {p.name: p.value for p in study.parameters}
    assert values["rudder_offset_angle"] == pytest.approx(OFFSET, rel=0.05)
    assert values["rudder_offset_angle"] == diagnosis.augmented["parameters"]["rudder_offset_angle"]
    assert values["K"] == 0.1  # as the study states it: only the effect is added
    free = {p.name: p.prior for p in study.parameters if p.vary}
    assert set(free) == {"K", "T", "rudder_offset_angle"}
    assert free["rudder_offset_angle"] is not None
    shown = call(folder, "simulate", str(path), "--json", "simulated.json")
    assert shown.returncode == 0, shown.stderr
    rows = json.loads((folder / "simulated.json").read_text())["result"]["fit"]
    plain = call(folder, "simulate", "study.toml", "--json", "plain.json")
    before = json.loads((folder / "plain.json").read_text())["result"]["fit"]
    assert plain.returncode == 0
    assert sum(row["rmse"] for row in rows) < 0.3 * sum(row["rmse"] for row in before)
    found = call(folder, "identify", str(path), "--quiet", "--out", "identified", "--threads", "1")
    assert found.returncode == 0, found.stderr
    assert "rudder_offset_angle" in found.stdout


@pytest.mark.slow
def test_a_user_s_own_effect_in_one_file_takes_part(folder: Path) -> None:
    """Beside a user's own model; the augmented study names the file where it lies."""
    (folder / "fade.py").write_text(small.FADE)
    runs = small.trials(folder, {"fade_k": 0.25}, specs=["fade.py:Fade"])
    place = folder / "faded"
    place.mkdir()
    small.files(small.folder_with_model(place), runs)
    (place / "fade.py").write_text(small.FADE)
    shown = call(
        place, "diagnose", "study.toml", "--effects", f"{EFFECTS},fade.py:Fade", "--no-validation", "--threads", "1"
    )
    assert shown.returncode == 0, shown.stderr
    found = Diagnosis.load(place / "study-diagnosis")
    assert found.named == ("fade",), str(found)
    assert found.validation is not None, "the decision predicts trials left out, whether that is asked for or not"
    assert "fade.py:Fade" in (place / "study-diagnosis" / "augmented.toml").read_text()
    assert call(place, "simulate", "study-diagnosis/augmented.toml").returncode == 0


@pytest.mark.slow
def test_an_installed_effect_takes_part_without_being_named(tmp_path: Path) -> None:
    """As docs/effects.md shows: one file and one entry-point line."""
    install("docs/effects.md", tmp_path)
    (tmp_path / "askew_log.py").unlink()
    code = "from seatruth.diagnosis.preconditions import usable_effects as f; from seatruth import load_study as l;"
    small.files(small.folder_with_model(tmp_path), small.trials(small.folder_with_model(tmp_path)))
    script = f"{code} found, left = f(l('study.toml'), None); print([e.name for e in found], left['askew_log'])"
    path = os.pathsep.join([str(tmp_path / "site"), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path}
    shown = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=100
    )
    assert shown.returncode == 0, shown.stderr
    assert "the model has no output 'u'" in shown.stdout
    assert "rudder_offset" in shown.stdout


def test_effects_on_one_actuator_alone_can_be_named() -> None:
    """`check --effects` listed them, and `diagnose --effects` did not know them."""
    twin = load_model("twin_thruster")

    def chosen(*wanted: str) -> list[str]:
        return [effect.name for effect in select_effects([*wanted], Path(), twin)[0] or []]

    assert chosen("thruster_gain_port", "current") == ["thruster_gain_port", "current"]
    assert chosen("thruster_gain_*") == ["thruster_gain_port", "thruster_gain_starboard"]
    assert "thruster_gain_port" not in chosen("thruster_*"), "a pattern means all actuators of a kind"
    with pytest.raises(BadInput, match="'thruster_gain_left'") as caught:
        chosen("thruster_gain_left")
    assert "thruster_gain" in caught.value.do


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nowhere.toml"], "no such study file"),
        (["study.toml", "--effects", "curent"], "there is no effect 'curent'"),
        (["study.toml", "--effects", "none.py:None"], "there is no effect file"),
        (["study.toml", "--effects", "ship.py:Nomoto"], "it is no Effect"),
        (["study.toml", "--effects", "current_shear"], "no effect can act on this model"),
        (["study.toml", "--out", "ship.py"], "a file stands where"),
    ],
)
def test_bad_input_is_said_in_one_message(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str], says: str
) -> None:
    monkeypatch.chdir(folder)
    assert run(["diagnose", *arguments, "--quiet"]) == 2
    shown = capsys.readouterr().err
    assert says in shown
    assert "Traceback" not in shown


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX")
def test_an_interrupt_gives_what_there_is(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while effects are fitted one by one: a verdict from what was reached, saved and reported, code 130.

    The same command goes on from there.
    """
    from seatruth.diagnosis import search
    from seatruth.diagnosis.hypothesis_fits import fit_both

    plain, calls = fit_both, []

    def once(*arguments: Any) -> Any:
        calls.append(arguments[1])
        if len(calls) == 3:
            signal.raise_signal(signal.SIGINT)
        return plain(*arguments)

    monkeypatch.setattr(search, "fit_both", once)
    monkeypatch.chdir(folder)
    assert run(["diagnose", "study.toml", "--effects", EFFECTS, "--quiet", "--out", "cut"]) == 130
    found = Diagnosis.load(folder / "cut")
    assert found.outcome["code"] == "interrupted"
    assert found.named == ("rudder_offset",)
    assert found.validation is not None
    assert found.next_trial is None
    assert "not complete" in (folder / "cut" / "report.html").read_text()
    assert run(["diagnose", "study.toml", "--effects", EFFECTS, "--quiet", "--out", "cut"]) == 0
    found = Diagnosis.load(folder / "cut")
    assert found.outcome["resumed"] > 0
    assert found.named == ("rudder_offset",)


def test_an_interrupt_before_anything_is_known_ends_in_one_message(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*given: Any, **options: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules["seatruth.diagnosis.pipeline"], "search", stopped)
    monkeypatch.chdir(folder)
    assert run(["diagnose", "study.toml", "--effects", EFFECTS, "--quiet", "--out", "early"]) == 130
    shown = capsys.readouterr().err
    assert "interrupted" in shown
    assert "Traceback" not in shown
    assert not (folder / "early" / NAME).exists()


def test_the_report_answers_the_three_questions_and_stands_alone(folder: Path, diagnosis: Diagnosis) -> None:
    page = (folder / "study-diagnosis" / "report.html").read_text()
    for words in ("Where?", "Which?", "How far?", "What next?", "rudder zero offset", "SYNTHETIC", "actuator of delta"):
        assert words in page, words
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert page.count("<script") == 1, "its own"
    ids = {part.split('"')[0] for part in page.split('<section id="')[1:]}
    links = {part.split('"')[0] for part in page.split('href="#')[1:]}
    assert {link for link in links if not link.startswith("f")} <= ids
    assert {"summary", "where", "which", "discrepancy", "noise", "coefficients", "validation", "next-trial"} <= ids
    assert str(folder) not in page


@pytest.mark.slow
def test_the_document_as_it_stands(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    (folder / "my_study.toml").write_text((folder / "study.toml").read_text())
    found = execute("docs/diagnosis.md")
    assert found["again"].named == found["diagnosis"].named == ("rudder_offset",)
    assert (folder / "my-diagnosis" / "report.html").exists()
    assert (folder / "my_study-diagnosis" / "augmented.toml").exists()


def test_the_report_tells_one_story(folder: Path, diagnosis: Diagnosis) -> None:
    place = folder / "study-diagnosis"
    one_story.check((place / "report.html").read_text(), diagnosis, (place / "augmented.toml").read_text())


def test_traces_hold_what_the_gap_says(diagnosis: Diagnosis) -> None:
    for _, row in diagnosis.gap.iterrows():
        part = diagnosis.traces
        part = part[(part["trial"] == row["trial"]) & (part["channel"] == row["channel"])]
        for fit in ("before", "refit", "effects"):
            rmse = float(np.sqrt(np.mean((part["measured"] - part[fit]) ** 2)))
            assert rmse == pytest.approx(row[f"rmse_{fit}"], rel=1e-9)
