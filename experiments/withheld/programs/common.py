"""What the simple programs share: a study refitted, its residuals, and the signatures of effects."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth import Study, load_study
from seatruth.costs import TrajectoryCost
from seatruth.effects import Effect, available, with_effects
from seatruth.models import Model
from seatruth.trials import Trial

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
STEPS = 20
"""Of a refit, at most."""
FALL = 1e-3
"""Relative fall of a step's cost below which a refit ends: a last linear step follows in every program."""
STIFFEST = 1e8
"""Damping at which no way down is seen."""


def fitted(study: Study) -> dict[str, float]:
    """Free coefficients and first states of a study at the least squares under their priors (Levenberg-Marquardt).

    A handful of steps: the whole identification, made to the last digit and judged, takes many times as long.
    """
    cost = TrajectoryCost(study)
    low, high = cost.bounds
    x = np.clip(cost.start, low, high)
    residuals = cost.residuals(x)
    damping = 1e-3
    for _ in range(STEPS):
        jacobian = cost.jacobian(x)
        now = float(residuals @ residuals)
        gram, pull = jacobian.T @ jacobian, jacobian.T @ residuals
        scale = np.maximum(np.diag(gram), 1e-300)
        while damping < STIFFEST:
            further = np.clip(x - np.linalg.solve(gram + np.diag(damping * scale), pull), low, high)
            there = cost.residuals(further)
            if float(there @ there) < now:
                break
            damping *= 10
        else:
            break
        x, residuals, damping = further, there, damping / 10
        if now - float(residuals @ residuals) < FALL * now:
            break
    return dict(zip(cost.names, x.tolist(), strict=True))


def effects_on(model: Model) -> tuple[str, ...]:
    """Names of installed effects that can act on a model."""
    return tuple(sorted(name for name, effect in available().items() if not effect.missing(model)))


@dataclass(frozen=True)
class Refitted:
    """A study at its refitted coefficients: residuals over the data sheet's noise, signatures of everything."""

    study: Study
    residuals: Array
    """(M,) of data in standard deviations of the data sheet, then those of the priors."""
    nuisances: Array
    """(M, K): derivatives by coefficients and first states."""
    signatures: dict[str, Array]
    """Effect -> (M, k)."""
    data: int
    """Number of data among the residuals."""
    channels: list[tuple[str, Rows]]
    """(output, rows)."""
    runs: list[tuple[str, Rows]]
    """The same for each trial by itself, samples in their order."""
    cost: TrajectoryCost
    """Of the study with all effects free."""
    at: Array
    """Where all of this is: coefficients and first states refitted, effects absent."""
    columns: dict[str, list[int]]
    """Effect -> places of its parameters in `at`."""

    def white(self) -> Array:
        """(M,) deviations of the white noise, in the residuals' units, by their differences; 1 for the priors' rows.

        Where a study states no noise the residuals' own units mean little. From one sample to the next neither the
        motion nor a slow error moves far.
        """
        found = np.ones(len(self.residuals))
        for name, rows in self.channels:
            steps = [np.diff(self.residuals[own]) for of, own in self.runs if of == name]
            sd = float(np.median(np.abs(np.concatenate(steps)))) / (0.6745 * math.sqrt(2))
            found[rows] = max(sd, 1e-12)
        return found


def refitted(path: Path, *, fit: bool = True, effects: bool = True) -> Refitted:
    """Refits a study's coefficients (unless told not to) and differentiates by them and by every effect, if wanted."""
    study = load_study(path)
    values = fitted(study) if fit else {}
    trials = [trial.name for trial in study.trials]
    names = effects_on(study.model) if effects else ()
    acting: list[Effect] = [available()[name].of_trials(trials) for name in names]
    model = with_effects(study.model, acting) if acting else study.model
    own = {p.name: p for p in study.parameters}
    parameters = tuple(own[p.name] if p.name in own else p.replace(vary=True) for p in model.parameters)
    cost = TrajectoryCost(study.replace(model=model, parameters=parameters))
    x = np.array([values.get(name, start) for name, start in zip(cost.names, cost.start.tolist(), strict=True)])
    jacobian = cost.jacobian(x)
    free = list(cost.names)
    columns = {e.name: [free.index(e.named(q.name)) for q in e.parameters] for e in acting}
    taken = {k for of in columns.values() for k in of}
    rest = [k for k in range(len(free)) if k not in taken]
    groups = [group for group in cost.residual_blocks if group.kind == "data" and len(group.rows)]
    channels: dict[str, list[Any]] = {}
    for group in groups:
        channels.setdefault(group.channel, []).append(group.rows)
    return Refitted(
        study,
        cost.residuals(x),
        jacobian[:, rest],
        {name: jacobian[:, of] for name, of in columns.items()},
        sum(len(group.rows) for group in groups),
        [(name, np.concatenate(rows)) for name, rows in channels.items()],
        [(group.channel, np.asarray(group.rows)) for group in groups],
        cost,
        x,
        columns,
    )


def recorded(trial: Trial, name: str) -> Array:
    """What a trial recorded of a state (n,), or the velocity through the water, which these programs take for it."""
    return np.asarray(trial.outputs[name if name in trial.outputs else f"{name}_w"])


def soft(scores: dict[str, float]) -> list[tuple[list[str], float]]:
    """Candidates with probabilities from log scores; "" is no effect."""
    top = max(scores.values())
    weights = {name: math.exp(max(-700.0, value - top)) for name, value in scores.items()}
    total = sum(weights.values())
    ranked = sorted(weights.items(), key=lambda one: -one[1])
    return [([name] if name else [], weight / total) for name, weight in ranked]
