"""Records that are longer than a diagnosis needs, made shorter: on record as a step, and never below what moves.

A diagnosis looks at slow signatures. A log at 20 Hz says of them what the same log at 2 Hz says, and costs ten times as
much. Inputs are averaged over each new interval, so that a step of the rudder keeps its time; of outputs every n-th
sample is kept as it was recorded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from seatruth.trials.trial import Step, Trial

MOST_SAMPLES = 9000
"""Samples of all trials that are simulated."""
MOST_ROWS = 14000
"""Samples of all channels that are compared."""
_COARSEST = 1.0
"""s: a longer step is not made, however long the record."""


def thinned(trials: Sequence[Trial], outputs: Sequence[str]) -> list[Trial]:
    """The trials with fewer samples where there are very many: fewer steps first, then fewer that are compared."""
    total = sum(len(trial) for trial in trials)
    step = max(float(np.median(np.diff(trial.t))) for trial in trials)
    stride = max(1, min(math.ceil(total / MOST_SAMPLES), int(_COARSEST / step) if step > 0 else 1))
    shorter = [_every(trial, stride) for trial in trials]
    rows = sum(int(np.isfinite(trial.outputs[n]).sum()) for trial in shorter for n in outputs if n in trial.outputs)
    skip = math.ceil(rows / MOST_ROWS)
    return [_compared(trial, skip, outputs) for trial in shorter]


def _every(trial: Trial, stride: int) -> Trial:
    if stride == 1 or len(trial) < 20 * stride:
        return trial
    at = np.arange(0, len(trial), stride)
    half = stride // 2

    def averaged(values: np.ndarray) -> np.ndarray:
        padded = np.concatenate([np.full(half, values[0]), values, np.full(stride, values[-1])])
        sums = np.cumsum(np.concatenate([[0.0], padded]))
        return np.asarray((sums[at + stride] - sums[at]) / stride)

    return trial.with_step(
        Step("thin", {"every": stride}, f"kept {len(at)} of {len(trial)} samples, inputs averaged between them"),
        t=trial.t[at],
        inputs={name: averaged(np.asarray(values)) for name, values in trial.inputs.items()},
        outputs={name: values[at] for name, values in trial.outputs.items()},
        lines=None if trial.lines is None else trial.lines[at],
    )


def _compared(trial: Trial, skip: int, outputs: Sequence[str]) -> Trial:
    """Every so many samples of the outputs counts; the others are not looked at."""
    if skip <= 1:
        return trial
    keep = np.zeros(len(trial), dtype=bool)
    keep[::skip] = True
    return trial.with_step(
        Step("compare", {"every": skip}, f"every {skip}th sample of the outputs is compared"),
        outputs={n: np.where(keep, v, np.nan) if n in outputs else v for n, v in trial.outputs.items()},
    )
