"""Stretches of one long recording, each of which can become a trial of its own.

By a column of the file that numbers or names the runs, by the times of events, and by pauses of the recording.
Manoeuvres are recognised in `seatruth.manoeuvres.recognise`.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.readers.tables import Table, as_text
from seatruth.trials.check.limits import GAP_STEPS


@dataclass(frozen=True)
class Stretch:
    """A part of a log: what it is, from `start` to `end` (s, both samples belong to it), and in words what it holds.

    `kind` is "turning circle", "zigzag", "stop", "straight run", "steady", "part" (between events or pauses) or "run"
    (by a column, whose rows `where` selects; its times are those of the file and may start anew).
    """

    kind: str
    label: str
    start: float
    end: float
    facts: str = ""
    where: str = ""
    name: str = ""

    @property
    def duration(self) -> float:
        return self.end - self.start


def by_events(t: Array, events: Sequence[float]) -> list[Stretch]:
    """The parts of a log (times (n,)) between events, given by their times in s; the first and last part included.

    Example:
        >>> import numpy as np
        >>> [(part.start, part.end) for part in by_events(np.arange(10.0), [4.0, 7.5])]
        [(0.0, 3.0), (4.0, 7.0), (8.0, 9.0)]
    """
    inside = sorted(set(events))
    outside = [event for event in inside if not t[0] <= event <= t[-1]]
    if outside:
        raise BadInput(
            f"an event at {outside[0]:g} s is outside the log, which lasts from {t[0]:g} to {t[-1]:g} s",
            do="Give the times of events on the log's own clock, in seconds.",
        )
    edges = [0, *np.searchsorted(t, inside).tolist(), t.size]
    return _parts(t, edges, "between events")


def by_pauses(t: Array) -> list[Stretch]:
    """The parts of a log between pauses that are longer than `GAP_STEPS` sampling steps."""
    steps = np.diff(t)
    edges = [0, *(np.flatnonzero(steps > GAP_STEPS * float(np.median(steps))) + 1).tolist(), t.size]
    return _parts(t, edges, "between pauses")


def _parts(t: Array, edges: Sequence[int], facts: str) -> list[Stretch]:
    """Stretches from each edge to the sample before the next one; parts of less than two samples are no trial."""
    found = [
        Stretch("part", "part", float(t[first]), float(t[stop - 1]), facts)
        for first, stop in itertools.pairwise(edges)
        if stop - first > 1
    ]
    return named(found)


def by_column(table: Table, column: str, t: Array) -> list[Stretch]:
    """The runs of a file by a column that holds their numbers or names, in the order in which they first occur.

    A row without a value belongs to no run. `t` (n,) is the time of each row, s.
    """
    series = table.column(column)
    text = as_text(series, f"{table.source}, column {column!r}")
    known = (series.notna() & (text != "")).to_numpy(dtype=bool)
    values = list(dict.fromkeys(series[known].tolist()))
    if not values:
        raise BadInput(f"column {column!r} is empty", where=table.source, do="Name the column that tells the runs.")
    if len(values) > max(50, len(table) // 20):
        raise BadInput(
            f"column {column!r} has {len(values)} different values in {len(table)} rows: it tells no runs",
            where=table.source,
            do="Name a column that stays the same throughout a run.",
        )
    found = []
    for value in values:
        rows = np.flatnonzero((series == value).to_numpy(dtype=bool, na_value=False) & known)
        if rows.size < 2:
            continue
        number = isinstance(value, int | float) and not pd.isna(value)
        condition = f"{column} == {value:.17g}" if number else f"{column} == {_quoted(str(value).strip())}"
        found.append(
            Stretch(
                "run",
                f"{column} {value:g}" if number else str(value).strip(),
                float(np.nanmin(t[rows])),
                float(np.nanmax(t[rows])),
                f"{rows.size} rows with {condition}",
                condition,
            )
        )
    return named(found)


def _quoted(text: str) -> str:
    return f"'{text}'" if "'" not in text else f'"{text}"'


def named(stretches: Iterable[Stretch]) -> list[Stretch]:
    """The stretches in the order of time, each with a name of its own that a file or a command line can hold."""
    ordered = sorted(stretches, key=lambda stretch: (stretch.start, stretch.end))
    words = [re.sub(r"[^\w.-]+", "_", stretch.label).strip("_") or stretch.kind for stretch in ordered]
    result: list[Stretch] = []
    for k, (word, stretch) in enumerate(zip(words, ordered)):
        alone = words.count(word) == 1
        result.append(replace(stretch, name=word if alone else f"{word}_{words[:k].count(word) + 1}"))
    return result
