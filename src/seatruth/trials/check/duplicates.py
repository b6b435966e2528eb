"""The same twice: a recording in two trials, a column in two channels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

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


def check_columns(trial: Trial) -> Iterator[Finding]:
    """Two measured channels with the same values throughout, or one with those of the other turned round."""
    for one, other in combinations(trial.outputs, 2):
        a, b = trial.channel(one), trial.channel(other)
        known = np.isfinite(a) & np.isfinite(b)
        if np.unique(a[known]).size < limits.FEW_SAMPLES or not (np.isfinite(a) == np.isfinite(b)).all():
            continue
        if (a[known] == b[known]).all() or (a[known] == -b[known]).all():
            yield make_finding(
                trial,
                "warning",
                "same-column",
                f"{one} and {other} have the same values in all {known.sum()} samples.",
                "Check which column each is read from: one measurement counts twice, and one of the two is wrong.",
                channel=other,
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
