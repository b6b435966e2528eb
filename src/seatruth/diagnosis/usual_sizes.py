"""What a problem takes for granted: priors that nobody stated, usual sizes of motions, times that begin at zero."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Indices
from seatruth.diagnosis.discrepancy.black_box import inertias
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.motion_records import motion, unrecorded_range
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial


def with_prior(parameter: Parameter, relative_sd: float) -> Parameter:
    """A free coefficient needs a prior, or it takes up any effect."""
    if not parameter.vary or parameter.prior is not None:
        return parameter
    reach = parameter.max - parameter.min
    wide = reach / 4.0 if math.isfinite(reach) else 1.0
    sd = relative_sd * abs(parameter.value) if parameter.value != 0.0 else wide
    return parameter.replace(prior=Prior(parameter.value, sd))


def from_zero(trial: Trial) -> Trial:
    """The trial with times that begin at zero."""
    return dataclasses.replace(trial, t=trial.t - trial.t[0]) if trial.t[0] != 0.0 else trial


def grouped(texts: Sequence[str], equation: Indices) -> list[tuple[Indices, Indices]]:
    """Terms of one text that stand in the same equations: those (k,), and the places (texts, k) of their terms."""
    found: dict[tuple[int, ...], list[list[int]]] = {}
    for text in dict.fromkeys(texts):
        members = [k for k, other in enumerate(texts) if other == text]
        found.setdefault(tuple(int(equation[k]) for k in members), []).append(members)
    return [(np.array(equations), np.array(members)) for equations, members in found.items()]


def spread_of(model: Model, trials: Sequence[Trial], name: str) -> float:
    """How far a state moves, in its unit: as recorded, else as other records tell of it, else 1."""
    values = [np.asarray(t.outputs[name]) for t in trials if name in t.outputs]
    finite = np.concatenate(values) if values else np.zeros(0)
    finite = finite[np.isfinite(finite)]
    size = float(np.ptp(finite)) if finite.size else unrecorded_range(model, trials, name)
    return size if size > 0.0 else 1.0


def usual_rate(model: Model, trials: Sequence[Trial], state: str, blocks: int, scale: float) -> float:
    """Usual acceleration of an equation: root mean square of the rate of the motion's means over short blocks.

    `scale` is the usual size of its motion.
    """
    found = [series for trial in trials if (series := motion(model, trial, state, blocks)) is not None]
    rates = [np.gradient(values, t) for t, values in found]
    size = float(np.sqrt(np.mean(np.concatenate(rates) ** 2))) if rates else 0.0
    # A motion that hardly changes has a scale all the same: a hundredth of the motion over a trial.
    return max(size, 0.01 * scale / min(trial.duration for trial in trials))


def inertias_of(
    model: BlackBox, trials: Sequence[Trial], values: Mapping[str, float], scales: Mapping[str, float]
) -> dict[str, float]:
    """The inertia that each force port of a black box shows on the first trial. Raises BadInput where one is dead."""
    values = {**model.nominal(), **values}
    states = [channel.name for channel in model.states]
    x0 = simulator(model, trials[:1], values=values).initial_states[0]
    return inertias(model, trials[0], values, dict(zip(states, x0.tolist())) if states else None, scales)
