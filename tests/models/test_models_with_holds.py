"""Inputs with a rule of their own between samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.models import BlackBox, Model, Parameter
from seatruth.models.with_holds import WithHolds
from seatruth.models.with_servos import Order, WithServos
from seatruth.simulate import simulator
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial


class Sum(Model):
    """Two states that integrate an input each."""

    name = "sum"
    states = (Channel("a", "m"), Channel("b", "m"))
    inputs = (Channel("order", "m/s"), Channel("measured", "m/s"))
    outputs = states
    parameters = (Parameter("k", 1.0, "1"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.k * i.order, p.k * i.measured)


X = Channel("x", "m")
RAMP = Trial("ramp", np.arange(5.0), {"order": np.arange(5.0), "measured": np.arange(5.0)}, {})


def ends(model: Model, hold: str) -> list[float]:
    """Both integrals at the end of the ramp: 8 m of a line, 6 m of steps that are held."""
    found = simulator(model, [RAMP], hold=hold).outputs(np.zeros((1, 0)), np.zeros((1, len(model.states))))
    return found.y[0, -1, :2].round(9).tolist()


@pytest.mark.parametrize(("hold", "plain", "own"), [("zoh", [6.0, 6.0], [6.0, 8.0]), ("foh", [8.0, 8.0], [8.0, 8.0])])
def test_an_input_goes_between_samples_as_it_says(hold: str, plain: list[float], own: list[float]) -> None:
    assert ends(Sum(), hold) == plain
    assert ends(WithHolds(Sum(), {"measured": "foh"}), hold) == own
    assert ends(WithHolds(Sum(), {"order": "zoh", "measured": "foh"}), hold) == [6.0, 8.0]


def test_a_dead_time_follows_the_rule_of_its_input() -> None:
    own = WithHolds(Sum(), {"order": "zoh", "measured": "foh"})
    late = WithServos(own, {"order": Order(delay=1.0), "measured": Order(delay=1.0)})
    assert late.holds == {"order": "zoh", "measured": "foh"}
    assert ends(late, "foh") == [3.0, 4.5]


def test_what_knows_no_such_rule_is_refused() -> None:
    box = BlackBox("box", lambda trial, p, first: {}, inputs=[Channel("n", "rev/s")], outputs=[X], parameters=[])
    with pytest.raises(BadInput, match="integrates by itself"):
        WithHolds(box, {"n": "foh"})
    with pytest.raises(BadInput, match="no input 'measurd'"):
        WithHolds(Sum(), {"measurd": "foh"})
