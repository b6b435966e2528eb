"""Trials made by simulation: a model runs a manoeuvre in closed loop, step by step in plain Python.

The engine can replay a trial open loop: the recorded inputs are those that acted, linear between samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from seatruth.effects.environment import with_current
from seatruth.errors import BadInput, nearest
from seatruth.manoeuvres.plans import Manoeuvre
from seatruth.models.base import Environment, Model, call, record
from seatruth.models.black_box import BlackBox
from seatruth.models.servo import stages
from seatruth.trials.trial import Trial

EnvironmentAt = Callable[[float, Any], Environment]
"""From the time (s) and the states (a named tuple) to the environment of the vehicle."""


def steady_current(speed: float, direction: float) -> EnvironmentAt:
    """The environment of a uniform current of `speed` (m/s) towards `direction` (rad, clockwise from +x).

    Example:
        run_manoeuvre(load_model("mmg"), Straight(60.0), environment=steady_current(0.2, 0.0))
    """

    north, east = speed * math.cos(direction), speed * math.sin(direction)

    def environment(t: float, s: Any) -> Environment:
        result: Environment = with_current(Environment(t=t), s, north, east)
        return result

    return environment


def run_manoeuvre(
    model: Model,
    manoeuvre: Manoeuvre,
    values: Mapping[str, float] | None = None,
    *,
    dt: float = 0.1,
    first_state: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    rudder_rate: float = math.radians(5.0),
    limit: float = 3600.0,
    environment: EnvironmentAt | None = None,
    name: str | None = None,
) -> Trial:
    """Runs `manoeuvre` with `model` and returns the record, without noise, labelled synthetic.

    Args:
        model: The model; its `rhs` must take the environment where `environment` is set.
        manoeuvre: The plan of the run.
        values: Parameter values that replace nominal ones, by name.
        dt: Step (classical Runge-Kutta) and sampling interval, s.
        first_state: States that do not start at zero, {"u": 1.2}.
        inputs: Inputs that the manoeuvre does not order, {"n": 11.85}.
        rudder_rate: Rate at which rudders and planes follow their orders, rad/s; other inputs, and those for which the
            model has a servo, are ordered within one step. Within a step inputs are linear.
        limit: Time after which the run ends where the manoeuvre has not ended before, s.
        environment: Currents and outside forces; none by default.
        name: Name of the trial; the label of the manoeuvre by default.

    Raises:
        BadInput: The manoeuvre needs an input or output that the model does not have, the model is a black box, or the
            motion diverges.

    Example:
        trial = run_manoeuvre(
            load_model("mmg"),
            Zigzag(math.radians(20), math.radians(20)),
            first_state={"u": 1.18},
            inputs={"n": 10.4},
        )
    """
    if not dt > 0 or not rudder_rate > 0:
        raise BadInput("dt and rudder_rate must be positive", where="run_manoeuvre")
    if isinstance(model, BlackBox):
        what = f"model {model.name!r} is a black box, which runs as a whole: nobody can steer it by its heading"
        raise BadInput(what, where="run_manoeuvre", do="Write the model's equations.")
    stepper = Stepper(model, values, environment)
    now = {channel.name: 0.0 for channel in model.inputs}
    ordered = {servo.input for servo in model.servos}
    _known(inputs or {}, now, f"model {model.name!r}: input")
    now.update(inputs or {})
    at_rest = {servo.state: now[servo.input] for servo in model.servos}
    state = stepper.first({**at_rest, **(first_state or {})})
    helm = manoeuvre.helm()
    times, states, taken = [0.0], [state], []
    fastest = rudder_rate * dt
    for step in range(round(limit / dt) + 1):
        t = step * dt
        try:
            orders = helm(t, stepper.outputs(state, now))
        except KeyError as missing:
            raise BadInput(f"{manoeuvre.label} watches {missing}, which is no output of model {model.name!r}") from None
        taken.append(now)
        if orders is None or t + dt > limit + 1e-9:
            break
        then = dict(now)
        for channel, order in _for_model(orders, then, manoeuvre, model).items():
            limited = channel in ("delta", "delta_s") and channel not in ordered
            then[channel] = now[channel] + max(-fastest, min(fastest, order - now[channel])) if limited else order
        state = stepper.step(t, state, now, then, dt)
        if not all(math.isfinite(x) for x in state):
            raise BadInput(f"the motion diverges at t = {t:g} s", where=f"{manoeuvre.label}, model {model.name!r}")
        times.append(t + dt)
        states.append(state)
        now = then
    rows = [stepper.outputs(s, i) for s, i in zip(states, taken)]
    return Trial(
        name=name or manoeuvre.label,
        t=np.array(times),
        inputs={c.name: np.array([i[c.name] for i in taken]) for c in model.inputs},
        outputs={c.name: np.array([row[c.name] for row in rows]) for c in model.outputs},
        conditions={"manoeuvre": manoeuvre.label, "model": model.name},
        source=f"simulated by model {model.name}",
        synthetic=True,
    )


class Stepper:
    """A model's equations with its parameters bound, and one Runge-Kutta step of them."""

    def __init__(
        self, model: Model, values: Mapping[str, float] | None = None, environment: EnvironmentAt | None = None
    ) -> None:
        nominal = model.nominal()
        _known(values or {}, nominal, f"model {model.name!r}: parameter")
        self.model, self.environment = model, environment
        self.p = record("Parameters", model.parameters)(**{**nominal, **(values or {})})
        self._state = record("States", model.states)
        self._inputs = record("Inputs", model.inputs)
        if environment is not None and not model.takes_environment:
            raise BadInput(f"model {model.name!r} takes no environment", do="Add the argument e to its rhs.")

    def first(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """A first state (S,): the values by name, zero for the other states."""
        _known(values, {s.name: 0.0 for s in self.model.states}, f"model {self.model.name!r}: state")
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


def self_propulsion(model: Model, speed: float, values: Mapping[str, float] | None = None) -> float:
    """Propeller revolutions (rev/s) at which the ship keeps `speed` (m/s) ahead on a straight course."""
    stepper = Stepper(model, values)
    if "n" not in {channel.name for channel in model.inputs}:
        raise BadInput(f"model {model.name!r} has no propeller speed n")
    state = stepper.first({"u": speed})
    inputs = {channel.name: 0.0 for channel in model.inputs}
    surge = [channel.name for channel in model.states].index("u")

    def excess(n: float) -> float:
        return stepper.rate(0.0, state, {**inputs, "n": n})[surge]

    largest = 1.0
    while excess(largest) < 0 and largest < 1e4:
        largest *= 2.0
    if not excess(0.0) < 0 <= excess(largest):
        raise BadInput(f"no propeller speed keeps {speed:g} m/s", where=f"model {model.name!r}")
    return float(scipy.optimize.brentq(excess, 0.0, largest, xtol=1e-12))


def add_noise(
    trial: Trial, sd: Mapping[str, float], rng: np.random.Generator, *, correlation: Mapping[str, float] | None = None
) -> Trial:
    """The trial with normal noise of standard deviation `sd` on the named outputs.

    Noise is white, or with a correlation time (s) where `correlation` names one (a stationary Ornstein-Uhlenbeck
    process at the trial's sample times).
    """
    times = correlation or {}
    for names in (sd, times):
        _known(names, trial.outputs, f"trial {trial.name!r}: output")
    outputs = dict(trial.outputs)
    for name in sorted(sd):
        white = rng.standard_normal(len(trial))
        if times.get(name, 0.0) > 0:
            keep = np.exp(-np.diff(trial.t) / times[name])
            for k, a in enumerate(keep):
                white[k + 1] = a * white[k] + math.sqrt(1 - a * a) * white[k + 1]
        outputs[name] = outputs[name] + sd[name] * white
    return replace(trial, outputs=outputs)


def _for_model(
    orders: Mapping[str, float], inputs: Mapping[str, float], manoeuvre: Manoeuvre, model: Model
) -> dict[str, float]:
    """Orders for the model's inputs; BadInput for one that it does not have."""
    for name, value in orders.items():
        if name not in inputs and value != 0.0:
            raise BadInput(f"{manoeuvre.label} orders {name!r}, which is no input of model {model.name!r}")
    return {name: value for name, value in orders.items() if name in inputs}


def _known(names: Mapping[str, Any], known: Mapping[str, Any], what: str) -> None:
    """BadInput where a name is not among the known ones."""
    for name in names:
        if name not in known:
            raise BadInput(f"{what} {name!r} does not exist", do=nearest(name, known))
