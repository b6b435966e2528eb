"""One step of a model's equations in plain Python: what simulated manoeuvres and the plain reference rest on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Environment, Model, call, record
from seatruth.models.servo import stages

EnvironmentAt = Callable[[float, Any], Environment]
"""From the time (s) and the states (a named tuple) to the environment of the vehicle."""


class Stepper:
    """A model's equations with its parameters bound, and one Runge-Kutta step of them."""

    def __init__(
        self, model: Model, values: Mapping[str, float] | None = None, environment: EnvironmentAt | None = None
    ) -> None:
        nominal = model.nominal()
        known_names(values or {}, nominal, f"model {model.name!r}: parameter")
        self.model, self.environment = model, environment
        self.p = record("Parameters", model.parameters)(**{**nominal, **(values or {})})
        self._state = record("States", model.states)
        self._inputs = record("Inputs", model.inputs)
        if environment is not None and not (model.takes_environment or model.takes_current):
            raise BadInput(f"model {model.name!r} takes no environment", do="Add the argument e to its rhs.")

    def first(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """A first state (S,): the values by name, zero for the other states."""
        known_names(values, {s.name: 0.0 for s in self.model.states}, f"model {self.model.name!r}: state")
        return tuple(float(values.get(s.name, 0.0)) for s in self.model.states)

    def rate(self, t: float, state: tuple[float, ...], inputs: Mapping[str, float]) -> tuple[float, ...]:
        """Rates of the states (S,) at time `t` (s), under the inputs as they act."""
        s, i = self._state(*state), self._inputs(**inputs)
        e = self.environment(t, s) if self.environment is not None else Environment(t=t)
        return call(self.model.name, "rhs", self.model.rhs, s, i, self.p, e)

    def outputs(self, state: tuple[float, ...], inputs: Mapping[str, float]) -> dict[str, float]:
        """Outputs by name."""
        s = self._state(*state)
        if self.model.output is None:
            return {c.name: float(getattr(s, c.name)) for c in self.model.outputs}
        i = self._inputs(**{**inputs, **{servo.input: getattr(s, servo.state) for servo in self.model.servos}})
        result = call(self.model.name, "output", self.model.output, s, i, self.p, Environment())
        return {c.name: float(y) for c, y in zip(self.model.outputs, result)}

    def step(
        self, t: float, state: tuple[float, ...], start: Mapping[str, float], end: Mapping[str, float], h: float
    ) -> tuple[float, ...]:
        """The state after `h`, recorded inputs linear from `start` to `end`."""
        start, middle, end = dict(start), {name: 0.5 * (start[name] + end[name]) for name in start}, dict(end)
        places = {}
        for servo in self.model.servos:
            place = [channel.name for channel in self.model.states].index(servo.state)
            values = stages(state[place], start[servo.input], end[servo.input], h, *servo.settings(self.p))
            start[servo.input], middle[servo.input], end[servo.input] = values
            places[place] = values[2]
        k1 = self.rate(t, state, start)
        k2 = self.rate(t + h / 2, tuple(x + h / 2 * d for x, d in zip(state, k1)), middle)
        k3 = self.rate(t + h / 2, tuple(x + h / 2 * d for x, d in zip(state, k2)), middle)
        k4 = self.rate(t + h, tuple(x + h * d for x, d in zip(state, k3)), end)
        after = (x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(state, k1, k2, k3, k4))
        return tuple(places.get(place, x) for place, x in enumerate(after))


def known_names(names: Mapping[str, Any], known: Mapping[str, Any], what: str) -> None:
    """BadInput where a name is not among the known ones."""
    for name in names:
        if name not in known:
            raise BadInput(f"{what} {name!r} does not exist", do=nearest(name, known))
