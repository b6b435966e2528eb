"""An underwater vehicle of a user that pitches: two main thrusters, one above the other, and a vertical one forward."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from seatruth.models import Channel, Dimensions, Model, Parameter, Thruster
from seatruth.trials.trial import Trial


class Diver(Model):
    """Surge, heave and pitch with linear and quadratic damping and a righting moment; inputs are forces."""

    name = "diver"
    title = "an underwater vehicle with thrusters"
    kind = "auv"
    source = "[S] made for these tests"
    states = outputs = (
        Channel("u", "m/s"),
        Channel("w", "m/s"),
        Channel("q", "rad/s"),
        Channel("x", "m"),
        Channel("z", "m"),
        Channel("theta", "rad", angle=True),
    )
    inputs = (Channel("upper", "N"), Channel("lower", "N"), Channel("lift", "N"))
    parameters = (
        Parameter("m", 40.0, "kg", 10.0, 100.0, source="[S] test"),
        Parameter("height", 0.2, "m", 0.1, 1.0, source="[S] test"),
        Parameter("ahead", 0.5, "m", 0.1, 1.0, source="[S] test"),
        Parameter("X_u", 15.0, "kg/s", 0.0, 100.0, source="[S] test"),
        Parameter("Z_w", 60.0, "kg/s", 0.0, 200.0, source="[S] test"),
        Parameter("M_q", 20.0, "kg m2/s", 0.0, 100.0, source="[S] test"),
        Parameter("M_theta", 30.0, "N m", 0.0, 100.0, source="[S] test"),
    )
    actuators = (
        Thruster("upper", "upper", (-0.6, 0.0, "-height"), (1.0, 0.0, 0.0), full=40.0, diameter=0.12),
        Thruster("lower", "lower", (-0.6, 0.0, "height"), (1.0, 0.0, 0.0), full=40.0, diameter=0.12),
        Thruster("lift", "lift", ("ahead", 0.0, 0.0), (0.0, 0.0, 1.0), full=20.0, diameter=0.12),
    )

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return i.upper, i.lower, i.lift

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(1.4, 0.3, 0.4, p.m, 1000.0)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u, w = s.u - e.u_c, s.w - e.w_c
        moment = p.height * (i.lower - i.upper) - p.ahead * i.lift - p.M_theta * math.sin(s.theta)
        return (
            (i.upper + i.lower - p.X_u * u * (0.5 + abs(u)) + e.X) / p.m - s.w * s.q,
            (i.lift - p.Z_w * w * (0.5 + abs(w)) + e.Z) / (1.5 * p.m) + s.u * s.q,
            (moment - p.M_q * s.q + e.M) / (0.3 * p.m),
            s.u * math.cos(s.theta) + s.w * math.sin(s.theta),
            s.w * math.cos(s.theta) - s.u * math.sin(s.theta),
            s.q,
        )


def diver_trials() -> tuple[list[Trial], list[dict[str, float]]]:
    """Trials in steps of each thruster alone and of all, ahead and astern, with their first states."""
    t = np.arange(0.0, 80.0, 0.25)
    k = (t // 4.0).astype(int)

    def steps(*levels: float) -> np.ndarray:
        return np.array(levels)[k % len(levels)]

    runs = [
        (5.0, steps(20.0, 10.0, 30.0, 5.0), steps(20.0, 25.0, 10.0), steps(0.0, 3.0, -3.0)),
        (10.0, steps(15.0, -20.0, 0.0, 25.0), steps(10.0, 15.0, -15.0), steps(0.0, -4.0, 2.0, 4.0)),
    ]
    found = [
        Trial(f"run {n}", t, {"upper": upper, "lower": lower, "lift": lift}, {}, synthetic=True)
        for n, (_, upper, lower, lift) in enumerate(runs)
    ]
    return found, [{"z": depth, "u": 0.5} for depth, *_ in runs]
