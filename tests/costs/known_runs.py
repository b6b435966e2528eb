"""Trials with known truth: small models in closed form, and the diving plane of Xu, Zou et al. (2012)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.models.base import Environment, Model, record
from seatruth.models.diving_plane import DivingPlane
from seatruth.models.parameter import Parameter
from seatruth.simulate import simulator
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial, Trials

Array = NDArray[np.float64]


class Yaw(Model):
    """Nomoto's yaw with a nonlinear rate term, and heading: T r' = K delta - r - c r^3."""

    name = "yaw"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = (Channel("psi", "rad", angle=True), Channel("r", "rad/s"))
    parameters = (
        Parameter("K", 0.2, "1/s", 0.02, 2.0, vary=True),
        Parameter("T", 8.0, "s", 1.0, 50.0, vary=True),
        Parameter("c", 30.0, "s2", -100.0, 300.0, vary=True),
        Parameter("K_over_T", 0.025, "1/s2"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return p.K / p.T * i.delta - s.r / p.T - p.c / p.T * s.r**3, s.r


class YawGain(Yaw):
    """The same with its gain as a parameter of its own: linear in a, b, d."""

    name = "yaw_gain"
    parameters = (
        Parameter("a", 0.025, "1/s2", 0.001, 0.5, vary=True),
        Parameter("b", -0.125, "1/s", -1.0, -0.01, vary=True),
        Parameter("d", -4.0, "s", -40.0, 10.0, vary=True),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return p.a * i.delta + p.b * s.r + p.d * s.r**3, s.r


def yaw_trials(
    names: tuple[str, ...] = ("a", "b"),
    n: int = 240,
    dt: float = 0.5,
    noise: tuple[float, float] = (0.01, 0.002),
    seed: int = 1,
    model: Model | None = None,
    truth: dict[str, float] | None = None,
) -> Trials:
    """Runs under square-wave rudder, with white noise (psi, r)."""
    model = model or Yaw()
    rng = np.random.default_rng(seed)
    t = np.arange(n) * dt
    found = []
    for k, name in enumerate(names):
        delta = np.radians(15) * np.sign(np.sin(2 * np.pi * t / (28 + 9 * k) + 0.4 * k))
        bare = Trial(name, t, {"delta": delta}, {"psi": np.zeros(n), "r": np.zeros(n)})
        sim = simulator(model, [bare], values={**model.nominal(), **(truth or {})})
        x0 = np.array([[0.01 * (k + 1), 0.2 - 0.1 * k]])
        y = sim.outputs(np.zeros((1, 0)), x0).y[0] + rng.standard_normal((n, 2)) * noise
        found.append(Trial(name, t, {"delta": delta}, {"psi": y[:, 0], "r": y[:, 1]}, synthetic=True))
    return Trials(found)


VISCOUS = (
    *("X_uu", "X_wq", "X_qq"),
    *("Z_0", "Z_w", "Z_aw", "Z_waw", "Z_q", "Z_qaq", "Z_ds"),
    *("M_w", "M_aw", "M_waw", "M_q", "M_qaq", "M_ds", "z_B"),
)
"""The coefficients that the published regressions identify (and z_B, as a check)."""


def dive(fin_deg: float = 5.0, seconds: float = 120.0, h: float = 0.5) -> Trial:
    """The zigzag in the vertical plane of models published for it: from rest at 100 m, 120 N, fin reversed at that
    pitch; fin rate 2.5 deg/s, Runge-Kutta steps of h with the fin at mid-step between those at the ends."""
    model = DivingPlane()
    States, Inputs = record("S", model.states), record("I", model.inputs)
    p = record("P", model.parameters)(**model.nominal())
    limit, rate = math.radians(fin_deg), math.radians(2.5)
    n = round(seconds / h) + 1
    x = np.zeros((n, 6))
    x[0, 5] = 100.0
    fin, order = np.zeros(n), limit

    def f(state: Array, delta: float) -> Array:
        return np.array(model.rhs(States(*state), Inputs(delta), p, Environment()))

    for k in range(n - 1):
        theta = x[k, 3]
        if theta <= -limit:
            order = -limit
        elif theta >= limit:
            order = limit
        fin[k + 1] = fin[k] + np.clip(order - fin[k], -rate * h, rate * h)
        middle = 0.5 * (fin[k] + fin[k + 1])
        k1 = f(x[k], fin[k])
        k2 = f(x[k] + 0.5 * h * k1, middle)
        k3 = f(x[k] + 0.5 * h * k2, middle)
        k4 = f(x[k] + h * k3, fin[k + 1])
        x[k + 1] = x[k] + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    outputs = {channel.name: x[:, k] for k, channel in enumerate(model.states)}
    return Trial("dive", np.arange(n) * h, {"delta_s": fin}, outputs, synthetic=True)


def diving_parameters(free: tuple[str, ...] = VISCOUS, off: float = 1.0) -> tuple[Parameter, ...]:
    """The model's parameters with these free and unbounded, starting at `off` times the truth."""
    return tuple(
        q.replace(vary=True, min=-math.inf, max=math.inf, value=off * q.value) if q.name in free else q
        for q in DivingPlane().parameters
    )
