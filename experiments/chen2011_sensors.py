"""The search of `chen2011_design` with the sensors' noise kept as it is on the benchmark, whatever the motion.

Noise in per cent of each output's peak [P] makes quiet motion quiet to measure: a trial that hardly turns is given a
gyro twenty times as good. With the same sensors as on the benchmark a trial gains by its motion alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import chen2011_system as system
import numpy as np
from chen2011_design import DEEPEST, LEVEL, PITCH, SETTINGS, SHALLOWEST, DesignCost, steered, trial
from chen2011_system import Array

from seatruth import Budget
from seatruth.optimizers import Chain, make, minimise
from seatruth.trials import Trial


class SameSensors(DesignCost):
    """Largest relative bound (per cent) under the noise `sd`, and a steep penalty for motion outside the limits."""

    def __init__(self, seconds: float, sd: Mapping[str, float]) -> None:
        super().__init__(seconds, 1)
        self.sd = dict(sd)

    def values(self, X: Array) -> Array:
        return np.array([self._value(trial(elevator)) for elevator in steered(np.asarray(X), self.seconds)])

    def _value(self, run: Trial) -> float:
        if not all(np.isfinite(y).all() for y in run.outputs.values()):
            return math.inf
        theta, depth = run.outputs["theta"], run.outputs["z"]
        beyond = max(0.0, float(np.abs(theta).max()) - PITCH) / math.radians(1.0)
        beyond += max(0.0, SHALLOWEST - float(depth.min()), float(depth.max()) - DEEPEST)
        return max(system.bounds(run, LEVEL, noise=self.sd).values()) + 10.0 * beyond


def search(seconds: float, evaluations: int, seed: int) -> dict[str, Any]:
    """The settings found, and the bounds in per cent under the benchmark's noise."""
    sd = system.noise_of(system.benchmark(), LEVEL)
    chain = Chain((make("differential_swarm", particles=40, omega=1.0), make("cma_es", sigma=0.05)))
    out = minimise(SameSensors(seconds, sd), chain, seed=seed, budget=Budget(evaluations))
    run = trial(steered(out.x[None], seconds)[0])
    settings = dict(zip((q.name for q in SETTINGS), out.x.tolist()))
    return {"seconds": seconds, "settings": settings, "bound": system.bounds(run, LEVEL, noise=sd)}
