"""Derivatives through servos are those of the simulation with derivatives in its lanes."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.effects import available, effects_by_name, with_effects
from seatruth.models import Order, WithServos, load_model
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial

NAMES = ["current", "rudder_lag", "heading_bias", "rudder_rate_limit"]


@pytest.mark.parametrize("order", [Order(), Order(lag=0.4), Order(rate_limit=0.1), Order(lag=0.4, rate_limit=0.1)])
@pytest.mark.parametrize("acting", [(), ("rudder_lag_tau", "rudder_rate_limit_slowness")])
def test_both_ways_agree_behind_servos(order: Order, acting: tuple[str, ...]) -> None:
    """A servo that is known, or that an effect makes slower, with steps of its order and within steps of the run."""
    model = with_effects(
        WithServos(load_model("mmg"), {"delta": order, "n": Order()}), effects_by_name(NAMES, available())
    )
    n = 60
    inputs = {channel.name: np.full(n, 10.0) for channel in model.inputs}
    inputs["delta"] = 0.3 * np.sign(np.sin(0.2 * np.arange(n))) + 0.02 * np.sin(np.arange(n))
    outputs = {channel.name: np.full(n, 1.0) for channel in model.outputs}
    trial = Trial("run", 0.5 * np.arange(n), inputs, outputs, synthetic=True)
    free = tuple(p.name for p in model.parameters)
    values = {**model.nominal(), **dict.fromkeys(acting, 0.3)}
    theta, states = np.array([values[name] for name in free]), ("u", "v", "r", "psi", "delta_acting")
    for hold in ("foh", "zoh"):
        sim = simulator(model, [trial], free=free, max_step=0.25, hold=hold)
        found = sim.jacobian(theta, sim.initial_states, states, last_states=False)
        exact = sim.jacobian(theta, sim.initial_states, states)
        size = np.abs(exact.dy).max(axis=0)
        assert np.isfinite(exact.dy).all()
        assert (np.abs(found.dy - exact.dy).max(axis=0) <= 1e-10 * size + 1e-13).all()
        assert found.y == pytest.approx(exact.y, rel=1e-12, abs=1e-12)
