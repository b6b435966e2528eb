"""`seatruth trials`: a log becomes the trials of a study, and whatever is wrong ends in one message."""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from documents import ROOT
from long_log import long_log

from seatruth import cli
from seatruth.commands import progress
from seatruth.errors import BadInput
from seatruth.manoeuvres import TurningCircle, run_manoeuvre
from seatruth.models import load_model
from seatruth.report.log_map import log_map
from seatruth.study import load_study
from seatruth.study.log import read_log
from seatruth.study.trial_tables import trial_tables, with_trials
from seatruth.trials.stretches import Stretch, by_events

sys.path.append(str(ROOT / "experiments"))

from log_formats import ulog_file

STUDY = """# My study: this comment stays.
[model]
use = "mmg"
vary = ["N_r"]

[channels]
delta = { column = "rudder" }
n = { column = "rpm" }
psi = { column = "heading" }

[[trials]]
file = "day.csv"   # the whole day

[trials.conditions]
sea = "calm"

# A run of another day: this comment stays too.
[[trials]]
name = "other"
file = "other.csv"
role = "holdout"

[[prepare]]
step = "unwrap"
"""


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A synthetic log of a day as a logger writes it, with the number of the run in a column, and a study of it."""
    folder = tmp_path_factory.mktemp("day")
    log, true = long_log()
    degrees = {name: np.degrees(log.channel(name)) for name in ("delta", "psi", "r")}
    run = np.zeros(len(log), dtype=int)
    for number, (_, start, end) in enumerate(true, 1):
        run[(log.t >= start) & (log.t <= end)] = number
    columns = {
        "t [s]": log.t,
        "rudder [deg]": degrees["delta"],
        "rpm [rpm]": 60 * log.inputs["n"],
        **{f"{name} [m]": log.outputs[name] for name in ("x", "y")},
        "heading [deg]": degrees["psi"] % 360,
        **{f"{name} [m/s]": log.outputs[name] for name in ("u", "v")},
        "r [deg/s]": degrees["r"],
        "run": run,
    }
    rows = [",".join(f"{value:.4f}" for value in row) for row in zip(*columns.values())]
    text = "\n".join(["# SYNTHETIC: made by a simulator", ",".join(columns), *rows]) + "\n"
    for name in ("day.csv", "other.csv"):
        (folder / name).write_text(text)
    return folder


@pytest.fixture
def study(day: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(day)
    monkeypatch.setenv("COLUMNS", "120")
    (day / "day.toml").write_text(STUDY)
    return day / "day.toml"


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    code = cli.run(["trials", *arguments])
    said = capsys.readouterr()
    return code, said.out, said.err


def test_a_log_prints_its_trials_as_toml(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "day.csv", "--json", "found.json")
    assert code == 0
    tables = tomllib.loads(out[out.index("[[trials]]") :])["trials"]
    found = json.loads(Path("found.json").read_text())["result"]["stretches"]
    assert [one["name"] for one in tables] == [one["name"] for one in found]
    kinds = [one["kind"] for one in found]
    assert (kinds.count("zigzag"), kinds.count("turning circle"), kinds.count("stop")) == (2, 2, 1)
    assert {one["file"] for one in tables} == {"day.csv"}


def test_what_a_log_lacks_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.arange(0.0, 60.0)
    pd.DataFrame({"t": t, "wheel": 0 * t, "rpm": 90 + 0 * t, "heading": 0 * t, "SOG": 0 * t}).to_csv(
        tmp_path / "log.csv", index=False
    )
    code, out, _ = run(capsys, str(tmp_path / "log.csv"))
    said = " ".join(out.split())
    assert code == 0
    assert "There is no rudder and no thrusters: turning circles and zigzags cannot be found. No column of" in said
    assert "There is no heading" not in said


def test_rudders_and_shafts_of_both_sides_are_found(
    study: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    log = pd.read_csv("day.csv", comment="#")
    for side in ("PS", "SB"):
        log[f"Rudder Feedback {side} [deg]"], log[f"Shaft Speed {side} [rpm]"] = log["rudder [deg]"], log["rpm [rpm]"]
    log.drop(columns=["rudder [deg]", "rpm [rpm]"]).to_csv(tmp_path / "twin.csv", index=False)
    _, whole, _ = run(capsys, "day.csv")
    _, twin, _ = run(capsys, str(tmp_path / "twin.csv"))
    assert [line for line in twin.splitlines() if line.startswith("[[trials]]")] == [
        line for line in whole.splitlines() if line.startswith("[[trials]]")
    ]


def test_a_log_without_a_study_has_the_time_that_init_gives_it(tmp_path: Path) -> None:
    t = np.arange(0.0, 40.0, 0.2)
    columns = {"TimeUS": 1e6 * (1212.0 + t), "ATT.Yaw": 10.0 + 0.0 * t, "GPS.Spd": 2.0 + 0.01 * np.sin(t)}
    pd.DataFrame(columns).to_csv(tmp_path / "log.csv", index=False)
    assert float(np.ptp(read_log(tmp_path / "log.csv").t)) == pytest.approx(39.8)


CAT = """
from seatruth import Channel, Model, Parameter
from seatruth.models import Thruster


class Cat(Model):
    name = "cat"
    title = "A catamaran under two speed controllers"
    states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("port", "UNIT"), Channel("starboard", "UNIT"))
    parameters = (Parameter("k_T", 1.0, "m/s2", 0.0, 9.0, vary=True, source="test"),)
    actuators = (
        Thruster("port", "port", at=(-1.0, -0.5, 0.0), towards=(1.0, 0.0, 0.0), full=REST + FULL),
        Thruster("starboard", "starboard", at=(-1.0, 0.5, 0.0), towards=(1.0, 0.0, 0.0), full=REST + FULL),
    )

    @staticmethod
    def rhs(s, i, p):
        port, starboard = (i.port - REST) / FULL, (i.starboard - REST) / FULL
        port, starboard = p.k_T * port * abs(port), p.k_T * starboard * abs(starboard)
        return port + starboard - 0.2 * s.u * abs(s.u), port - starboard - s.r, s.r
"""


@pytest.mark.parametrize(
    ("unit", "rest", "full", "stopped"),
    [("us", 1500.0, 400.0, "pulse from 1740 to 1500 us"), ("1", 0.0, 1.0, "command from 0.6 to 0,")],
)
def test_manoeuvres_under_pulses_are_those_under_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], unit: str, rest: float, full: float, stopped: str
) -> None:
    text = CAT.replace("UNIT", unit).replace("REST", str(rest)).replace("FULL", str(full))
    (tmp_path / "cat.py").write_text(text)
    boat, ahead = load_model("cat.py:Cat", tmp_path), rest + 0.6 * full
    plan = TurningCircle(-0.2, by="thrust")
    run = run_manoeuvre(boat, plan, first_state={"u": 1.9}, inputs={"port": ahead, "starboard": ahead})
    run = run.section(0, int(np.searchsorted(run.t, 60.0)), "circle")
    # Then straight ahead again, and the thrust taken off.
    t, dt = np.arange(0.0, 80.0, 0.5), 0.5
    orders, u = np.where(t < 40.0, ahead, rest), [1.9]
    for order in orders[:-1]:
        u.append(u[-1] + dt * (2.0 * ((order - rest) / full) ** 2 - 0.2 * u[-1] ** 2))
    circle = pd.DataFrame({"time": run.t, **run.inputs, "psi": run.outputs["psi"], "u": run.outputs["u"]})
    stop = pd.DataFrame({"time": t, "port": orders, "starboard": orders, "psi": 0.0 * t, "u": u})
    study = (
        '[model]\nuse = "cat.py:Cat"\nvary = ["k_T"]\n\n[time]\ncolumn = "time"\n\n[channels]\n'
        f'port = {{ column = "port", unit = "{unit}" }}\nstarboard = {{ column = "starboard", unit = "{unit}" }}\n\n'
        '[[trials]]\nfile = "circle.csv"\n'
    )
    (tmp_path / "s.toml").write_text(study)
    said = {}
    for name, table in (("circle", circle), ("stop", stop)):
        table.to_csv(tmp_path / f"{name}.csv", index=False)
        assert cli.run(["trials", str(tmp_path / f"{name}.csv"), "--study", str(tmp_path / "s.toml")]) == 0
        said[name] = " ".join(capsys.readouterr().out.split())
    assert "turning circle 20 % port: thrust difference -20.0 %" in said["circle"]
    assert stopped in said["stop"]


def test_manoeuvres_of_a_boat_that_thrusters_steer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The study's model knows its thrusters and their full power."""
    boat, ahead = load_model("twin_thruster"), {"n_port": 10.3, "n_starboard": 10.3}
    plan = TurningCircle(-0.2, by="thrust")
    run = run_manoeuvre(boat, plan, first_state={"u": 1.2}, inputs=ahead)
    columns = {"time": run.t, "left": run.inputs["n_port"], "right": run.inputs["n_starboard"], **run.outputs}
    pd.DataFrame(columns).to_csv(tmp_path / "log.csv", index=False)
    study = tmp_path / "study.toml"
    study.write_text(
        '[model]\nuse = "twin_thruster"\nvary = ["N_r"]\n\n[time]\ncolumn = "time"\n\n[channels]\n'
        'n_port = { column = "left", unit = "rev/s" }\nn_starboard = { column = "right", unit = "rev/s" }\n'
        '[[trials]]\nfile = "log.csv"\n'
    )
    assert cli.run(["trials", str(tmp_path / "log.csv"), "--study", str(study)]) == 0
    assert "# turning circle 20 % port: thrust difference -20.0 %" in capsys.readouterr().out


def test_the_progress_of_the_reading_is_shown(
    study: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress.ProgressLine, "_keep_alive", lambda *given: None)
    monkeypatch.setattr(progress, "_LOG_FIRST_S", 0.0)
    monkeypatch.setattr(progress, "_LOG_EVERY_S", 0.0)
    for split in ([], ["--by", "column", "--column", "run"]):
        code, _, said = run(capsys, "day.csv", *split)
        assert (code, "Reading day.csv: 100 of 100 percent" in said) == (0, True)


def test_what_is_picked_goes_into_the_study_and_nothing_else_changes(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = run(capsys, "day.csv", "--study", "day.toml", "--pick", "2,4", "--write")
    assert (code, "Wrote 2 trials" in out) == (0, True)
    text = study.read_text()
    for kept in ("# My study: this comment stays.", "# A run of another day: this comment stays too."):
        assert kept in text
    assert "the whole day" not in text
    loaded = load_study(study)
    assert [trial.name for trial in loaded.holdout] == ["other"]
    zigzag, circle = loaded.trials
    assert zigzag.name.startswith("zigzag_20")
    assert circle.name == "turning_circle_35_starboard"
    assert float(np.ptp(circle.outputs["psi"])) == pytest.approx(np.radians(500), abs=0.1)
    again = study.read_text()
    assert run(capsys, "day.csv", "--study", "day.toml", "--pick", "2,4", "--write")[0] == 0
    assert study.read_text() == again


def test_a_column_selects_rows(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("day.csv", "--by", "column", "--column", "run", "--pick", "2-3", "--study", "day.toml", "--write")
    assert run(capsys, *arguments)[0] == 0
    first, second = load_study(study).trials
    assert (first.name, second.name) == ("run_1", "run_2")
    log, true = long_log()
    assert (second.t[0], second.t[-1]) == pytest.approx(true[1][1:])
    assert second.lines is not None
    assert second.lines[0] == np.flatnonzero(log.t == true[1][1])[0] + 3  # after the comment and the header


@pytest.fixture
def topics(day: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The log as topics of an autopilot, each of which is sampled a little later than the one before."""
    monkeypatch.chdir(day)
    table = pd.read_csv(day / "day.csv", comment="#")
    fields = {str(title).partition(" ")[0]: table[title].to_numpy(dtype=float) for title in table}
    own = {
        "gyro": ["heading", "rate of turn"],
        "steering": ["rudder", "rpm", "run"],
        "track": ["north", "east", "surge"],
    }
    named = {"rate of turn": "r", "north": "x", "east": "y", "surge": "u"}
    stamps = {name: 1e6 * (fields["t"] + late) for name, late in zip(own, (0.0, 0.03, 0.08))}
    values = {name: {field: fields[named.get(field, field)] for field in inside} for name, inside in own.items()}
    ulog_file(day / "day.ulg", {name: (stamps[name], values[name]) for name in own})
    return day / "day.ulg"


def test_topics_with_clocks_of_their_own_give_the_same_trials(topics: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def found(log: str, *options: str) -> list[str]:
        code, out, said = run(capsys, log, *options)
        assert code == 0, said
        return [line for line in out.splitlines() if line.startswith("name")]

    assert found(topics.name) == found("day.csv")
    assert len(found(topics.name, "--by", "pauses")) == 1
    _, out, _ = run(capsys, topics.name, "--by", "column", "--column", "steering.run")
    assert out.count('where = "steering.run == ') == len(found("day.csv", "--by", "column", "--column", "run"))


def test_time_may_start_anew_with_each_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "runs.csv"
    rows = [f"{k % 30},{'first' if k < 30 else 'then'},{0.1 * k}" for k in range(60)]
    file.write_text("\n".join(["t,name,psi", *rows]) + "\n")
    code, out, _ = run(capsys, str(file), "--by", "column", "--column", "name")
    assert code == 0
    assert "where = \"name == 'then'\"" in out
    code, _, said = run(capsys, str(file))
    assert code == 2
    assert "use --by column" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--by", "column"], "--by column needs --column"),
        (["--events", "3"], "--events is of no use with --by manoeuvres"),
        (["--by", "events", "--events", "soon"], "'soon' is not a time in seconds"),
        (["--by", "events", "--events", "99999"], "an event at 99999 s is outside the log"),
        (["--pick", "0"], "'0' is none of the numbers"),
        (["--write"], "--write needs a study"),
        (["--by", "column", "--column", "rum"], "no column 'rum'"),
        (["--map", "day.csv"], "the map would replace the log"),
    ],
)
def test_a_wrong_call_ends_in_one_message(
    study: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    code, _, said = run(capsys, "day.csv", *arguments)
    assert code == 2
    assert message in said
    assert len(said.strip().splitlines()) == 1


def test_events_come_from_a_file(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("events.txt").write_text("# marks of the crew\n100.0 zigzag begins\n\n300.0\n")
    code, out, _ = run(capsys, "day.csv", "--by", "events", "--events", "events.txt")
    assert (code, out.count("[[trials]]")) == (0, 3)
    Path("events.txt").write_bytes(b"\xff\xfe1\x002\x00")
    code, _, said = run(capsys, "day.csv", "--by", "events", "--events", "events.txt")
    assert (code, "events.txt: it is not UTF-8 text" in said) == (2, True)


def test_the_map_shows_every_stretch(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "day.csv", "--map", "map.html", "--pick", "1")[0] == 0
    page = Path("map.html").read_text()
    assert "SYNTHETIC" in page
    assert "turning_circle_35_starboard" in page
    assert page.count("<svg") == 2


def test_a_map_of_a_log_without_positions_or_stretches(day: Path) -> None:
    log = read_log(day / "day.csv").section(0, 50)
    alone = log_map(log, [], [], "manoeuvres")
    assert "Nothing was found" in alone
    few = log_map(log, by_events(log.t, [10.0]), ["part_1"], "events")
    assert "part_2" in few


def test_trials_in_a_form_that_is_not_tables_are_left_alone() -> None:
    text = 'trials = [{ file = "log.csv" }, { file = "other.csv" }]\n\n[model]\nuse = "mmg"\n'
    tables = trial_tables([Stretch("part", "part", 0.0, 1.0, name="a")], "log.csv")
    with pytest.raises(BadInput, match="cannot be replaced safely"):
        with_trials(text, tables, "log.csv", "study.toml")


def test_a_study_without_trials_gets_them_at_its_end() -> None:
    tables = trial_tables([Stretch("part", "part", 0.0, 1.0, 'a "quoted" word', name="a")], "log.csv")
    text = with_trials('[model]\nuse = "mmg"', tables, "log.csv", "study.toml")
    assert tomllib.loads(text)["trials"][0]["prepare"] == [{"step": "cut", "start": 0.0, "end": 1.0}]


@pytest.mark.parametrize("pattern", ["*.csv", "log?.csv", "**/*.csv"])
def test_a_log_that_a_pattern_takes_is_not_written_twice(pattern: str) -> None:
    """As `init` of all logs of a folder writes it; the run was in twice then, once with columns that it lacks."""
    text = f'[model]\nuse = "mmg"\n\n[[trials]]\nfile = "{pattern}"\n'
    tables = trial_tables([Stretch("manoeuvres", "turn", 0.0, 10.0, "rudder 20 deg", name="turn")], "log1.csv")
    with pytest.raises(BadInput, match="twice"):
        with_trials(text, tables, "log1.csv", "study.toml")
    assert "turn" in with_trials(text, tables, "day/log1.csv" if "**" not in pattern else "log1.txt", "study.toml")


def test_what_a_replaced_trial_lacks_its_parts_lack_too() -> None:
    text = '[model]\nuse = "mmg"\n\n[[trials]]\nfile = "log.csv"\nwithout = ["u", "v"]\n'
    tables = trial_tables([Stretch("manoeuvres", "turn", 0.0, 10.0, "rudder 20 deg", name="turn")] * 2, "log.csv")
    assert with_trials(text, tables, "log.csv", "study.toml").count('without = ["u", "v"]') == 2
