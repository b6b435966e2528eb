"""The command line: exit codes, one message for whatever goes wrong, JSON, and output that reads well when piped."""

from __future__ import annotations

import errno
import importlib
import inspect
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nomoto_ship import answered, call, write_ship

import seatruth
from seatruth import cli
from seatruth.commands import common, init
from seatruth.commands.identify import more_findings
from seatruth.errors import DEBUG, BadInput, SeatruthWarning
from seatruth.models.user_file import load_object
from seatruth.storage.atomic import DiskFull, write_file
from seatruth.trials.finding import Finding


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a user's model and a log of it, as the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    write_ship(tmp_path)
    return tmp_path


def test_the_answer_that_the_document_shows_is_what_is_written(tmp_path: Path) -> None:
    document = (Path(__file__).parents[1] / "docs" / "command-line.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"^```json\n(.*?)^```$", document, re.MULTILINE | re.DOTALL)
    assert call("list", "readers", "--json", tmp_path / "out.json") == 0
    written = answered(tmp_path / "out.json")
    assert list(json.loads(shown)) == list(written)
    assert json.loads(shown) == written | {"command": "identify", "result": {}}


def test_version_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("--version") == 0
    assert capsys.readouterr().out.startswith("seatruth ")
    assert call("--help") == call() == 0
    for command in ("identify", "diagnose", "init", "check", "simulate", "list", "demo"):
        assert call(command, "--help") == 0


@pytest.mark.parametrize(
    "arguments",
    [["lst"], ["list", "model"], ["list"], ["identify"], ["identify", "a", "b"], ["init", "x", "--sed", "1"]],
)
def test_usage_errors_are_bad_input(arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "answer.json"
    assert call(*arguments, "--json", file) == 2
    shown = capsys.readouterr()
    assert shown.err.startswith("seatruth: ")
    assert "--help" in shown.err
    assert "Traceback" not in shown.err
    assert answered(file)["error"]["kind"] == "Usage"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["init", "zigzg.csv"], ["zigzag.csv"]),
        (["init", "zigzag.csv", "--model", "ship.py:Nomotto"], ["Did you mean 'Nomoto'"]),
        (["init", "zigzag.csv", "--model", "mgm"], ["no model 'mgm'"]),
        (["check", "nothing.toml"], ["no such study file"]),
        (["identify", "nothing.toml"], ["no such study file"]),
    ],
)
def test_bad_input_exits_2_with_the_nearest_name(
    folder: Path, arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(*arguments, "--json", "out.json") == 2
    message = " ".join(capsys.readouterr().err.split())
    error = answered(folder / "out.json")["error"]
    for word in words:
        assert word in message
        assert word in error["message"]


def raising(problem: BaseException) -> Any:
    def read(*_: object, **__: object) -> None:
        raise problem

    return read


@pytest.mark.parametrize(
    ("problem", "code", "words"),
    [
        (RuntimeError("boom"), 1, ["unexpected RuntimeError", "boom", "report it", DEBUG]),
        (OSError(errno.ENOSPC, "No space left on device"), 1, ["no space left on the disk"]),
        (PermissionError(errno.EACCES, "Permission denied", "x"), 1, ["Permission denied"]),
        (KeyboardInterrupt(), 130, ["nterrupted"]),
        (MemoryError(), 1, ["memory"]),
    ],
)
def test_whatever_happens_ends_in_one_message(
    folder: Path,
    problem: BaseException,
    code: int,
    words: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(init, "read_log", raising(problem))
    assert call("init", "zigzag.csv", "--json", "out.json") == code
    message = " ".join(capsys.readouterr().err.split())
    assert "Traceback" not in message
    for word in words:
        assert word in message
    assert answered(folder / "out.json")["exit_code"] == code


def test_what_the_code_of_a_user_raises_is_no_fault_in_seatruth(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("def size(p):\n    return p.length * math.pi\n")
    size = load_object("own.py:size", tmp_path)
    with pytest.raises(AttributeError) as raised:
        size(None)
    code, error = common.explain(raised.value)
    assert (code, error["where"]) == (1, "own.py, line 2")
    assert "AttributeError" in error["what"]
    assert error["do"] == "Correct the model file."


def test_check_is_named_for_findings_that_it_lists_alone() -> None:
    search, data = Finding("warning", "runs-stray", "", "search"), Finding("warning", "held", "", "a.csv")
    assert more_findings([search]) == "and 1 more finding: see the report."
    assert "those of the data `seatruth check` lists" in more_findings([search, data])


def test_the_traceback_is_there_for_those_who_ask(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(DEBUG, "1")
    monkeypatch.setattr(init, "read_log", raising(RuntimeError("boom")))
    assert call("init", "zigzag.csv") == 1
    assert "Traceback" in capsys.readouterr().err


def test_a_full_disk_leaves_what_was_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = folder / "kept.toml"
    target.write_text("before")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(DiskFull, match="no space"):
        write_file(target, "after")
    assert target.read_text() == "before"
    assert [path.name for path in folder.iterdir() if path.name.startswith(".")] == []


def test_numbers_that_json_lacks_become_null() -> None:
    import pandas as pd

    frame = pd.DataFrame({"a": [1.0, float("nan")]}, index=pd.Index(["x", "y"], name="name"))
    assert common.plain({"frame": frame, "inf": float("inf"), "array": np.arange(2), "path": Path("a")}) == {
        "frame": [{"name": "x", "a": 1.0}, {"name": "y", "a": None}],
        "inf": None,
        "array": [0, 1],
        "path": "a",
    }


def test_a_closed_pipe_is_no_error() -> None:
    command = f"{sys.executable} -m seatruth.cli list optimizers --long | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert done.stderr == ""


def test_a_table_in_a_pipe_has_whole_rows(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """A terminal folds what does not fit, and cuts names that stay in one piece."""
    name, words = "rudder_rate_limit_slowness_of_the_port_pod", "0.068923 to 0.069745 beside " * 5
    built = common.table(["parameter", "interval"], [[name, words]], whole=["parameter", "interval"])
    monkeypatch.delenv("COLUMNS", raising=False)
    common.console().print(built)
    common.say("word " * 40)
    out = capsys.readouterr().out.splitlines()
    assert out[1].startswith(f"{name}  {words.strip()}")
    assert max(map(len, out[2:])) <= 80
    monkeypatch.setenv("COLUMNS", "60")
    common.console().print(built)
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 60


def test_an_interrupt_while_loading_is_one_line() -> None:
    code = (
        "import sys\n"
        "class Impatient:\n"
        "    def find_spec(self, name, *rest):\n"
        "        if name == 'seatruth.commands':\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Impatient())\n"
        "import seatruth.cli\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ended.returncode == 130
    assert ended.stderr.splitlines() == ["seatruth: interrupted. Run the same command again."]


@pytest.mark.parametrize("place", ["../elsewhere", "/elsewhere-of-a-study", "inside/../../x", "link/below", "linked"])
def test_a_study_writes_into_its_own_folder_unless_the_command_line_says_otherwise(folder: Path, place: str) -> None:
    source = folder / "study.toml"
    (folder / "link").symlink_to("/")
    (folder / "linked").mkdir()
    (folder / "linked" / "tables").symlink_to("/")
    with pytest.raises(BadInput, match=r"--out DIR"):
        common.result_folder(None, source.parent / place, source)
    assert common.result_folder(folder / place, folder / "own", source) == folder / place
    assert common.result_folder(None, folder / "own" / "below", source) == folder / "own" / "below"


def test_the_folder_of_a_study_is_checked_before_anything_is_made(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["init", "zigzag.csv", "--model", "ship.py:Nomoto", "-o", "inside/study.toml"]) == 0
    study = folder / "inside" / "study.toml"
    study.write_text(study.read_text() + '\n[output]\nfolder = "../outside"\n')
    capsys.readouterr()
    assert cli.run(["identify", str(study), "--quiet"]) == 2
    assert "lies outside of its own" in capsys.readouterr().err
    assert not (folder / "outside").exists()


def test_two_runs_do_not_write_into_one_folder(tmp_path: Path) -> None:
    with common.own_folder(tmp_path / "result"):
        second = common.own_folder(tmp_path / "result")
        with pytest.raises(BadInput, match="another run is writing into this folder"), second:
            pass
    assert list((tmp_path / "result").iterdir()) == []
    with common.own_folder(tmp_path / "result"):
        (tmp_path / "result" / "file").write_text("")
    with pytest.raises(BadInput, match="a file stands where"), common.own_folder(tmp_path / "result" / "file"):
        pass


def test_warnings_of_seatruth_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    cli._warned(SeatruthWarning("the \x1b[2Jstore is damaged"), SeatruthWarning, "store.py", 3)
    assert capsys.readouterr().err == "seatruth: the \\x1b[2Jstore is damaged\n"


def test_names_that_act_on_a_terminal_are_shown_as_codes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["identify", "\x1b[2Jstudy\udcff.toml"]) == 2
    shown = capsys.readouterr().err
    assert r"\x1b[2Jstudy\udcff.toml" in shown
    assert "\x1b" not in shown


def test_a_log_that_is_a_link_to_itself_is_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "loop.csv").symlink_to("loop.csv")
    assert cli.run(["init", "loop.csv"]) == 2
    assert "loop.csv" in capsys.readouterr().err


def test_the_list_of_commands_says_what_each_says_itself() -> None:
    for name, (module, text) in cli.COMMANDS.items():
        function = getattr(importlib.import_module(f"seatruth.commands.{module}"), module)
        assert inspect.getdoc(function).startswith(text), name


def test_help_loads_no_numerical_library_and_check_only_what_it_needs() -> None:
    heavy = {"numpy", "pandas", "scipy", "pydantic", "pint", "matplotlib", "sklearn", "llvmlite"}
    code = "import sys; from seatruth.cli import run; run(sys.argv[1:]); print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code, "--help"], capture_output=True, text=True, check=True)
    assert "diagnose" in done.stdout
    assert not heavy & set(done.stderr.split())
    study = Path(seatruth.__file__).parent / "sample" / "study.toml"
    done = subprocess.run([sys.executable, "-c", code, "check", str(study)], capture_output=True, text=True, check=True)
    assert not {"scipy.stats", "scipy.signal", "pint", "sklearn", "joblib", "matplotlib"} & set(done.stderr.split())
