"""Under what a manoeuvre is predicted: approach speed, revolutions, rudder rate, steps; calm water."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.effects.base import Effect
from seatruth.errors import BadInput, nearest
from seatruth.manoeuvres import self_propulsion
from seatruth.manoeuvres.run import common_drives
from seatruth.manoeuvres.steering import ThrustSteering, steering_of
from seatruth.models.base import Model
from seatruth.models.wrapper import ModelWrapper
from seatruth.prediction.first_motion import first_motion
from seatruth.prediction.measured import manoeuvres_of
from seatruth.trials.trial import Trial

_MOST_SAMPLES = 1500
"""Steps of the longest trial, about: a faster record is not simulated with shorter steps. Chosen here [S]."""
_LIMIT = 5.0
"""Time limit of a manoeuvre over the longest trial. Chosen here [S]: turns take about as long as zigzags."""
_STILL = 0.05
"""Part of the fastest rate below which a rudder is held. Chosen here [S]."""
_FIRST = 10
"""Samples at the beginning of a manoeuvre whose median is its approach speed. Chosen here [S]."""
_USUAL_RATE = 0.9
"""Quantile of the rates of a moving rudder that is its rate: accelerating and stopping take the rest. [S]"""


def approach_speed(model: Model, trials: Sequence[Trial], asked: float | None) -> float:
    """The speed ahead of a manoeuvre, m/s: what was asked for, or the median of the trials' manoeuvres."""
    if asked is not None:
        if not np.isfinite(asked) or asked == 0:
            raise BadInput(f"a speed of {asked} m/s has no manoeuvre", where="speed", do="Give m/s, negative astern.")
        return float(asked)
    # At the beginning of their manoeuvres: a record may begin at rest.
    runs = [run for trial in trials for _, _, run in manoeuvres_of(model, trial)] or list(trials)
    first = [u[np.isfinite(u)][:_FIRST] for run in runs if (u := run.outputs.get("u")) is not None]
    first = first or [np.array([ahead]) for run in runs if (ahead := _speed_of(model, run)) is not None]
    speeds = [float(np.median(values)) for values in first if values.size and np.median(values) != 0]
    if not speeds:
        what = "no trial recorded a speed, nor positions beside its heading"
        raise BadInput(what, where="predict", do="State the approach speed (m/s): --speed.")
    return float(np.median(speeds))


def _speed_of(model: Model, run: Trial) -> float | None:
    """The speed ahead with which a run begins, by its ground velocity or its positions."""
    rows = np.flatnonzero(np.all([np.isfinite(values) for values in run.outputs.values()], axis=0))[:_FIRST]
    return first_motion(model, run, rows).get("u") if rows.size else None


def rudder_rate(trials: Sequence[Trial], asked: float | None, rudders: Sequence[str]) -> float:
    """The rate at which the rudder moves, rad/s: what was asked for, or that of the recorded inputs `rudders`."""
    if asked is not None:
        return asked
    rates = [
        np.abs(np.diff(trial.inputs[name]) / np.diff(trial.t))
        for trial in trials
        for name in rudders
        if name in trial.inputs
    ]
    moving = np.concatenate([rate[rate > _STILL * float(rate.max(initial=0.0))] for rate in rates] or [np.zeros(0)])
    return float(np.quantile(moving, _USUAL_RATE)) if moving.size else float(np.radians(5.0))


def time_step(model: Model, trials: Sequence[Trial], asked: float | None) -> float:
    """Step of the simulation, s."""
    if asked is not None:
        return asked
    longest = max(trial.duration for trial in trials)
    usual = float(np.median([np.median(np.diff(trial.t)) for trial in trials]))
    return min(max(usual, longest / _MOST_SAMPLES), model.longest_step)


def time_limit(trials: Sequence[Trial], asked: float | None) -> float:
    """Time after which a manoeuvre ends where it has not ended before, s."""
    return asked if asked is not None else _LIMIT * max(trial.duration for trial in trials)


def propulsion(model: Model, values: Array, speed: float, inputs: Mapping[str, float]) -> dict[str, Array]:
    """The inputs (P,) of each ship besides its rudder: those that were stated, else the revolutions at which it keeps
    its speed on a straight course; where several thrusters drive it, those of each.
    """
    channels = [channel.name for channel in model.inputs]
    for name in inputs:
        if name not in channels:
            raise BadInput(f"model {model.name!r} has no input {name!r}", where="inputs", do=nearest(name, channels))
    found = {name: np.full(len(values), float(value)) for name, value in inputs.items()}
    steering = steering_of(model)
    thrust = steering if "n" not in channels and isinstance(steering, ThrustSteering) and steering.most else None
    driving = ["n"] if "n" in channels else list(thrust.driven(thrust.rest)) if thrust is not None else []
    driving = driving or list(common_drives(model))
    if not driving or set(driving) & set(inputs):
        return found
    if speed < 0:
        which = " and ".join(driving)
        raise BadInput("the revolutions astern are not known", where="predict", do=f"State the input {which} (< 0).")
    names = [parameter.name for parameter in model.parameters]
    own = []
    for row in values.tolist():
        try:
            own.append(self_propulsion(model, speed, dict(zip(names, row)), inputs))
        except BadInput:
            if not own:
                raise  # the estimate itself
            own.append(own[0])
    if thrust is None:
        return {**found, **dict.fromkeys(driving, np.array(own))}
    orders = [thrust.driven(n) for n in own]
    return {**found, **{name: np.array([order[name] for order in orders]) for name in driving}}


def calm_water(model: Model) -> dict[str, float]:
    """Parameters of the model's effects of the environment at the values at which these vanish."""
    found: dict[str, float] = {}
    inner: Any = model
    while isinstance(inner, ModelWrapper):
        for effect in getattr(inner, "effects", ()):
            if isinstance(effect, Effect) and effect.family == "environment":
                found |= {p.name: p.value for p in effect.null_parameters() if p.prior is None}
        inner = inner.base
    return found
