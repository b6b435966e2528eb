"""Trials against each other: the same recording twice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from seatruth.trials.check import limits
from seatruth.trials.check.helpers import at_all_times, make_finding
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial


def check_duplicates(trials: Sequence[Trial]) -> Iterator[Finding]:
    """Two trials with many samples in common, alike in every channel (time aside)."""
    rows = [_rows(trial) for trial in trials]
    for k, later in enumerate(trials):
        for j in range(k):
            if set(_names(later)) != set(_names(trials[j])):
                continue
            common = len(rows[k] & rows[j])
            if common < limits.SAME_ROWS:
                continue
            part = common / max(1, min(len(rows[k]), len(rows[j])))
            yield make_finding(
                later,
                "error" if part > 0.9 else "warning",
                "duplicate",
                f"{common} samples ({100 * part:.0f} % of the shorter) are also in trial {trials[j].name!r}.",
                "Keep one of them, or cut them so that they do not overlap: the same data counted twice make every "
                "standard error too small, and a held-out copy predicts nothing.",
            )


def _names(trial: Trial) -> list[str]:
    return sorted([*trial.inputs, *trial.outputs])


def _rows(trial: Trial) -> set[bytes]:
    """Distinct samples as bytes; those in which less than two channels differ from the sample before are left out.

    A vehicle at rest, or a simulation that starts where another did, repeats samples without being the same run.
    """
    names = _names(trial)
    if not names or len(trial) < 2:
        return set()
    table = np.ascontiguousarray(np.column_stack([at_all_times(trial, name) for name in names]))
    table = np.where(table == 0.0, 0.0, table)  # -0.0 and 0.0 have different bytes
    moved = np.concatenate([[False], (np.diff(table, axis=0) != 0.0).sum(axis=1) >= min(2, len(names))])
    return {row.tobytes() for row in table[moved]}
