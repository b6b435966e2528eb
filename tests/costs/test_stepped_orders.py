"""Orders that step: between samples that lines join, and in pauses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from astray_boat import study

from seatruth import identify
from seatruth.analysis import check_study
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.stepped_orders import steps_from_rest, without_stale_notes
from seatruth.models import Model, Observation, Order, Parameter, observed, with_servos
from seatruth.study import Study
from seatruth.trials import Channel
from seatruth.trials.channel import Hold
from seatruth.trials.finding import Finding
from seatruth.trials.split import split_at_gaps
from seatruth.trials.trial import Trial, Trials


def ordered(hold: Hold, *, smooth: bool = False) -> Study:
    plain = study(cost=TrajectoryOptions(hold=hold))
    trials = plain.trials
    if smooth:
        trials = Trials([replace(t, inputs={"delta": 0.3 * np.sin(0.5 * t.t)}) for t in trials])
    model = with_servos(plain.model, {"delta": Order(lag=0.5)})
    return Study("orders", model, trials, cost=plain.cost, noise=plain.noise)


@pytest.mark.parametrize(("hold", "smooth", "said"), [("foh", False, 1), ("zoh", False, 0), ("foh", True, 0)])
def test_orders_that_step_ask_for_a_hold(hold: Hold, smooth: bool, said: int) -> None:
    codes = [finding.code for finding in check_study(ordered(hold, smooth=smooth))]
    assert codes.count("orders-step") == said
    assert "input-jumps" not in codes  # the study has said that they are orders


def test_a_record_that_is_not_said_to_be_an_order_is_asked_about() -> None:
    codes = [finding.code for finding in check_study(study())]
    assert "input-jumps" in codes
    assert "orders-step" not in codes


@pytest.mark.parametrize(("noise", "said"), [(0.02, True), (0.04, False), ("estimate", True)])
def test_a_noise_that_is_larger_than_the_rounding_is_not_asked_for(noise: float | str, said: bool) -> None:
    """The rounding to 0.1 rad has a standard deviation of 0.029 rad."""
    plain = study()
    trials = [replace(t, outputs={**t.outputs, "psi": np.round(t.outputs["psi"], 1)}) for t in plain.trials]
    coarse = plain.replace(trials=Trials(trials), noise={**plain.noise, "psi": noise})
    assert ("quantised" in [finding.code for finding in check_study(coarse)]) == said


@pytest.mark.parametrize(("at", "left"), [(None, True), ((0.0, 0.0, 0.0), True), ((-0.3, 0.0, 0.0), False)])
def test_an_antenna_whose_place_is_stated_is_not_asked_for_it(
    at: tuple[float, float, float] | None, left: bool
) -> None:
    """With a servo in front of the model as well."""
    plain = ordered("zoh")
    model = with_servos(observed(study().model, [Observation("x", "x", at)] if at else []), {"delta": Order(lag=0.5)})
    said = Finding("note", "lever-arm", "x, y move like a point", plain.trials[0].name, channel="x")
    kept = without_stale_notes([said], plain.replace(model=model), plain.trials)
    assert bool(kept) == left


def paused(*, split: bool) -> Study:
    """Samples are missing where the rudder steps for the third time."""
    plain = study()
    runs: list[Trial] = []
    for trial in plain.trials:
        delta = trial.inputs["delta"]
        jumps = np.flatnonzero(np.abs(np.diff(delta)) > 0.5 * np.ptp(delta))
        kept = np.abs(np.arange(len(trial)) - jumps[min(2, jumps.size - 1)]) > 5
        cut = trial.samples(np.flatnonzero(kept))
        runs += split_at_gaps(cut) if split else [cut]
    return plain.replace(trials=Trials(runs))


def test_a_step_in_a_pause_leaves_nothing_identified() -> None:
    """When it was is not known; a new trial after the pause does not need it."""
    whole, parts = identify(paused(split=False), threads=1), identify(paused(split=True), threads=1)
    codes = [[finding.code for finding in estimate.findings] for estimate in (whole, parts)]
    assert "step-in-gap" in codes[0]
    assert "step-in-gap" not in codes[1]
    assert "identified" not in set(whole.parameters["verdict"])
    assert "identified" in set(parts.parameters["verdict"])


class Pulsed(Model):
    """A vehicle whose speed controller takes pulses."""

    name, title, kind = "pulsed", "raft", "ship"
    states = outputs = (Channel("u", "m/s"),)
    inputs = (Channel("pwm_1", "us"),)
    parameters = (Parameter("k", 0.01, "m/s^2", vary=True, source="own"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return (p.k * (i.pwm_1 - 1500.0) - s.u,)


@pytest.mark.parametrize(("hold", "said"), [("foh", 1), ("zoh", 0)])
def test_pulses_that_step_ask_for_a_hold(hold: Hold, said: int) -> None:
    """They are commands, whoever says so; an autopilot changes them a little all the time."""
    t = np.arange(0.0, 100.0, 0.1)
    pulses = np.where(t % 20.0 < 10.0, 1500.0, 1650.0) + np.arange(t.size) % 2
    trials = Trials([Trial("run", t, {"pwm_1": pulses}, {"u": np.sin(t)})])
    codes = [f.code for f in check_study(Study("raft", Pulsed(), trials, cost=TrajectoryOptions(hold=hold)))]
    assert codes.count("orders-step") == said


@pytest.mark.parametrize(
    ("values", "steps"),
    [
        ([660.0, 660.0, 661.0, 661.0, 661.0, 659.0, 659.0, 660.0], 0),  # a measured speed, rounded
        ([0.0, 0.0, 0.35, 0.35, 0.35, -0.35, -0.35, -0.35], 2),  # a rudder of two angles
        ([660.0, 660.0, 660.0, 700.0, 700.0, 700.0, 700.0], 1),
        ([1500.0, 1500.0, 1500.0, 1560.0, 1560.0, 1560.0], 1),
    ],
)
def test_the_last_digit_of_a_record_is_no_step(values: list[float], steps: int) -> None:
    assert steps_from_rest(np.array(values)) == steps
