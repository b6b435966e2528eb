"""The rates of a model at one state."""

from __future__ import annotations

import numpy as np

from seatruth.models import load_model
from seatruth.models.base import Environment
from seatruth.models.rates import rates_at
from seatruth.simulate import evaluate_rhs


def test_they_are_those_that_the_engine_computes() -> None:
    ship = load_model("mmg")
    states, inputs = {"u": 1.2, "v": -0.1, "r": 0.05, "psi": 0.4}, {"delta": 0.2, "n": 10.0}
    rows = np.array([[states.get(s.name, 0.0) for s in ship.states]])
    orders = np.array([[inputs.get(c.name, 0.0) for c in ship.inputs]])
    engine = evaluate_rhs(ship, np.zeros(0), [], ship.nominal(), rows, orders)[0]
    np.testing.assert_allclose(rates_at(ship, states, inputs), engine, rtol=1e-12)


def test_what_is_not_said_is_zero_and_forces_act() -> None:
    ship = load_model("mmg")
    rest = rates_at(ship)
    np.testing.assert_array_equal(rest, rates_at(ship, {"u": 0.0}, {"n": 0.0}, Environment()))
    pushed = rates_at(ship, e=Environment(X=10.0)) - rest
    assert pushed[[s.name for s in ship.states].index("u")] > 0.0
    assert np.flatnonzero(pushed).size == 1
