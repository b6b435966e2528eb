"""The command line: exit codes, one message for whatever goes wrong, JSON, and output that reads well when piped."""

from __future__ import annotations

import errno
import importlib
import inspect
import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seatruth
from seatruth import cli
from seatruth.commands import common, init, list_installed
from seatruth.errors import BadInput, SeatruthWarning
from seatruth.storage.atomic import DiskFull, write_file
from seatruth.study import parse

SHIP = """
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.trials import Channel


class Nomoto(Model):
    name = "nomoto"
    title = "Nomoto first-order yaw"
    kind = "ship"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    parameters = (
        Parameter("K", 0.1, "1/s", min=0.0, max=1.0, vary=True, description="rudder gain"),
        Parameter("T", 10.0, "s", min=1.0, max=100.0, vary=True),
    )

    @staticmethod
    def rhs(s, i, p):
        return (p.K * i.delta - s.r) / p.T, s.r
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a user's model and a log of it, as the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "ship.py").write_text(SHIP)
    (tmp_path / "zigzag.csv").write_text(log())
    return tmp_path


def log() -> str:
    """A zigzag of the model above with K = 0.12, T = 8 and a little noise, as a logger writes it."""
    rng = np.random.default_rng(1)
    r, psi, step = 0.0, 0.0, 0.2
    lines = ["Time(s),rudder_deg,yaw rate [deg/s],Heading"]
    for k in range(400):
        delta = np.deg2rad(10.0 if (k // 80) % 2 == 0 else -10.0)
        noise = rng.normal(size=2)
        lines.append(
            f"{k * step:.1f},{np.rad2deg(delta):.2f},{np.rad2deg(r + 2e-4 * noise[0]):.5f},"
            f"{np.rad2deg(psi + 1e-3 * noise[1]):.4f}"
        )
        exact = np.exp(-step / 8.0)
        psi += 0.12 * delta * step + (r - 0.12 * delta) * 8.0 * (1 - exact)
        r = 0.12 * delta + (r - 0.12 * delta) * exact
    return "\n".join(lines) + "\n"


def call(*arguments: str | Path) -> int:
    return cli.run([str(argument) for argument in arguments])


def answered(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text())
    assert set(content) == {"seatruth", "command", "ok", "exit_code", "result", "error"}
    assert content["ok"] == (content["exit_code"] == 0)
    if content["error"] is not None:
        assert set(content["error"]) == {"kind", "message", "what", "where", "do", "code"}
    return content


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


def test_list_optimizers_in_the_terminal_and_as_json(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("list", "optimizers", "--long", "--json", "out.json") == 0
    shown = capsys.readouterr().out
    assert "least_squares" in shown
    assert "\x1b" not in shown
    assert max(len(line.rstrip()) for line in shown.splitlines()) <= 80
    found = {entry["name"]: entry for entry in answered(folder / "out.json")["result"]["optimizers"]}
    assert found["ls_svm"]["needs"] == ["regression"]
    assert found["cma_es"]["options"]


def test_list_costs_says_what_the_study_file_takes(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("list", "costs", "--long") == 0
    shown = capsys.readouterr().out
    assert "max_step" in shown
    assert "`" not in shown


@pytest.mark.parametrize("kind", ["models", "effects"])
def test_a_long_list_explains_the_tags_of_its_sources(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("list", kind, "--long") == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "source: [L]" in shown
    assert "[L] other literature; [S] chosen here" in shown
    assert call("list", kind) == 0
    assert "Tags:" not in capsys.readouterr().out


def test_a_model_plugin_that_cannot_be_loaded_is_listed_with_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    from seatruth import models

    monkeypatch.setattr(models, "broken", lambda: {"a_broken_one": "no module named 'x'"})
    found = {entry["name"]: entry for entry in list_installed.list_installed(list_installed.Kind.models).data["models"]}
    assert "no module named" in found["a_broken_one"]["error"]
    assert "delta" in found["mmg"]["inputs"]


def test_an_optimizer_added_as_one_file_is_listed(tmp_path: Path) -> None:
    """A package of one module with an entry point, as `pip install` leaves it."""
    (tmp_path / "random_search.py").write_text(
        "from dataclasses import dataclass\n"
        "from seatruth.optimizers import Optimizer, option\n\n"
        "@dataclass(frozen=True)\n"
        "class RandomSearch(Optimizer):\n"
        "    name = 'random_search'\n"
        "    title = 'Uniform random search'\n"
        "    batch: int = option(50, 'candidates a call', low=1)\n\n"
        "    def run(self, problem, rng):\n"
        "        while True:\n"
        "            problem.values(problem.sample(rng, self.batch))\n"
    )
    info = tmp_path / "random_search-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: random-search\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[seatruth.optimizers]\nrandom_search = random_search:RandomSearch\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from seatruth.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "list", "optimizers", "--long"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert "random_search" in done.stdout
    assert "Uniform random search" in done.stdout
    assert "candidates a call" in done.stdout


def test_init_guesses_a_study_that_parses(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("init", "zigzag.csv", "--model", "ship.py:Nomoto", "--json", "out.json") == 0
    text = (folder / "zigzag.toml").read_text()
    file, _ = parse(text)
    assert file.model is not None
    assert (file.model.use, file.model.vary) == ("ship.py:Nomoto", ["K", "T"])
    assert file.time.column == "Time"
    assert {name: (table.column, table.unit) for name, table in file.channels.items()} == {
        "delta": ("rudder_deg", "deg"),
        "r": ("yaw rate", "deg/s"),
        "psi": ("Heading", "deg"),
    }
    assert answered(folder / "out.json")["result"]["to_do"] == []
    assert "seatruth check" in capsys.readouterr().out


def test_init_never_overwrites_unless_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "zigzag.toml").write_text("precious")
    assert call("init", "zigzag.csv", "--model", "ship.py:Nomoto") == 2
    assert "--force" in capsys.readouterr().err
    assert (folder / "zigzag.toml").read_text() == "precious"
    assert call("init", "zigzag.csv", "-o", "zigzag.csv", "--force", "--model", "ship.py:Nomoto") == 2
    assert (folder / "zigzag.csv").read_text() == log()
    assert call("init", "zigzag.csv", "--model", "ship.py:Nomoto", "--force") == 0
    assert (folder / "zigzag.toml").read_text() != "precious"


def test_init_says_what_it_could_not_guess(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "odd.csv").write_text('a "b" [x],c,helm\n0,1,2\n1,2,3\n')
    (folder / "sub").mkdir()
    assert call("init", "odd.csv", "-o", "sub/odd.toml", "--model", "ship.py:Nomoto") == 0
    file, _ = parse((folder / "sub" / "odd.toml").read_text())
    assert file.trials[0].file == "../odd.csv"
    assert file.model is not None
    assert file.model.use == "../ship.py:Nomoto"
    shown = " ".join(capsys.readouterr().out.split())
    assert "No time column" in shown
    assert "No column was recognised for any output" in shown


def test_init_for_an_installed_model_states_rpm_as_rpm(folder: Path) -> None:
    header = "t,x,y,psi,u,v,r,rudder,rpm"
    rows = "\n".join(f"{k},{k},0,0.1,1.0,0,0,{10 if k % 4 else -10},{600 + k}" for k in range(20))
    (folder / "run.csv").write_text(f"{header}\n{rows}\n")
    assert call("init", "run.csv") == 0
    data = tomllib.loads((folder / "run.toml").read_text())
    assert data["model"] == {"use": "mmg", "set": "KVLCC2", "vary": ["Y_v", "Y_r", "N_v", "N_r"]}
    assert data["channels"]["n"] == {"column": "rpm", "unit": "rpm"}
    assert data["channels"]["delta"]["unit"] == "deg"


def test_init_writes_an_unwrap_for_a_heading_that_wraps(folder: Path) -> None:
    rows = "\n".join(f"{k},{10 if k % 4 else -10},{(350 + 3 * k) % 360}" for k in range(20))
    (folder / "turn.csv").write_text(f"t,rudder,heading\n{rows}\n")
    assert call("init", "turn.csv", "--model", "ship.py:Nomoto") == 0
    data = tomllib.loads((folder / "turn.toml").read_text())
    assert data["prepare"] == [{"step": "unwrap", "channels": ["psi"]}]
    assert data["trials"][0]["without"] == ["r"]


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
        (RuntimeError("boom"), 1, ["unexpected RuntimeError", "boom", "report it", common.DEBUG]),
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


def test_the_traceback_is_there_for_those_who_ask(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(common.DEBUG, "1")
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


@pytest.mark.skipif(os.name == "nt", reason="there is no lock there")
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
