"""Headings that stand at an angle to the course on every course alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seatruth.trials import Trial, check_trials
from seatruth.trials.check.headings import heading_offset


def legs(*courses: float, off: float = 0.0, current: complex = 0.0, names: tuple[str, ...] = ("sog", "cog")) -> Trial:
    """Legs of a minute at 2 m/s on these courses (deg), with a heading that is `off` (deg) the course through water."""
    t = np.arange(0.0, 60.0 * len(courses), 0.5)
    heading = np.radians(np.array(courses)[(t // 60.0).astype(int)])
    velocity = 2.0 * np.exp(1j * heading) + current
    way = np.concatenate([[0.0], np.cumsum(0.25 * (velocity[1:] + velocity[:-1]))])
    rng = np.random.default_rng(1)
    x, y, psi = (rng.normal(0.0, sd, t.size) for sd in (0.1, 0.1, 0.005))
    outputs = {
        "x": way.real + x,
        "y": way.imag + y,
        "psi": heading - np.radians(off) + psi,
        "sog": np.abs(velocity),
        "cog": np.angle(velocity),
    }
    kept = {name: values for name, values in outputs.items() if name in ("x", "y", "psi", *names)}
    return Trial("legs", t, {"n": 10.0 + np.sin(t)}, kept, synthetic=True)


def found(*trials: Trial) -> list[str]:
    return [one.message for one in check_trials(trials) if one.code == "heading-offset"]


@pytest.mark.parametrize("names", [("sog", "cog"), ()])
@pytest.mark.parametrize(("off", "side"), [(90.0, "starboard"), (-20.0, "port")])
def test_a_heading_at_an_angle_on_every_course_is_told(off: float, side: str, names: tuple[str, ...]) -> None:
    (said,) = found(legs(0, 120, 240, off=off, names=names))
    assert f"to {side} of psi" in said
    assert float(said.split(" moves ")[1].split()[0]) == pytest.approx(abs(off), abs=1.0)


def test_a_current_or_a_compass_is_not() -> None:
    assert found(legs(0, 120, 240, off=10.0)) == []
    assert found(legs(0, 180, current=1.5j)) == []  # 37 deg to one side, then to the other
    assert found(legs(30, 30, current=3.0j)) == []  # on one course nobody can tell


def test_courses_of_several_trials_count_together() -> None:
    one, other = legs(0, 20, off=90.0), replace(legs(150, 170, off=90.0), name="back")
    assert found(one) == []
    assert len(found(one, other)) == 1


@pytest.mark.parametrize("off", [90.0, -20.0, 150.0])
@pytest.mark.parametrize("speeds", [False, True])
def test_the_angle_from_the_heading_to_the_track_is_measured(off: float, speeds: bool) -> None:
    log = legs(0, 120, 240, off=off)
    if speeds:
        log = replace(log, outputs={**log.outputs, "u": np.full(len(log), 2.0), "v": np.zeros(len(log))})
    angle = heading_offset([log])
    assert angle is not None
    assert np.degrees(angle) == pytest.approx(off, abs=3.0)


def test_no_angle_holds_where_a_current_or_a_compass_turns_the_track() -> None:
    assert heading_offset([legs(0, 120, 240, off=10.0)]) is None
    assert heading_offset([legs(0, 180, current=1.5j)]) is None
    assert heading_offset([]) is None
