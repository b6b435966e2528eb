"""Trials cut into segments (the shooting intervals of multiple shooting), each with its own initial state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.motion_records import unrecorded_range
from seatruth.trials.trial import Trial

_MIN_SAMPLES = 3
"""Fewest samples of a segment: two intervals show a rate and its change (chosen here [S])."""
_TIME_TOLERANCE = 1e-9
"""Rounding of a sample's time that does not move an edge by one sample, s (chosen here [S])."""
_ROOM = 2.0
"""Ranges that other records tell of a state within which it is searched: they tell it roughly (chosen here [S])."""


@dataclass(frozen=True)
class Segment:
    """Samples `start` to `stop` (excluded) of trial number `parent`.

    The last sample of a segment is the first one of the next. `trial` holds these samples alone; `first` and `last`
    say whether it is the first and the last segment of its trial.
    """

    parent: int
    start: int
    stop: int
    trial: Trial
    first: bool
    last: bool

    @property
    def label(self) -> str:
        """The trial's name, and the time at which the segment begins unless it is the first."""
        return self.trial.name if self.first else f"{self.trial.name} at {self.trial.t[0]:g} s"


def cut(trials: Sequence[Trial], seconds: float | None) -> list[Segment]:
    """Cuts every trial into segments of about this length, s; None keeps whole trials.

    All segments of a trial get nearly the same length, the duration over the nearest whole number of segments.
    """
    segments = []
    for parent, trial in enumerate(trials):
        edges = _edges(trial, seconds)
        for k, (start, stop) in enumerate(pairwise(edges)):
            last = k == len(edges) - 2
            stop = len(trial) if last else stop + 1
            whole = start == 0 and stop == len(trial)
            section = trial if whole else trial.section(start, stop)
            segments.append(Segment(parent, start, stop, section, k == 0, last))
    return segments


def _edges(trial: Trial, seconds: float | None) -> list[int]:
    """First sample of every segment, then the number of samples."""
    edges = [0]
    if seconds is not None:
        if trial.duration > seconds * len(trial):
            raise BadInput(
                f"segments of {seconds:g} s are shorter than its samples are apart",
                where=f"trial {trial.name!r}",
                do="Set `segments` to the time of many samples.",
            )
        count = max(1, round(trial.duration / seconds))
        for k in range(1, count):
            sample = int(np.searchsorted(trial.t, trial.t[0] + k * seconds - _TIME_TOLERANCE))
            if sample - edges[-1] >= _MIN_SAMPLES - 1 and len(trial) - sample >= _MIN_SAMPLES:
                edges.append(sample)
    return [*edges, len(trial)]


def state_at(
    model: Model, trial: Trial, sample: int, parameters: Mapping[str, float], moved: Mapping[str, Array]
) -> Array:
    """State (S,) of a model at a sample of a trial, from the outputs at that sample.

    Gaps are interpolated linearly; `Model.complete` adds outputs that the trial did not record. Actuators behind servos
    are where they have `moved` by then, (n,) by state: see `seatruth.models.servo_black_box.acting`.
    """
    y = {}
    for channel in model.outputs:
        values = trial.outputs.get(channel.name)
        valid = np.flatnonzero(np.isfinite(values)) if values is not None else np.zeros(0, dtype=np.intp)
        if values is not None and valid.size:
            y[channel.name] = float(np.interp(trial.t[sample], trial.t[valid], values[valid]))
    i = {channel.name: float(trial.inputs[channel.name][sample]) for channel in model.inputs}
    state = np.array(model.first_state(y, i, parameters))
    for place, channel in enumerate(model.states):
        if channel.name in moved:
            state[place] = moved[channel.name][sample]
    return state


def spread_of(model: Model, trials: Sequence[Trial]) -> dict[str, float]:
    """How far each state moves over the trials, in its unit.

    The standard deviation of the output of its name; where that is not recorded, twice the range that other records
    tell of it; else 1.
    """
    spreads = {}
    for state in model.states:
        parts = [trial.outputs[state.name] for trial in trials if state.name in trial.outputs]
        values = np.concatenate(parts) if parts else np.zeros(0)
        values = values[np.isfinite(values)]
        spread = float(values.std()) if values.size else _ROOM * unrecorded_range(model, trials, state.name)
        spreads[state.name] = spread if spread > 0 else 1.0
    return spreads
