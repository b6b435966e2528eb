"""A boat with position and heading, and SYNTHETIC runs of it that a search from wrong values leaves half a turn off."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from seatruth.costs.options import TrajectoryOptions
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.study import Study
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial, Trials

NOISE = {"psi": 0.01, "x": 0.1, "y": 0.1}
TRUE = {"K": 0.5, "T": 3.0, "U": 1.5}


class Boat(Model):
    """Nomoto's first-order steering equation, and the track at a constant speed."""

    name = "boat"
    title = "A boat that steers"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True), Channel("x", "m"), Channel("y", "m"))
    inputs = (Channel("delta", "rad"),)
    outputs = (*states[1:],)
    parameters = (
        Parameter("K", 0.4, "1/s", -2.0, 2.0, vary=True, source="test"),
        Parameter("T", 4.0, "s", 0.3, 50.0, vary=True, source="test"),
        Parameter("U", 1.2, "m/s", -4.0, 4.0, vary=True, source="test"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.K * i.delta - s.r) / p.T, s.r, p.U * math.cos(s.psi), p.U * math.sin(s.psi)

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return 0.0, y.psi, y.x, y.y


@functools.cache
def runs(count: int = 1, n: int = 240) -> tuple[Trial, ...]:
    """Zigzags of 60 s and 24 s each way, recorded with noise."""
    from seatruth.simulate import simulator

    rng = np.random.default_rng(3)
    found = []
    for k in range(count):
        t = np.arange(n) * 0.25
        delta = np.where((t // (12.0 + 3.0 * k)) % 2 == 0, 0.35, -0.35)
        bare = Trial(f"run {k}", t, {"delta": delta}, {}, synthetic=True)
        values = {**Boat().nominal(), **TRUE}
        y = simulator(Boat(), [bare], values=values).outputs(np.zeros((1, 0)), np.zeros((1, 4))).y[0]
        outputs = {name: y[:, c] + rng.normal(size=n) * sd for c, (name, sd) in enumerate(NOISE.items())}
        found.append(Trial(f"run {k}", t, {"delta": delta}, outputs, synthetic=True))
    return tuple(found)


def study(count: int = 1, values: dict[str, float] | None = None, **changes: Any) -> Study:
    """The study that starts at these values."""
    parameters = tuple(p.replace(value=(values or {}).get(p.name, p.value)) for p in Boat.parameters)
    fields: dict[str, Any] = {"noise": NOISE, "cost": TrajectoryOptions(), "parameters": parameters, **changes}
    return Study("boat", Boat(), Trials(list(runs(count))), **fields)
