"""What README.md and docs/*.md show works as it stands there."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from documents import ROOT, blocks, execute, files, install
from fmu_ships import ship_fmu

from seatruth import identify, load_model, load_study
from seatruth.costs.sensor_places import receiver_in_two_places, sensor_places
from seatruth.readers import available
from seatruth.sample import FOLDER, copy_to

DOCUMENTS = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "experiments").rglob("*.md"))
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


@pytest.mark.parametrize("document", DOCUMENTS)
def test_links_lead_somewhere(document: str) -> None:
    path = ROOT / document
    for target in re.findall(r"\]\((?!https?:|mailto:)([^)#\s]+)", path.read_text()):
        assert (path.parent / target).exists(), target


def test_the_rules_of_the_diagnosis_stand_where_its_document_says() -> None:
    """ "`diagnosis/withdrawals.py: without_outdone`": a module of the sources, and one or more names in it."""
    named = re.findall(r"`(\w+/\w+\.py)(?:: ([\w, ]+))?`", (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8"))
    assert len(named) > 40
    for module, names in named:
        text = (ROOT / "src" / "seatruth" / module).read_text(encoding="utf-8")
        for name in filter(None, names.split(", ")):
            assert re.search(rf"^(?:    )?(?:def |class )?{name}\b", text, re.MULTILINE), f"{module}: {name}"


@pytest.mark.essential
def test_readme(folder: Path) -> None:
    """Its commands in their order, and after them what the first page of the documentation shows from Python."""
    copy_to(folder)
    shutil.copy(folder / "zigzag_20_20.csv", folder / "my_log.csv")
    execute("README.md")
    assert (folder / "my_log-result" / "report.html").exists()
    estimate = execute("docs/index.md")["estimate"]
    assert estimate.outcome["code"] == "converged"
    assert (folder / "my-result" / "report.html").stat().st_size > 10_000


def test_the_readme_stays_one_screen_with_its_picture_on_top() -> None:
    """In a column of 1000 pixels it is 1060 high, heading and picture included. A screen has about 1100."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = text.splitlines()
    assert lines[2].startswith("![")
    assert lines[2].endswith("(docs/figures/diagnosis.png)")
    assert len(lines) <= 36
    assert len(re.sub(r"\]\([^)]*\)", "]", text)) <= 2_300, "what a reader sees, without the targets of links"
    header = (ROOT / "docs" / "figures" / "diagnosis.png").read_bytes()[16:24]
    width, height = int.from_bytes(header[:4], "big"), int.from_bytes(header[4:], "big")
    assert width <= 1000
    assert height <= 300
    for word in (
        "make demo",
        "make test",
        "pip install .",
        "[CITATION.cff]",
        "[LICENSE]",
        "docs/index.md",
        "blind synthetic",
    ):
        assert word in text
    for command in ("init", "check", "identify", "diagnose"):
        assert f"seatruth {command} my_" in text


def test_models(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    estimate: Any = execute("docs/models.md")["estimate"]
    assert 0.05 < estimate.parameters.loc["K", "value"] < 1.0
    assert (folder / "my_study-result" / "report.html").exists()
    assert (folder / "black_box-result" / "report.html").exists()


def test_simulators(folder: Path) -> None:
    ahead = execute("docs/simulators.md")["ahead"]
    assert ahead.tolist() == [2.0, 2.0, 2.0, 2.0, 2.0]


def test_the_how_to_of_an_fmu(folder: Path) -> None:
    """A ship whose heading is called `heading` sails a synthetic zigzag, and the page identifies it."""
    log = pd.read_csv(FOLDER / "zigzag_20_20.csv", comment="#", nrows=200)
    run = log.rename(columns=lambda title: title.partition(" ")[0])
    units = [title.partition(" ")[2] for title in log.columns]
    run = run.assign(n=run["n"] * (60.0 if "rev/s" in str(units) else 1.0))
    run.to_csv(folder / "zigzag.csv", index=False)
    shutil.copy(ship_fmu(edit=(('name="psi"', 'name="heading"'),)), folder / "ship.fmu")
    execute("docs/how-to/fmu.md")
    assert (folder / "study-result" / "report.html").exists()
    assert 'inputs = ["delta", "n"]' in (folder / "zigzag.toml").read_text()


PLANE = """
from seatruth import Channel, Model, Parameter

UNITS = {"u": "m/s", "v": "m/s", "r": "rad/s", "psi": "rad", "x": "m", "y": "m"}


class Plane(Model):
    name = "plane"
    kind = "auv"
    states = outputs = tuple(Channel(name, unit, angle=name == "psi") for name, unit in UNITS.items())
    inputs = tuple(Channel(f"c_{k}", "1") for k in range(1, 5))
    parameters = (Parameter("d", 1.0, "1/s", min=0.1, max=9.0),)

    @staticmethod
    def rhs(s, i, p):
        return i.c_1 - p.d * s.u, i.c_2 - s.v, i.c_3 + i.c_4 - s.r, s.r, s.u, s.v
"""


def test_the_study_of_an_rov(folder: Path) -> None:
    """The page's tables on rows of 10 Hz, with cells that are empty where a sensor has no sample."""
    _, study, _ = [block for _, kind, block in blocks("docs/how-to/prepare_a_diagnosis.md") if kind == "toml"]
    (folder / "rov.toml").write_text(
        f'[study]\nname = "rov"\n[model]\nuse = "plane.py:Plane"\nvary = ["d"]\n[time]\ncolumn = "t"\n{study}\n'
        '[[trials]]\nfile = "log.csv"\n'
    )
    (folder / "plane.py").write_text(PLANE)
    k = np.arange(600)
    log = {"t": 0.1 * k, **{f"cmd{n}": 0.2 * np.sin(0.05 * k + n) for n in range(1, 5)}}
    log |= {"heading": 10.0 + 0.0 * k, "yaw_rate": 0.0 * k, "dvl_vx": np.where(k % 2, np.nan, 0.3), "dvl_vy": 0.0 * k}
    usbl = np.where(k % 10 == 3, 0.03 * k, np.nan)
    usbl[303] += 40.0
    pd.DataFrame({**log, "usbl_n": usbl, "usbl_e": usbl}).to_csv(folder / "log.csv", index=False)
    (trial,) = load_study("rov.toml").trials
    valid = {name: int(np.isfinite(values).sum()) for name, values in trial.outputs.items()}
    assert valid == {"u": 300, "v": 600, "psi": 600, "r": 600, "x": 59, "y": 59}


def test_the_study_of_a_ship(folder: Path) -> None:
    """The page's tables on the log of a bridge: the receiver's place holds for its position and its velocity."""
    study, _, _ = [block for _, kind, block in blocks("docs/how-to/prepare_a_diagnosis.md") if kind == "toml"]
    (folder / "ship.toml").write_text(
        f'[study]\nname = "ship"\n[model]\nuse = "mmg"\nvary = ["Y_v"]\n[time]\ncolumn = "t"\n{study}\n'
        '[[trials]]\nfile = "log.csv"\n'
    )
    t = np.arange(300.0)
    log = {"t": t, "rudder_deg": 5.0 * np.sin(0.05 * t), "rpm": 100.0 + 0.0 * t, "rot": 0.0 * t, "heading": 0.0 * t}
    # Due north at 12 kn: a minute of latitude each five minutes.
    log |= {"lat": 54.0 + t / 300.0 / 60.0, "lon": 10.0 + 0.0 * t, "sog": 12.0 + 0.0 * t, "cog": 0.0 * t}
    pd.DataFrame({**log, "stw": 12.0 + 0.0 * t}).to_csv(folder / "log.csv", index=False)
    loaded = load_study("ship.toml")
    (trial,) = loaded.trials
    assert [channel.name for channel in loaded.model.outputs] == ["x", "y", "psi", "r", "u_w", "v_n", "v_e"]
    assert np.ptp(trial.outputs["x"]) == pytest.approx(1852.0 * 299.0 / 300.0, rel=0.01)
    assert receiver_in_two_places(loaded) == []


def test_the_study_of_an_auv(folder: Path) -> None:
    """The page's tables on a level straight run: orders move both fins, and each sensor has its place."""
    _, _, study = [block for _, kind, block in blocks("docs/how-to/prepare_a_diagnosis.md") if kind == "toml"]
    study = study.replace("[channels]\n", "[channels]\ndelta_d = { value = 0.0 }\n")  # no fin of this one rolls it
    (folder / "auv.toml").write_text(
        f'[study]\nname = "auv"\n[model]\nuse = "torpedo"\nvary = ["C_x0"]\n[time]\ncolumn = "t"\n{study}\n'
        '[[trials]]\nfile = "log.csv"\n'
    )
    t = np.arange(0.0, 60.0, 0.4)
    still = ("dvl_v", "dvl_w", "roll", "pitch", "heading", "roll_rate", "pitch_rate", "yaw_rate", "east")
    log = {"t": t, "rudder_order": 5.0 * np.sign(np.sin(0.2 * t)), "plane_order": 2.0 * np.sign(np.sin(0.1 * t))}
    log |= {"shaft": 600.0 + 0.0 * t, "dvl_u": 1.5 + 0.0 * t, "north": 1.5 * t, "depth": 10.0 + 0.0 * t}
    pd.DataFrame({**log, **dict.fromkeys(still, 0.0 * t)}).to_csv(folder / "log.csv", index=False)
    loaded = load_study("auv.toml")
    assert {servo.input for servo in loaded.model.servos} == {"delta", "delta_s"}
    assert loaded.trials[0].inputs["n"] == pytest.approx(10.0)
    places = sensor_places(loaded)
    assert places["u"] == pytest.approx((0.4, 0.0, 0.1))
    assert places["z"] == pytest.approx((0.5, 0.0, 0.0))


def test_channels(folder: Path) -> None:
    shown = execute("docs/channels.md")
    assert shown["outputs"] == ["x", "y", "psi", "r", "v_n", "v_e"]
    steps = ["read", "position", "unwrap", "follow_heading", "ground_velocity"]
    assert [step.partition(":")[0] for step in shown["steps"]] == steps
    before, after = shown["trial"], shown["study"].trials[0]
    assert after.conditions["start"] == "2025-07-31T23:59:00+00:00"
    for name in ("x", "y", "psi"):
        change = before.outputs[name] - after.outputs[name]
        assert change - change[0] == pytest.approx(np.zeros(len(after)), abs=1e-3)


@pytest.mark.slow
def test_reading_the_report(folder: Path) -> None:
    estimate = identify(load_study(copy_to(folder)))
    execute("docs/reading-the-report.md", estimate=estimate)
    assert (folder / "report.html").stat().st_size > 10_000
    assert (folder / "parameters.pdf").exists()


def test_engine(folder: Path) -> None:
    trials = load_study(copy_to(folder)).trials
    model = load_model("mmg")
    weights = np.ones((sum(len(trial) for trial in trials), len(model.outputs)))
    theta = np.array([[model.nominal()["Y_v"], model.nominal()["N_v"]]] * 3)
    errors = execute("docs/engine.md", trials=trials, theta=theta, weights=weights)["errors"]
    assert np.isfinite(errors.sums).all()
    assert errors.sums.shape == (3, len(trials), len(model.outputs))


@pytest.mark.slow
def test_the_model_of_the_document_conforms(folder: Path) -> None:
    for name, text in files("docs/models.md").items():
        (folder / name).write_text(text)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", ".", "test_my_ship.py"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout[-3000:]
    assert " passed" in done.stdout


def test_reading_logs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file of each how-to is written by the format's own library."""
    monkeypatch.syspath_prepend(str(ROOT / "experiments"))
    from log_formats import WRITERS, manoeuvre

    (folder / "hdf5").mkdir()
    for name, write in WRITERS.items():
        write(folder / "hdf5" if name == "hdf5" else folder, manoeuvre(np.arange(0.0, 4.0, 0.1)))
    trial = execute("docs/reading-logs.md")["trial"]
    assert len(trial) == 40
    assert (folder / "run.toml").exists()


def german(folder: Path, run: pd.DataFrame) -> None:
    """The run as a German program writes it, with a rudder that is positive to port."""
    knot = 1852 / 3600
    table = run.assign(delta=-run["delta"], n=60 * run["n"], u=run["u"] / knot, v=run["v"] / knot, r=60 * run["r"])
    names = ("Zeit", "Ruder", "Drehzahl", "Nord", "Ost", "Kurs", "Fahrt", "Drift", "Drehung")
    table.columns = list(names)
    table.to_csv(folder / "run.csv", sep=";", decimal=",", index=False, encoding="latin-1")


HOW_TOS = {
    "csv": ("csv", german),
    "parquet": ("parquet", "parquet"),
    "matlab": ("matlab", "matlab"),
    "hdf5": ("hdf5", "hdf5"),
    "excel": ("excel", "excel"),
    "ros1": ("rosbag", "ros1"),
    "ros2": ("rosbag", "ros2"),
    "mcap": ("mcap", "mcap"),
    "px4": ("ulog", "ulog"),
    "ardupilot": ("dataflash", "dataflash"),
    "nmea": ("nmea", "nmea"),
}
"""Page of a format: its reader, and what writes its file."""


@pytest.mark.slow
@pytest.mark.parametrize("page", HOW_TOS)
def test_the_how_to_of_a_format_reads_its_file(page: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The format's own library writes a synthetic zigzag; the study of the page gives its numbers back."""
    monkeypatch.syspath_prepend(str(ROOT / "experiments"))
    from log_formats import UNITS, WRITERS

    log = pd.read_csv(FOLDER / "zigzag_20_20.csv", comment="#", nrows=200)
    run = log.rename(columns=lambda title: title.partition(" ")[0])
    _, write = HOW_TOS[page]
    (WRITERS[write] if isinstance(write, str) else write)(folder, run)
    execute(f"docs/how-to/{page}.md")
    trial = load_study("study.toml").trials[0]
    assert trial.t == pytest.approx(run["t"], abs=1e-7)
    for name in (*trial.inputs, *trial.outputs):
        true = run[name].to_numpy(dtype=float)
        true = np.unwrap(np.radians(true)) if name == "psi" else np.radians(true) if "deg" in UNITS[name] else true
        assert trial.channel(name) == pytest.approx(true, rel=1e-7, abs=1e-7), name


def test_every_reader_has_a_how_to() -> None:
    assert {reader for reader, _ in HOW_TOS.values()} == {
        name for name, info in available().items() if info.package == "seatruth"
    }


@pytest.mark.slow
def test_the_reader_of_the_document_conforms(folder: Path) -> None:
    install("docs/readers.md", folder)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(["site", os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", ".", "test_blackbox_log.py"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stdout[-3000:]
    assert " passed" in done.stdout
