"""A boat with positions and two rudders, for what a first-order yaw model cannot show: currents, courses, actuators."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.effects import Effect, load_effects, with_effects
from seatruth.models.base import Model
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import simulator
from seatruth.study import Study
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial, Trials

_MOTION = (
    Channel("u", "m/s"),
    Channel("v", "m/s"),
    Channel("r", "rad/s"),
    Channel("psi", "rad", angle=True),
    Channel("x", "m"),
    Channel("y", "m"),
)


class Boat(Model):
    """Linear in surge, sway and yaw about a steady speed, with its track over ground."""

    name = "boat"
    title = "a boat"
    kind = "ship"
    states = outputs = _MOTION
    inputs = (Channel("delta", "rad"),)
    parameters = (
        Parameter("U", 2.0, "m/s", min=0.5, max=5.0, vary=True, prior=Prior(2.0, 0.1)),
        Parameter("K", 0.15, "1/s", min=0.01, max=1.0, vary=True, prior=Prior(0.15, 0.02)),
        Parameter("T", 6.0, "s", min=1.0, max=50.0, vary=True, prior=Prior(6.0, 1.0)),
        Parameter("S", 0.3, "m/s", min=-3.0, max=3.0),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return (
            (p.U - (s.u - e.u_c)) / 8.0 + e.du_c,
            (-p.S * i.delta - (s.v - e.v_c)) / 4.0 + e.dv_c,
            (p.K * i.delta - s.r) / p.T,
            s.r,
            s.u * math.cos(s.psi) - s.v * math.sin(s.psi),
            s.u * math.sin(s.psi) + s.v * math.cos(s.psi),
        )


class Catamaran(Boat):
    """The same with a rudder in each hull."""

    name = "catamaran"
    inputs = (Channel("port", "rad"), Channel("starboard", "rad"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        delta = 0.5 * (i.port + i.starboard)
        return (
            (p.U - (s.u - e.u_c)) / 8.0 + e.du_c,
            (-p.S * delta - (s.v - e.v_c)) / 4.0 + e.dv_c,
            (p.K * delta - s.r) / p.T,
            s.r,
            s.u * math.cos(s.psi) - s.v * math.sin(s.psi),
            s.u * math.sin(s.psi) + s.v * math.cos(s.psi),
        )


class Hull(Boat):
    """The boat, with a size and a mass on which forces can act."""

    name = "hull"

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(6.0, 2.0, 0.5, 3000.0, 1025.0)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        surge, sway, yaw, *rest = Boat.rhs(s, i, p, e)
        return (surge + e.X / 3000.0, sway + e.Y / 3000.0, yaw + e.N / 9000.0, *rest)


NOISE = {"u": 0.01, "v": 0.01, "r": 0.001, "psi": 0.003, "x": 0.1, "y": 0.1}


def trials(
    model: Model,
    inputs: Sequence[Mapping[str, np.ndarray]],
    *,
    headings: Sequence[float],
    effects: Mapping[str, float] | None = None,
    specs: Sequence[str | Effect] = (),
    noise: Mapping[str, float] = NOISE,
    seed: int = 1,
) -> list[Trial]:
    """Noisy trials sampled at 1 Hz, each from its heading (rad); `effects` are parameters of the extended model."""
    acting = [spec if isinstance(spec, Effect) else load_effects([spec])[0] for spec in specs]
    extended = with_effects(model, acting)
    bare = [
        Trial(f"run_{k}", np.arange(float(len(next(iter(series.values()))))), dict(series), {}, synthetic=True)
        for k, series in enumerate(inputs)
    ]
    sim = simulator(extended, bare, free=(), values={**extended.nominal(), **(effects or {})})
    names = [channel.name for channel in extended.states]
    first = np.zeros((len(bare), len(names)))
    first[:, names.index("u")] = 2.0
    first[:, names.index("psi")] = headings
    y = sim.outputs(np.zeros((1, 0)), first).y[0]
    rng = np.random.default_rng(seed)
    return [
        Trial(
            trial.name,
            trial.t,
            dict(trial.inputs),
            {c.name: y[rows, k] + noise[c.name] * rng.normal(size=len(trial)) for k, c in enumerate(model.outputs)},
            synthetic=True,
        )
        for trial, rows in zip(bare, sim.rows)
    ]


def study(model: Model, runs: Sequence[Trial], noise: Mapping[str, float] | None = None) -> Study:
    """The study of some trials; `noise` is the declared one."""
    return Study(name="boat", model=model, trials=Trials(list(runs)), parameters=model.parameters, noise=noise or {})


def zigzag(seconds: int, angle: float, every: float) -> np.ndarray:
    """Rudder angle (seconds,) that alternates, rad."""
    t = np.arange(float(seconds))
    return np.where(np.floor(t / every) % 2 == 0, angle, -angle)
