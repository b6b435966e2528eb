"""Trials made by simulation: a model runs a manoeuvre in closed loop, step by step in plain Python.

The engine can replay a trial open loop: the recorded inputs are those that acted, linear between samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
import scipy

from seatruth.effects.commands import FULL
from seatruth.effects.environment import with_current
from seatruth.effects.undeclared_actuators import drive_inputs, resting_inputs
from seatruth.errors import BadInput
from seatruth.manoeuvres.plans import Manoeuvre
from seatruth.manoeuvres.steering import Allocation, ThrustSteering, limited_inputs, steering_of
from seatruth.manoeuvres.stepper import EnvironmentAt, Stepper, known_names
from seatruth.models.base import Environment, Model
from seatruth.models.black_box import BlackBox
from seatruth.trials.trial import Trial

_LARGEST = {"rev/s": 1e4, "N": 1e9}
"""Revolutions and thrust beyond which no vehicle is driven; a command has its full one."""


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
        inputs: Inputs that the manoeuvre does not order, {"n": 11.85}; of thrusters those of the straight approach,
            {"n_port": 8.0, "n_starboard": 8.0}, on top of which a manoeuvre by thrust steers.
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
    known_names(inputs or {}, now, f"model {model.name!r}: input")
    now.update(inputs or {})
    at_rest = {servo.state: now[servo.input] for servo in model.servos}
    state = stepper.first({**at_rest, **(first_state or {})})
    steering = steering_of(model)
    helm, allocation = manoeuvre.helm(), Allocation(model, steering, now, manoeuvre.label)
    rudders = {*limited_inputs(steering)} - ordered
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
        for channel, order in allocation(orders).items():
            change = order - now[channel]
            then[channel] = now[channel] + max(-fastest, min(fastest, change)) if channel in rudders else order
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


def self_propulsion(
    model: Model,
    speed: float,
    values: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] = MappingProxyType({}),
) -> float:
    """Propeller revolutions (rev/s) at which the ship keeps `speed` (m/s) ahead on a straight course.

    Where thrusters drive it, the order that those which push ahead get alike, in the unit of their inputs; so of other
    drives that push ahead (`common_drives`). `inputs` are the model's others, {"voltage": 16.0}.

    Raises:
        BadInput: the model has neither, or its full power does not keep this speed.

    Example:
        >>> from seatruth.models import load_model
        >>> round(self_propulsion(load_model("twin_thruster"), 1.0), 2)
        9.42
    """
    stepper, steering = Stepper(model, values), steering_of(model)
    channels = [channel.name for channel in model.inputs]
    thrust = steering if "n" not in channels and isinstance(steering, ThrustSteering) else None
    drives = {"n": 0.0} if "n" in channels else {} if thrust is not None else common_drives(model, values)
    least = thrust.rest if thrust is not None else next(iter(drives.values()), 0.0)
    most = thrust.most if thrust is not None else _most(model, drives)
    if not most:
        raise BadInput(f"model {model.name!r} has no propeller speed n")
    state = stepper.first({"u": speed})
    rest = {**dict.fromkeys(channels, 0.0), **inputs}
    surge = [channel.name for channel in model.states].index("u")

    def excess(n: float) -> float:
        driven = dict.fromkeys(drives, n) if thrust is None else thrust.driven(n)
        return stepper.rate(0.0, state, {**rest, **driven})[surge]

    step = min(1.0, most - least)
    while excess(least + step) < 0 and step < most - least:
        step = min(2.0 * step, most - least)
    if not excess(least) < 0 <= excess(least + step):
        raise BadInput(f"no propeller speed keeps {speed:g} m/s", where=f"model {model.name!r}")
    return float(scipy.optimize.brentq(excess, least, least + step, xtol=1e-12))


def _most(model: Model, drives: Mapping[str, float]) -> float:
    """The largest order of drives that is tried; zero where there are none."""
    units = {channel.name: channel.unit for channel in model.inputs}
    return min((_LARGEST.get(units[name], rest + FULL.get(rest, 1.0)) for name, rest in drives.items()), default=0.0)


def common_drives(model: Model, values: Mapping[str, float] | None = None) -> dict[str, float]:
    """The inputs that push a model ahead which names no thruster and has no n, with that at which they rest.

    Those of one unit, which are ordered alike: the revolutions of two shafts, the commands of two speed controllers.

    Example:
        >>> from seatruth import Channel, Model
        >>> class Pods(Model):
        ...     name = "pods"
        ...     states = outputs = (Channel("u", "m/s"),)
        ...     inputs = (Channel("n_p", "rev/s"), Channel("n_s", "rev/s"), Channel("n_bow", "rev/s"))
        ...
        ...     @staticmethod
        ...     def rhs(s, i, p):
        ...         return (i.n_p * i.n_p + i.n_s * i.n_s - s.u,)
        >>> common_drives(Pods()), self_propulsion(Pods(), 2.0)
        ({'n_p': 0.0, 'n_s': 0.0}, 1.0)
    """
    if isinstance(model, BlackBox) or "u" not in [state.name for state in model.states]:
        return {}
    names, resting = drive_inputs(model), resting_inputs(model) or {}
    units = {channel.name: channel.unit for channel in model.inputs}
    stepper = Stepper(model, values)
    state, surge = stepper.first({}), [channel.name for channel in model.states].index("u")
    rest = {**dict.fromkeys(units, 0.0), **resting}
    still = stepper.rate(0.0, state, rest)[surge]
    found = {}
    for name in names:
        on = {**rest, name: rest[name] + FULL.get(rest[name], 1.0)}
        if units[name] == units[names[0]] and stepper.rate(0.0, state, on)[surge] > still:
            found[name] = rest[name]
    return found


def add_noise(
    trial: Trial, sd: Mapping[str, float], rng: np.random.Generator, *, correlation: Mapping[str, float] | None = None
) -> Trial:
    """The trial with normal noise of standard deviation `sd` on the named outputs.

    Noise is white, or with a correlation time (s) where `correlation` names one (a stationary Ornstein-Uhlenbeck
    process at the trial's sample times).
    """
    times = correlation or {}
    for names in (sd, times):
        known_names(names, trial.outputs, f"trial {trial.name!r}: output")
    outputs = dict(trial.outputs)
    for name in sorted(sd):
        white = rng.standard_normal(len(trial))
        if times.get(name, 0.0) > 0:
            keep = np.exp(-np.diff(trial.t) / times[name])
            for k, a in enumerate(keep):
                white[k + 1] = a * white[k] + math.sqrt(1 - a * a) * white[k + 1]
        outputs[name] = outputs[name] + sd[name] * white
    return replace(trial, outputs=outputs)
