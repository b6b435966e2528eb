"""When the simulation steps: the samples of all trials one after another, and the steps between them."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.memory import require_memory
from seatruth.models.base import Model
from seatruth.trials.channel import Hold
from seatruth.trials.trial import Trial

Integers = NDArray[np.int64]
_GAP = 1.5
"""An interval longer than this many median sampling intervals is a gap and takes several steps. Chosen here [S]."""
_MOST_IN_A_GAP = 100_000
"""Steps through one interval between samples. A gap of so many is no part of a trial: nothing is known of it, and what
was before it no longer matters after it. Chosen here [S]."""
_BYTES = 112
"""Bytes that a step takes for its times, and again for each input: 14 numbers while the grid is made (the interval, the
step's number in it, and at three stages the share, the time, what they are made from, and the grid of all trials)."""
_ROUNDING = 1e-6
"""A step may be longer than allowed by this part, so that 0.1 s sampling written in decimals does not double its
steps for max_step = 0.1."""


@dataclass(frozen=True, eq=False)
class TimeGrid:
    """Samples (N) of T trials and the Runge-Kutta steps (M) between them.

    Steps begin and end at samples, where inputs change, so no step reaches over a change of input.

    `rows`: samples of each trial; `start` (T + 1,): the first of them, and N. `t` (N,) s and `inputs` (N, I) at the
    samples. `substeps` (N,): steps in the interval that begins at a sample, 0 at a trial's last; `length` (N,) s: of
    each of those steps. `stage_t` (3 M,) s and `stage_inputs` (3 M, I): at the start, middle and end of each step;
    `stage_start` (T,): a trial's first row in them. `trial` (N,) and `stage_trial` (3 M,): `e.trial` in each row.
    `step` (M,) s: the length of each step. `interval` (M,): the sample at which the interval of each step begins, and
    `share` (M, 3): how far through it the step's stages are. `base` is a grid that differs in the inputs `changed`, by
    their places, alone; what was computed for it from others holds for this one.
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
    trial: Array
    stage_trial: Array
    step: Array
    interval: Integers
    share: Array
    base: TimeGrid | None = None
    changed: frozenset[int] = frozenset()

    @property
    def steps(self) -> int:
        """M, of all trials together."""
        return self.stage_t.size // 3


def time_grid(model: Model, trials: Sequence[Trial], hold: Hold, max_step: float | None, finer: int = 1) -> TimeGrid:
    """The grid of some trials (at least one, of at least one sample each, with the model's inputs).

    `hold`: "foh" or "zoh" (zero-order hold), of inputs without a rule of their own (`Model.holds`). `max_step` s: the
    longest step, or None for one step an interval and more in a gap; never longer than the model's own `longest_step`.
    `finer` divides every step further. Raises BadInput for an input that is not finite, a time that does not increase,
    or too many steps.
    """
    if hold not in ("foh", "zoh"):
        raise BadInput(f"hold is {hold!r}", do=nearest(str(hold), ("foh", "zoh")))
    if max_step is not None and not (math.isfinite(max_step) and max_step > 0.0):
        raise BadInput(f"the longest step is {max_step} s", do="Give a positive number of seconds.")
    _require_memory(model, trials, max_step, finer)
    grids = [_of_trial(model, trial, hold, max_step, finer) for trial in trials]
    sizes = np.array([len(trial) for trial in trials], dtype=np.int64)
    start = np.concatenate([[0], np.cumsum(sizes)])
    stages = np.array([grid.stage_t.size for grid in grids], dtype=np.int64)
    numbers = np.array([model.number_of(trial.name) for trial in trials])
    return TimeGrid(
        rows=[slice(int(a), int(b)) for a, b in pairwise(start)],
        start=start,
        t=np.concatenate([grid.t for grid in grids]),
        inputs=np.concatenate([grid.inputs for grid in grids]),
        substeps=np.concatenate([grid.substeps for grid in grids]),
        length=np.concatenate([grid.length for grid in grids]),
        stage_start=np.concatenate([[0], np.cumsum(stages)[:-1]]),
        stage_t=np.concatenate([grid.stage_t for grid in grids]),
        stage_inputs=np.concatenate([grid.stage_inputs for grid in grids]),
        trial=np.repeat(numbers, sizes),
        stage_trial=np.repeat(numbers, stages),
        step=np.concatenate([np.repeat(grid.length, grid.substeps) for grid in grids]),
        interval=np.concatenate([first + grid.interval for first, grid in zip(start, grids)]),
        share=np.concatenate([grid.share for grid in grids]),
    )


def with_inputs(grid: TimeGrid, model: Model, trials: Sequence[Trial], names: Collection[str], hold: Hold) -> TimeGrid:
    """The grid of the same trials with other values of some inputs, none of them delayed; as made anew, only sooner.

    Raises BadInput for an input that is not finite.
    """
    inputs, stage_inputs, holds = grid.inputs.copy(), grid.stage_inputs.copy(), _holds(model, hold)
    places = [k for k, channel in enumerate(model.inputs) if channel.name in names]
    for k in places:
        inputs[:, k] = column = np.concatenate([_finite_input(trial, model.inputs[k].name) for trial in trials])
        stage_inputs[:, k] = _between(column, grid.interval, grid.share, holds[k]).reshape(-1)
    base, changed = (grid, frozenset(places)) if grid.base is None else (grid.base, grid.changed | {*places})
    return replace(grid, inputs=inputs, stage_inputs=stage_inputs, base=base, changed=changed)


def _holds(model: Model, hold: Hold) -> list[Hold]:
    """How each input goes between its samples."""
    usual: dict[str, Hold] = {**dict.fromkeys(model.linear, "foh"), **model.holds}
    return [usual.get(channel.name, hold) for channel in model.inputs]


def _between(values: Array, interval: Integers, share: Array, hold: Hold) -> Array:
    """Values (n,) or (n, I) at shares (M, 3) of the way from samples (M,) to the next ones: (M, 3) or (M, 3, I)."""
    before, after = values[interval], values[interval + 1]
    if hold == "zoh":
        return np.repeat(before[:, None], share.shape[1], axis=1)
    found = before[:, None] + share.reshape(*share.shape, *(1,) * (values.ndim - 1)) * (after - before)[:, None]
    found[share == 1.0] = after[share[:, 2] == 1.0]
    return np.asarray(found)


def _finite_input(trial: Trial, name: str) -> Array:
    """The samples of an input; BadInput where one is not finite."""
    column = trial.inputs[name]
    if not np.isfinite(column).all():
        bad = int(np.flatnonzero(~np.isfinite(column))[0])
        place = f"trial {trial.name!r}, channel {name!r}, t = {trial.t[bad]:g} s"
        raise BadInput("the input is not finite", where=place, do="Add the step fill_gaps, or cut the trial there.")
    return column


@dataclass(frozen=True, eq=False)
class _TrialGrid:
    t: Array
    inputs: Array
    substeps: Integers
    length: Array
    stage_t: Array
    stage_inputs: Array
    interval: Integers
    share: Array


def _of_trial(model: Model, trial: Trial, hold: Hold, max_step: float | None, finer: int) -> _TrialGrid:
    where = f"trial {trial.name!r}"
    columns = [_finite_input(trial, channel.name) for channel in model.inputs]
    inputs = np.stack(columns, axis=1) if columns else np.zeros((len(trial), 0))
    t = np.asarray(trial.t)
    late = [(k, model.delays[channel.name]) for k, channel in enumerate(model.inputs) if channel.name in model.delays]
    intervals = np.diff(t)
    if intervals.size and not (np.isfinite(intervals).all() and (intervals > 0).all()):
        raise BadInput("its time does not increase", where=where, do="See `seatruth check`.")
    counts = _counts(intervals, max_step, model.longest_step).astype(np.int64) * finer
    length = np.append(intervals / np.maximum(counts, 1), 1.0)
    interval = np.repeat(np.arange(intervals.size), counts)
    number = np.arange(interval.size) - np.repeat(np.cumsum(counts) - counts, counts)
    nodes = np.array([0.0, 0.5, 1.0])
    share = (number[:, None] + nodes) / counts[interval][:, None] if interval.size else np.zeros((0, 3))
    stage_t = t[interval][:, None] + share * intervals[interval][:, None]
    stage_inputs, holds = _between(inputs, interval, share, "foh"), _holds(model, hold)
    held = [k for k, one in enumerate(holds) if one == "zoh"]
    stage_inputs[:, :, held] = inputs[interval][:, None, held]
    for k, delay in late:
        column = inputs[:, k].copy()
        inputs[:, k] = _delayed(t, column, t - delay, holds[k])
        middles = stage_t[:, 1:2].repeat(3, axis=1) if holds[k] == "zoh" else stage_t
        stage_inputs[:, :, k] = _delayed(t, column, middles - delay, holds[k])
    return _TrialGrid(
        t=t,
        inputs=inputs,
        substeps=np.append(counts, 0).astype(np.int64),
        length=length,
        stage_t=stage_t.reshape(-1),
        stage_inputs=stage_inputs.reshape(stage_t.size, inputs.shape[1]),
        interval=interval,
        share=share,
    )


def _delayed(t: Array, values: Array, at: Array, hold: Hold) -> Array:
    """An input between its samples, at any times; the first sample before them."""
    if hold == "foh":
        return np.interp(at, t, values)
    return np.asarray(values[np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 1)])


def _require_memory(model: Model, trials: Sequence[Trial], max_step: float | None, finer: int) -> None:
    """Refuses steps that are too many, before they are made."""
    total = 0.0
    for trial in trials:
        intervals = np.diff(trial.t)
        counts = _counts(intervals, max_step, model.longest_step) * finer
        total += float(counts.sum())
        longest = int(counts.argmax()) if counts.size else 0
        if counts.size and counts[longest] > _MOST_IN_A_GAP:
            raise BadInput(
                f"the {intervals[longest]:g} s after t = {trial.t[longest]:g} s need {counts[longest]:.3g} steps",
                where=f"trial {trial.name!r}",
                do="Cut the trial there, or give each part a file of its own"
                + (", or allow longer steps (`max_step`)." if max_step is not None else "."),
            )
    require_memory(
        _BYTES * (1.0 + len(model.inputs)) * total,
        f"the {total:.3g} steps of the simulation",
        do="Cut or thin the trials (steps `cut`, `decimate`), or allow longer steps.",
    )


def _counts(intervals: Array, max_step: float | None, allowed: float) -> Array:
    """Steps in each interval of lengths `intervals` (n - 1,) s, as numbers; none is longer than `allowed` s."""
    if not intervals.size:
        return np.zeros(0)
    longest = min(allowed, max_step if max_step is not None else _GAP * float(np.median(intervals)))
    with np.errstate(all="ignore"):  # times that overflow are refused later
        return np.maximum(1.0, np.ceil(intervals / longest - _ROUNDING))
