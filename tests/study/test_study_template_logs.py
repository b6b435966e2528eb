"""The study file that `init` proposes for logs of several topics."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth import load_model, load_study
from seatruth.cli import run
from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.readers import read_log
from seatruth.study.template import template
from seatruth.trials.channel import Channel

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from log_formats import WRITERS, manoeuvre

RUN = manoeuvre(np.arange(0.0, 20.0, 0.2))
EXPECTED = {
    "nmea": {
        "delta": "AGRSA.rudder",
        "n": "IIRPM[S0].shaft_speed",
        "psi": "HEHDT.heading",
        "u": "VDVBW.longitudinal_ground_speed",
        "v": "VDVBW.transverse_ground_speed",
        "r": "TIROT.rate_of_turn",
    },
    "ros2": {
        "delta": "/delta.data",
        "n": "/n.data",
        "x": "/pose.pose.position.x",
        "y": "/pose.pose.position.y",
        "psi": "/psi.data",
        "u": "/twist.twist.linear.x",
        "v": "/twist.twist.linear.y",
        "r": "/twist.twist.angular.z",
    },
    "ulog": {"x": "vehicle_local_position.x", "y": "vehicle_local_position.y", "psi": "vehicle_attitude.psi"},
    "dataflash": {"delta": "ACT.Rud", "x": "POS.X", "y": "POS.Y", "psi": "ATT.Yaw"},
}


@pytest.mark.parametrize("name", EXPECTED)
def test_fields_of_topics_are_recognised(tmp_path: Path, name: str) -> None:
    path = WRITERS[name](tmp_path, RUN).path
    text, _ = template(path.name, read_log(path), load_model("mmg"), "mmg")
    study = tomllib.loads(text)
    assert {channel: table["column"] for channel, table in study["channels"].items()} == EXPECTED[name]
    assert "time" not in study
    if name == "nmea":
        assert "water_speed" not in text  # the instrument has no log: its fields are empty
    if name == "ros2":
        assert "# Of the log: ROS counts y and v to port" in text


def test_init_lists_the_fields_and_writes_a_study_that_loads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = WRITERS["nmea"](tmp_path, RUN).path
    assert run(["init", str(path), "--json", str(tmp_path / "init.json")]) == 0
    said = capsys.readouterr().out
    assert "HEHDT.heading" in said
    assert "deg/min" in said
    assert load_study(tmp_path / "run.toml").trials[0].duration == pytest.approx(19.8)


def test_a_study_takes_the_folder_of_a_bag(tmp_path: Path) -> None:
    WRITERS["ros2"](tmp_path, RUN)
    assert run(["init", str(tmp_path / "run"), "-o", str(tmp_path / "study.toml")]) == 0
    study = load_study(tmp_path / "study.toml")
    assert len(study.trials[0]) == len(RUN)
    (tmp_path / "run" / "metadata.yaml").write_text("")
    with pytest.raises(BadInput, match="run"):
        load_study(tmp_path / "study.toml")


def test_init_lists_topics_alone_where_there_are_many_fields(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [",".join(["t", *(f"c{k}" for k in range(80))])] + [
        ",".join("1" * 80).join([f"{t},", ""]) for t in range(3)
    ]
    (tmp_path / "run.csv").write_text("\n".join(lines))
    assert run(["init", str(tmp_path / "run.csv")]) == 0
    assert "81 fields; --fields lists them all." in capsys.readouterr().out
    assert run(["init", str(tmp_path / "run.csv"), "--fields", "--force"]) == 0
    assert "c79" in capsys.readouterr().out


class Catamaran(Model):
    """A user's model: it names no thruster, and tells its propellers by their descriptions alone."""

    name, title, kind = "catamaran", "survey catamaran", "ship"
    states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("n_p", "rev/s", "port propeller"), Channel("n_s", "rev/s", "starboard propeller"))
    parameters = (Parameter("k", 0.5, "1", min=0.0, max=2.0, vary=True),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return p.k * (i.n_p + i.n_s) - s.u, p.k * (i.n_p - i.n_s) - s.r, s.r


def test_drives_of_a_model_that_names_no_thruster_are_told_by_their_sides(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    rows = "\n".join(f"{k},1.0,{5 * k},0.5,{600 + k},{620 - k}" for k in range(20))
    log.write_text(f"t [s],u [m/s],heading [deg],rot [deg/s],RPM stbd,RPM port\n{rows}\n", encoding="utf-8")
    text, _ = template(log.name, read_log(log), Catamaran(), "catamaran.py:Catamaran")
    channels = tomllib.loads(text)["channels"]
    assert {name: (channels[name]["column"], channels[name]["unit"]) for name in ("n_p", "n_s")} == {
        "n_p": ("RPM port", "rpm"),
        "n_s": ("RPM stbd", "rpm"),
    }
