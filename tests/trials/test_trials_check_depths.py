"""Depths against speeds: units, the sign of w, and a sea that turns nothing round."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from known_motion import Array, altered
from scipy.signal import lfilter

from seatruth.trials import Trial, check_trials

FAULTS = ("depth-scale", "heave-sign", "depth-pitch-sign")


def diving(name: str = "dive", *, roll: float = 0.0, noise: float = 0.0) -> Trial:
    """A vehicle that pitches and heaves at two periods, with a list, its depth exactly what its speeds say."""
    t = np.arange(0, 300, 0.1)
    theta = 0.2 * np.sin(2 * np.pi * t / 60)
    u, w = 1.5 + 0.2 * np.sin(2 * np.pi * t / 97), 0.08 * np.sin(2 * np.pi * t / 23)
    v, phi = 0.3 * np.cos(2 * np.pi * t / 41), np.full(t.size, roll)
    sinking = -u * np.sin(theta) + np.cos(theta) * (w * np.cos(phi) + v * np.sin(phi))
    z = 30 + np.concatenate([[0], np.cumsum(0.05 * (sinking[1:] + sinking[:-1]))])
    z = z + noise * np.random.default_rng(1).normal(size=t.size)
    outputs = {"u": u, "v": v, "w": w, "phi": phi, "theta": theta, "z": z}
    return Trial(name, t, {"delta_s": 0.1 * np.sin(t)}, outputs, synthetic=True)


def found(*trials: Trial) -> list[tuple[str, str]]:
    return [(one.code, one.message) for one in check_trials(trials) if one.code in FAULTS]


@pytest.mark.parametrize("roll", [0.0, 0.5])
def test_a_right_log_is_left_alone(roll: float) -> None:
    assert found(diving(roll=roll, noise=0.05)) == []


@pytest.mark.parametrize(
    ("channel", "fault", "says"),
    [
        ("z", lambda a: 0.01 * a, "z was taken for cm, or u is in cm/s"),
        ("z", lambda a: a / 0.3048, "z is in ft"),
        ("u", lambda a: a * 3600 / 1852, "u is in kn"),
        ("u", lambda a: a * 1852 / 3600, "u was taken for kn"),
        ("z", lambda a: 30 + 1.6 * (a - 30), "changes by 1.6 times"),
    ],
)
def test_a_wrong_unit_is_named(channel: str, fault: Callable[[Array], Array], says: str) -> None:
    ((code, message),) = found(altered(diving(noise=0.01), {channel: fault}))
    assert code == "depth-scale"
    assert says in message


def test_a_calibration_is_left_to_the_fit() -> None:
    assert found(altered(diving(), {"u": lambda a: 1.05 * a})) == []


def test_a_heave_velocity_that_is_turned_round_is_found_in_its_own_noise() -> None:
    # A slow error of the log, of 8 s, adds up to as much as the heave itself: the depth follows half of what w says.
    error = lfilter(
        [0.0644 * np.sqrt(1 - np.exp(-0.025))], [1, -np.exp(-0.0125)], np.random.default_rng(2).normal(size=3000)
    )
    assert found(altered(diving(), {"w": lambda a: a + error})) == []
    ((code, message),) = found(altered(diving(), {"w": lambda a: error - a}))
    assert code == "heave-sign"
    assert "changes by -0.4" in message


def test_a_heave_velocity_that_is_turned_round_is_found() -> None:
    ((code, message),) = found(altered(diving(), {"w": np.negative}))
    assert code == "heave-sign"
    assert "-1.0" in message


def test_a_pressure_cell_that_shows_a_part_of_the_waves_is_not_turned_round() -> None:
    """The depth falls a little where the speeds say that it grows; it did the other way in eight trials of an AUV."""
    level = diving("level")
    depth = 30 - 0.2 * (level.outputs["z"] - 30)
    assert found(altered(level, {"z": lambda a: depth})) == []
    assert [code for code, _ in found(altered(level, {"z": lambda a: 60 - a}))] == ["depth-pitch-sign"]


@pytest.mark.parametrize(("times", "unit"), [(100.0, "cm"), (1.0 / 0.3048, "ft"), (1.0, None), (2.0, None)])
def test_a_depth_in_another_unit_shows_beside_the_speed_down_alone(times: float, unit: str | None) -> None:
    """Of an ROV, whose pitch nobody records."""
    t = np.arange(0, 200, 0.2)
    w = 0.2 * np.sin(2 * np.pi * t / 40)
    rng = np.random.default_rng(2)
    z = times * (3.0 + np.concatenate([[0], np.cumsum(0.1 * (w[1:] + w[:-1]))]) + 0.01 * rng.normal(size=t.size))
    level = Trial("dip", t, {"c": np.sin(t)}, {"w": w + 0.01 * rng.normal(size=t.size), "z": z}, synthetic=True)
    said = [one for one in check_trials([level]) if one.code == "unit"]
    assert [one.channel for one in said] == ([] if unit is None else ["z"])
    assert all(f"is in {unit}" in one.message for one in said)
