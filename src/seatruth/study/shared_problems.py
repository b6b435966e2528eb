"""Problems with logs that stand in what all trials share: said once, where the study file has them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from seatruth.errors import BadInput, SeatruthError
from seatruth.study.schema import StudyFile
from seatruth.study.schema_trials import ChannelTable
from seatruth.study.validation import Problems
from seatruth.text import listed
from seatruth.trials import STANDARD_CHANNELS, Channel
from seatruth.trials.columns import DDMM
from seatruth.trials.pressure import conversion
from seatruth.units import inside_unit, to_si

Path = tuple[str | int, ...]
_NO_COLUMN = re.compile(r"no column (['\"])(.*)\1")
_SHOWN = 3
"""Trials that a message names. Chosen here [S]."""


class SharedProblems:
    """Collects what is wrong with the log of each trial, and says together what has one cause."""

    def __init__(self, file: StudyFile, problems: Problems) -> None:
        self._file, self._problems = file, problems
        self._trials: set[str] = set()
        self._found: dict[tuple[Path, str, str], list[tuple[str, int, SeatruthError]]] = {}

    @contextmanager
    def of(self, trial: str, entry: int) -> Iterator[None]:
        """Notes what is raised inside as a problem of this trial, of that entry of [[trials]], and goes on."""
        self._trials.add(trial)
        try:
            yield
        except SeatruthError as problem:
            place = self._place(problem, entry)
            self._found.setdefault((place, problem.what, problem.do), []).append((trial, entry, problem))

    def report(self) -> None:
        """Hands over what was found; what stands in the study once, for several trials or the only one, once."""
        for (place, what, do), found in self._found.items():
            if place and len(found) > min(1, len(self._trials) - 1):
                self._problems.add(place, f"{what} {self._in(found)}", do, type(found[0][2]))
                continue
            for _, entry, problem in found:
                with self._problems.at("trials", entry):
                    raise problem

    def _in(self, found: Sequence[tuple[str, int, SeatruthError]]) -> str:
        names = [repr(trial) for trial, _, _ in found]
        if len(names) == len(self._trials):
            return "in any trial" if len(names) > 1 else f"in {names[0]}"
        more = [f"{len(names) - _SHOWN} more"] if len(names) > _SHOWN else []
        return f"in {listed([*names[:_SHOWN], *more])}"

    def _place(self, problem: SeatruthError, entry: int) -> Path:
        """Where the study names the column that is missing for all trials; empty where it does not."""
        missing = _NO_COLUMN.fullmatch(problem.what)
        if missing is None:
            return ()
        own, column = self._file.trials[entry], missing[2]
        for name, table in self._file.channels.items():
            own_column = name in own.channels and "column" in own.channels[name].model_fields_set
            if not own_column and (table.column or name) == column:
                return ("channels", name, "column")
        return ("time", "column") if own.time is None and self._file.time.column == column else ()


def check_units(file: StudyFile, known: dict[str, Channel], problems: Problems) -> None:
    """Units that are none, or that a channel cannot have: no log is needed to see that."""
    stated: list[tuple[Path, str, ChannelTable]] = [
        (("channels", name), name, table) for name, table in file.channels.items()
    ]
    for entry, trial in enumerate(file.trials):
        stated += [(("trials", entry, "channels", name), name, table) for name, table in trial.channels.items()]
    for place, name, table in stated:
        if table.unit is None or table.unit == DDMM:
            continue
        channel = known.get(name) or STANDARD_CHANNELS.get(name)
        try:
            to_si(table.unit, inside_unit(table.unit)) if channel is None else conversion(table.unit, channel)
        except BadInput as problem:
            problems.add((*place, "unit"), problem.what, problem.do)
