"""The small study that is attacked: a model of two states in a file of the user's, and a SYNTHETIC log of it."""

from __future__ import annotations

import math
from pathlib import Path

MODEL = """
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.trials import Channel


class Nomoto(Model):
    name = "nomoto"
    title = "Nomoto's first-order yaw, synthetic"
    kind = "ship"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = states
    parameters = (
        Parameter("K", 0.1, "1/s", min=0.0, max=1.0, vary=True),
        Parameter("T", 10.0, "s", min=1.0, max=100.0, vary=True),
    )

    @staticmethod
    def rhs(s, i, p):
        return (p.K * i.delta - s.r) / p.T, s.r
"""
STUDY = """
[study]
name = "attacked"
seed = 1
synthetic = true

[model]
use = "boat.py:Nomoto"
vary = ["K", "T"]

[[trials]]
file = "run_*.csv"

[budget]
evaluations = 60

[output]
report = false
"""
COMPARISON = """
[comparison]
seeds = 2
budgets = [30]

[[problems]]
study = "study.toml"
start = "study"

[[solvers]]
use = "least_squares"

[[solvers]]
use = "particle_swarm"
particles = 8

[[noise]]
levels = [0.01]
"""


def log(samples: int = 60, step: float = 0.5, phase: float = 0.0) -> str:
    """A SYNTHETIC log as CSV: a rudder that goes to and fro, and the yaw that follows, with a small ripple as noise."""
    lines, r, psi = ["t,delta,r,psi"], 0.0, 0.0
    for k in range(samples):
        t = k * step
        delta = 0.3 if math.sin(0.3 * t + phase) > 0 else -0.3
        ripple = 1e-3 * math.sin(17.0 * k + phase)
        lines.append(f"{t!r},{delta!r},{r + ripple!r},{psi + ripple!r}")
        r += step * (0.12 * delta - r) / 8.0
        psi += step * r
    return "\n".join(lines) + "\n"


def build(folder: Path) -> Path:
    """Writes model, logs, study and comparison into a folder; returns the study file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "boat.py").write_text(MODEL)
    (folder / "run_1.csv").write_text(log())
    (folder / "run_2.csv").write_text(log(phase=1.0))
    (folder / "comparison.toml").write_text(COMPARISON)
    (folder / "study.toml").write_text(STUDY)
    return folder / "study.toml"
