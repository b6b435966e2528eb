"""A study of any model whose equations are asked, and a ship whose equations know nothing of what is outside."""

from __future__ import annotations

from typing import Any

import numpy as np

from seatruth import Channel, Model, Parameter, Study
from seatruth.trials import Trial, Trials

STATES = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"))
INPUTS = (Channel("delta", "rad"), Channel("n", "rev/s"))


class Unaware(Model):
    """Without e: seatruth computes what the water does, and no force from outside can act."""

    name = "unaware"
    states = outputs = STATES
    inputs = INPUTS
    parameters = (Parameter("d", 0.01, "1/m", 0.0, 1.0, vary=True),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return 0.05 * i.n - p.d * s.u * abs(s.u) + s.v * s.r, -0.05 * s.v - s.u * s.r, 0.1 * i.delta - 0.2 * s.r


def study(model: Model) -> Study:
    """A minute under way at 5 m/s."""
    t = np.arange(0.0, 60.0)
    outputs = {channel.name: 0.02 * np.sin(t) for channel in model.outputs}
    inputs = {channel.name: np.sin(0.1 * t) for channel in model.inputs}
    return Study("s", model, Trials([Trial("run", t, inputs, outputs | {"u": 5.0 + 0 * t})]))
