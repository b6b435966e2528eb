"""The benchmark of Chen, Yan and Wang 2011: its trial, its studies, its bounds.

Tags: [P] printed in the paper, [R] reconstructed, [L] other literature, [S] chosen here, [V] by independent code.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth import Model, Study
from seatruth.manoeuvres import Manoeuvre, add_noise, run_manoeuvre
from seatruth.models.longitudinal_plane import READINGS, LongitudinalPlane
from seatruth.trials import Trial, Trials
from seatruth.uncertainty import prior_identifiability

Array = NDArray[np.float64]
PLANT = LongitudinalPlane()
TRUTH: dict[str, float] = PLANT.nominal()
FREE = READINGS["R2"]
OUTPUTS = tuple(channel.name for channel in PLANT.outputs)
FIRST = {"u": 4.0, "z": 60.0}
"""[S] m/s, m."""
STEP = 0.05
"""[S] s: 20 Hz."""
SECONDS = 60.0
"""[S]"""
ANGLE, RATE = math.radians(20.0), math.radians(60.0)
"""[S] Limits of the elevator, rad and rad/s."""
LOW, HIGH = 0.2, 3.0
"""[S] Bounds of the search in multiples of the truth."""


@dataclass(frozen=True)
class PitchSteps(Manoeuvre):
    """[S] Pitch up and down by `pitch` every 10 s in closed loop, with a switching elevator on top.

    The elevator follows -(2.0 (theta_d - theta) - 1.5 q) + 8 deg sign(sin(2 pi t / 3.1) + 0.7 sin(2 pi t / 1.7))
    within its limits. What it did is the record: an identification takes it as a known input.
    """

    pitch: float = math.radians(25.0)
    dither: float = math.radians(8.0)

    @property
    def label(self) -> str:
        return "pitch steps with a switching elevator"

    def helm(self) -> Any:
        def helm(t: float, y: Mapping[str, float]) -> Mapping[str, float]:
            wanted = self.pitch if t % 20.0 < 10.0 else -self.pitch
            sign = math.sin(2.0 * math.pi * t / 3.1) + 0.7 * math.sin(2.0 * math.pi * t / 1.7)
            order = -(2.0 * (wanted - y["theta"]) - 1.5 * y["q"])
            order += math.copysign(self.dither, sign) if sign else 0.0
            return {"delta_s": max(-ANGLE, min(ANGLE, order))}

        return helm


def benchmark(model: Model = PLANT, values: Mapping[str, float] | None = None, plan: Manoeuvre | None = None) -> Trial:
    """The benchmark trial [S], simulated, without noise; of another model, or with another plan."""
    plan = plan or PitchSteps()
    return run_manoeuvre(model, plan, values, dt=STEP, first_state=FIRST, rudder_rate=RATE, limit=SECONDS)


def noise_of(trial: Trial, level: float, outputs: tuple[str, ...] = OUTPUTS) -> dict[str, float]:
    """[P] Standard deviation of each output: this part of its peak, the largest absolute value."""
    return {name: level * float(np.abs(trial.outputs[name]).max()) for name in outputs}


def noisy(trial: Trial, sd: Mapping[str, float], rng: np.random.Generator) -> Trial:
    """White noise on all outputs but for the first sample: the first state is taken from the data [P], and known."""
    made = add_noise(trial, sd, rng)
    outputs = {name: np.concatenate([trial.outputs[name][:1], y[1:]]) for name, y in made.outputs.items()}
    return replace(made, outputs=outputs)


def study(trial: Trial, level: float, start: Mapping[str, float] | None = None, **changes: Any) -> Study:
    """A study of the 11 parameters of reading R2 within `LOW` to `HIGH` times the truth.

    `start` gives values in place of the truth; with `bounded=False` there are no bounds. Outputs are weighted as with
    noise of this level (of the trial's own peaks, or as `noise` says).
    """
    model: Model = changes.pop("model", PLANT)
    names: tuple[str, ...] = changes.pop("free", FREE)
    bounded: bool = changes.pop("bounded", True)
    values = {**model.nominal(), **changes.pop("values", {})}
    given = []
    for q in model.parameters:
        value = values[q.name]
        if q.name in names:
            low, high = sorted((LOW * value, HIGH * value)) if bounded else (-math.inf, math.inf)
            q = q.replace(value=(start or {}).get(q.name, value), min=low, max=high, vary=True)
        else:
            q = q.replace(value=value)
        given.append(q)
    fields: dict[str, Any] = {"noise": noise_of(trial, level), "parameters": tuple(given), **changes}
    return Study("chen2011", model, Trials([trial]), **fields)


def random_start(rng: np.random.Generator) -> dict[str, float]:
    """A start anywhere within the bounds."""
    return {name: TRUTH[name] * float(rng.uniform(LOW, HIGH)) for name in FREE}


def bounds(trial: Trial, level: float, **changes: Any) -> dict[str, float]:
    """Cramer-Rao bounds in per cent of each parameter."""
    frame = prior_identifiability(study(trial, level, **changes), threads=1)
    return {str(q): 100.0 * float(row["crlb"] / abs(row["value"])) for q, row in frame.iterrows()}


def percent(found: Mapping[str, float]) -> dict[str, float]:
    """Relative errors in per cent."""
    return {name: 100.0 * (value / TRUTH[name] - 1.0) for name, value in found.items()}
