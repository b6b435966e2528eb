"""Synthetic trials that excite what effects change: several headings, speeds, revolutions and amplitudes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from seatruth.manoeuvres import thruster_layout
from seatruth.models import load_model
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

Array = NDArray[np.float64]

NOISE: Mapping[str, float] = {
    **dict.fromkeys("xyz", 0.1),
    **dict.fromkeys(("u", "v", "w", "v_n", "v_e"), 0.01),
    **dict.fromkeys(("phi", "theta", "psi"), math.radians(0.1)),
    **dict.fromkeys("pqr", math.radians(0.05)),
}
"""Standard deviations in SI units, of trials of models in a basin."""


def steps(t: Array, levels: tuple[float, ...], every: float) -> Array:
    """Levels held one after another, for `every` seconds each."""
    return np.asarray(levels)[(t // every).astype(int) % len(levels)]


def ship_trials(seconds: float = 120.0) -> tuple[list[Trial], list[dict[str, float]]]:
    """Trials of the 7 m KVLCC2 and their first states: zigzags, a circle, a coast-down, on four headings."""
    t: Array = np.arange(0.0, seconds, 0.5)
    full = np.full(t.size, 11.85)
    deg = math.radians(1.0)
    runs = [
        (0.0, 1.1, steps(t, (10 * deg, -10 * deg, 20 * deg, -20 * deg), 15.0), full),
        (1.6, 0.8, np.full(t.size, 25 * deg) * (t > 10.0), full),
        (3.1, 1.2, steps(t, (0.0, 5 * deg, -2 * deg, 1 * deg, -5 * deg), 8.0), np.where(t < seconds / 2, full, 0.0)),
        (4.5, 0.5, steps(t, (-15 * deg, 15 * deg), 6.0), steps(t, (14.0, 7.0, 11.0), 30.0)),
    ]
    found = [
        Trial(f"run {k}", t, {"delta": delta, "n": n}, {}, synthetic=True) for k, (_, _, delta, n) in enumerate(runs)
    ]
    return found, [{"psi": heading, "u": speed} for heading, speed, _, _ in runs]


def torpedo_trials(seconds: float = 60.0) -> tuple[list[Trial], list[dict[str, float]]]:
    """Trials of the small torpedo and their first states: planes, rudder and revolutions in steps, at two depths."""
    t: Array = np.arange(0.0, seconds, 0.2)
    deg = math.radians(1.0)
    runs = [
        (0.0, 1.5, 5.0, (2 * deg, -2 * deg, 4 * deg, -4 * deg), (0.0, 3 * deg, -3 * deg), (22.0,)),
        (2.0, 1.0, 20.0, (0.0,), (5 * deg, -5 * deg, 1 * deg), (15.0, 25.0)),
        (4.0, 2.0, 10.0, (-3 * deg, 1 * deg, 2 * deg), (-6 * deg, 6 * deg), (25.0, 0.0, 18.0)),
    ]
    found, first = [], []
    for k, (heading, speed, depth, planes, rudders, revolutions) in enumerate(runs):
        inputs = {
            "delta": steps(t, rudders, 7.0),
            "delta_s": steps(t, planes, 4.0),
            "delta_d": np.zeros(t.size),
            "n": steps(t, revolutions, 15.0),
        }
        found.append(Trial(f"run {k}", t, inputs, {}, synthetic=True))
        first.append({"psi": heading, "u": speed, "z": depth})
    return found, first


def diving_trials(seconds: float = 100.0) -> tuple[list[Trial], list[dict[str, float]]]:
    """Trials of the 5 m vehicle in the diving plane and their first states: plane angles in steps, small and large."""
    t: Array = np.arange(0.0, seconds, 0.25)
    deg = math.radians(1.0)
    runs = [(1.5, 5.0, (12 * deg, -12 * deg), 10.0), (1.0, 20.0, (2 * deg, -1 * deg, 6 * deg, -6 * deg), 5.0)]
    found = [
        Trial(f"run {k}", t, {"delta_s": steps(t, planes, every)}, {}, synthetic=True)
        for k, (_, _, planes, every) in enumerate(runs)
    ]
    return found, [{"u": speed, "z": depth} for speed, depth, _, _ in runs]


def boat_trials(seconds: float = 80.0) -> tuple[list[Trial], list[dict[str, float]]]:
    """Trials of the 2 m boat with two thrusters and their first states: steps of each, of both, and astern."""
    t: Array = np.arange(0.0, seconds, 0.25)
    runs = [
        (0.3, 0.8, (10.0, 6.0, 12.0, 3.0, 8.0), (10.0, 12.0, 4.0, 9.0)),
        (2.4, 0.3, (9.0, -7.0, 1.5, -1.0, 13.0, 0.0), (7.0, 1.0, -1.2, 12.0, -9.0)),
        (4.0, 1.5, (8.0, 8.0, 14.0, 14.0, 8.0, -4.0), (8.0, 5.0, 8.0, 14.0)),
    ]
    found = [
        Trial(
            f"run {k}", t, {"n_port": steps(t, port, 4.0), "n_starboard": steps(t, starboard, 5.0)}, {}, synthetic=True
        )
        for k, (_, _, port, starboard) in enumerate(runs)
    ]
    return found, [{"psi": heading, "u": speed} for heading, speed, _, _ in runs]


def rov_trials(seconds: float = 42.0) -> tuple[list[Trial], list[dict[str, float]]]:
    """Trials of the vehicle with eight thrusters and their first states: steps along its axes and of each thruster."""
    model = load_model("bluerov2_heavy")
    layout = thruster_layout(model, {"voltage": 16.0}, dead_band=0.07)
    t: Array = np.arange(0.0, seconds, 0.1)
    levels = (
        {"surge": (0.1, 0.2, 0.05, -0.1, 0.15), "yaw": (0.01, -0.015, 0.0, 0.005), "heave": (0.05, -0.05, 0.0)},
        {"surge": (0.05, 0.15), "sway": (0.03, -0.05, 0.02), "heave": (0.08, -0.08), "yaw": (0.0, 0.01, -0.005)},
        {"surge": (0.2, -0.1, 0.1), "heave": (-0.05, 0.08, 0.0), "yaw": (-0.01, 0.01), "sway": (0.0, 0.05)},
    )
    found = []
    for k, axes in enumerate(levels):
        held = {axis: steps(t, values, 3.0 + n) for n, (axis, values) in enumerate(axes.items())}
        rows = [layout.orders({axis: float(values[j]) for axis, values in held.items()}) for j in range(t.size)]
        inputs = {name: np.array([row[name] for row in rows]) for name in layout.full}
        for n, name in enumerate(inputs):  # each alone for a while
            inputs[name] = inputs[name] + 0.1 * ((t > 2.0 + 4.5 * n) & (t < 4.0 + 4.5 * n))
        voltage = 16.0 - 0.02 * t - 0.5 * k
        found.append(Trial(f"run {k}", t, {**inputs, "voltage": voltage}, {}, synthetic=True))
    return found, [{"psi": heading, "u": 0.2, "z": depth} for heading, depth in ((0.3, 3.0), (2.4, 8.0), (4.0, 15.0))]


def start(model: Model, first: Mapping[str, float], trial: Trial, values: Mapping[str, float]) -> Array:
    """A first state (S,) of an extended model: the given base states, and the effects' own as they follow them."""
    outputs = {channel.name: first.get(channel.name, 0.0) for channel in model.outputs}
    inputs = {channel.name: float(trial.inputs[channel.name][0]) for channel in model.inputs}
    return np.array(model.first_state(outputs, inputs, values))
