"""Delays and lags by two filters, against the exact ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatruth.effects import available, with_effects
from seatruth.effects.filtered import FASTEST, SLOWEST, Filtered
from seatruth.models import load_model
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial


@pytest.mark.parametrize(
    ("name", "output", "tau", "near"),
    [
        ("rate_delay", "r", 0.08, 0.05),
        ("speed_delay", "v", 0.3, 0.05),
        ("heading_delay", "psi", 0.2, 0.05),
        ("heading_delay", "psi", 1.5, 0.25),
    ],
)
def test_a_small_fast_vehicle_is_delayed_as_it_should_be(name: str, output: str, tau: float, near: float) -> None:
    """A torpedo under fins that swing in two seconds: to so much of what the delay changes.

    Filters of 0.1 s whatever the delay, carried on by a parabola, left 64 % of 1.5 s.
    """
    model = with_effects(load_model("torpedo"), [available()[name]])
    t = np.arange(0.0, 20.0, 0.02)
    inputs = {channel.name: np.zeros(t.size) for channel in model.inputs}
    inputs["delta"], inputs["n"] = 0.1 * np.sin(1.2 * t) + 0.05 * np.sin(3.1 * t), np.full(t.size, 25.0)
    engine = simulator(model, [Trial("quick", t, inputs, {}, synthetic=True)], (f"{name}_tau",), model.nominal())
    first = engine.initial_states.copy()
    first[:, [channel.name for channel in model.states].index("u")] = 1.5
    plain, late = engine.outputs(np.array([[0.0], [tau]]), first).y
    k = [channel.name for channel in model.outputs].index(output)
    exact = np.interp(t - tau, t, plain[:, k])
    later = t > 2.0 + 2.0 * tau
    missed, changed = late[later, k] - exact[later], plain[later, k] - exact[later]
    assert np.sqrt(np.mean(missed**2)) < near * np.sqrt(np.mean(changed**2))


@pytest.mark.parametrize(
    ("model", "time"),
    [("abkowitz", SLOWEST), ("mmg", SLOWEST * math.sqrt(0.07)), ("torpedo", FASTEST), ("glider", SLOWEST)],
)
def test_filters_are_as_fast_as_the_vehicle(model: str, time: float) -> None:
    vehicle = load_model(model)
    for name in ("heading_delay", "rudder_delay", "rudder_backlash"):
        if not available()[name].missing(vehicle):
            fitted = available()[name].on(vehicle)
            assert isinstance(fitted, Filtered)
            assert (fitted.filter_time, fitted.longest_step) == (pytest.approx(time), pytest.approx(2.0 * time))
    current = available()["current"]
    assert current.on(vehicle) is current


@pytest.mark.parametrize("tau", [0.3, 2.0])
def test_a_long_dead_time_of_a_rudder_is_one(tau: float) -> None:
    """A torpedo whose fins are ordered in steps, against shifted orders: to 12 % of what the dead time changes.

    One pair of filters leaves 24 % of 2 s, two 15 %, four 9 %.
    """
    plain, late = load_model("torpedo"), with_effects(load_model("torpedo"), [available()["rudder_delay"]])
    t = np.arange(0.0, 40.0, 0.1)
    order = 0.1 * np.sign(np.sin(0.7 * t)) * (t > 4.0)
    rates = []
    for model, angle in ((plain, order), (late, order), (plain, np.interp(t - tau, t, order))):
        inputs = {channel.name: np.zeros(t.size) for channel in model.inputs} | {
            "delta": angle,
            "n": np.full(t.size, 25.0),
        }
        free = ("rudder_delay_tau",) if model is late else ()
        trial = Trial("steps", t, inputs, {}, synthetic=True)
        engine = simulator(model, [trial], free, model.nominal(), hold="zoh")
        first = engine.initial_states.copy()
        first[:, [channel.name for channel in model.states].index("u")] = 1.5
        theta = np.full((1, len(free)), tau)
        rates.append(engine.outputs(theta, first).y[0][:, [channel.name for channel in model.outputs].index("r")])
    recorded, seen, exact = rates
    assert np.sqrt(np.mean((seen - exact) ** 2)) < 0.12 * np.sqrt(np.mean((recorded - exact) ** 2))
