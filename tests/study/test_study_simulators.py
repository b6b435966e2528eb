"""A study that names an FMU: what the file says of it is what runs; and the commands on it."""

from __future__ import annotations

import json
import shutil
import time
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fmu_ships import ship_fmu, zigzag

from seatruth import BadInput, BlackBox, Channel, OutputSettings, Parameter, Study, load_study, simulator
from seatruth.cli import run as command
from seatruth.commands.cost_notice import say_cost
from seatruth.cost_forecast import forecast
from seatruth.effects import available, dimensions_of
from seatruth.models import FMU, IsolatedBlackBox, Rudder, ServoBlackBox, Thruster, load_fmu
from seatruth.sample import copy_to
from seatruth.trials import Trial, Trials

STUDY = """
[study]
synthetic = true

[model]
use = "ship.fmu"
vary = ["R_0", "N_r"]
kind = "ship"
time_limit = 20
{model}

[time]
column = "t"
unit = "s"

[channels]
delta = {{ column = "delta", unit = "rad" }}
n = {{ column = "n", unit = "rev/s" }}
psi = "psi"
u = "u"
r = "r"

[[trials]]
file = "run.csv"
without = ["x", "y", "v"]

[noise]
psi = 0.002
u = 0.01
r = 0.001

[optimizer]
use = "least_squares"

[budget]
evaluations = 60
{budget}
"""
PORTS = 'ports = { force = ["X", "Y", "N"], current = { north = "north", east = "-east" } }'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("fmu-study")
    shutil.copy(ship_fmu(), place / "ship.fmu")
    model, trial = load_fmu(place / "ship.fmu", inputs=["delta", "n"]), zigzag()
    sim = simulator(model, [trial], free=("R_0", "N_r"), threads=1)
    y = sim.outputs(np.array([[0.026, -0.055]]), sim.initial_states).y[0]
    rng = np.random.default_rng(2)
    table = {"t": trial.t, **trial.inputs}
    for name, sd in (("psi", 0.002), ("u", 0.01), ("r", 0.001)):
        column = [channel.name for channel in model.outputs].index(name)
        noise = rng.normal(0.0, sd, len(trial))
        noise[0] = 0.0  # where the trial starts is known
        table[name] = y[:, column] + noise
    pd.DataFrame(table).to_csv(place / "run.csv", index=False)
    return place


def written(folder: Path, model: str = PORTS, budget: str = "", name: str = "study.toml") -> Path:
    (folder / name).write_text(STUDY.format(model=model, budget=budget))
    return folder / name


def test_what_the_file_says_is_what_runs(folder: Path) -> None:
    study = load_study(written(folder, f"{PORTS}\nstep = 0.5", "diagnosis = 70"))
    assert isinstance(study.model, FMU)
    assert study.model.time_limit == 20.0
    assert study.model.ports.components == ("X", "Y", "N", "north", "east")
    assert study.diagnosis_budget == 70
    assert study.model.kind == "ship"
    other = load_study(written(folder, f"{PORTS}\nstep = 1.0"))
    assert other.content_hash != study.content_hash


def test_actuators_of_an_fmu_have_effects(folder: Path) -> None:
    propeller = 'input = "n", full = 12.0, at = [-3, 0.0, "d"], towards = [1.0, 0.0, 0.0], diameter = 0.2'
    named = f'effects = ["thruster_lag"]\nactuators = {{ propeller = {{ {propeller} }}, helm = {{ input = "delta" }} }}'
    study = load_study(written(folder, f"{PORTS}\n{named}", name="named.toml"))
    assert study.model.actuators == (
        Thruster("propeller", "n", at=(-3.0, 0.0, "d"), towards=(1.0, 0.0, 0.0), full=12.0, diameter=0.2),
        Rudder("helm", "delta"),
    )
    assert "thruster_lag_tau" in study.model.nominal()
    jet = 'actuators = { jet = { input = "n", turns = "yaw", full = 12.0 } }'
    assert load_study(written(folder, f"{PORTS}\n{jet}", name="jet.toml")).model.actuators == (
        Rudder("jet", "n", full=12.0),
    )
    assert "does not declare its thrusts" in available()["thruster_gain"].missing(study.model)
    with pytest.raises(BadInput, match="names no thruster"):
        load_study(written(folder, f'{PORTS}\neffects = ["thruster_dead_band"]', name="unnamed.toml"))


def test_positions_that_are_states_of_an_fmu_are_not_shown_elsewhere(folder: Path) -> None:
    fixes = 'latitude = { column = "x", at = [1, 0, 0] }\nlongitude = "y"\npsi = "psi"\n'
    path = written(folder, name="antenna.toml")
    path.write_text(path.read_text().replace('psi = "psi"\n', fixes))
    with pytest.raises(BadInput, match=r"latitude.at: the positions of a black box that .* with the step 'lever_arm'"):
        load_study(path)


def test_orders_get_a_servo_before_a_simulator(folder: Path) -> None:
    servo = '[actuators]\ndelta = { record = "order", rate_limit = "2.3 deg/s", lag = "1 s", delay = "0.5 s" }'
    plain = load_study(written(folder))
    study = load_study(written(folder, f"{PORTS}\n{servo}", name="orders.toml"))
    assert isinstance(study.model, ServoBlackBox)
    stated = {parameter.name: parameter.value for parameter in study.parameters}
    assert stated["delta_rate_limit"] == pytest.approx(np.radians(2.3))
    assert (stated["delta_lag"], study.model.delays["delta"]) == (1.0, 0.5)
    assert study.content_hash != plain.content_hash
    late = load_study(written(folder, f"{PORTS}\n{servo.replace('0.5 s', '0.7 s')}", name="late.toml"))
    assert late.content_hash != study.content_hash
    slow, quick = (one.simulate(threads=1)["run"]["psi"].to_numpy() for one in (study, plain))
    assert np.abs(slow - quick).max() > 0.1


@pytest.mark.parametrize(
    ("model", "message"),
    [
        ('ports = { force = ["X", "Q"] }', "no component 'Q'"),
        ('ports = { force = { X = "F" } }', r"no variable 'F'.*It has inputs"),
        ('set = "KVLCC2"', "no parameter sets"),
        ("step = 0.0", "step"),
        ('names = { helm = "delta" }', "no channel 'helm'|helm"),
        ("dimensions = { length = 7.0 }", "breadth"),
        ('actuators = { port = { input = "n", full = 10.0 } }', "a thruster needs 'at'"),
        ('actuators = { port = { input = "n", full = 10.0, at = [0, 0, 0], turns = "yaw" } }', "a rudder has no 'at'"),
        ('actuators = { helm = { input = "n", turns = "yaw" } }', "state `full`, the input hard over"),
        ('actuators = { helm = { input = "rudder" } }', "input 'rudder', which the model does not have"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(folder: Path, model: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        load_study(written(folder, model, name="wrong.toml"))


def test_keys_of_an_fmu_are_no_keys_of_another_model(folder: Path) -> None:
    text = STUDY.format(model=PORTS, budget="").replace('"ship.fmu"', '"mmg"')
    (folder / "mmg.toml").write_text(text)
    with pytest.raises(BadInput, match=r"(?s)'kind' belongs to an FMU.*time limit.*'ports'"):
        load_study(folder / "mmg.toml")


def test_any_model_with_a_size_takes_areas_above_water(folder: Path, tmp_path: Path) -> None:
    size = "dimensions = { length = 7.0, breadth = 1.3, draft = 0.5, mass = 3000.0 }"
    study = load_study(written(folder, f'{PORTS}\n{size}\nlateral_area = "20000 cm2"', name="areas.toml"))
    found = dimensions_of(study.model)
    assert found is not None
    assert found == (7.0, 1.3, 0.5, 3000.0, 1025.0, None, pytest.approx(2.0))
    copy_to(tmp_path)
    text = (tmp_path / "study.toml").read_text()
    effects = next(line for line in text.splitlines() if line.startswith("effects"))
    stated = 'effects = ["current", "wind"]\nfrontal_area = 0.8\nlateral_area = "3 m2"'
    (tmp_path / "s.toml").write_text(text.replace(effects, stated, 1))
    known = load_study(tmp_path / "s.toml")
    found = dimensions_of(known.model)
    assert found is not None
    assert (found.frontal_area, found.lateral_area) == (0.8, 3.0)
    (tmp_path / "s.toml").write_text(text.replace(effects, stated.replace("3 m2", "4 m2"), 1))
    assert load_study(tmp_path / "s.toml").content_hash != known.content_hash


@pytest.mark.parametrize(
    ("model", "message"),
    [
        ("lateral_area = 2.0", "declares no dimensions"),
        ('lateral_area = "2 m"', "lateral_area"),
        ('frontal_area = "wide"', "no number with a unit"),
        ("frontal_area = -1.0", "frontal_area"),
        (
            "frontal_area = 1.0\n"
            "dimensions = { length = 7.0, breadth = 1.3, draft = 0.5, mass = 3000.0, frontal_area = 1.0 }",
            "stated twice",
        ),
    ],
)
def test_what_is_wrong_with_an_area_is_said(folder: Path, model: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        load_study(written(folder, f"{PORTS}\n{model}", name="wrong.toml"))


def test_a_time_limit_puts_a_black_box_into_processes(folder: Path) -> None:
    (folder / "box.py").write_text(
        "from seatruth import BlackBox, Channel, Parameter\n"
        "def run(trial, p, first):\n"
        "    return {'psi': p['a'] * trial.t, 'u': 0 * trial.t, 'r': 0 * trial.t}\n"
        "box = BlackBox('box', run, inputs=[Channel('delta', 'rad'), Channel('n', 'rev/s')],\n"
        "               outputs=[Channel('psi', 'rad'), Channel('u', 'm/s'), Channel('r', 'rad/s')],\n"
        "               parameters=[Parameter('R_0', 1.0), Parameter('N_r', 1.0), Parameter('a', 0.1)])\n"
    )
    text = STUDY.format(model="", budget="").replace('"ship.fmu"', '"box.py:box"').replace('kind = "ship"', "")
    (folder / "box.toml").write_text(text.replace('without = ["x", "y", "v"]', ""))
    study = load_study(folder / "box.toml")
    assert isinstance(study.model, IsolatedBlackBox)
    found = study.simulate(threads=1)["run"]["psi"].to_numpy()
    assert found == pytest.approx(0.1 * study.trials[0].t)
    study.model.stop()


def test_the_cost_is_said_before_it_begins(folder: Path) -> None:
    study = load_study(written(folder, PORTS, "diagnosis = 70"))
    identify, diagnose = forecast(study, ["rudder_offset", "wind"], threads=1)
    assert identify.expected == 36  # of two parameters, by least squares
    assert identify.most == 60
    assert (diagnose.expected, diagnose.most) == (70, 70)
    assert 0.0 < identify.evaluation_s < 10.0
    assert "36 evaluations" in str(identify)
    assert "from a poor start several times as long" in str(identify)
    assert "poor" not in str(diagnose)
    assert "budget of 70" in str(diagnose)
    assert identify.seconds == pytest.approx(36 * identify.evaluation_s)


def test_the_commands_take_an_fmu(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study = str(written(folder))

    def run(*arguments: str) -> str:
        code = command([*arguments])
        captured = capsys.readouterr()
        assert code == 0, captured
        return captured.out + captured.err

    json_file = folder / "check.json"
    run("check", study, "--json", str(json_file))
    data = json.loads(json_file.read_text())["result"]
    assert [entry["what"] for entry in data["cost"]] == ["identify", "diagnose"]
    assert {row["verdict"] for row in data["preview"]} == {"identified"}
    assert "run" in run("simulate", study)
    run("identify", study, "-q", "--json", str(json_file), "--threads", "2")
    values = {row["name"]: row for row in json.loads(json_file.read_text())["result"]["parameters"]}
    for name, truth in (("R_0", 0.026), ("N_r", -0.055)):
        assert abs(values[name]["value"] - truth) < 4.0 * values[name]["stderr"]
    run("init", str(folder / "run.csv"), "--model", str(folder / "ship.fmu"), "-o", str(folder / "made.toml"))
    made = (folder / "made.toml").read_text()
    assert 'use = "ship.fmu"' in made
    assert "# ports =" in made
    assert "# names =" in made


def test_a_first_study_of_an_fmu_proposes_names_for_variables_that_say_what_they_are(folder: Path) -> None:
    """Names as other makers give them. What says nothing gets the name of the column that it ends with."""
    made = {"psi": "nav.HDG", "x": "nav.North", "y": "nav.East", "delta": "helm.cmd.rudder", "v": "nav.v_lat"}
    edit = tuple((f'name="{name}" v', f'name="{other}" v') for name, other in made.items())
    (folder / "other.fmu").write_bytes(ship_fmu(edit=edit).read_bytes())
    log = pd.read_csv(folder / "run.csv")
    log.assign(v_lat=0.1 * log["r"]).to_csv(folder / "other.csv", index=False)
    code = command(
        ["init", str(folder / "other.csv"), "--model", str(folder / "other.fmu"), "-o", str(folder / "other.toml")]
    )
    assert code == 0
    content = tomllib.loads((folder / "other.toml").read_text())
    assert content["model"]["names"] == {
        "delta": "helm.cmd.rudder",
        "psi": "nav.HDG",
        "x": "nav.North",
        "y": "nav.East",
        "v_lat": "nav.v_lat",
    }
    assert {"delta", "psi", "v_lat"} <= content["channels"].keys()
    study = load_study(folder / "other.toml")
    assert len(study.free) == 4, "numbers, not its switches"


def slow_boat(pause: float) -> Study:
    """A function of Python that takes so many seconds for a run."""

    def sail(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, np.ndarray]:
        time.sleep(pause)
        return {"u": p["gain"] * trial.inputs["push"]}

    speed = Channel("u", "m/s")
    gain = Parameter("gain", 1.0, "1", 0.1, 9.0, vary=True, source="test")
    box = BlackBox("slow", sail, inputs=[Channel("push", "N")], outputs=[speed], states=[speed], parameters=[gain])
    t = np.arange(20.0)
    return Study("slow", box, Trials([Trial(name, t, {"push": t}, {"u": t}) for name in "ab"]))


def test_a_slow_function_of_python_is_forecast_as_an_fmu_is(capsys: pytest.CaptureFixture[str]) -> None:
    identify, diagnose = forecast(slow_boat(0.1), threads=2)
    assert identify.own_s == 0.0 < diagnose.own_s < 0.1
    assert diagnose.seconds == pytest.approx((diagnose.evaluation_s + diagnose.own_s) * diagnose.expected)
    quick = replace(diagnose, evaluation_s=diagnose.own_s, processes=1)
    assert "s of seatruth's own)" in str(quick)
    assert identify.evaluation_s == pytest.approx(0.2, abs=0.1)
    assert (identify.processes, identify.expected) == (1, 24)
    assert diagnose.expected > identify.expected
    # Three starts, and two searches with half of the trials each.
    often = slow_boat(0.1).replace(starts=3, output=OutputSettings(cross_validate=True))
    assert forecast(often, threads=2)[0].expected == 4 * 24
    assert [one["what"] for one in say_cost(slow_boat(0.5), None, "identify")] == ["identify"]
    assert "identify takes about 24 evaluations" in capsys.readouterr().err
    assert say_cost(slow_boat(0.0), None, "identify")  # as --json has it; nobody waits for it
    assert capsys.readouterr().err == ""
