"""Runs of a model that start from the record again and again, with its inputs as recorded or changed.

No error in the values can carry them far away, so that they show which way a model turns and drives.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.effects.undeclared_actuators import resting_inputs
from seatruth.errors import SeatruthError
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.trials.trial import Trial, Trials

_SECONDS = (240.0, 60.0, 15.0)
"""s between two starts from the record: some time constants in yaw and pitch (T of Nomoto's equation) of small
vehicles, of launches and of ships: a second, ten, a minute. Where the longest agree, no others are asked; in shorter
ones a quick vehicle is not carried away. Chosen here [S]."""
_FEWEST_SAMPLES, _MOST_PIECES = 15, 200
_LOST = 1e100
"""In SI units; a run that goes so far has diverged, and what is left of it says nothing."""
_TRACKS = (("v_n", "v_e"), ("x", "y"))
"""Channels that give the way made ahead, with the heading: a heading that a model misses does not turn that round."""
_SPEEDS = (("u",), ("u_w",), *((*pair, "psi") for pair in _TRACKS), ("sog",))
"""What a drive is judged by: the first of these that the model shows and all trials hold."""
_SINCE_START = ("psi", "theta")
"""Angles, of which the change over a piece so far stands for the rate: noise hides it less than it hides a slope."""

Change = Mapping[str, tuple[str, float]]
"""For each input that is changed, the input whose record takes its place, and a factor on that: -1 turns it round."""


class Missed(NamedTuple):
    """Norm of the error of a channel, infinite where a run diverges, and of its record."""

    error: float
    size: float


@dataclass
class ShortRuns:
    """The model of a study in pieces of its trials.

    Args:
        study: the study.
        x: values of its free parameters (K,) or more; None takes the start values.
        threads: threads of a simulation; None for all processors.
    """

    study: EstimationProblem
    x: Array | None = None
    threads: int | None = None
    _made: dict[tuple[object, ...], list[tuple[Trial, Array]]] = field(default_factory=dict)

    @property
    def lengths(self) -> tuple[float, ...]:
        """s between two starts from the record: of a black box, whose runs may take long, only the longest."""
        return _SECONDS[:1] if isinstance(self.study.model, BlackBox) else _SECONDS

    def agreement(self, channel: str, change: Change, seconds: float) -> float:
        """Correlation about zero of a simulated with the recorded rate; 0 where nothing tells, or nothing is simulated.

        Other findings say why it cannot.
        """
        simulated, measured = self._pair((channel,), change, seconds)
        if _diverges(simulated):
            return 0.0
        size = float(np.sqrt((simulated @ simulated) * (measured @ measured)))
        return float(simulated @ measured) / size if size > 0 else 0.0

    def missed(self, channels: Sequence[str], change: Change, seconds: float) -> Missed:
        """By how much a rate, or a speed of `speed_of`, is missed."""
        simulated, measured = self._pair(channels, change, seconds)
        error = math.inf if _diverges(simulated) else float(np.linalg.norm(simulated - measured))
        return Missed(error, float(np.linalg.norm(measured)))

    def _pair(self, channels: Sequence[str], change: Change, seconds: float) -> tuple[Array, Array]:
        """A motion (n,) as simulated and as recorded; nothing where it cannot be simulated."""
        try:
            runs = self._runs(change, seconds)
        except SeatruthError:
            return np.zeros(0), np.zeros(0)
        shown = [one.name for one in self.study.model.outputs]
        columns = [shown.index(channel) for channel in channels]
        pairs = [
            _known(y[:, columns].T, np.array([piece.outputs[channel] for channel in channels]), channels)
            for piece, y in runs
        ]
        if not pairs:
            return np.zeros(0), np.zeros(0)
        simulated, measured = (np.concatenate(part) for part in zip(*pairs))
        return simulated, measured

    def _runs(self, change: Change, seconds: float) -> list[tuple[Trial, Array]]:
        key = (seconds, *sorted(change.items()))
        if key not in self._made:
            study, resting = self.study, resting_inputs(self.study.model) or {}
            pieces = [piece for trial in study.trials for piece in pieces_of(_changed(trial, change, resting), seconds)]
            if not pieces:
                return []
            options: Any = study.cost
            plain = options.replace(segments=None, multiple_shooting=False, initial="fixed", initial_sd={})
            short = study.replace(trials=Trials(pieces[:_MOST_PIECES]), cost=plain)
            cost: StudyCost = cost_of(short, threads=self.threads)
            at = np.clip(cost.start if self.x is None else self.x[: len(cost.start)], *cost.bounds)
            self._made[key] = list(zip(cost.trials, cost.predict(at)))
        return self._made[key]


def judged(model: Model, trials: Sequence[Trial], names: Sequence[str]) -> str | None:
    """The first of these channels that the model shows and all trials hold."""
    shown = {channel.name for channel in model.outputs}
    for name in names:
        if name in shown and all(name in t.outputs and np.isfinite(t.outputs[name]).any() for t in trials):
            return name
    return None


def speed_of(model: Model, trials: Sequence[Trial]) -> tuple[str, ...]:
    """The channels by which a drive is judged; none where nothing tells."""
    return next((names for names in _SPEEDS if all(judged(model, trials, [name]) for name in names)), ())


def pieces_of(trial: Trial, seconds: float) -> list[Trial]:
    """The trial in pieces of so many seconds, however long its gaps are."""
    turns = np.floor((trial.t - trial.t[0]) / seconds)
    edges = [0, *(np.flatnonzero(np.diff(turns)) + 1).tolist(), len(trial)]
    return [
        trial.section(first, stop, f"{trial.name} {number}")
        for number, (first, stop) in enumerate(itertools.pairwise(edges))
        if stop - first >= _FEWEST_SAMPLES
    ]


def _known(simulated: Array, measured: Array, channels: Sequence[str]) -> tuple[Array, Array]:
    """A motion (n,) as simulated and as recorded, from channels (C, n), where all of them are known."""
    good = np.isfinite(simulated).all(axis=0) & np.isfinite(measured).all(axis=0)
    if not good.any():
        return np.zeros(0), np.zeros(0)
    return _motion(simulated[:, good], channels), _motion(measured[:, good], channels)


def _motion(values: Array, channels: Sequence[str]) -> Array:
    """A rate or a speed (n,); of an angle, its change so far; of a velocity over the ground, its part ahead; of a
    position, the way made ahead so far."""
    if len(channels) == 1:
        first = values[0, 0] if channels[0] in _SINCE_START else 0.0
        return np.asarray(values[0] - first, dtype=np.float64)
    north, east, psi = values
    if channels[0] == "v_n":
        return np.asarray(north * np.cos(psi) + east * np.sin(psi), dtype=np.float64)
    steps = np.diff(north) * np.cos(psi[:-1]) + np.diff(east) * np.sin(psi[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def _diverges(simulated: Array) -> bool:
    """Whether a run (n,) goes beyond numbers whose squares can be added up."""
    return bool(np.abs(simulated).max(initial=0.0) > _LOST)


def _changed(trial: Trial, change: Change, resting: Mapping[str, float]) -> Trial:
    """The trial with inputs exchanged, turned round or made larger about the value at which they rest."""
    inputs = {
        name: trial.inputs[source] if factor == 1.0 else _moved(trial.inputs[source], resting.get(source, 0.0), factor)
        for name, (source, factor) in change.items()
        if source in trial.inputs
    }
    return replace(trial, inputs={**trial.inputs, **inputs})


def _moved(values: Array, rest: float, factor: float) -> Array:
    return rest + factor * (values - rest)
