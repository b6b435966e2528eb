"""A program without a model of the ship: do the sensors agree with each other?

Position is the integral of speed turned by heading, and heading that of the rate of turn, whatever moves the ship. What
is left of both over pieces of 5 s is regressed on what an error of each sensor would leave; single errors, pairs and
triples are compared by BIC. It can name nothing but sensors, and cannot tell a bias of the compass from a turned log.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from withheld.programs.common import recorded, soft
from withheld.verdicts import verdict

Array = NDArray[np.float64]
Record = Mapping[str, Array]
Change = Callable[[Record, float], dict[str, Array]]
PIECE = 5.0
"""s over which positions and headings are compared."""
TEMPERATURE = 2.0
"""By which log-evidence is divided: pieces that follow each other are not quite independent."""
NEEDED = ("x", "y", "psi", "u", "v", "r")


def _late(*names: str) -> Change:
    return lambda c, h: {name: np.interp(c["t"] - h, c["t"], c[name]) for name in names}


ERRORS: dict[str, dict[str, tuple[str, float, Change]]] = {
    "heading_bias": {"b": ("rad", 0.01, lambda c, h: {"psi": c["psi"] + h})},
    "speed_scale": {"k": ("1", 0.01, lambda c, h: {"u": c["u"] * (1 + h)})},
    "speed_bias": {"b": ("m/s", 0.01, lambda c, h: {"u": c["u"] + h})},
    "sway_bias": {"b": ("m/s", 0.01, lambda c, h: {"v": c["v"] + h})},
    "log_lever_arm": {
        "forward": ("m", 0.1, lambda c, h: {"v": c["v"] + h * c["r"]}),
        "starboard": ("m", 0.1, lambda c, h: {"u": c["u"] - h * c["r"]}),
    },
    "position_lever_arm": {
        "forward": ("m", 0.1, lambda c, h: {"x": c["x"] + h * np.cos(c["psi"]), "y": c["y"] + h * np.sin(c["psi"])}),
        "starboard": ("m", 0.1, lambda c, h: {"x": c["x"] - h * np.sin(c["psi"]), "y": c["y"] + h * np.cos(c["psi"])}),
    },
    "position_delay": {"tau": ("s", 0.1, _late("x", "y"))},
    "heading_delay": {"tau": ("s", 0.1, _late("psi"))},
    "rate_delay": {"tau": ("s", 0.1, _late("r"))},
    "gyro_bias": {"b": ("rad/s", 0.001, lambda c, h: {"r": c["r"] + h})},
}
"""By error: its parameters, their units, a step and what it changes. A turned log is left out: by tracks and speeds
alone it is a heading bias."""


def left(c: Record) -> tuple[Array, Array]:
    """What the positions and the heading do over pieces beyond what the other sensors say: (n,) m, (m,) rad."""
    t = c["t"]
    along = c["u"] * np.cos(c["psi"]) - c["v"] * np.sin(c["psi"])
    across = c["u"] * np.sin(c["psi"]) + c["v"] * np.cos(c["psi"])

    def path(rate: Array) -> Array:
        return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])

    step = float(np.median(np.diff(t)))
    # The first and last seconds are left out, where a delayed column holds its end.
    margin = math.ceil(2.0 / step)
    at = np.arange(margin, len(t) - margin, max(1, round(PIECE / step)))
    track = [np.diff((c[name] - path(rate))[at]) for name, rate in (("x", along), ("y", across))]
    return np.concatenate(track), np.diff((c["psi"] - path(c["r"]))[at])


def kinematics(study: Path) -> dict[str, Any]:
    """The verdict by the sensors' agreement alone."""
    from seatruth import load_study

    records = [
        {"t": t.t, **{name: _whole(t.t, recorded(t, name)) for name in NEEDED}} for t in load_study(study).trials
    ]
    base = [_joined([left(c)[k] for c in records]) for k in (0, 1)]
    columns: dict[str, list[Array]] = {}
    for name, of in ERRORS.items():
        changed = [
            [
                _joined([(left({**c, **change(c, h)})[k] - left(c)[k]) / h for c in records])
                for _, h, change in of.values()
            ]
            for k in (0, 1)
        ]
        columns[name] = [np.stack(part, axis=1) for part in changed]
    everything = [np.concatenate([columns[name][k] for name in ERRORS], axis=1) for k in (0, 1)]
    # The noise of each kind is what no error explains; white pieces are assumed.
    sizes = [_rms(base[k] - everything[k] @ np.linalg.lstsq(everything[k], base[k], rcond=1e-8)[0]) for k in (0, 1)]
    y = np.concatenate([base[k] / sizes[k] for k in (0, 1)])
    by_name = {name: np.concatenate([columns[name][k] / sizes[k] for k in (0, 1)]) for name in ERRORS}
    keys = [key for size in (1, 2, 3) for key in itertools.combinations(sorted(ERRORS), size)]
    gains = {key: _gain(y, [by_name[name] for name in key]) for key in keys}
    chances = soft({"": 0.0, **{"+".join(key): gain / TEMPERATURE for key, gain in gains.items()}})
    candidates = [(words[0].split("+") if words else [], p) for words, p in chances][:40]
    which = [
        {
            "name": name,
            "probability": sum(p for effects, p in candidates if name in effects),
            "log_evidence": gains[name,],
            "parameters": _values(y, by_name[name], ERRORS[name]),
        }
        for name in ERRORS
    ]
    return verdict(study.parent.name, candidates, which=which)


def _gain(y: Array, blocks: Sequence[Array]) -> float:
    """Fall of half the sum of squares, less BIC's price of the parameters."""
    A = np.concatenate(blocks, axis=1)
    rest = y - A @ np.linalg.lstsq(A, y, rcond=1e-8)[0]
    return 0.5 * float(y @ y - rest @ rest) - 0.5 * int(A.shape[1]) * math.log(len(y))


def _values(y: Array, A: Array, of: Mapping[str, tuple[str, float, Change]]) -> list[dict[str, Any]]:
    found = np.linalg.lstsq(A, y, rcond=1e-8)[0]
    # With the errors as large as this one alone leaves them.
    errors = np.sqrt(np.diag(np.linalg.pinv(A.T @ A))) * _rms(y - A @ found)
    return [
        {"name": name, "value": float(value), "stderr": float(error), "unit": unit}
        for (name, (unit, _, _)), value, error in zip(of.items(), found, errors, strict=True)
    ]


def _rms(values: Array) -> float:
    return max(float(np.sqrt(np.mean(values**2))), 1e-12)


def _joined(parts: Sequence[Array]) -> Array:
    return np.concatenate(list(parts))


def _whole(t: Array, values: Array) -> Array:
    good = np.isfinite(values)
    return np.interp(t, t[good], values[good])
