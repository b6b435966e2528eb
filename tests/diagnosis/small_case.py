"""A small vehicle with few states, its trials with a known effect, and files of them as a user would have them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.pipeline import diagnose
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import first_sizes, noise_prior
from seatruth.effects import load_effects, with_effects
from seatruth.models import load_model
from seatruth.models.parameter import Prior
from seatruth.simulate import simulator
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

SHIP = '''
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.trials import Channel


class Nomoto(Model):
    """First-order yaw at a steady speed, with its track."""

    name = "nomoto"
    title = "Nomoto first-order yaw"
    kind = "ship"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    parameters = (
        Parameter("K", 0.1, "1/s", min=0.01, max=1.0, vary=True, description="rudder gain"),
        Parameter("T", 10.0, "s", min=1.0, max=100.0, vary=True, description="time constant"),
    )

    @staticmethod
    def rhs(s, i, p):
        return (p.K * i.delta - s.r) / p.T, s.r
'''
FADE = '''
"""A rudder that loses force with its angle."""

from seatruth.effects import Effect
from seatruth.models import Parameter


class Fade(Effect):
    name = "fade"
    title = "rudder that fades with its angle"
    cause = "actuator.steering.gain"
    equation = "delta (1 - k |delta| / 0.35)"
    source = "measured on the slipway"
    needs_inputs = ("delta",)
    acts_on = ("actuator:delta",)
    parameters = (Parameter("k", 0.2, "1", min=-1.0, max=1.0),)
    null = {"k": 0.0}

    @staticmethod
    def true_inputs(i, s, q, e):
        return i._replace(delta=i.delta * (1.0 - q.k * abs(i.delta) / 0.35))
'''
EFFECTS = ("rudder_offset", "rudder_gain", "heading_bias", "gyro_bias")
NOISE = {"r": math.radians(0.05), "psi": math.radians(0.2)}
TRUE = {"K": 0.105, "T": 9.5}
OFFSET = 0.02
"""rad, of the rudder where it stands off."""
DEG = math.radians(1.0)


def folder_with_model(folder: Path) -> Path:
    (folder / "ship.py").write_text(SHIP)
    return folder


def rudders(seconds: float = 120.0, step: float = 1.0) -> tuple[np.ndarray, list[np.ndarray]]:
    """Times (n,) and rudder angles (n,) of four trials: zigzags, a turn, small steps."""
    t = np.arange(0.0, seconds, step)

    def steps(levels: Sequence[float], every: float) -> np.ndarray:
        return np.asarray(levels)[(t // every).astype(int) % len(levels)] * DEG

    return t, [steps((10, -10), 15.0), steps((20, -20), 20.0), 15 * DEG * (t > 10.0), steps((2, 0, -3, 0), 12.0)]


def trials(
    folder: Path, effects: Mapping[str, float] | None = None, *, specs: Sequence[str] = (), seed: int = 1
) -> list[Trial]:
    """Noisy trials of the ship; `effects` gives parameters of effects as the extended model names them."""
    plain = load_model("ship.py:Nomoto", folder)
    model = with_effects(plain, load_effects(specs, folder)) if specs else plain
    t, angles = rudders()
    bare = [Trial(f"run_{k}", t, {"delta": delta}, {}, synthetic=True) for k, delta in enumerate(angles)]
    sim = simulator(model, bare, free=(), values={**model.nominal(), **TRUE, **(effects or {})})
    first = np.zeros((1, len(bare), len(model.states)))
    answer = sim.outputs(np.zeros((1, 0)), first[0])
    rng = np.random.default_rng(seed)
    found = []
    for trial, rows in zip(bare, sim.rows):
        y = answer.y[0][rows]
        noisy = {c.name: y[:, k] + NOISE[c.name] * rng.normal(size=t.size) for k, c in enumerate(model.outputs)}
        conditions: dict[str, Any] = {"manoeuvre": "turn" if trial.name == "run_2" else "zigzag"}
        found.append(Trial(trial.name, t, dict(trial.inputs), noisy, synthetic=True, conditions=conditions))
    return found


def study(folder: Path, runs: Sequence[Trial], name: str = "small") -> Study:
    """The study of some trials with the plain model; its two coefficients have priors of 10 %."""
    model = load_model("ship.py:Nomoto", folder)
    parameters = tuple(p.replace(prior=Prior(p.value, 0.1 * p.value)) for p in model.parameters)
    return Study(name=name, model=model, trials=Trials(list(runs)), parameters=parameters)


def problem(
    folder: Path, runs: Sequence[Trial], effects: Sequence[str] = EFFECTS, settings: Settings | None = None
) -> Problem:
    """The problem of diagnosing some trials."""
    return Problem(study(folder, runs), load_effects(effects, folder), settings or Settings(), threads=1)


def diagnosed(folder: Path, runs: Sequence[Trial], *, suggest: bool = False, **options: Any) -> Diagnosis:
    """The diagnosis, without the next trial unless it is asked for: that takes most of the time."""
    return diagnose(study(folder, runs), EFFECTS, threads=1, suggest=suggest, **options)


def fitted(problem: Problem, effects: Sequence[str], *, discrepancy: bool = False) -> Fit:
    """The fit of these effects from where a problem starts."""
    known = noise_prior(problem)
    return fit(problem, effects, problem.start, first_sizes(problem, known), known, discrepancy=discrepancy)


def codes(found: Diagnosis) -> set[str]:
    """Codes of the findings."""
    return {finding.code for finding in found.findings}


def shortened(runs: Sequence[Trial], samples: int) -> list[Trial]:
    """The first samples of each trial."""
    return [
        dataclasses.replace(
            trial,
            t=trial.t[:samples],
            inputs={name: values[:samples] for name, values in trial.inputs.items()},
            outputs={name: values[:samples] for name, values in trial.outputs.items()},
        )
        for trial in runs
    ]


def silent(text: str, done: int, total: int) -> None:
    """No progress."""


def files(folder: Path, runs: Sequence[Trial]) -> Path:
    """The same as files of a user: logs and a study file."""
    for trial in runs:
        table = {"t": trial.t, **trial.inputs, **trial.outputs}
        lines = [",".join(table), *(",".join(f"{x:.7f}" for x in row) for row in zip(*table.values()))]
        (folder / f"{trial.name}.csv").write_text("\n".join(lines) + "\n")
    text = [
        '[study]\nname = "small"\nseed = 3\nsynthetic = true\n',
        '[model]\nuse = "ship.py:Nomoto"\n',
        "[parameters]\nK = { prior = { mean = 0.1, sd = 0.01 } }\nT = { prior = { mean = 10.0, sd = 1.0 } }\n",
        '[time]\ncolumn = "t"\nunit = "s"\n',
        '[channels]\ndelta = { unit = "rad" }\nr = { unit = "rad/s" }\npsi = { unit = "rad" }\n',
        *(
            f'[[trials]]\nfile = "{trial.name}.csv"\nconditions = {{ manoeuvre = "{trial.conditions["manoeuvre"]}" }}\n'
            for trial in runs
        ),
        '[cost]\ninitial = "free"\n',
    ]
    path = folder / "study.toml"
    path.write_text("\n".join(text))
    return path
