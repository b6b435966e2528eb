"""When the simulation steps: the samples of all trials one after another, and the steps between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

Integers = NDArray[np.int64]
Hold = Literal["foh", "zoh"]
_LONG = 1.5
"""A sampling interval longer than this many usual ones (a gap) is taken in several steps."""
_MOST_STEPS = 200_000_000


@dataclass(frozen=True, eq=False)
class Grid:
    """Samples (N) of T trials and the Runge-Kutta steps (M) between them.

    Steps begin and end at samples, where inputs change, so no step reaches over a change of input. `substeps` (N,) of
    the interval that begins at a sample (0 at a trial's last), `length` (N,) s of each; `stage_t` (3 M,) and
    `stage_inputs` (3 M, I) at the start, middle and end of each step; `inputs` (N, I), `t` (N,) at the samples.
    """

    rows: list[slice]
    start: Integers
    t: Array
    inputs: Array
    substeps: Integers
    length: Array
    stage_start: Integers
    stage_t: Array
    stage_inputs: Array

    @property
    def steps(self) -> int:
        return self.stage_t.size // 3


def grid(model: Model, trials: Sequence[Trial], hold: Hold, max_step: float | None, finer: int = 1) -> Grid:
    """The grid of some trials. `finer` divides every step, to see what the steps cost in accuracy."""
    if hold not in ("foh", "zoh"):
        raise BadInput(f"hold is {hold!r}", do=nearest(str(hold), ("foh", "zoh")))
    if max_step is not None and not (math.isfinite(max_step) and max_step > 0.0):
        raise BadInput(f"the longest step is {max_step} s", do="Give a positive number of seconds.")
    if not trials:
        raise BadInput("there is no trial to simulate", do="Add one.")
    parts = [_of_trial(model, trial, hold, max_step, finer) for trial in trials]
    sizes = np.array([len(trial) for trial in trials], dtype=np.int64)
    start = np.concatenate([[0], np.cumsum(sizes)])
    stages = np.array([part.stage_t.size for part in parts], dtype=np.int64)
    return Grid(
        rows=[slice(int(a), int(b)) for a, b in pairwise(start)],
        start=start,
        t=np.concatenate([part.t for part in parts]),
        inputs=np.concatenate([part.inputs for part in parts]),
        substeps=np.concatenate([part.substeps for part in parts]),
        length=np.concatenate([part.length for part in parts]),
        stage_start=np.concatenate([[0], np.cumsum(stages)[:-1]]),
        stage_t=np.concatenate([part.stage_t for part in parts]),
        stage_inputs=np.concatenate([part.stage_inputs for part in parts]),
    )


@dataclass(frozen=True, eq=False)
class _Part:
    t: Array
    inputs: Array
    substeps: Integers
    length: Array
    stage_t: Array
    stage_inputs: Array


def _of_trial(model: Model, trial: Trial, hold: Hold, max_step: float | None, finer: int) -> _Part:
    where = f"trial {trial.name!r}"
    if not len(trial):
        raise BadInput("it has no samples", where=where)
    columns = []
    for channel in model.inputs:
        if channel.name not in trial.inputs:
            known = [*trial.inputs, *trial.outputs]
            raise BadInput(f"it has no input {channel.name!r}", where=where, do=nearest(channel.name, known))
        column = trial.inputs[channel.name]
        if not np.isfinite(column).all():
            bad = int(np.flatnonzero(~np.isfinite(column))[0])
            place = f"{where}, channel {channel.name!r}, t = {trial.t[bad]:g} s"
            raise BadInput("the input is not finite", where=place, do="Add the step fill_gaps, or cut the trial there.")
        columns.append(column)
    inputs = np.stack(columns, axis=1) if columns else np.zeros((len(trial), 0))
    t = np.asarray(trial.t)
    gaps = np.diff(t)
    if gaps.size and not (np.isfinite(gaps).all() and (gaps > 0).all()):
        raise BadInput("its time does not increase", where=where, do="See `seatruth check`.")
    counts = _counts(gaps, max_step, model.longest_step) * finer
    if counts.sum() > _MOST_STEPS:
        raise BadInput(
            f"it needs {int(counts.sum())} steps of {max_step} s",
            where=where,
            do="Allow longer steps or cut the trial.",
        )
    length = np.append(gaps / np.maximum(counts, 1), 1.0)
    interval = np.repeat(np.arange(gaps.size), counts)
    number = np.arange(interval.size) - np.repeat(np.cumsum(counts) - counts, counts)
    parts = np.array([0.0, 0.5, 1.0])
    share = (number[:, None] + parts) / counts[interval][:, None] if interval.size else np.zeros((0, 3))
    stage_t = t[interval][:, None] + share * gaps[interval][:, None]
    before, after = inputs[:-1][interval], inputs[1:][interval]
    if hold == "zoh":
        stage_inputs = np.repeat(before[:, None, :], 3, axis=1)
    else:
        stage_inputs = before[:, None, :] + share[:, :, None] * (after - before)[:, None, :]
        stage_inputs[share == 1.0] = after[share[:, 2] == 1.0]
    return _Part(
        t=t,
        inputs=inputs,
        substeps=np.append(counts, 0).astype(np.int64),
        length=length,
        stage_t=stage_t.reshape(-1),
        stage_inputs=stage_inputs.reshape(stage_t.size, inputs.shape[1]),
    )


def _counts(gaps: Array, max_step: float | None, allowed: float) -> Integers:
    """Steps in each interval: as many as the longest step asks for, or one, and more in a gap."""
    if not gaps.size:
        return np.zeros(0, dtype=np.int64)
    longest = min(allowed, max_step if max_step is not None else _LONG * float(np.median(gaps)))
    # A hair of tolerance: 0.1 s sampling written in decimals must not double its steps for max_step = 0.1.
    return np.maximum(1, np.ceil(gaps / longest - 1e-6)).astype(np.int64)
