"""A vehicle whose log holds no surge speed, steered by pods under names of their own, is predicted as any other."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from seatruth import identify, load_model, load_study, predict
from seatruth.errors import BadInput
from seatruth.manoeuvres import TurningCircle, Zigzag, run_manoeuvre, self_propulsion
from seatruth.prediction.conditions import approach_speed
from seatruth.prediction.first_motion import first_motion
from seatruth.trials import Trial

DEG = math.radians(1.0)
TUG = """
import math

from seatruth import Channel, Model, Parameter
from seatruth.models import Rudder


class Tug(Model):
    name = "tug"
    title = "Two pods aft"
    states = outputs = (
        Channel("u", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True), Channel("x", "m"),
        Channel("y", "m"),
    )
    inputs = (Channel("az_p", "rad"), Channel("az_s", "rad"), Channel("n_p", "rev/s"), Channel("n_s", "rev/s"))
    parameters = (Parameter("N_r", 0.5, "1/s", min=0.1, max=2.0),)
    actuators = (Rudder("port", "az_p"), Rudder("stbd", "az_s"))

    @staticmethod
    def rhs(s, i, p):
        port, stbd = i.n_p * (i.n_p - s.u), i.n_s * (i.n_s - s.u)
        return (
            0.01 * (port * math.cos(i.az_p) + stbd * math.cos(i.az_s)) - 0.3 * s.u,
            -0.006 * (port * math.sin(i.az_p) + stbd * math.sin(i.az_s)) - p.N_r * s.r,
            s.r,
            s.u * math.cos(s.psi),
            s.u * math.sin(s.psi),
        )
"""
STUDY = """
[study]
name = "tug"

[model]
use = "tug.py:Tug"
vary = ["N_r"]

[channels]
az_p = "az_p"
az_s = "az_s"
n_p = "n_p"
n_s = "n_s"
psi = "psi"
r = "r"
%s

[[trials]]
file = "run.csv"
without = [%s]

[cost]
kind = "trajectory"
initial = "fixed"
"""
POSITIONS = "x = 'x'\ny = 'y'", "'u'"
SPEEDS = "sog = 'sog'\ncog = 'cog'", "'u', 'x', 'y'"


@pytest.fixture
def tug(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Trial:
    """A zigzag under pods, of which the log has no speed through or over ground ahead."""
    monkeypatch.chdir(tmp_path)
    Path("tug.py").write_text(TUG)
    model = load_model("tug.py:Tug", tmp_path)
    n = self_propulsion(model, 2.0)
    plan = Zigzag(10 * DEG, 10 * DEG, executes=5, approach=10.0)
    run = run_manoeuvre(model, plan, dt=0.1, first_state={"u": 2.0}, inputs={"n_p": n, "n_s": n})
    rng = np.random.default_rng(1)
    shown = {name: values + 0.002 * rng.standard_normal(len(run)) for name, values in run.outputs.items()}
    log = pd.DataFrame({"t": run.t, **run.inputs, **shown, "sog": shown["u"], "cog": run.outputs["psi"]})
    log.to_csv("run.csv", index=False)
    return run


@pytest.mark.parametrize("known", [POSITIONS, SPEEDS], ids=["positions", "sog"])
def test_the_approach_speed_is_that_of_positions_or_of_the_ground(tug: Trial, known: tuple[str, str]) -> None:
    Path("s.toml").write_text(STUDY % known)
    study = load_study("s.toml")
    assert approach_speed(study.model, list(study.trials), None) == pytest.approx(2.0, abs=0.02)
    rows = np.arange(200, 203)
    assert first_motion(study.model, study.trials[0], rows)["u"] == pytest.approx(tug.outputs["u"][201], abs=0.05)


def test_manoeuvres_begin_with_that_speed(tug: Trial) -> None:
    """Planned ones, and the recorded zigzag that is sailed anew: both began at rest, under pods at rest."""
    Path("s.toml").write_text(STUDY % POSITIONS)
    study = load_study("s.toml")
    found = predict(study, identify(study), [TurningCircle(20 * DEG)], draws=40)
    turn = found.figures.set_index("figure").value
    model = load_model("tug.py:Tug", Path())
    n = found.conditions["inputs"]["n_p"]
    assert n == pytest.approx(self_propulsion(model, found.conditions["speed"]))
    assert n == found.conditions["inputs"]["n_s"]
    assert turn["advance"] > 5.0
    zigzag = found.measured.set_index("figure")
    for figure in ("first_overshoot", "initial_turning_distance", "reach"):
        assert zigzag.predicted[figure] == pytest.approx(zigzag.measured[figure], rel=0.06), figure


def test_a_log_of_headings_alone_asks_for_a_speed() -> None:
    t = np.arange(0.0, 20.0, 0.5)
    run = Trial("run", t, {"delta": 0.0 * t, "n": 0.0 * t}, {"psi": 0.0 * t})
    with pytest.raises(BadInput, match="no trial recorded a speed, nor positions"):
        approach_speed(load_model("mmg"), [run], None)
