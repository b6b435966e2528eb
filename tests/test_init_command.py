"""`seatruth init`: it guesses a study from a log, says what it could not guess, and overwrites nothing."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from nomoto_ship import answered, call, log, write_ship

from seatruth.study import load_study, parse


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


def test_init_frees_what_no_scale_or_drawing_says_of_ones_own_model(folder: Path) -> None:
    """Damping may have the unit of a mass: it is known by its name."""
    names = {"m": "kg", "I_zz": "kg m2", "N_rd": "kg m2", "Y_r": "kg", "N_rr": "kg m2", "X_uu": "kg/m", "beam": "m"}
    declared = ", ".join(f'Parameter({name!r}, 1.0, {unit!r}, 0.1, 9.0, source="own")' for name, unit in names.items())
    text = (folder / "ship.py").read_text().replace(", vary=True", "")
    head, _, rest = text.partition("    parameters = (")
    (folder / "own.py").write_text(f"{head}    parameters = ({declared}, {rest}")
    assert call("init", "zigzag.csv", "--model", "own.py:Nomoto", "--output", "own.toml") == 0
    file, _ = parse((folder / "own.toml").read_text())
    assert file.model is not None
    assert {*file.model.vary} == {"Y_r", "N_rr", "X_uu", "K", "T"}


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


def test_init_writes_it_too_where_another_log_may_wrap(folder: Path) -> None:
    rows = "\n".join(f"{k},{10 if k % 4 else -10},{100 + k}" for k in range(20))
    for name in ("one", "two"):
        (folder / f"{name}.csv").write_text(f"t,rudder,heading\n{rows}\n")
    assert call("init", "one.csv", "--model", "ship.py:Nomoto") == 0
    assert "prepare" not in tomllib.loads((folder / "one.toml").read_text())
    assert call("init", "one.csv", "two.csv", "--model", "ship.py:Nomoto", "-o", "both.toml") == 0
    prepare = tomllib.loads((folder / "both.toml").read_text())["prepare"]
    assert prepare == [{"step": "unwrap", "channels": ["psi"]}]


def test_init_unwraps_the_direction_of_a_pod_that_wraps_in_any_log(folder: Path) -> None:
    """Ahead it stays near zero; astern it runs on from 170 to 190 deg, which the log calls -170."""
    ship = (folder / "ship.py").read_text()
    pod = ship.replace('(Channel("delta", "rad"),)', '(Channel("az", "rad"),)').replace("i.delta", "i.az")
    (folder / "pod.py").write_text(pod)
    for name, first in (("ahead", 0), ("astern", 160)):
        rows = "\n".join(f"{k},{(first + 2 * k + 180) % 360 - 180},{100 + k}" for k in range(20))
        (folder / f"{name}.csv").write_text(f"t,az_deg,heading\n{rows}\n")
    assert call("init", "ahead.csv", "astern.csv", "lost.txt", "--model", "pod.py:Nomoto", "-o", "x.toml") == 2
    (folder / "lost.txt").write_bytes(b"\0")  # not to be read: what is wrong with it is for `check` to say
    assert call("init", "ahead.csv", "astern.csv", "lost.txt", "--model", "pod.py:Nomoto", "-o", "both.toml") == 0
    prepare = tomllib.loads((folder / "both.toml").read_text())["prepare"]
    assert prepare == [{"step": "unwrap", "channels": ["psi", "az"]}]
    assert call("init", "ahead.csv", "--model", "pod.py:Nomoto", "-o", "one.toml") == 0
    assert "prepare" not in tomllib.loads((folder / "one.toml").read_text())


@pytest.mark.parametrize("name", ["", ".", "/"])
def test_init_refuses_a_path_without_a_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    empty = folder / "empty"
    empty.mkdir()
    monkeypatch.chdir(empty)
    assert call("init", name) == 2
    assert "Name a file." in capsys.readouterr().err


def test_init_takes_several_logs_of_orders_and_depths(tmp_path: Path) -> None:
    t = np.arange(0.0, 20.0, 0.25)
    for name in ("a", "b"):
        pd.DataFrame(
            {"time_ms": 1000 * t, "fin_cmd_deg": 5 * np.sign(np.sin(t)), "thrust_N": 5.0 + 0 * t, "speed": 1.4 + 0 * t}
            | {"pitch_deg": np.sin(t), "depth": 20 - t}
        ).to_csv(tmp_path / f"{name}.csv", index=False)
    study = tmp_path / "both.toml"
    logs = [str(tmp_path / "a.csv"), str(tmp_path / "b.csv")]
    assert call("init", *logs, "--model", "diving_plane_driven", "-o", str(study)) == 0
    written = tomllib.loads(study.read_text())
    assert [trial["file"] for trial in written["trials"]] == ["a.csv", "b.csv"]
    assert written["study"]["name"] == tmp_path.name
    assert written["actuators"] == {"delta_s": "order"}
    assert written["cost"]["hold"] == "zoh"
    assert written["channels"]["z"]["column"] == "depth"
    assert written["time"] == {"column": "time_ms", "unit": "ms"}
    assert [len(trial) for trial in load_study(study).trials] == [len(t), len(t)]


def test_init_lists_logs_beside_which_there_are_others(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        (tmp_path / f"{name}.csv").write_text("t,rudder,n,r\n0,0,9,0\n1,0,9,0\n2,0,9,0\n")
    study = tmp_path / "two.toml"
    assert call("init", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "-o", str(study)) == 0
    assert [trial["file"] for trial in tomllib.loads(study.read_text())["trials"]] == ["a.csv", "b.csv"]


@pytest.mark.parametrize(
    ("names", "beside", "files"),
    [
        (["run_1", "run_12"], ["pool"], ["run_*.csv"]),
        (["zigzag_10", "zigzag_20"], ["zigzag_30"], ["zigzag_10.csv", "zigzag_20.csv"]),
        (["yo", "pitch_step"], [], ["pitch_step.csv", "yo.csv"]),
        ([f"{letter}_run" for letter in "abcdefghijklmnopqrstuvwxyz"], [], ["*.csv"]),
    ],
)
def test_init_writes_a_pattern_of_what_the_names_share(
    tmp_path: Path, names: list[str], beside: list[str], files: list[str]
) -> None:
    """A pattern of all files would make a trial of whatever comes to lie beside the logs."""
    for name in (*names, *beside):
        (tmp_path / f"{name}.csv").write_text("t,rudder,n,r\n0,0,9,0\n1,0,9,0\n2,0,9,0\n")
    study = tmp_path / "study.toml"
    assert call("init", *(str(tmp_path / f"{name}.csv") for name in sorted(names)), "-o", str(study)) == 0
    assert [trial["file"] for trial in tomllib.loads(study.read_text())["trials"]] == files


def ferry(folder: Path) -> Path:
    """A log with a rudder and a shaft on each side, as ordered and as measured."""
    t = np.arange(0.0, 60.0)
    rudder = 20.0 * np.sin(0.2 * t)
    pd.DataFrame(
        {"t [s]": t, "Gyro Heading [deg]": 10.0 * np.cos(0.2 * t), "Rudder Order [deg]": 20.0 * np.sign(rudder)}
        | {f"Rudder Feedback {side} [deg]": rudder + k for k, side in enumerate(("PS", "SB"))}
        | {f"Shaft Speed {side} [rpm]": 200.0 + 10 * k + 0 * t for k, side in enumerate(("PS", "SB"))}
        | {"SOG [m/s]": 6.0 + 0 * t}
    ).to_csv(folder / "ferry.csv", index=False)
    return folder / "ferry.csv"


def test_init_takes_what_acted_and_the_mean_of_both_sides(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study = tmp_path / "ferry.toml"
    assert call("init", str(ferry(tmp_path)), "-o", str(study)) == 0
    text = study.read_text()
    channels = tomllib.loads(text)["channels"]
    assert channels["delta"] == {"mean": ["Rudder Feedback PS", "Rudder Feedback SB"], "unit": "deg"}
    assert channels["n"] == {"mean": ["Shaft Speed PS", "Shaft Speed SB"], "unit": "rpm"}
    assert "actuators" not in tomllib.loads(text)
    assert "# Rudder Order: what delta was ordered to; the model takes what acted." in text
    said = " ".join(capsys.readouterr().out.split())
    assert "The model has one shaft and the log 2 (Shaft Speed PS, Shaft Speed SB)" in said
    trial = load_study(study).trials[0]
    assert trial.inputs["n"][0] == pytest.approx(205.0 / 60.0)
    assert trial.inputs["delta"][0] == pytest.approx(np.radians(0.5))


def test_init_says_which_model_it_took_and_where_it_wrote(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The study stands beside its log, to which its paths are relative; the ship is none that the user asked for."""
    (folder / "logs").mkdir()
    (folder / "zigzag.csv").rename(folder / "logs" / "zigzag.csv")
    assert call("init", "logs/zigzag.csv") == 0
    said = capsys.readouterr().out
    assert "No --model is named: the study takes mmg, Ship, MMG standard method" in said
    assert "Wrote logs/zigzag.toml, beside the log. Check its" in said
    assert call("init", "logs/zigzag.csv", "--model", "ship.py:Nomoto", "-o", "own.toml") == 0
    said = capsys.readouterr().out
    assert "--model" not in said
    assert "Wrote own.toml. Check its" in said


def test_init_names_a_log_that_does_not_exist(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.csv").write_text("t,r\n0,0\n1,0\n")
    assert call("init", str(tmp_path / "a.csv"), str(tmp_path / "lost.csv")) == 2
    assert "lost.csv" in " ".join(capsys.readouterr().err.split())


def test_init_names_the_outputs_that_it_did_not_find(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = "\n".join(f"{k},{10 if k % 4 else -10},{100 + k}" for k in range(20))
    (folder / "turn.csv").write_text(f"t,rudder,heading\n{rows}\n")
    assert call("init", "turn.csv", "--model", "ship.py:Nomoto") == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "No column was recognised for the output 'r'" in shown


def test_init_takes_no_ship_for_a_log_of_dives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = "\n".join(f"{k},{20 - k},{5 + k},{0.1 * k}" for k in range(20))
    (tmp_path / "dive.csv").write_text(f"t,pitch_deg,press_dbar,batt_in\n{rows}\n")
    assert call("init", str(tmp_path / "dive.csv")) == 0
    assert tomllib.loads((tmp_path / "dive.toml").read_text())["model"]["use"] == "glider"
    said = " ".join(capsys.readouterr().out.split())
    assert "the study takes glider, Underwater glider" in said
    assert "The log has a pitch, a depth and a ballast or a mass that is moved, and no rudder." in said
