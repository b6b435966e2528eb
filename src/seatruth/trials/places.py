"""Where samples of a trial stand in its file, for messages."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from seatruth.readers.tables import runs
from seatruth.trials.trial import Trial


def place(trial: Trial, samples: NDArray[np.int64] | Sequence[int]) -> str:
    """Place of samples in their file, as "run.csv, lines 12-14"; by time where the file has no lines."""
    where = trial.source or f"trial {trial.name!r}"
    index = np.asarray(samples, dtype=np.int64)
    if index.size == 0:
        return where
    if trial.lines is not None and bool((trial.lines[index] > 0).all()):
        numbers = trial.lines[index].tolist()
        text = where.lower().endswith((".parquet", ".pq", ".mat"))
        return f"{where}, {'row' if text else 'line'}{'s' if len(numbers) > 1 else ''} {runs(numbers)}"
    return f"{where}, t = {trial.t[index[0]]:g}" + (f" to {trial.t[index[-1]]:g} s" if index.size > 1 else " s")
