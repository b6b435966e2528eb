"""Problems that solvers are tuned on, and others that check what the tuning gained; all synthetic.

None is in the standard comparison, whose systems are in standard_comparison_systems.py. Tags: [L] other literature,
[S] chosen here. All trials are simulated; the bounds of the searches and the noise levels are [S].
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from standard_comparison_systems import HIGH, LOW, made

from seatruth import Model, Parameter
from seatruth.comparison import Problem
from seatruth.manoeuvres import Manoeuvre, TurningCircle, Zigzag, run_manoeuvre
from seatruth.models.abkowitz import AbkowitzShip
from seatruth.models.mmg import MMGShip
from seatruth.models.twin_thruster import TwinThruster
from seatruth.study import formula_study
from seatruth.trials import Channel

NOISE = {"tuned on": (0.01,), "checked on": (0.0, 0.02)}
"""[S] White noise, parts of each channel's range."""
MARINER_FREE = ("X_u", "X_vv", "X_rv", "Y_v", "Y_r", "Y_d", "N_v", "N_r", "N_d", "N_vvr", "Y_vvr", "N_ddd")
OTTER_FREE = ("X_u", "k_ahead", "N_r", "N_rr", "X_du", "Y_dv", "N_dr", "C_d")
KVLCC2_FREE = ("Y_v", "Y_r", "N_v", "N_r", "X_vv", "R_0", "t_R", "a_H", "x_H")


class SwayYaw(Model):
    """Linear sway and yaw (Davidson and Schiff 1946) with a cubic yaw damping, and the heading; values [S]."""

    name = "sway_yaw"
    title = "Sway and yaw, linear but for one cubic term"
    kind = "ship"
    states = (Channel("v", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    parameters = (
        Parameter("a_vv", 0.04, "1/s", min=0.0, max=1.0, vary=True, description="sway damping by sway"),
        Parameter("a_vr", 2.2, "m/s", min=0.0, max=20.0, vary=True, description="sway by yaw"),
        Parameter("a_rv", 1.3e-3, "1/m/s", min=0.0, max=0.1, vary=True, description="yaw by sway"),
        Parameter("a_rr", 0.09, "1/s", min=0.0, max=1.0, vary=True, description="yaw damping by yaw"),
        Parameter("a_rrr", 900.0, "s", min=0.0, max=1e5, vary=True, description="yaw damping by yaw cubed"),
        Parameter("b_v", 0.05, "m/s2", min=0.0, max=1.0, vary=True, description="sway by rudder"),
        Parameter("b_r", 2.5e-3, "1/s2", min=0.0, max=1.0, vary=True, description="yaw by rudder"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        sway = -p.a_vv * s.v - p.a_vr * s.r + p.b_v * i.delta
        yaw = -p.a_rv * s.v - p.a_rr * s.r - p.a_rrr * s.r**3 + p.b_r * i.delta
        return sway, yaw, s.r

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return 0.0, y.r, y.psi


@dataclass(frozen=True)
class ThrusterSteps(Manoeuvre):
    """[S] Both thrusters of a boat in turn at two speeds, each for a time of its own (s)."""

    fast: float = 14.0
    slow: float = 6.0
    port: float = 9.0
    starboard: float = 13.0

    @property
    def label(self) -> str:
        return f"thruster steps, {self.port:g} s and {self.starboard:g} s"

    def helm(self) -> Any:
        def helm(t: float, y: Mapping[str, float]) -> Mapping[str, float]:
            port, starboard = (
                self.fast if t % (2 * last) < last else self.slow for last in (self.port, self.starboard)
            )
            return {"n_port": port, "n_starboard": starboard}

        return helm


def sway_yaw() -> Problem:
    """A zigzag of a ship with linear sway and yaw; the sway itself is not recorded."""
    model = SwayYaw()
    plans = (Zigzag(math.radians(20.0), math.radians(20.0)), Zigzag(math.radians(10.0), math.radians(10.0)))
    fit, held = (run_manoeuvre(model, plan, dt=1.0, limit=150.0) for plan in plans)
    free = [q.name for q in model.parameters]
    return made("sway and yaw", model, free, [fit], [held])


def mariner() -> Problem:
    """A Mariner class ship [L] in a zigzag of 20 deg; a turning circle held out."""
    model = AbkowitzShip()
    first = {"u": model.nominal()["U_0"]}
    plans = (Zigzag(math.radians(20.0), math.radians(20.0)), TurningCircle(math.radians(20.0)))
    fit, held = (run_manoeuvre(model, plan, dt=2.0, first_state=first, limit=300.0) for plan in plans)
    return made("Mariner", model, MARINER_FREE, [fit], [held])


def boat() -> Problem:
    """A boat with two thrusters [L] under steps of both; other steps held out."""
    model = TwinThruster()
    plans = (ThrusterSteps(), ThrusterSteps(port=7.0, starboard=16.0))
    fit, held = (run_manoeuvre(model, plan, dt=0.5, first_state={"u": 1.0}, limit=60.0) for plan in plans)
    return made("boat with two thrusters", model, OTTER_FREE, [fit], [held])


def tanker() -> Problem:
    """KVLCC2's model of 7 m [L] in a zigzag of 20 deg; a turning circle held out."""
    model = MMGShip()
    plans = (Zigzag(math.radians(20.0), math.radians(20.0)), TurningCircle(math.radians(25.0)))
    first, inputs = {"u": 1.1}, {"n": 10.4}
    fit, held = (
        run_manoeuvre(model, plan, dt=1.0, first_state=first, inputs=inputs, rudder_rate=0.3, limit=90.0)
        for plan in plans
    )
    return made("KVLCC2, simulated", model, KVLCC2_FREE, [fit], [held])


def thermal() -> Problem:
    """A quotient of two cubics on 37 points, as in NIST's Thurber and Hahn1 [L]; values [S]."""
    values = {"b1": 2.9, "b2": 1.5, "b3": 0.6, "b4": 0.1, "b5": 0.45, "b6": 0.2, "b7": 0.03}
    formula = "y = (b1 + b2*x + b3*x**2 + b4*x**3)/(1 + b5*x + b6*x**2 + b7*x**3)"
    return _regression("quotient of cubics", formula, values, np.linspace(-1.5, 4.0, 37), np.linspace(-1.2, 3.7, 15))


def decays() -> Problem:
    """The sum of three exponential decays, as in NIST's Lanczos [L], on 40 points; values [S]."""
    values = {"a1": 1.0, "k1": 0.25, "a2": 2.0, "k2": 1.0, "a3": 1.5, "k3": 5.0}
    formula = "y = a1*exp(-k1*x) + a2*exp(-k2*x) + a3*exp(-k3*x)"
    return _regression("three decays", formula, values, np.linspace(0.0, 6.0, 40), np.linspace(0.1, 5.0, 15))


def roll() -> Problem:
    """A decaying roll on a bias with a drift, 120 samples; values [S]. The frequency has several local minima."""
    values = {"a": 0.3, "d": 0.08, "w": 0.9, "phase": 0.5, "bias": 0.05, "drift": 0.002}
    formula = "y = a*exp(-d*x)*cos(w*x + phase) + bias + drift*x"
    return _regression("roll decay", formula, values, np.linspace(0.0, 40.0, 120), np.linspace(0.0, 45.0, 40))


def peaks() -> Problem:
    """Two overlapping peaks on a decay, as in NIST's Gauss [L], 80 points; values [S]."""
    values = {"a1": 1.0, "k": 0.3, "a2": 0.8, "c2": 3.0, "s2": 0.6, "a3": 0.6, "c3": 4.2, "s3": 0.5}
    formula = "y = a1*exp(-k*x) + a2*exp(-(x - c2)**2/s2**2) + a3*exp(-(x - c3)**2/s3**2)"
    return _regression("two peaks", formula, values, np.linspace(0.0, 8.0, 80), np.linspace(0.1, 7.5, 30))


def resistance() -> Problem:
    """A resistance with a hump over the Froude number, 40 points; values [S]."""
    values = {"c0": 0.6, "c1": 2.0, "power": 3.2, "hump": 0.8, "at": 0.35, "width": 0.06}
    formula = "y = c0*x + c1*abs(x)**power*(1 + hump*exp(-(x - at)**2/width**2))"
    return _regression(
        "resistance with a hump", formula, values, np.linspace(0.1, 0.6, 40), np.linspace(0.12, 0.58, 20)
    )


def _regression(name: str, formula: str, values: Mapping[str, float], fit: Any, held: Any) -> Problem:
    parameters = [Parameter(q, v, min=LOW * v, max=HIGH * v, vary=True) for q, v in values.items()]
    of, other = (
        formula_study(formula, pd.DataFrame({"x": x, "y": np.zeros(len(x))}), parameters, name=name, synthetic=True)
        for x in (fit, held)
    )
    return Problem(name, of.replace(holdout=other.trials), dict(values))


TUNED_ON: dict[str, Callable[[], Problem]] = {
    "sway and yaw": sway_yaw,
    "Mariner": mariner,
    "quotient of cubics": thermal,
    "two peaks": peaks,
}
CHECKED_ON: dict[str, Callable[[], Problem]] = {
    "KVLCC2": tanker,
    "boat": boat,
    "decays": decays,
    "roll": roll,
    "resistance": resistance,
}
