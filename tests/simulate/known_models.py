"""Small models whose motion is known, and trials to run them on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial


class Lag(Model):
    """dx/dt = (k input - x) / T and the angle that x turns."""

    name = "lag"
    states = (Channel("x", "1"), Channel("angle", "rad"))
    inputs = (Channel("push", "1"),)
    outputs = states
    parameters = (Parameter("T", 2.0, "s"), Parameter("k", 1.5, "1"), Parameter("unused", 7.0, "1"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.k * i.push - s.x) / p.T, s.x


class Blowing(Model):
    """dx/dt = a x^2: leaves every bound at t = 1 / (a x0)."""

    name = "blowing"
    states = (Channel("x", "1"),)
    outputs = states
    parameters = (Parameter("a", 1.0, "1"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.a * s.x * s.x,)


def record_of(t: Any, push: Callable[[Any], Any] | None = None, name: str = "run", **outputs: Any) -> Trial:
    times = np.asarray(t, dtype=np.float64)
    inputs = {} if push is None else {"push": np.asarray(push(times), dtype=np.float64)}
    return Trial(name, times, inputs, outputs, synthetic=True)


def step_record(n: int = 51, dt: float = 0.1, **outputs: Any) -> Trial:
    return record_of(np.arange(n) * dt, np.ones_like, **outputs)


def plain_model(
    rates: Callable[..., Any], states: Sequence[str], parameters: Sequence[str] = (), inputs: Sequence[str] = ()
) -> Model:
    """A model of one function; every parameter is 1."""

    class Plain(Model):
        name = "plain"

    Plain.states = tuple(Channel(name, "1") for name in states)
    Plain.outputs = Plain.states
    Plain.inputs = tuple(Channel(name, "1") for name in inputs)
    Plain.parameters = tuple(Parameter(name, 1.0, "1") for name in parameters)
    Plain.rhs = staticmethod(rates)
    return Plain()


def exact_lag(t: Any, k: float, period: float, x0: float, push: float = 1.0) -> Any:
    """x of `Lag` under a constant push from x0."""
    return k * push + (x0 - k * push) * np.exp(-np.asarray(t) / period)
