"""Makes the embedded sample again, byte for byte: `python -m seatruth.sample.make [FOLDER]`.

The trials are simulated, noisy and rounded as an instrument's log is. What is behind them (true coefficients, current)
goes to truth.json, which nothing in seatruth reads.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seatruth.manoeuvres import (
    Manoeuvre,
    SpeedSteps,
    TurningCircle,
    Zigzag,
    add_noise,
    run_manoeuvre,
    self_propulsion,
    steady_current,
)
from seatruth.models.mmg import MMGShip
from seatruth.sample import FOLDER
from seatruth.trials.trial import Trial

SEED = 20265
SPEED = 1.179
"""Approach speed through the water, m/s (model scale of the service speed)."""
RUDDER_RATE = math.radians(15.8)
STEP = 0.2
"""Sampling and integration step, s."""
CURRENT, CURRENT_DIRECTION = 0.08, math.radians(70.0)
NOISE = {"x": 0.1, "y": 0.1, "psi": math.radians(0.1), "u": 0.01, "v": 0.01, "r": math.radians(0.05)}
MOVED = ("R_0", "X_vvvv", "Y_v", "Y_r", "Y_vvv", "Y_vrr", "N_v", "N_r", "N_vvr", "N_vrr", "a_H", "t_R")
"""Coefficients that are 10 to 20 % off their nominal value in the sample's ship."""

COLUMNS = (
    ("t", "s", 1.0, 1),
    ("delta", "deg", math.degrees(1.0), 2),
    ("n", "rev/s", 1.0, 2),
    ("x", "m", 1.0, 2),
    ("y", "m", 1.0, 2),
    ("psi", "deg", math.degrees(1.0), 2),
    ("u", "m/s", 1.0, 3),
    ("v", "m/s", 1.0, 3),
    ("r", "deg/s", math.degrees(1.0), 3),
)
"""Channel, unit in the file, factor from SI, decimals."""


@dataclass(frozen=True)
class Run:
    """One trial of the sample: its file's name, the manoeuvre, the heading of the approach (rad), a time limit (s)."""

    name: str
    manoeuvre: Manoeuvre
    heading: float
    limit: float


def runs(n: float) -> tuple[Run, ...]:
    """The sample's trials; `n` (rev/s) propels the ship at the approach speed."""
    deg = math.radians
    return (
        Run("zigzag_10_10", Zigzag(deg(10), deg(10), "starboard", approach=5), deg(30), 130.0),
        Run("zigzag_20_20", Zigzag(deg(20), deg(20), "port", approach=5), deg(210), 130.0),
        Run("turning_circle_35", TurningCircle(deg(35), deg(560), approach=5), deg(120), 150.0),
        Run("speed_steps", SpeedSteps((n, 0.6 * n, 1.1 * n), hold=40.0), deg(300), 120.0),
        Run("zigzag_20_10", Zigzag(deg(20), deg(10), "starboard", approach=5), deg(330), 130.0),
    )


def true_values(rng: np.random.Generator) -> dict[str, float]:
    """The coefficients of the sample's ship that differ from nominal."""
    nominal = MMGShip().nominal()
    factors = 1.0 + rng.choice((-1.0, 1.0), len(MOVED)) * rng.uniform(0.10, 0.20, len(MOVED))
    return {name: nominal[name] * float(factor) for name, factor in zip(MOVED, factors)}


def simulate(values: dict[str, float], run: Run, n: float, *, current: float = CURRENT) -> Trial:
    """One trial without noise."""
    environment = steady_current(current, CURRENT_DIRECTION)
    drift = (current * math.cos(CURRENT_DIRECTION - run.heading), current * math.sin(CURRENT_DIRECTION - run.heading))
    return run_manoeuvre(
        MMGShip(),
        run.manoeuvre,
        values,
        dt=STEP,
        first_state={"u": SPEED + drift[0], "v": drift[1], "psi": run.heading},
        inputs={"n": n},
        rudder_rate=RUDDER_RATE,
        limit=run.limit,
        environment=environment,
        name=run.name,
    )


def trials(seed: int = SEED) -> tuple[dict[str, float], float, list[Trial]]:
    """True values, propeller speed (rev/s) and the noisy trials."""
    rng = np.random.default_rng(seed)
    values = true_values(rng)
    n = round(self_propulsion(MMGShip(), SPEED, values), 2)
    return values, n, [add_noise(simulate(values, run, n), NOISE, rng) for run in runs(n)]


def text(trial: Trial) -> str:
    """The trial as a CSV log: a comment that says it is synthetic, a header with units, rounded numbers.

    The heading is logged as a compass shows it, from 0 to 360 degrees.
    """
    lines = [
        f"# SYNTHETIC: {trial.conditions['manoeuvre']}, simulated by seatruth.sample.make; no measurement",
        ",".join(f"{name} [{unit}]" for name, unit, _, _ in COLUMNS),
    ]
    columns = []
    for name, _, factor, decimals in COLUMNS:
        values = (trial.t if name == "t" else trial.channel(name)) * factor
        values = np.round(values, decimals) + 0.0
        if name == "psi":
            values = np.mod(values, 360.0)
        columns.append([f"{value:.{decimals}f}" for value in values])
    lines += [",".join(row) for row in zip(*columns)]
    return "\n".join(lines) + "\n"


def make(folder: Path) -> None:
    """Writes the CSV files and truth.json into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    values, n, made = trials()
    for trial in made:
        (folder / f"{trial.name}.csv").write_text(text(trial), encoding="utf-8", newline="\n")
    truth = {
        "synthetic": True,
        "model": "mmg",
        "parameters": {name: round(value, 6) for name, value in values.items()},
        "effect": {
            "name": "current",
            "speed_m_s": CURRENT,
            "runs_towards_deg": round(math.degrees(CURRENT_DIRECTION), 6),
        },
        "noise_sd_SI": {name: round(sd, 8) for name, sd in NOISE.items()},
        "approach_speed_m_s": SPEED,
        "propeller_rev_s": n,
        "seed": SEED,
    }
    (folder / "truth.json").write_text(json.dumps(truth, indent=2) + "\n", encoding="utf-8", newline="\n")


def main(arguments: Sequence[str]) -> None:
    """Makes the sample in the folder that is named, or where it belongs."""
    make(Path(arguments[0]) if arguments else FOLDER)


if __name__ == "__main__":
    main(sys.argv[1:])
