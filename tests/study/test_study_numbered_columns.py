"""Numbered families of columns as numbered families of inputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatruth import load_study
from seatruth.cli import run
from seatruth.study.numbered_columns import numbered_columns
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
