"""A ship as FMU for the tests, built from experiments/fmu_ship once in each process; and a run of it."""

from __future__ import annotations

import functools
import sys
import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np

from seatruth import Trial

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "experiments"))

from fmu_ship.build import build  # noqa: E402

PORTS: dict[str, list[str]] = {"force": ["X", "Y", "N"], "current": ["north", "east"]}


@functools.cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="seatruth-test-fmu-")


@functools.cache
def ship_fmu(fmi: Literal[2, 3] = 2, prefix: str = "", edit: tuple[tuple[str, str], ...] = ()) -> Path:
    """The path of a ship's FMU."""
    number = abs(hash((fmi, prefix, edit)))
    return Path(build(Path(_folder().name) / f"ship_{fmi}_{number}.fmu", fmi, prefix=prefix, edit=dict(edit)))


def zigzag(name: str = "zigzag", samples: int = 60, **outputs: Any) -> Trial:
    """A trial of the ship's inputs, 1 s apart, that starts at 0.8 m/s."""
    t = np.arange(float(samples))
    delta = np.radians(15.0) * np.clip(3.0 * np.sin(t / 6.0), -1.0, 1.0)
    first = {"u": np.full(t.size, 0.8), "psi": np.full(t.size, 0.3), **outputs}
    return Trial(name, t, {"delta": delta, "n": np.full(t.size, 10.4)}, first)
