"""Steady stretches: nothing moves in them, the pitch neither."""

from __future__ import annotations

import math

import numpy as np
from long_log import long_log

from seatruth.manoeuvres import Straight, run_manoeuvre
from seatruth.manoeuvres.steady import steady
from seatruth.models import load_model
from seatruth.trials import Trial

RUN, TRUE = long_log()


def test_steady_stretches_are_runs_and_steady_turns() -> None:
    found = steady(RUN)
    circle = TRUE[1]
    assert any(circle[1] < s.start and s.end <= circle[2] and "rudder 35.0 deg" in s.facts for s in found)
    assert any("rudder 0.0 deg" in s.facts or "rudder -0.0 deg" in s.facts for s in found)
    assert all(s.duration >= 19.9 for s in found)
    zigzag = TRUE[0]
    assert not any(s.start < zigzag[2] - 5 and s.end > zigzag[1] + 5 for s in found)
    straight = run_manoeuvre(load_model("mmg"), Straight(100.0), dt=1.0, first_state={"u": 1.18}, inputs={"n": 11.85})
    assert [(s.start, s.end) for s in steady(straight)] == [(0.0, 100.0)]


def test_a_glider_that_pitches_up_is_not_steady() -> None:
    """Its speed and all usual inputs stay the same through the inflexion."""
    t = np.arange(0.0, 400.0, 0.5)
    theta = np.radians(30.0 * np.tanh((t - 200.0) / 5.0))
    log = Trial("yo", t, {}, {"u": 0.4 + 0.0 * t, "theta": theta})
    found = steady(log)
    assert len(found) == 2
    assert not any(s.start < 195.0 < s.end or s.start < 205.0 < s.end for s in found)
    assert [s.facts.rpartition(", ")[2] for s in found] == ["pitch -30 deg", "pitch 30 deg"]
    assert math.isclose(found[0].start, 0.0)


def test_an_input_of_the_model_that_moves_ends_a_steady_stretch() -> None:
    """Only the model knows that the log holds one."""
    model = load_model("glider")
    t = np.arange(0.0, 200.0, 0.5)
    moved = {model.inputs[0].name: np.where(t < 100.0, 0.3, -0.3)}
    log = Trial("yo", t, {}, {"u": 0.4 + 0.0 * t, "theta": 0.0 * t, **moved})
    assert len(steady(log)) == 1
    assert len(steady(log, model=model)) == 2
