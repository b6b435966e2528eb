"""Decimation of long records for a diagnosis, recorded as a preparation step.

A diagnosis looks at slow signatures: a log at 20 Hz says no more about them than the same log at 2 Hz, and takes ten
times as long. Inputs are averaged over each new interval, so that a step of the rudder keeps its time. Of the outputs,
every n-th sample is kept as it was recorded; of a sensor that is slower than the log, those that it has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Indices
from seatruth.text import listed
from seatruth.trials.trial import Step, Trial

MAX_SAMPLES = 9000
"""Largest number of simulated samples, all trials together: it bounds the time of a diagnosis. Chosen here [S]."""
MAX_COMPARED = 14000
"""Largest number of compared samples, all channels together: it bounds the memory. Chosen here [S]."""
_MAX_STEP = 1.0
"""s: longest new sampling step; vehicles of a few metres turn within a few seconds. Chosen here [S]."""

_AS_MANY = 0.9
"""Part of the samples of a channel from which on another counts as one of its rate. [S] Each has gaps of its own."""


def decimate(trials: Sequence[Trial], outputs: Sequence[str]) -> list[Trial]:
    """The trials with at most about MAX_SAMPLES samples and MAX_COMPARED compared samples of the named outputs.

    A longer sampling step comes first; if that is not enough, fewer samples of the outputs are compared (the others
    become NaN), of those that have the most. Slow sensors keep theirs, which take up to as many samples again. Trials
    that are short enough are returned as they are.

    Example: `decimate([trial], ["u", "r"])` keeps every seventh sample of a trial of 60 000.
    """
    total = sum(len(trial) for trial in trials)
    step = max(float(np.median(np.diff(trial.t))) for trial in trials)
    stride = max(1, min(math.ceil(total / MAX_SAMPLES), int(_MAX_STEP / step) if step > 0 else 1))
    shorter = [_decimated(trial, stride, outputs) for trial in trials]
    skips = _skips({n: sum(_count(trial, n) for trial in shorter) for n in outputs}, MAX_COMPARED)
    return [_with_fewer_compared(trial, skips) for trial in shorter]


def _count(trial: Trial, output: str) -> int:
    return int(np.isfinite(trial.outputs[output]).sum()) if output in trial.outputs else 0


def _skips(counts: Mapping[str, int], whole: int) -> dict[str, int]:
    """Of each output every n-th sample is compared, where all together may be `whole`; those with 1 are left out.

    Outputs with most samples, and those with nearly as many, are thinned first.
    """
    skips = {name: 1 for name, count in counts.items() if count}
    while True:
        kept = {name: counts[name] / skip for name, skip in skips.items()}
        if sum(kept.values()) <= whole:
            return {name: skip for name, skip in skips.items() if skip > 1}
        first = max(kept, key=lambda name: kept[name])
        for name in skips:
            alike = _AS_MANY * counts[first] <= counts[name] <= counts[first] / _AS_MANY
            skips[name] += alike and kept[name] >= _AS_MANY * kept[first]  # what was thinned before this one waits


def _decimated(trial: Trial, stride: int, outputs: Sequence[str]) -> Trial:
    if stride == 1 or len(trial) < 20 * stride:
        return trial
    at = _kept(trial, stride, outputs)
    steps = np.diff(at, prepend=at[0] - stride)
    begin = at - steps // 2
    end = np.append(begin[1:], at[-1] + stride - stride // 2)

    def averaged(values: np.ndarray) -> np.ndarray:
        padded = np.concatenate([np.full(stride, values[0]), values, np.full(stride, values[-1])])
        sums = np.cumsum(np.concatenate([[0.0], padded]))
        return np.asarray((sums[end + stride] - sums[begin + stride]) / (end - begin))

    return trial.with_step(
        Step("decimate", {"every": stride}, f"kept {len(at)} of {len(trial)} samples, inputs averaged between them"),
        t=trial.t[at],
        inputs={name: averaged(np.asarray(values)) for name, values in trial.inputs.items()},
        outputs={name: values[at] for name, values in trial.outputs.items()},
        lines=None if trial.lines is None else trial.lines[at],
    )


def _kept(trial: Trial, stride: int, outputs: Sequence[str]) -> Indices:
    """Every `stride`-th row, and of channels that have their samples between these as many rows again.

    It begins where it meets most samples: a receiver of half the log's rate may have its own in the odd rows.
    """
    shown = [np.isfinite(trial.outputs[name]) for name in outputs if name in trial.outputs]
    first = max(range(stride), key=lambda k: sum(int(one[k::stride].sum()) for one in shown))
    at = np.arange(first, len(trial), stride)
    rows = [at]
    for name in (n for n in outputs if n in trial.outputs):
        valid = np.flatnonzero(np.isfinite(trial.outputs[name]))
        own = valid[:: math.ceil(len(valid) / len(at)) or 1]
        if np.isfinite(trial.outputs[name][at]).sum() < len(own) / 2:
            rows.append(own)
    return np.unique(np.concatenate(rows))


def _with_fewer_compared(trial: Trial, skips: Mapping[str, int]) -> Trial:
    """The trial with every n-th valid sample of some outputs; the others are NaN."""
    skips = {name: skip for name, skip in skips.items() if _count(trial, name)}
    if not skips:
        return trial
    outputs = dict(trial.outputs)
    for name, skip in skips.items():
        kept = np.flatnonzero(np.isfinite(outputs[name]))[::skip]
        values = np.full(len(trial), np.nan)
        values[kept] = outputs[name][kept]
        outputs[name] = values
    said = listed([f"every {skip}{_ending(skip)} sample of {name}" for name, skip in skips.items()])
    return trial.with_step(Step("compare", {"every": skips}, f"{said} is compared"), outputs=outputs)


def _ending(number: int) -> str:
    return {2: "nd", 3: "rd"}.get(number if number < 20 else number % 10, "th")
