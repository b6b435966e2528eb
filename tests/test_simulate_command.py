"""What `seatruth simulate` says of a run that diverges."""

from __future__ import annotations

from pathlib import Path

import pytest
from nomoto_ship import call

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
