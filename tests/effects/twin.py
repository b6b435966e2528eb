"""A boat of a user: two thrusters under names of its own, and a steering nozzle that is not called a rudder."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from seatruth.models import Channel, Dimensions, Model, Parameter, Rudder, Thruster
from seatruth.trials.trial import Trial


class Twin(Model):
    """Surge, sway and yaw with linear and quadratic damping; thrust goes with the square of the command."""

    name = "twin"
    title = "a boat with two thrusters"
    kind = "ship"
    source = "[S] made for these tests"
    states = outputs = (
        Channel("u", "m/s"),
        Channel("v", "m/s"),
        Channel("r", "rad/s"),
        Channel("x", "m"),
        Channel("y", "m"),
        Channel("psi", "rad", angle=True),
    )
    inputs = (Channel("left", "1"), Channel("right", "1"), Channel("helm", "rad"))
    parameters = (
        Parameter("m", 30.0, "kg", 10.0, 100.0, source="[S] test"),
        Parameter("half_beam", 0.35, "m", 0.1, 1.0, source="[S] test"),
        Parameter("T_full", 40.0, "N", 1.0, 200.0, source="[S] test"),
        Parameter("X_u", 12.0, "kg/s", 0.0, 100.0, source="[S] test"),
        Parameter("Y_v", 25.0, "kg/s", 0.0, 100.0, source="[S] test"),
        Parameter("N_r", 8.0, "kg m2/s", 0.0, 100.0, source="[S] test"),
        Parameter("N_helm", 6.0, "kg/m", 0.0, 100.0, source="[S] test"),
    )
    actuators = (
        Thruster("left", "left", (-0.6, "-half_beam", 0.0), (1.0, 0.0, 0.0), full=2.0, diameter=0.12),
        Thruster("right", "right", (-0.6, "half_beam", 0.0), (1.0, 0.0, 0.0), full=2.0, diameter=0.12),
        Rudder("nozzle", "helm"),
    )

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return tuple(0.25 * p.T_full * x * abs(x) for x in (i.left, i.right))

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(1.4, 0.9, 0.2, p.m, 1000.0)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u, v = s.u - e.u_c, s.v - e.v_c
        left, right = Twin.thrusts(s, i, p, e)
        return (
            (left + right - p.X_u * u * (0.5 + abs(u)) + e.X) / p.m + s.r * s.v,
            (-p.Y_v * v + e.Y) / (1.5 * p.m) - s.r * s.u,
            (p.half_beam * (left - right) - p.N_r * s.r + p.N_helm * u * abs(u) * i.helm + e.N) / (0.3 * p.m),
            s.u * math.cos(s.psi) - s.v * math.sin(s.psi),
            s.u * math.sin(s.psi) + s.v * math.cos(s.psi),
            s.r,
        )


class Unnamed(Twin):
    """The same boat, whose author named no actuators."""

    name = "unnamed"
    actuators = ()
    thrusts = None


def twin_trials() -> tuple[list[Trial], list[dict[str, float]]]:
    """Trials in steps of one thruster, of both, and astern, on three headings, with their first states."""
    t = np.arange(0.0, 80.0, 0.25)
    k = (t // 4.0).astype(int)

    def steps(*levels: float) -> np.ndarray:
        return np.array(levels)[k % len(levels)]

    runs = [
        (0.3, steps(1.5, 0.8, 1.8, 0.3, 1.0), steps(1.5, 1.8, 0.4, 1.2), steps(0.0, 0.2, -0.2)),
        (2.4, steps(1.2, -1.0, 0.15, -0.12, 1.9, 0.0), steps(0.9, 0.1, -0.1, 1.6, -1.4), steps(0.0)),
        (4.0, steps(1.0, 1.0, 1.9, 1.9), steps(1.0, -0.8, -1.8), steps(-0.3, 0.1, 0.3)),
    ]
    found = [
        Trial(f"run {n}", t, {"left": left, "right": right, "helm": helm}, {}, synthetic=True)
        for n, (_, left, right, helm) in enumerate(runs)
    ]
    return found, [{"psi": heading, "u": 0.5} for heading, *_ in runs]
