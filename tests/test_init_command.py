"""`seatruth init`: it guesses a study from a log, says what it could not guess, and overwrites nothing."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from nomoto_ship import answered, call, log, write_ship

from seatruth.study import parse


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a user's model and a log of it, as the current folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    write_ship(tmp_path)
    return tmp_path


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


@pytest.mark.parametrize("name", ["", ".", "/"])
def test_init_refuses_a_path_without_a_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    empty = folder / "empty"
    empty.mkdir()
    monkeypatch.chdir(empty)
    assert call("init", name) == 2
    assert "Name a file." in capsys.readouterr().err
