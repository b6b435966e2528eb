"""Where a recorded channel crosses a level, where a step of it began, and how high it peaked."""

from __future__ import annotations

import math

import numpy as np

from seatruth.arrays import Array


def first_crossing(t: Array, values: Array, level: float) -> float | None:
    """First time at which `values` rises through `level`, linear between samples; None where it never does."""
    above = np.flatnonzero(values >= level)
    if above.size == 0:
        return None
    k = int(above[0])
    if k == 0:
        return float(t[0])
    part = (level - values[k - 1]) / (values[k] - values[k - 1])
    return float(t[k - 1] + part * (t[k] - t[k - 1]))


def last_crossing(t: Array, values: Array, index: int, level: float) -> float:
    """Last time before sample `index` at which `values` rises through `level`, linear between samples."""
    below = np.flatnonzero(values[: index + 1] <= level)
    if below.size == 0:
        return float(t[0])
    k = int(below[-1])
    if k == index:
        return float(t[k])
    return float(t[k] + (t[k + 1] - t[k]) * (level - values[k]) / (values[k + 1] - values[k]))


def began(t: Array, rising: Array, index: int, base: float, threshold: float, middle: float) -> float:
    """The time at which `rising` left `base` on its way up to where it is at `index`.

    It is where the line through its last crossings of `threshold` and `middle` meets `base`: for a rudder that turns
    at a constant rate the moment it began to move, whatever noise it has at rest.
    """
    early, late = (last_crossing(t, rising, index, level) for level in (threshold, middle))
    return max(float(t[0]), early - (late - early) * (threshold - base) / (middle - threshold))


def executes(t: Array, control: Array, level: float, still: float) -> list[tuple[float, float]]:
    """When the rudder began each swing to a side (time, side +1 or -1), a swing being one that passes 60 % of level.

    A rudder that moves by less than `still` is at rest.
    """
    moves: list[tuple[float, float]] = []
    side = 0.0
    for k in np.flatnonzero(np.abs(control) > 0.6 * level):
        now = math.copysign(1.0, control[k])
        if now == side:
            continue
        # A reversal leaves the other side's level, the first execute leaves rest.
        base = -level if side else 0.0
        threshold = -0.9 * level if side else min(0.4 * level, max(still, 0.05 * level))
        moves.append((began(t, now * control, int(k), base, threshold, 0.5 * (threshold + 0.6 * level)), now))
        side = now
    return moves


def peak(values: Array, k: int) -> float:
    """Height of the maximum at sample k, from the parabola through it and its neighbours."""
    if not 0 < k < values.size - 1:
        return float(values[k])
    a, b, c = values[k - 1], values[k], values[k + 1]
    bend = a - 2 * b + c
    return float(b - (c - a) ** 2 / (8 * bend)) if bend < 0 else float(b)
