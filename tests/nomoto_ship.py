"""A user's folder with a model of its own and a SYNTHETIC log of it, and the command line as a user calls it there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from seatruth import cli

SHIP = """
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.trials import Channel


class Nomoto(Model):
    name = "nomoto"
    title = "Nomoto first-order yaw"
    kind = "ship"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    parameters = (
        Parameter("K", 0.1, "1/s", min=0.0, max=1.0, vary=True, description="rudder gain"),
        Parameter("T", 10.0, "s", min=1.0, max=100.0, vary=True),
    )

    @staticmethod
    def rhs(s, i, p):
        return (p.K * i.delta - s.r) / p.T, s.r
"""


def write_ship(folder: Path) -> None:
    """Writes ship.py with the model and zigzag.csv with the log."""
    (folder / "ship.py").write_text(SHIP)
    (folder / "zigzag.csv").write_text(log())


def begun(folder: Path) -> Path:
    """The study file that `init` writes of them; the folder is the current one."""
    write_ship(folder)
    assert call("init", "zigzag.csv", "--model", "ship.py:Nomoto") == 0
    return folder / "zigzag.toml"


def log() -> str:
    """A zigzag of the model above with K = 0.12, T = 8 and a little noise, as a logger writes it."""
    rng = np.random.default_rng(1)
    r, psi, step = 0.0, 0.0, 0.2
    lines = ["Time(s),rudder_deg,yaw rate [deg/s],Heading"]
    for k in range(400):
        delta = np.deg2rad(10.0 if (k // 80) % 2 == 0 else -10.0)
        noise = rng.normal(size=2)
        lines.append(
            f"{k * step:.1f},{np.rad2deg(delta):.2f},{np.rad2deg(r + 2e-4 * noise[0]):.5f},"
            f"{np.rad2deg(psi + 1e-3 * noise[1]):.4f}"
        )
        exact = np.exp(-step / 8.0)
        psi += 0.12 * delta * step + (r - 0.12 * delta) * 8.0 * (1 - exact)
        r = 0.12 * delta + (r - 0.12 * delta) * exact
    return "\n".join(lines) + "\n"


def call(*arguments: str | Path) -> int:
    return cli.run([str(argument) for argument in arguments])


def answered(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text())
    assert set(content) == {"seatruth", "command", "ok", "exit_code", "result", "error"}
    assert content["ok"] == (content["exit_code"] == 0)
    if content["error"] is not None:
        assert set(content["error"]) == {"kind", "message", "what", "where", "do", "code"}
    return content
