"""The command line from a log to a report, as a user runs it."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from seatruth import Diagnosis, load_study, sample
from seatruth.cli import run
from seatruth.commands import demo, diagnose
from seatruth.effects import load_effects
from seatruth.estimate import Estimate
from seatruth.workers import Answer, Workers

SHORT = """
[study]
name = "short"
synthetic = true
seed = 4

[model]
use = "mmg"
vary = ["R_0", "Y_v", "N_v", "N_r"]

[channels]
delta = { unit = "deg" }
psi = { unit = "deg" }
r = { unit = "deg/s" }

[[trials]]
file = "zigzag_20_20.csv"

[[prepare]]
step = "unwrap"
channels = ["psi"]

[optimizer]
use = "differential_swarm"

[budget]
evaluations = 12000
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    sample.copy_to(tmp_path)
    (tmp_path / "short.toml").write_text(SHORT)
    return tmp_path


def answer(path: Path) -> dict[str, Any]:
    found = json.loads(path.read_text())
    assert isinstance(found, dict)
    return found


@pytest.mark.slow
def test_demo(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The whole demo; in the diagnosis fewer effects take part, which is quicker."""
    few = load_effects(["current", "wind", "heading_bias"])
    monkeypatch.setattr(diagnose, "select_effects", lambda *given: (few, {}))
    out = tmp_path / "demo"
    assert run(["demo", "--out", str(out), "--threads", "2", "--quiet", "--json", str(tmp_path / "demo.json")]) == 0
    shown = capsys.readouterr().out
    assert "SYNTHETIC" in shown
    assert "current_north" in shown
    assert "<svg" in (out / "report.html").read_text()
    found = Estimate.load(out)
    assert found.outcome["code"] == "converged"
    diagnosed = Diagnosis.load(out / "diagnosis")
    assert diagnosed.named == ("current",)
    assert load_study(out / "diagnosis" / "augmented.toml").model.name == "mmg"
    assert "<svg" in (out / "diagnosis" / "report.html").read_text()
    data = answer(tmp_path / "demo.json")
    assert data["ok"] is True
    causes = data["result"]["diagnosis"]["verdict"]["causes"]
    assert [cause["effects"] for cause in causes] == [["current"]]
    names = [row["name"] for row in data["result"]["parameters"]]
    assert names == list(found.parameters.index)


@pytest.mark.parametrize("threads", [1, 2])
def test_the_demo_identifies_here_where_no_process_can(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """On one core, or where its process ends without an answer."""
    called: list[tuple[str, ...]] = []

    def identified(*given: str) -> str:
        called.append(given)
        return "found"

    monkeypatch.setattr(demo, "_identified", identified)
    monkeypatch.setattr(Workers, "call", lambda *given: Answer(None, "it ended its process", 0.0, 0.0))
    with demo._identification(Path("sample"), Path("out"), threads) as found:
        assert found() == "found"
    assert called == [("sample", "out")]


@pytest.mark.essential
def test_from_a_log_to_parameters(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """init guesses a study from the log's columns; check and identify run on it as it stands."""
    log, study = folder / "zigzag_20_20.csv", folder / "mine.toml"
    assert run(["init", str(log), "-o", str(study)]) == 0
    assert run(["check", str(study), "--json", str(folder / "check.json")]) == 0
    check = answer(folder / "check.json")
    assert check["result"]["errors"] == 0
    assert {row["verdict"] for row in check["result"]["preview"]} & {"identified", "weak"}
    assert run(["simulate", str(study)]) == 0
    assert run(["identify", str(study), "--threads", "2", "--quiet", "--out", str(folder / "out")]) == 0
    found = Estimate.load(folder / "out")
    assert found.outcome["code"] in ("converged", "budget")
    assert found.fit["rmse"].lt(found.fit["rmse_start"]).mean() > 0.5
    assert "report.html" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX")
def test_ctrl_c_loses_nothing(folder: Path) -> None:
    """Killed by Ctrl-C in the middle, the same command goes on and ends where an uninterrupted run ends."""
    environment = {**os.environ, "SEATRUTH_THREADS": "1"}

    def command(out: str) -> list[str]:
        return [sys.executable, "-m", "seatruth", "identify", "short.toml", "--out", out]

    def start(out: str) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        return subprocess.Popen(command(out), cwd=folder, env=environment, stdout=pipe, stderr=pipe, text=True)

    whole = start("whole")
    cut = start("cut")
    deadline = time.monotonic() + 60
    journals = folder / "cut"
    while cut.poll() is None and time.monotonic() < deadline:
        if sum(path.stat().st_size for path in journals.glob("*") if path.is_file()) > 40_000:
            cut.send_signal(signal.SIGINT)
            break
        time.sleep(0.01)
    out, err = cut.communicate(timeout=60)
    assert cut.returncode == 130, err
    assert "Interrupted" in out
    assert "Traceback" not in err
    first = Estimate.load(journals)
    assert first.outcome["code"] == "interrupted"
    again = subprocess.run(
        command("cut"), cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert again.returncode == 0, again.stderr
    assert "Going on" in again.stderr
    whole.communicate(timeout=120)
    assert whole.returncode == 0
    one, two = Estimate.load(folder / "whole"), Estimate.load(folder / "cut")
    pd.testing.assert_frame_equal(one.parameters, two.parameters, check_exact=True)
    assert one.outcome["evaluations"] == two.outcome["evaluations"]
    assert first.outcome["evaluations"] < two.outcome["evaluations"]
    assert list(one.history["best"]) == list(two.history["best"])
    assert not list((folder / "cut").glob("*checkpoint*"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('use = "mmg"', 'use = "mmgg"'), "mmg"),
        (("zigzag_20_20.csv", "zigzag_20_21.csv"), "zigzag_20_21.csv"),
        (('"N_r"]', '"N_rr"]'), "N_rr"),
        (('use = "differential_swarm"', 'use = "differential_swam"'), "differential_swarm"),
        (("evaluations = 12000", "evaluatons = 12000"), "evaluations"),
        (('unit = "deg/s"', 'unit = "deg/parsec2x"'), "deg/parsec2x"),
        (("[study]", "[study"), "TOML"),
        (("[optimizer]", "[parameters.Y_v]\nmin = 0.5\nmax = 1.0\n\n[optimizer]"), "outside its bounds"),
    ],
)
def test_a_wrong_study_ends_in_one_message(
    folder: Path, capsys: pytest.CaptureFixture[str], change: tuple[str, str], words: str
) -> None:
    study = folder / "wrong.toml"
    study.write_text(SHORT.replace(*change))
    for command in ("check", "identify", "simulate"):
        assert run([command, str(study), "--json", str(folder / "wrong.json")]) == 2
        shown = capsys.readouterr().err
        assert words in shown
        assert "Traceback" not in shown
        data = answer(folder / "wrong.json")
        assert (data["ok"], data["exit_code"]) == (False, 2)


def test_a_model_that_diverges_everywhere(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "mine.py").write_text(
        """
from seatruth.models import Model
from seatruth.models.mmg import MMGShip

class Wild(MMGShip):
    name = "wild"

    @staticmethod
    def rhs(s, i, p, e):
        return (1e3 + s.u * s.u + p.Y_v * p.Y_v) * 1e9, s.v, s.r, s.u, s.v, s.r
"""
    )
    study = folder / "wild.toml"
    study.write_text(SHORT.replace('"mmg"', '"mine.py:Wild"').replace("12000", "200"))
    assert run(["identify", str(study), "--quiet", "--json", str(folder / "wild.json")]) == 1
    shown = capsys.readouterr()
    assert "diverged" in shown.out
    assert "Traceback" not in shown.err
    assert answer(folder / "wild.json")["ok"] is False
    found = Estimate.load(folder / "wild-result")
    assert math.isinf(found.outcome["value"])
    assert run(["check", str(study)]) in (1, 2)
    assert "diverges" in "".join(capsys.readouterr())


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["list", "models", "--json", "/dev/full"]) == 1
    assert "no space left" in capsys.readouterr().err.lower()


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="limits of processes are POSIX")
def test_a_disk_that_fills_up_costs_no_answer(folder: Path) -> None:
    """What was found is shown, one message says why it is not saved, and the same command makes it again."""
    import resource

    study = folder / "local.toml"
    study.write_text(SHORT.replace("differential_swarm", "least_squares"))
    command = [sys.executable, "-m", "seatruth", "identify", "local.toml", "--threads", "1"]
    plan: dict[str, Any] = {"cwd": folder, "capture_output": True, "text": True, "timeout": 120, "check": False}
    # What measures the coverage of processes cannot write either, and says so among what seatruth says.
    plan["env"] = {name: value for name, value in os.environ.items() if name != "COVERAGE_PROCESS_CONFIG"}
    small = (4096, 4096)
    done = subprocess.run(command, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, small), **plan)
    assert done.returncode == 1
    assert "N_r" in done.stdout
    assert "no space left" in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in (folder / "local-result").iterdir()] == ["checkpoint.journal"]
    assert subprocess.run(command, **plan).returncode == 0
    assert Estimate.load(folder / "local-result").outcome["code"] == "converged"


def test_a_folder_that_cannot_be_written_is_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "file").write_text("")
    code = run(["identify", str(folder / "short.toml"), "--quiet", "--out", str(folder / "file" / "below")])
    assert code == 2
    shown = capsys.readouterr().err
    assert "Traceback" not in shown
    assert "file" in shown


def test_a_file_where_the_folder_should_be_and_a_checkpoint_of_another_study(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "taken").write_text("mine")
    command = ["identify", str(folder / "short.toml"), "--quiet", "--out"]
    assert run([*command, str(folder / "taken")]) == 2
    assert "--out" in capsys.readouterr().err
    assert (folder / "taken").read_text() == "mine"
    old = folder / "old" / "checkpoint.journal"
    old.parent.mkdir()
    old.write_text('{"format": "something else"}\n')
    assert run([*command, str(old.parent)]) == 2
    assert "--fresh" in capsys.readouterr().err
    assert old.read_text() == '{"format": "something else"}\n'
