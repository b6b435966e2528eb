"""Trials whose motion is known exactly, for the tests of preparation and checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from seatruth.trials import Finding, Step, Trial

Array = NDArray[np.float64]


def zigzag(
    seed: int = 0,
    *,
    seconds: float = 300.0,
    rate: float = 10.0,
    noise: float = 1.0,
    amplitude: float = 0.35,
    period: float = 60.0,
    speed: float = 1.2,
    course: float = 0.4,
    current: complex = 0.0,
    arm: complex = 0.0,
    name: str = "zigzag",
) -> Trial:
    """A zigzag of a ship that answers its rudder by Nomoto's first-order law and slips sideways in the turn.

    The motion is integrated at a tenth of the sampling step; `noise` scales sensor noise of good instruments.
    """
    rng = np.random.default_rng(seed)
    fine = int(seconds * rate) * 10
    h = 1.0 / (10 * rate)
    t = np.arange(fine) * h
    command = amplitude * np.sign(np.sin(2 * np.pi * t / period + 1e-9))
    delta, r, psi, x, y, u = np.zeros((6, fine))
    psi[0], u[0] = course, speed
    position = 0.0 + 0.0j
    for k in range(fine - 1):
        delta[k + 1] = delta[k] + float(np.clip(command[k] - delta[k], -0.2 * h, 0.2 * h))
        r[k + 1] = r[k] + h * (0.12 * delta[k] - r[k]) / 4.0
        u[k + 1] = u[k] + h * (0.02 * (speed - u[k]) - 4.0 * r[k] ** 2 * u[k])
        psi[k + 1] = psi[k] + 0.5 * h * (r[k] + r[k + 1])
        middle = 0.5 * (psi[k] + psi[k + 1])
        position += h * ((0.5 * (u[k] + u[k + 1]) - 1j * 1.5 * 0.5 * (r[k] + r[k + 1])) * np.exp(1j * middle) + current)
        x[k + 1], y[k + 1] = position.real, position.imag
    v = -1.5 * r
    place = x + 1j * y + arm * (np.exp(1j * psi) - np.exp(1j * psi[0]))
    clean = {"x": place.real, "y": place.imag, "psi": psi, "u": u, "v": v, "r": r}
    sd = {"x": 0.02, "y": 0.02, "psi": 0.002, "u": 0.005, "v": 0.005, "r": 0.0005}
    outputs = {k: value[::10] + noise * sd[k] * rng.standard_normal(fine // 10) for k, value in clean.items()}
    n = 10.0 + 0.1 * rng.standard_normal(fine // 10)
    return Trial(
        name,
        t[::10].astype(np.float64),
        {"delta": delta[::10], "n": n},
        outputs,
        source=f"{name}.csv",
        synthetic=True,
        lines=np.arange(2, 2 + fine // 10, dtype=np.int64),
    )


def altered(trial: Trial, changes: Mapping[str, Callable[[Array], Array]], name: str | None = None) -> Trial:
    """A copy in which functions have been applied to channels."""
    return replace(
        trial,
        name=trial.name if name is None else name,
        inputs={k: changes[k](np.array(v)) if k in changes else v for k, v in trial.inputs.items()},
        outputs={k: changes[k](np.array(v)) if k in changes else v for k, v in trial.outputs.items()},
    )


def scattered(trial: Trial, every: int = 5) -> Trial:
    """The trial as topics with clocks of their own give it: a burst of four samples, one a sensor, then a pause."""
    groups = {"x": 0, "y": 0, "psi": 1, "r": 2, "u": 3, "v": 3}
    rows = np.flatnonzero(np.arange(len(trial)) % every < 4)
    kept = trial.samples(rows)
    outputs = {c: np.where(rows % every == groups.get(c, 0), v, np.nan) for c, v in kept.outputs.items()}
    return kept.with_step(Step("read", {"own_clocks": list(outputs)}), outputs=outputs)


def codes(findings: Sequence[Finding]) -> set[str]:
    """Which findings there are."""
    return {finding.code for finding in findings}


def step_at(values: Array) -> Array:
    values[1500:] += 1.0
    return values
