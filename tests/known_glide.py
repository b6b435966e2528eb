"""A known motion with two things to find, its noisy runs, and studies of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from seatruth.costs.options import TrajectoryOptions, option_names
from seatruth.estimate import Estimate
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.study import Study
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial, Trials


class Glide(Model):
    """dv/dt = (push - a v - b v|v|) / m: a known motion with two things to find."""

    name = "glide"
    title = "A body pushed through water"
    states = (Channel("v", "m/s"), Channel("s", "m"))
    inputs = (Channel("push", "N"),)
    outputs = states
    parameters = (
        Parameter("a", 0.8, "N s/m", 0.0, 4.0, vary=True, source="test"),
        Parameter("b", 1.2, "N s2/m2", 0.0, 6.0, vary=True, source="test"),
        Parameter("m", 2.0, "kg", 0.5, 9.0, source="test"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (i.push - p.a * s.v - p.b * s.v * abs(s.v)) / p.m, s.v


TRUE = {"a": 0.5, "b": 2.0}
NOISE = {"v": 0.02, "s": 0.05}


def sailed(seed: int, runs: int = 3, n: int = 150) -> list[Trial]:
    from seatruth.simulate import simulator

    rng = np.random.default_rng(seed)
    found = []
    for k in range(runs):
        t = np.arange(n) * 0.2
        push = 2.0 * np.sign(np.sin(0.5 * t + k)) + np.sin(0.2 * t)
        bare = Trial(f"run {k}", t, {"push": push}, {}, synthetic=True)
        values = {**Glide().nominal(), **TRUE}
        y = simulator(Glide(), [bare], values=values).outputs(np.zeros((1, 0)), np.zeros((1, 2))).y[0]
        outputs = {name: y[:, c] + rng.normal(size=n) * NOISE[name] for c, name in enumerate(("v", "s"))}
        found.append(Trial(f"run {k}", t, {"push": push}, outputs, synthetic=True))
    return found


def study(seed: int = 1, **changes: Any) -> Study:
    trials = sailed(seed)
    options = {name: changes.pop(name) for name in option_names(TrajectoryOptions) if name in changes}
    cost = TrajectoryOptions(**{"initial": "free", **options})
    fields: dict[str, Any] = {"holdout": Trials(trials[2:]), "noise": NOISE, "cost": cost, **changes}
    return Study("glide", Glide(), Trials(trials[:2]), **fields)


def same(a: Estimate, b: Estimate) -> None:
    """Same bytes in everything but wall-clock times."""
    for name in ("parameters", "nuisances", "covariance", "sensitivity", "fit", "traces"):
        pd.testing.assert_frame_equal(getattr(a, name), getattr(b, name), check_exact=True)
    for name in ("optimizer", "cost", "identifiability", "discretisation", "seed"):
        assert getattr(a, name) == getattr(b, name), name
    timeless = [{k: v for k, v in e.outcome.items() if k != "wall_s"} for e in (a, b)]
    assert timeless[0] == timeless[1]
    assert list(a.history["best"]) == list(b.history["best"])
