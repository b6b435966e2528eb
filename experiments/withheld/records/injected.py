"""Errors of sensors put into a record: what the log would say, had the sensor been so.

This file imports numpy and nothing else, and shares nothing with seatruth's effects (a test holds that). A record is a
mapping of columns (n,) in SI units: t, x, y (m, over ground), psi (rad), u, v (m/s), r (rad/s), and whatever else the
log holds. Each function gives a changed copy. All but a delay are exact sample by sample; a delay is read off on the
straight line between two samples (exactly where it is a whole number of samples), and the first samples of the whole
log, of which the late sensor had said nothing yet, are dropped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Columns = dict[str, Array]

COMPANIONS = {"x": ("pos_hold", "pos_jump")}
"""Columns that say something of another one's sample, and are late with it."""
_SAME = 1e-6
"""s: times that are nearer than this are the same."""


def heading_bias(record: Columns, b: float) -> Columns:
    """The compass reads b (rad) too much."""
    return {**record, "psi": record["psi"] + b}


def speed_scale(record: Columns, k: float) -> Columns:
    """The log's speed along is too large by a part k of it."""
    return {**record, "u": (1.0 + k) * record["u"]}


def speed_bias(record: Columns, b: float) -> Columns:
    """The log's speed along is b (m/s) too large."""
    return {**record, "u": record["u"] + b}


def log_lever_arm(record: Columns, forward: float, starboard: float) -> Columns:
    """The log sits off midship (m) and measures the hull's speed there, by the recorded rate of turn."""
    across = record["v"] + forward * record["r"]
    along = record["u"] - starboard * record["r"]
    return {**record, "u": along, "v": across}


def position_lever_arm(record: Columns, forward: float, starboard: float) -> Columns:
    """The antenna stands off midship (m); the recorded heading says where it is."""
    c, s = np.cos(record["psi"]), np.sin(record["psi"])
    x = record["x"] + forward * c - starboard * s
    y = record["y"] + forward * s + starboard * c
    return {**record, "x": x, "y": y}


def log_misalignment(record: Columns, angle: float) -> Columns:
    """The log is turned by an angle (rad) to starboard: its axes are not the hull's."""
    c, s = math.cos(angle), math.sin(angle)
    u, v = record["u"], record["v"]
    return {**record, "u": c * u + s * v, "v": c * v - s * u}


def late(record: Columns, names: tuple[str, ...], tau: float) -> Columns:
    """These columns as they were tau (s) before; flags of their samples go with them."""
    t = record["t"]
    kept = t >= t[0] + tau - _SAME
    found = {name: values[kept] for name, values in record.items()}
    then = found["t"] - tau
    for name in names:
        found[name] = np.interp(then, t, record[name])
        before = np.maximum(np.searchsorted(t, then + _SAME, side="right") - 1, 0)
        for flag in COMPANIONS.get(name, ()):
            if flag in record:
                found[flag] = record[flag][before]
    return found


def heading_delay(record: Columns, tau: float) -> Columns:
    """The heading is recorded late."""
    return late(record, ("psi",), tau)


def position_delay(record: Columns, tau: float) -> Columns:
    """The position is recorded late."""
    return late(record, ("x", "y"), tau)


INJECTIONS: Mapping[str, Callable[..., Columns]] = {
    "heading_bias": heading_bias,
    "speed_scale": speed_scale,
    "speed_bias": speed_bias,
    "log_lever_arm": log_lever_arm,
    "position_lever_arm": position_lever_arm,
    "log_misalignment": log_misalignment,
    "heading_delay": heading_delay,
    "position_delay": position_delay,
}


def injected(record: Columns, key: str, values: Mapping[str, float]) -> Columns:
    """The record with one sensor's error in it."""
    return INJECTIONS[key](record, **values)
