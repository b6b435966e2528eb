"""The time grid: holds of inputs, steps that end at samples, gaps, the longest step, and trials that are refused."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import psutil
import pytest
from known_models import Lag, exact_lag, record_of, step_record

from seatruth.errors import BadInput
from seatruth.simulate import simulator
from seatruth.simulate.time_grid import time_grid, with_inputs
from seatruth.trials.channel import Channel, Hold
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


def test_a_grid_with_other_inputs_is_the_one_made_anew() -> None:
    """Held and linear inputs, gaps, several steps in an interval; what did not change stays the same array of times."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0.0, 20.0, 60))

    class Two(Lag):
        inputs = (Channel("push", "1"), Channel("pull", "1"))
        holds: ClassVar[dict[str, Hold]] = {"pull": "zoh"}

    def trial(seed: int, name: str) -> Trial:
        values = np.random.default_rng(seed).standard_normal((2, t.size))
        return Trial(name, t, {"push": values[0], "pull": values[1]}, {})

    model, before = Two(), [trial(1, "a"), trial(2, "b")]
    after = [
        replace(one, inputs={**one.inputs, "pull": other.inputs["pull"]}) for one, other in zip(before, before[::-1])
    ]
    last = [replace(one, inputs={**one.inputs, "push": -one.inputs["push"]}) for one in after]
    own = time_grid(model, before, "foh", 0.05)
    once = with_inputs(own, model, after, {"pull"}, "foh")
    twice = with_inputs(once, model, last, {"push"}, "foh")
    for grid, trials in ((once, after), (twice, last)):
        anew = time_grid(model, trials, "foh", 0.05)
        np.testing.assert_array_equal(grid.inputs, anew.inputs)
        np.testing.assert_array_equal(grid.stage_inputs, anew.stage_inputs)
        assert grid.t is own.t
        assert grid.base is own
    assert (once.changed, twice.changed) == ({1}, {0, 1})
    with pytest.raises(BadInput, match="trial 'a', channel 'push'"):
        with_inputs(
            own, model, [replace(after[0], inputs={**after[0].inputs, "push": np.full(60, np.nan)})], {"push"}, "foh"
        )


def test_a_simulator_with_other_inputs_gives_what_one_made_anew_gives() -> None:
    """Also where an equation uses the input in an expression of its own, and where a time changes."""

    class Squared(Lag):
        inputs = (Channel("push", "1"), Channel("pull", "1"))

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> Any:
            rest = Lag.rhs(s, i, p)
            return rest[0] + 0.1 * i.pull * i.pull, rest[1]

    t = np.arange(0.0, 20.0, 0.25)
    base = Trial("run", t, {"push": np.sin(t), "pull": np.cos(t)}, {})
    others = [
        replace(base, inputs={**base.inputs, "pull": np.cos(2.0 * t)}),
        replace(base, inputs={**base.inputs, "push": np.sin(3.0 * t)}),
        replace(base, t=t + 1.0),
    ]
    own = simulator(Squared(), [base])
    own.outputs(np.zeros((1, 0)), np.zeros((1, 2)))
    for other in others:
        found = own.rebind(trials=[other]).outputs(np.zeros((1, 0)), np.zeros((1, 2))).y
        anew = simulator(Squared(), [other]).outputs(np.zeros((1, 0)), np.zeros((1, 2))).y
        np.testing.assert_array_equal(found, anew)
        assert not np.array_equal(found, own.outputs(np.zeros((1, 0)), np.zeros((1, 2))).y) or other is others[2]
