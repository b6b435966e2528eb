"""A small boat as a black box, with trials of its own, for the diagnosis of simulators that cannot be opened."""

from __future__ import annotations

from typing import Any

import numpy as np

from seatruth import BlackBox, Channel, Parameter, Prior, Study, Trial, Trials
from seatruth.models.base import Model

MOTION = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
PARAMETERS = (
    Parameter("m", 100.0, "kg"),
    Parameter("X_uu", -8.0, "kg/m", vary=True, prior=Prior(-8.0, 1.0)),
    Parameter("Y_v", -60.0, "kg/s"),
    Parameter("I", 300.0, "kg*m^2"),
    Parameter("N_r", -150.0, "kg*m^2/s", vary=True, prior=Prior(-150.0, 20.0)),
    Parameter("N_d", 60.0, "N*m"),
)


def rates(y: Any, delta: Any, n: Any, p: Any, X: Any, Y: Any, N: Any) -> tuple[Any, ...]:
    """d/dt of u, v, r, psi of a small boat under a thrust of n."""
    u, v, r, _ = y
    return (
        (n + p["X_uu"] * u * abs(u) + X) / p["m"] + v * r,
        (p["Y_v"] * v + Y) / p["m"] - u * r,
        (p["N_r"] * r + p["N_d"] * delta * u + N) / p["I"],
        r,
    )


def boat(trial: Trial, p: dict[str, float], first: dict[str, float], outside: Any = None) -> dict[str, Any]:
    """Half-second steps of the midpoint rule."""
    y = np.array([first[channel.name] for channel in MOTION])
    rows = [y]
    for k in range(len(trial) - 1):
        h = float(trial.t[k + 1] - trial.t[k])
        delta, n = (0.5 * (trial.inputs[i][k] + trial.inputs[i][k + 1]) for i in ("delta", "n"))
        f = outside(float(trial.t[k]), dict(zip(first, y))) if outside else {"X": 0.0, "Y": 0.0, "N": 0.0}
        forces = (f["X"], f.get("Y", 0.0), f.get("N", 0.0))
        half = y + 0.5 * h * np.array(rates(y, delta, n, p, *forces))
        y = y + h * np.array(rates(half, delta, n, p, *forces))
        rows.append(y)
    return {channel.name: np.array(rows)[:, k] for k, channel in enumerate(MOTION)}


PORTS = {"force": ["X", "Y", "N"]}


def box(ports: Any = PORTS) -> BlackBox:
    return BlackBox(
        "boat",
        boat,
        inputs=[Channel("delta", "rad"), Channel("n", "N")],
        outputs=MOTION,
        states=MOTION,
        parameters=PARAMETERS,
        ports=ports,
    )


def trials(push: Any = lambda t, y: {"X": 0.0, "Y": 0.0, "N": 0.0}, *, offset: float = 0.0) -> Trials:
    rng, found = np.random.default_rng(4), []
    for number, period in enumerate((20.0, 33.0)):
        t = np.arange(0.0, 50.0, 0.5)
        inputs = {"delta": 0.3 * np.sin(2 * np.pi * t / period), "n": 20.0 + 10.0 * (t > 25.0)}
        acting = {**inputs, "delta": inputs["delta"] + offset}
        first = {"u": 1.5, "v": 0.0, "r": 0.0, "psi": 0.0}
        p = {q.name: q.value for q in PARAMETERS}
        y = boat(Trial("run", t, acting, {}), p, first, push)
        noise = {"u": 0.01, "v": 0.01, "r": 0.002, "psi": 0.005}
        outputs = {name: values + rng.normal(0.0, noise[name], t.size) for name, values in y.items()}
        found.append(Trial(f"run{number}", t, inputs, outputs, synthetic=True))
    return Trials(found)


NOISE = {"u": 0.01, "v": 0.01, "r": 0.002, "psi": 0.005}


def study(model: Model, runs: Trials) -> Study:
    return Study("boat", model, runs, noise=NOISE)
