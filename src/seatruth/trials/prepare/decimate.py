"""Decimation of long records for a diagnosis, recorded as a preparation step.

A diagnosis looks at slow signatures: a log at 20 Hz says no more about them than the same log at 2 Hz, and takes ten
times as long. Inputs are averaged over each new interval, so that a step of the rudder keeps its time. Of the outputs,
every n-th sample is kept as it was recorded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from seatruth.trials.trial import Step, Trial

MAX_SAMPLES = 9000
"""Largest number of simulated samples, all trials together: it bounds the time of a diagnosis. Chosen here [S]."""
MAX_COMPARED = 14000
"""Largest number of compared samples, all channels together: it bounds the memory. Chosen here [S]."""
_MAX_STEP = 1.0
"""s: longest new sampling step; vehicles of a few metres turn within a few seconds. Chosen here [S]."""


def decimate(trials: Sequence[Trial], outputs: Sequence[str]) -> list[Trial]:
    """The trials with at most about MAX_SAMPLES samples and MAX_COMPARED compared samples of the named outputs.

    A longer sampling step comes first; if that is not enough, fewer samples of the outputs are compared (the others
    become NaN). Trials that are short enough are returned as they are.

    Example: `decimate([trial], ["u", "r"])` keeps every seventh sample of a trial of 60 000.
    """
    total = sum(len(trial) for trial in trials)
    step = max(float(np.median(np.diff(trial.t))) for trial in trials)
    stride = max(1, min(math.ceil(total / MAX_SAMPLES), int(_MAX_STEP / step) if step > 0 else 1))
    shorter = [_decimated(trial, stride) for trial in trials]
    rows = sum(int(np.isfinite(trial.outputs[n]).sum()) for trial in shorter for n in outputs if n in trial.outputs)
    skip = math.ceil(rows / MAX_COMPARED)
    return [_with_fewer_compared(trial, skip, outputs) for trial in shorter]


def _decimated(trial: Trial, stride: int) -> Trial:
    if stride == 1 or len(trial) < 20 * stride:
        return trial
    at = np.arange(0, len(trial), stride)
    half = stride // 2

    def averaged(values: np.ndarray) -> np.ndarray:
        padded = np.concatenate([np.full(half, values[0]), values, np.full(stride, values[-1])])
        sums = np.cumsum(np.concatenate([[0.0], padded]))
        return np.asarray((sums[at + stride] - sums[at]) / stride)

    return trial.with_step(
        Step("decimate", {"every": stride}, f"kept {len(at)} of {len(trial)} samples, inputs averaged between them"),
        t=trial.t[at],
        inputs={name: averaged(np.asarray(values)) for name, values in trial.inputs.items()},
        outputs={name: values[at] for name, values in trial.outputs.items()},
        lines=None if trial.lines is None else trial.lines[at],
    )


def _with_fewer_compared(trial: Trial, skip: int, outputs: Sequence[str]) -> Trial:
    """The trial with every `skip`-th sample of the outputs; the others are NaN."""
    if skip <= 1:
        return trial
    keep = np.zeros(len(trial), dtype=bool)
    keep[::skip] = True
    return trial.with_step(
        Step("compare", {"every": skip}, f"every {skip}th sample of the outputs is compared"),
        outputs={n: np.where(keep, v, np.nan) if n in outputs else v for n, v in trial.outputs.items()},
    )
