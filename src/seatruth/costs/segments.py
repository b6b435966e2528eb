"""Trials cut into pieces, each simulated from its own initial state."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

_SHORTEST = 3
"""Samples that a piece has at least, its first one included."""


@dataclass(frozen=True)
class Piece:
    """Samples `start` to `stop` (excluded) of trial number `parent`; its last sample is the next piece's first one."""

    parent: int
    start: int
    stop: int
    trial: Trial
    first: bool
    last: bool

    @property
    def label(self) -> str:
        """The trial's name, and where the piece begins unless it is the first."""
        return self.trial.name if self.first else f"{self.trial.name} at {self.trial.t[0]:g} s"


def cut(trials: Sequence[Trial], seconds: float | None) -> list[Piece]:
    """Every trial in pieces of that many seconds (whole trials where None); a rest of under half a piece joins."""
    found = []
    for parent, trial in enumerate(trials):
        edges = _edges(trial, seconds)
        for k, (start, stop) in enumerate(pairwise(edges)):
            last = k == len(edges) - 2
            stop = len(trial) if last else stop + 1
            whole = start == 0 and stop == len(trial)
            section = trial if whole else trial.section(start, stop)
            found.append(Piece(parent, start, stop, section, k == 0, last))
    return found


def _edges(trial: Trial, seconds: float | None) -> list[int]:
    edges = [0]
    if seconds is not None:
        count = max(1, round(trial.duration / seconds))
        for k in range(1, count):
            at = int(np.searchsorted(trial.t, trial.t[0] + k * seconds - 1e-9))
            if at - edges[-1] >= _SHORTEST - 1 and len(trial) - at >= _SHORTEST:
                edges.append(at)
    return [*edges, len(trial)]


def state_at(model: Model, trial: Trial, sample: int, parameters: Mapping[str, float]) -> Array:
    """A model's state (S,) at a sample of a trial, from the outputs there; gaps are bridged by straight lines.

    Outputs that the trial did not record count as zero.
    """
    y = {}
    for channel in model.outputs:
        values = trial.outputs.get(channel.name)
        valid = np.flatnonzero(np.isfinite(values)) if values is not None else np.zeros(0, dtype=np.intp)
        if values is None or not valid.size:
            y[channel.name] = 0.0
        else:
            y[channel.name] = float(np.interp(trial.t[sample], trial.t[valid], values[valid]))
    i = {channel.name: float(trial.inputs[channel.name][sample]) for channel in model.inputs}
    return np.array(model.first_state(y, i, parameters))


def spread_of(model: Model, trials: Sequence[Trial]) -> dict[str, float]:
    """How far each state moves in the trials, by the output of its name; 1 where that is not recorded."""
    found = {}
    for state in model.states:
        parts = [trial.outputs[state.name] for trial in trials if state.name in trial.outputs]
        values = np.concatenate(parts) if parts else np.zeros(0)
        values = values[np.isfinite(values)]
        spread = float(values.std()) if values.size else math.nan
        found[state.name] = spread if spread > 0 else 1.0
    return found
