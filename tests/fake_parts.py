"""Parts of a diagnosis made by hand beside its verdict. SYNTHETIC: no trial and no simulation is behind them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.diagnosis.parts import (
    ChannelNoise,
    Discrepancy,
    Fold,
    MenuEntry,
    MissingForce,
    MissingTerm,
    NextTrial,
    Shares,
    Validation,
)

TRIALS = ("zigzag_20_20", "turn_35_port", "straight_run")
CHANNELS = {"u": ("m/s", 0.02), "psi": ("rad", 0.002), "x": ("m", 0.5)}
T = tuple(float(t) for t in range(0, 101, 2))


def noise() -> tuple[ChannelNoise, ...]:
    """Of each channel."""
    return tuple(
        ChannelNoise(name, unit, sd, sd if name == "x" else 0.0, 8.0, math.nan, 150)
        for name, (unit, sd) in CHANNELS.items()
    )


def shares(kind: str) -> Shares:
    """The split of the misfit."""
    if kind in ("no_gap", "unknown_small", "underpowered", "only_small"):
        return Shares(0.4, 0.58, 0.0, 0.02, 2.5, 1.05, 1.05)
    if kind == "unknown":
        return Shares(0.1, 0.2, 0.0, 0.7, 10.0, 8.0, 8.0)
    return Shares(0.1, 0.2, 0.65, 0.05, 10.0, 8.0, 1.5)


def gap_table(trials: Sequence[str], kind: str) -> pd.DataFrame:
    """By trial and channel."""
    large = kind not in ("no_gap", "unknown_small", "underpowered", "only_small")
    multiples = {"before": 4.0, "refit": 3.0 if large else 1.02, "effects": 3.0 if kind == "unknown" else 1.01}
    rows = []
    for trial in trials:
        for channel, (unit, noise) in CHANNELS.items():
            row: dict[str, Any] = {"trial": trial, "channel": channel, "unit": unit, "n": 50, "noise": noise}
            row |= {f"rmse_{fit}": noise * m for fit, m in multiples.items()}
            rows.append(row | {f"multiple_{fit}": m for fit, m in multiples.items()})
    return pd.DataFrame(rows)


def time_table(trials: Sequence[str], kind: str) -> pd.DataFrame:
    """By parts of each trial."""
    rows = []
    for n, trial in enumerate(trials):
        for k in range(4):
            row = {"trial": trial, "from_s": 25.0 * k, "to_s": 25.0 * (k + 1), "n": 36, "p": 0.5 if k == 0 else 1e-6}
            row |= {"misfit": 1.0 + 20.0 * k * (n == 1), "p_adjusted": row["p"]}
            rows.append(row | {"significant": n == 1 and k > 0 and kind != "no_gap"})
    return pd.DataFrame(rows)


def region_table(kind: str) -> pd.DataFrame:
    """By cells of heading and speed."""
    rows = []
    for k, cell in enumerate(("north", "east", "south", "west")):
        row = {"variable": "heading", "unit": "rad", "cell": cell, "from": k * math.pi / 2, "to": (k + 1) * math.pi / 2}
        rows.append(row | {"n": 40, "misfit": 1.0 + 5.0 * k})
    for k in range(2):
        row = {"variable": "speed", "unit": "m/s", "cell": "", "from": 0.5 * k, "to": 0.5 * (k + 1)}
        rows.append(row | {"n": 40, "misfit": 2.0})
    for row in rows:
        row["p"] = row["p_adjusted"] = 0.001 if row["misfit"] > 10.0 else 0.4
        row["significant"] = row["misfit"] > 10.0 and kind != "no_gap"
    return pd.DataFrame(rows)


def traces(trials: Sequence[str]) -> pd.DataFrame:
    """Time histories."""
    rng = np.random.default_rng(0)
    parts = []
    for trial in trials:
        for channel, (_, noise) in CHANNELS.items():
            t = np.array(T)
            gap = 3.0 * noise * np.sin(t / 20.0)
            values = {
                "measured": gap + noise * rng.normal(size=t.size),
                "before": -gap,
                "refit": 0.0 * t,
                "effects": gap,
            }
            parts.append(pd.DataFrame({"trial": trial, "t": t, "channel": channel, **values}))
    return pd.concat(parts, ignore_index=True)


def discrepancy(kind: str) -> Discrepancy:
    """What the model lacks."""
    grave = kind in ("with_discrepancy", "unknown")
    forces = tuple(
        MissingForce(trial, "yaw", T, tuple(0.001 * math.sin(t / 9.0) for t in T), (3e-4,) * len(T), "rad/s^2")
        for trial in TRIALS
    )
    terms = (
        MissingTerm("yaw", "v r / U^2", 0.25, 0.02, "rad/s^2"),
        MissingTerm("yaw", "1", -0.02, 0.004, "rad/s^2"),
    )
    sizes = {"yaw": 0.21, "sway": 0.03, "surge": 0.0} if grave else {"yaw": 0.002, "sway": 0.0, "surge": 0.0}
    return Discrepancy(sizes, forces if grave else (), terms if grave else (), 24.0 if grave else -3.0)


def validation(names: tuple[str, ...], kind: str) -> Validation:
    """Trials left out."""
    poor = kind == "not_predictive"
    folds = tuple(
        Fold(trial, names, 2.8, 2.9 if poor else 1.1, 2.6, 1.05, 1.0, 0.2, -0.5 if poor else 10.0) for trial in TRIALS
    )
    if poor:
        return Validation(folds, 0.08, -0.4, 0.56, 0.1)
    return Validation(folds, 0.93, 0.85, 1.0, 0.12)


def next_trial(kind: str) -> NextTrial:
    """The suggestion."""
    helps = kind in ("inseparable", "effects", "underpowered")
    track = {"x": T, "y": tuple(10.0 * math.sin(t / 30.0) for t in T), "psi": tuple(t / 100.0 for t in T)}
    pair = ("wind", "wave_drift")
    menu = (
        MenuEntry(
            "turn by +delta", "rudder hard over to starboard", 100.0 if helps else 4.0, 8.0 if helps else 1.0, pair
        ),
        MenuEntry("zigzag 10/10", "rudder 10 deg to each side", 9.0 if helps else 4.0, 2.2 if helps else 1.0, pair),
    )
    none: dict[str, tuple[float, ...]] = {}
    return NextTrial(
        manoeuvre="turn by +delta" if helps else "",
        text="rudder hard over to starboard" if helps else "",
        survivors=("wind", "wave_drift", "unknown"),
        noncentrality_now=4.0,
        noncentrality_then=100.0 if helps else 4.0,
        gain=8.0 if helps else 1.0,
        menu=menu,
        t=T if helps else (),
        inputs={"delta": tuple(0.6 * (t > 10.0) for t in T)} if helps else none,
        motion=track if helps else none,
        units={"delta": "rad", "x": "m", "y": "m", "psi": "rad"},
    )
