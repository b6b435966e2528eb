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


@pytest.mark.parametrize(("name", "output", "tau"), [("rate_delay", "r", 0.08), ("heading_delay", "psi", 0.2)])
def test_a_small_fast_vehicle_is_delayed_as_it_should_be(name: str, output: str, tau: float) -> None:
    """A torpedo under fins that swing in two seconds: to 5 % of what the delay changes."""
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
    later = t > 2.0
    missed, changed = late[later, k] - exact[later], plain[later, k] - exact[later]
    assert np.sqrt(np.mean(missed**2)) < 0.05 * np.sqrt(np.mean(changed**2))


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
