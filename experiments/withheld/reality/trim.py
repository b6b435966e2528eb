"""Level motion: how a vehicle that its elevator must hold down or up starts a trial."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from withheld.reality.families import Family
from withheld.reality.motion import Array, View


@dataclass(frozen=True)
class Level:
    """Steady motion on a level path: velocities (m/s), angle and actuator (rad)."""

    u: float
    w: float = 0.0
    angle: float = 0.0
    delta: float = 0.0


def level(family: Family, coefficients: Mapping[str, float]) -> Level:
    """Of a vehicle that is trimmed before its trials, by Newton's method; of the others straight ahead at their speed.

    The crew finds the trim of the vehicle that it has, so these are the true coefficients, without any mechanism.
    """
    if not family.trimmed:
        return Level(family.speed)
    p = {name: np.full(4, value) for name, value in {**family.sizes, **coefficients}.items()}
    found: Array = np.array([family.speed, 0.0, 0.0])
    for _ in range(20):
        tried = found[:, None] + 1e-6 * np.eye(3, 4, 1)
        u, angle, delta = tried
        zero = np.zeros(4)
        view = View(
            0.0, u, u * np.tan(angle), zero, zero, zero, angle, np.zeros((4, 4)), zero, zero, zero, zero, delta, zero
        )  # fmt: skip
        rates = np.stack(family.vehicle.rates(view, p, zero, zero, zero)[:3])
        step = np.linalg.solve((rates[:, 1:] - rates[:, :1]) / 1e-6, -rates[:, 0])
        found = found + step
        if np.abs(step).max() < 1e-10:
            break
    return Level(float(found[0]), float(found[0] * np.tan(found[1])), float(found[1]), float(found[2]))
