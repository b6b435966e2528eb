"""What sensors make of the motion, and their noise.

A sensor changes true outputs (name -> (time, lanes)) into read ones; it is applied to whole records on the fine grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from withheld.reality.motion import Array, Values

Outputs = dict[str, Array]


def speed_scale(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"u": y["u"] * (1 + q["k"])}


def speed_bias(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"u": y["u"] + q["b"]}


def heading_bias(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"psi": y["psi"] + q["b"]}


def compass_deviation(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"psi": y["psi"] + q["A"] * np.sin(y["psi"]) + q["B"] * np.cos(y["psi"])}


def gyro_bias(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"r": y["r"] + q["b"]}


def lever_arm(y: Outputs, q: Values, t: Array) -> Outputs:
    """The velocity log stands `forward` and `across` of the origin."""
    return {"u": y["u"] - q["across"] * y["r"], "v": y["v"] + q["forward"] * y["r"]}


def lever_arm_vertical(y: Outputs, q: Values, t: Array) -> Outputs:
    """The same in the vertical plane: forward and below."""
    return {"u": y["u"] + q["below"] * y["q"], "w": y["w"] - q["forward"] * y["q"]}


def depth(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"z": y["z"] + q["b"] + q["k"] * (y["z"] - y["z"][:1])}


def sway_bias(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"v": y["v"] + q["b"]}


def turned_log(y: Outputs, q: Values, t: Array) -> Outputs:
    """The log's axes are turned by `angle`, rad: to starboard, or bow down where the diving plane is the vehicle's."""
    c, d, across = np.cos(q["angle"]), np.sin(q["angle"]), "v" if "v" in y else "w"
    return {"u": c * y["u"] + d * y[across], across: c * y[across] - d * y["u"]}


def heave_bias(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"w": y["w"] + q["b"]}


def pitch_bias(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"theta": y["theta"] + q["b"]}


def pitch_gyro_bias(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"q": y["q"] + q["b"]}


def antenna(y: Outputs, q: Values, t: Array) -> Outputs:
    """The position is that of a point `forward` and `across` of the origin."""
    c, d = np.cos(y["psi"]), np.sin(y["psi"])
    return {"x": y["x"] + q["forward"] * c - q["across"] * d, "y": y["y"] + q["forward"] * d + q["across"] * c}


def pressure_port(y: Outputs, q: Values, t: Array) -> Outputs:
    """The depth is that of a point `forward` of the origin."""
    return {"z": y["z"] - q["forward"] * np.sin(y["theta"])}


def _late(values: Array, tau: Array, t: Array) -> Array:
    """Values `tau` s old; before its first sample the vehicle went on as it began."""
    found = np.empty_like(values)
    for lane in range(values.shape[1]):
        back = t - tau[lane]
        found[:, lane] = np.interp(back, t, values[:, lane])
        early = back < t[0]
        slope = (values[1, lane] - values[0, lane]) / (t[1] - t[0])
        found[early, lane] = values[0, lane] + (back[early] - t[0]) * slope
    return found


def late_position(y: Outputs, q: Values, t: Array) -> Outputs:
    return {name: _late(y[name], q["tau"], t) for name in ("x", "y")}


def late_heading(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"psi": _late(y["psi"], q["tau"], t)}


def late_rate(y: Outputs, q: Values, t: Array) -> Outputs:
    name = "r" if "r" in y else "q"
    return {name: _late(y[name], q["tau"], t)}


def late_speed(y: Outputs, q: Values, t: Array) -> Outputs:
    return {name: _late(y[name], q["tau"], t) for name in ("u", "v", "w") if name in y}


def late_pitch(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"theta": _late(y["theta"], q["tau"], t)}


def late_depth(y: Outputs, q: Values, t: Array) -> Outputs:
    return {"z": _late(y["z"], q["tau"], t)}


HISTORY = (late_position, late_heading, late_rate, late_speed, late_pitch, late_depth, depth)
"""Those that need the record before now; a pilot is not told of them."""


SLOW = (0.3, 2.0)
"""Least and largest slow part of a sensor's error, in multiples of its white part; even in the logarithm [S]."""
TAU = (1.0, 60.0)
"""s: its correlation time, in the same way [S]; a position by satellite reaches the upper end."""


@dataclass(frozen=True)
class Noise:
    """Noise of one channel: white of sd `white`, and Ornstein-Uhlenbeck of sd `slow` and correlation time `tau` s."""

    white: float
    slow: float
    tau: float

    @property
    def sd(self) -> float:
        """Of both together."""
        return float(np.hypot(self.white, self.slow))

    def covariance(self, n: int, dt: float) -> Array:
        """(n, n)."""
        lag = dt * np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
        return self.slow**2 * np.exp(-lag / self.tau) + self.white**2 * np.eye(n)

    @classmethod
    def drawn(cls, rng: np.random.Generator, stated: float) -> Noise:
        """Noise of a channel whose data sheet states `stated`: white near that, and a slow error that it leaves out."""
        white = stated * float(np.exp(rng.normal(0.0, 0.12)))
        slow = white * float(np.exp(rng.uniform(*np.log(SLOW))))
        return cls(white, slow, float(np.exp(rng.uniform(*np.log(TAU)))))

    def draw(self, rng: np.random.Generator, n: int, dt: float) -> Array:
        """n samples dt apart."""
        phi = float(np.exp(-dt / self.tau))
        kick = rng.standard_normal(n) * self.slow
        slow = np.empty(n)
        slow[0] = kick[0]
        for k in range(1, n):
            slow[k] = phi * slow[k - 1] + np.sqrt(1 - phi**2) * kick[k]
        return slow + self.white * rng.standard_normal(n)
