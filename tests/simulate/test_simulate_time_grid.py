"""The time grid: holds of inputs, steps that end at samples, gaps, the longest step, and trials that are refused."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
from known_models import Lag, exact_lag, record_of, step_record

from seatruth.errors import BadInput
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial


def test_hold_of_inputs() -> None:
    """Under a ramp sampled once a second, the held input lags by half a second and the linear one does not."""
    t = np.arange(0.0, 21.0)
    trial = record_of(t, lambda x: x)
    ends = {}
    for hold in ("foh", "zoh"):
        sim = simulator(Lag(), [trial], hold=hold, max_step=0.02)
        ends[hold] = sim.outputs(np.zeros((1, 0)), np.zeros((1, 2))).x_end[0, 0, 0]
    assert ends["foh"] == pytest.approx(1.5 * (20.0 - 2.0 + 2.0 * math.exp(-10.0)), rel=1e-9)
    held = 0.0
    for k in range(20):
        held = float(exact_lag(1.0, 1.5, 2.0, held, push=float(k)))
    assert ends["zoh"] == pytest.approx(held, rel=1e-9)


def test_an_input_may_be_linear_where_others_are_held() -> None:
    """Recorded orders are held from sample to sample, missing forces are not."""
    t = np.arange(0.0, 21.0)
    model = Lag()
    model.linear = ("push",)
    sim = simulator(model, [record_of(t, lambda x: x)], hold="zoh", max_step=0.02)
    end = sim.outputs(np.zeros((1, 0)), np.zeros((1, 2))).x_end[0, 0, 0]
    assert end == pytest.approx(1.5 * (20.0 - 2.0 + 2.0 * math.exp(-10.0)), rel=1e-9)


def test_steps_end_where_inputs_change() -> None:
    """A step in the input at an odd sample costs no accuracy: the exact answer comes out at fourth order."""
    t = np.array([0.0, 0.3, 0.37, 1.0, 1.9, 2.0])
    trial = record_of(t, lambda x: (x >= 0.37).astype(float))
    sim = simulator(Lag(), [trial], hold="zoh", max_step=0.01)
    expected = exact_lag(2.0 - 0.37, 1.5, 2.0, 0.0)
    assert sim.outputs(np.zeros((1, 0)), np.zeros((1, 2))).x_end[0, 0, 0] == pytest.approx(expected, rel=1e-10)


def test_a_gap_is_taken_in_several_steps() -> None:
    t = np.concatenate([np.arange(0.0, 2.0, 0.1), np.arange(6.0, 8.0, 0.1)])
    sim = simulator(Lag(), [record_of(t, np.ones_like)])
    assert sim.steps > len(t) + 20
    assert sim.outputs(np.zeros((1, 0)), np.zeros((1, 2))).y[0, :, 0] == pytest.approx(
        exact_lag(t, 1.5, 2.0, 0.0), abs=1e-6
    )


def test_longest_step() -> None:
    trial = step_record()
    assert simulator(Lag(), [trial], max_step=0.1).steps == 50
    assert simulator(Lag(), [trial], max_step=0.05).steps == 100
    assert simulator(Lag(), [trial], max_step=0.04).steps == 150


def test_steps_that_are_too_many_are_refused_before_they_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.append(np.arange(0.0, 30.0, 0.5), 1e6)
    trial = Trial("torn", t, {"push": 0 * t}, {})
    with pytest.raises(BadInput, match=r"'torn'.* after t = 29.5 s need 1.33e\+06 steps. Cut the trial there, or give"):
        simulator(Lag(), [trial])
    short = Trial("fine", t[:5], {"push": t[:5]}, {})
    with pytest.raises(BadInput, match=r"need 5e\+11 steps.*or allow longer steps"):
        simulator(Lag(), [short], max_step=1e-12)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=1e6))
    with pytest.raises(BadInput, match=r"the 1e\+04 steps of the simulation need .* GB of memory"):
        simulator(Lag(), [short], max_step=2e-4)


def test_trials_that_cannot_be_simulated_are_named() -> None:
    t = np.arange(5.0)
    with pytest.raises(BadInput, match="no input 'push'"):
        simulator(Lag(), [Trial("bare", t, {}, {})])
    with pytest.raises(BadInput, match="t = 2 s"):
        simulator(Lag(), [Trial("holed", t, {"push": np.array([0, 0, math.nan, 0, 0])}, {})])
    with pytest.raises(BadInput, match="no samples"):
        simulator(Lag(), [Trial("empty", t[:0], {"push": t[:0]}, {})])
    with pytest.raises(BadInput, match="no trial"):
        simulator(Lag(), [])
    with pytest.raises(BadInput, match="does not increase"):
        simulator(Lag(), [Trial("back", t[::-1], {"push": t}, {})])
