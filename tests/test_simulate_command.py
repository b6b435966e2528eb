"""What `seatruth simulate` says of runs that diverge, and of headings that are missed by far."""

from __future__ import annotations

from pathlib import Path

import pytest
from nomoto_ship import call, write_ship

MODEL = """
from seatruth.models import Channel, Model, Parameter


class Runaway(Model):
    name = "runaway"
    states = outputs = (Channel("u", "m/s"),)
    inputs = (Channel("n", "rev/s"),)
    parameters = (Parameter("a", 1.0, "1/m", 0.1, 2.0, vary=True, source="test"),)

    @staticmethod
    def rhs(s, i, p):
        return (p.a * s.u * s.u,)
"""

STUDY = """
[study]
name = "runaway"

[model]
use = "runaway.py:Runaway"

[channels]
n = { column = "n", unit = "rev/s" }
u = { column = "u", unit = "m/s" }

[time]
column = "t"

[[trials]]
file = "run.csv"
"""


SHIP_STUDY = """
[model]
use = "ship.py:Nomoto"

[parameters]
K = {{ value = {gain} }}
T = {{ value = 8.0 }}

[channels]
delta = {{ column = "rudder_deg", unit = "deg" }}
r = {{ column = "yaw rate [deg/s]" }}
psi = {{ column = "Heading", unit = "deg" }}

[time]
column = "Time(s)"

[[trials]]
file = "zigzag.csv"
"""


def test_it_says_when_and_from_where_a_run_diverges(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """From 0.5 m/s at t = 0 the speed is 1 / (2 - t) m/s: 5 at 1.8 s, and none from 2 s on."""
    monkeypatch.chdir(tmp_path)
    Path("runaway.py").write_text(MODEL)
    Path("study.toml").write_text(STUDY)
    Path("run.csv").write_text("t,n,u\n" + "".join(f"{0.2 * k:.1f},{k % 3},0.5\n" for k in range(30)))
    assert call("simulate", "study.toml") == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "The simulation of 'run' diverges at t = 2" in said
    assert "what the equations do there" in said


def test_headings_that_are_missed_by_far_are_told_in_degrees(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_ship(tmp_path)
    Path("study.toml").write_text(SHIP_STUDY.format(gain=0.12))
    assert call("simulate", "study.toml") == 0
    near = " ".join(capsys.readouterr().out.split())
    assert "deg/s" in near
    assert "rad" not in near
    assert "is missed by" not in near
    Path("study.toml").write_text(SHIP_STUDY.format(gain=0.9))
    assert call("simulate", "study.toml") == 0
    far = " ".join(capsys.readouterr().out.split())
    assert "psi is missed by" in far
    assert "nothing has been fitted yet" in far
