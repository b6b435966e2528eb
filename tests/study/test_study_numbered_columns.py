"""Numbered families of columns as numbered families of inputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth import load_study
from seatruth.cli import run
from seatruth.study.numbered_columns import numbered_columns, pulse_columns
from seatruth.trials import Channel

PULSES = np.array([1500.0, 1500.0, 1680.0, 1448.0])
STILL = np.zeros(4)


def pwm(count: int, unit: str = "us") -> list[Channel]:
    return [Channel(f"pwm_{k}", unit) for k in range(1, count + 1)]


def log(pattern: str, numbers: range) -> dict[str, np.ndarray]:
    return {pattern.format(k): PULSES + k for k in numbers}


@pytest.mark.parametrize(
    ("pattern", "first"),
    [
        ("servo{}_raw", 1),
        ("SERVO_OUTPUT_RAW.servo{}_raw", 1),
        ("RCOU.C{}", 1),
        ("RCOU[0].C{} [us]", 1),
        ("C{}", 1),
        ("pwm{}", 1),
        ("ch{}_out", 1),
        ("motor_{}", 0),
        ("thruster_{}_pwm", 1),
        ("actuator_outputs.output[{}]", 0),
        ("actuator_motors.control[{}]", 0),
        ("/mavros/rc/out.channels[{}]", 0),
    ],
)
def test_outputs_of_autopilots_are_taken_by_their_numbers(pattern: str, first: int) -> None:
    columns = log(pattern, range(first, first + 6))
    found = numbered_columns(dict(reversed(columns.items())), pwm(6))
    assert [found[f"pwm_{k}"].column for k in range(1, 7)] == list(columns)
    assert {hit.unit for hit in found.values()} == {"us"}


@pytest.mark.parametrize(
    "pattern",
    [
        *("current_{}", "motor_{}_current", "esc{}_temperature", "RCIN.C{}", "rc{}_raw", "RC_CHANNELS.chan{}_raw"),
        *("cell{}", "motor {} [rpm]", "/mavros/rc/in.channels[{}]"),
    ],
)
def test_other_families_are_left_alone(pattern: str) -> None:
    assert numbered_columns(log(pattern, range(1, 7)), pwm(6)) == {}


def test_a_family_is_taken_whole_or_not_at_all() -> None:
    six = log("servo{}_raw", range(1, 7))
    assert numbered_columns(six, pwm(5)) == {}  # which one is none is not known
    assert numbered_columns(six, pwm(7)) == {}
    spare = six | {"servo7_raw": STILL, "servo8_raw": STILL}
    assert len(numbered_columns(spare, pwm(6))) == 6
    assert numbered_columns(six | {"servo7_raw": PULSES}, pwm(6)) == {}
    rover = dict.fromkeys(spare, STILL) | dict.fromkeys(("servo1_raw", "servo3_raw"), PULSES)
    assert [hit.column for hit in numbered_columns(rover, pwm(2)).values()] == ["servo1_raw", "servo3_raw"]


def test_two_families_that_fit_alike_are_not_guessed_between() -> None:
    servos, outputs = log("servo{}_raw", range(1, 4)), log("RCOU.C{}", range(1, 4))
    assert numbered_columns(servos | outputs, pwm(3)) == {}
    named = log("pwm{}", range(1, 4))
    assert [hit.column for hit in numbered_columns(servos | outputs | named, pwm(3)).values()] == list(named)


def test_pulses_become_commands_without_a_unit() -> None:
    hit = numbered_columns(log("servo{}_raw", range(1, 3)), pwm(2, "1"))["pwm_1"]
    assert (hit.unit, hit.turned) == ("1", "scale = 0.0025, offset = -3.75")
    wide = {f"servo{k}_raw": np.array([1000.0, 2000.0]) for k in (1, 2)}
    assert numbered_columns(wide, pwm(2, "1"))["pwm_1"].turned == "scale = 0.002, offset = -3"
    shares = {f"thruster_{k}": np.array([-1.0, 0.5]) for k in (1, 2)}
    assert numbered_columns(shares, pwm(2, "1"))["pwm_1"].turned == ""


@pytest.mark.parametrize("unit", ["N", "rev/s", "rad"])
def test_pulses_are_no_forces_revolutions_or_angles(unit: str) -> None:
    assert numbered_columns(log("servo{}_raw", range(1, 3)), pwm(2, unit)) == {}


@pytest.mark.parametrize("header", ["servo{}_raw", "servo{} [us]"])
def test_init_reads_pulses_for_a_vehicle_of_commands(tmp_path: Path, header: str) -> None:
    names = [header.format(k) for k in range(1, 7)]
    rows = [f"{0.1 * t},15.8,0,0,9,0,0,0," + ",".join(["1500" if t < 20 else "1700"] * 6) for t in range(60)]
    head = ",".join(["t [s]", "voltage", "x", "y", "z", "u", "v", "w", *names])
    (tmp_path / "dive.csv").write_text("\n".join([head, *rows]))
    assert run(["init", str(tmp_path / "dive.csv"), "--model", "bluerov2"]) == 0
    text = (tmp_path / "dive.toml").read_text()
    assert 'hold = "zoh"' in text
    trial = load_study(tmp_path / "dive.toml").trials[0]
    for k in range(1, 7):
        np.testing.assert_allclose(trial.inputs[f"c_{k}"][[0, -1]], [0.0, 0.5])


THRUSTERS = [Channel("pwm_starboard", "us"), Channel("pwm_port", "us")]


@pytest.mark.parametrize("names", [("RCOU.C1", "RCOU.C3"), ("C1", "C3"), ("servo1_raw", "servo3_raw")])
def test_outputs_of_an_autopilot_are_those_of_two_thrusters_in_order(names: tuple[str, str]) -> None:
    moving = np.array([1500.0, 1600.0, 1450.0])
    log = {names[0]: moving, names[1]: moving[::-1], "IMU.GyrZ": 0.01 * moving}
    found = pulse_columns(log, THRUSTERS)
    assert {name: hit.column for name, hit in found.items()} == {"pwm_port": names[0], "pwm_starboard": names[1]}
    assert all("check which is port" in hit.why for hit in found.values())
    idle = {names[0].replace("1", "2"): np.full(3, 1500.0)}
    assert pulse_columns({**log, **idle}, THRUSTERS) == found


def test_outputs_of_two_thrusters_are_not_guessed_among_more() -> None:
    moving = np.array([1500.0, 1600.0, 1450.0])
    three = {f"RCOU.C{k}": moving for k in (1, 2, 3)}
    assert pulse_columns(three, THRUSTERS) == {}
    other = {"RCOU.C1": moving, "RCOU.C3": moving, "servo1_raw": moving, "servo2_raw": moving}
    assert pulse_columns(other, THRUSTERS) == {}
    assert pulse_columns({"RCIN.C1": moving, "RCIN.C3": moving}, THRUSTERS) == {}
    steered = [Channel("steering", "us"), Channel("throttle", "us")]
    assert pulse_columns({"RCOU.C1": moving, "RCOU.C3": moving}, steered) == {}
    shares = [Channel("port", "1"), Channel("starboard", "1")]
    assert pulse_columns({"RCOU.C1": moving, "RCOU.C3": moving}, shares) == {}


def test_init_writes_the_guess_of_two_thrusters(tmp_path: Path) -> None:
    (tmp_path / "cat.py").write_text(
        "from seatruth import Channel, Model\n\n\nclass Cat(Model):\n"
        '    name = "cat"\n    states = outputs = (Channel("psi", "rad", angle=True),)\n'
        '    inputs = (Channel("pwm_port", "us"), Channel("pwm_stbd", "us"))\n\n'
        "    @staticmethod\n    def rhs(s, i, p):\n        return ((i.pwm_port - i.pwm_stbd) / 4000.0,)\n"
    )
    rows = [f"{0.1 * k:.1f},{0.02 * k:.2f},{1500 + k % 50},{1500 - k % 40}" for k in range(200)]
    (tmp_path / "log.csv").write_text("\n".join(["time [s],heading [deg],RCOU.C1,RCOU.C3", *rows]) + "\n")
    study = tmp_path / "s.toml"
    assert run(["init", str(tmp_path / "log.csv"), "--model", f"{tmp_path}/cat.py:Cat", "-o", str(study)]) == 0
    text = study.read_text()
    assert 'pwm_port = { column = "RCOU.C1", unit = "us" }   # guessed by the order of their numbers' in text
    assert 'pwm_stbd = { column = "RCOU.C3", unit = "us" }' in text
