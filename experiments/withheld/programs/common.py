"""What the simple programs share: a study refitted, its residuals, and the signatures of effects."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth import Study, identify, load_study
from seatruth.costs import TrajectoryCost
from seatruth.effects import Effect, available, with_effects
from seatruth.models import load_model

Array = NDArray[np.float64]


@cache
def effects_on(model_name: str) -> tuple[str, ...]:
    """Names of installed effects that can act on a built-in model."""
    model = load_model(model_name)
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
    channels: list[tuple[str, NDArray[np.intp]]]
    """(output, rows)."""


def refitted(path: Path, *, fit: bool = True) -> Refitted:
    """Refits a study's coefficients (unless told not to) and differentiates by them and by every effect."""
    study = load_study(path)
    values = dict(identify(study, seed=0).values) if fit else {}
    effects: list[Effect] = [available()[name] for name in effects_on(study.model.name)]
    model = with_effects(study.model, effects)
    own = {p.name: p for p in study.parameters}
    parameters = tuple(
        own[p.name].but(value=values.get(p.name, own[p.name].value)) if p.name in own else p.but(vary=True)
        for p in model.parameters
    )
    cost = TrajectoryCost(study.but(model=model, parameters=parameters))
    x = cost.start
    jacobian = cost.jacobian(x)
    names = list(cost.names)
    columns = {e.name: [names.index(e.named(q.name)) for q in e.parameters] for e in effects}
    taken = {k for of in columns.values() for k in of}
    rest = [k for k in range(len(names)) if k not in taken]
    groups = [group for group in cost.groups if group.kind == "data" and len(group.rows)]
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
    )


def soft(scores: dict[str, float]) -> list[tuple[list[str], float]]:
    """Candidates with probabilities from log scores; "" is no effect."""
    top = max(scores.values())
    weights = {name: math.exp(max(-700.0, value - top)) for name, value in scores.items()}
    total = sum(weights.values())
    ranked = sorted(weights.items(), key=lambda one: -one[1])
    return [([name] if name else [], weight / total) for name, weight in ranked]
