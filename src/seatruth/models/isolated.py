"""A black box in processes of its own: a crash or a hang costs one run, and what was simulated once is kept."""

from __future__ import annotations

import hashlib
import json
import math
import threading
import uuid
from collections import Counter, OrderedDict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.black_box_wrapper import BlackBoxWrapper
from seatruth.models.ports import Outside
from seatruth.models.servo_black_box import ActingTrial
from seatruth.storage.kept_runs import KeptRuns
from seatruth.trials.trial import Trial
from seatruth.workers import Workers

TIME_LIMIT = 60.0
"""s that one run of one trial may take. Chosen here [S]: a simulator that takes longer is too slow for a search."""
_MEMORY = 256 * 2**20
"""Bytes of runs kept in memory. Chosen here [S]."""


@dataclass
class RunCounts:
    """What the runs of a simulator have cost in this process.

    `simulated` were made, `kept` found in memory or on disk; `failures` count reasons; `wall_s` and `cpu_s` are those
    of the `simulated`, in s.
    """

    simulated: int = 0
    kept: int = 0
    failures: Counter[str] = field(default_factory=Counter)
    wall_s: float = 0.0
    cpu_s: float = 0.0

    @property
    def succeeded(self) -> int:
        """Runs that gave outputs, kept ones included."""
        return self.simulated + self.kept - sum(self.failures.values())


class IsolatedBlackBox(BlackBoxWrapper):
    """A black box that runs in processes of its own, as many at once as there are threads to simulate.

    A run that ends its process, takes too long or raises gives NaN: it has diverged. Runs are kept in memory, and on
    disk (the folder of `SEATRUTH_CACHE`) where an `identity` says what decides them beside trial and parameters.

    Args:
        base: the black box. What its function holds is sent to other processes by cloudpickle.
        time_limit: s that one run of one trial may take.
        identity: a text that changes whenever the simulator does: a version, the checksum of a file. None keeps runs
            for the life of this process alone.

    Raises:
        BadInput: the time limit is none.

    Example:
        >>> from seatruth import BlackBox, Channel, Trial
        >>> from seatruth.models import IsolatedBlackBox
        >>> def halts(trial, p, first_state):
        ...     while True:
        ...         pass
        >>> box = BlackBox("halts", halts, inputs=[], outputs=[Channel("y", "m")], parameters=[])
        >>> alone = IsolatedBlackBox(box, time_limit=0.2)
        >>> alone.run(Trial("run", [0.0, 1.0], {}, {}), {}, None)[:, 0].tolist()
        [nan, nan]
        >>> dict(alone.counts.failures)
        {'it took longer than 0.2 s': 1}
    """

    def __init__(self, base: BlackBox, *, time_limit: float = TIME_LIMIT, identity: str | None = None) -> None:
        if not (time_limit > 0.0 and math.isfinite(time_limit)):
            raise BadInput(f"{time_limit!r} s is no time limit", where=f"model {base.name!r}", do="Give a number > 0.")
        self.time_limit, self.identity = time_limit, identity
        self._number = uuid.uuid4().hex if identity is None else identity
        super().__init__(base, base.function)

    @property
    def counts(self) -> RunCounts:
        """What its runs have cost in this process."""
        return _home(self).counts

    def run(
        self,
        trial: Trial,
        parameters: Mapping[str, float],
        first_state: Mapping[str, float] | None,
        outside: Outside | None = None,
    ) -> Array:
        """See `BlackBox.run`; NaN where the run failed."""
        home = _home(self)
        key = self._key(trial, parameters, first_state, outside)
        kept = home.kept(key)
        if kept is not None:
            return kept
        closed = home.workers.closed
        answer = home.workers.call((trial, dict(parameters), first_state, outside), self.time_limit)
        outputs = answer.value
        if answer.failure or not isinstance(outputs, np.ndarray):
            outputs = np.full((len(trial), len(self.outputs)), math.nan)
        if home.workers.closed == closed:  # else it was ended from here
            home.note(key, outputs, answer.failure, answer.wall_s, answer.cpu_s)
        return np.array(outputs)

    @contextmanager
    def anew(self) -> Iterator[None]:
        """Inside, every run is made, whether it was made before or not: to time it."""
        home = _home(self)
        home.anew = True
        try:
            yield
        finally:
            home.anew = False

    def stop(self) -> None:
        """Ends its processes, also those at work."""
        _home(self).workers.close()

    def _key(
        self,
        trial: Trial,
        parameters: Mapping[str, float],
        first_state: Mapping[str, float] | None,
        outside: Outside | None,
    ) -> str:
        """A checksum of all that decides a run."""
        content = hashlib.sha256()
        describe = getattr(outside, "describe", None)
        acting = None if outside is None else describe() if describe is not None else uuid.uuid4().hex
        plain = [self._number, dict(parameters), None if first_state is None else dict(first_state), acting]
        if self.servos:
            plain.append(isinstance(trial, ActingTrial))  # the same numbers mean another thing behind the servos
        content.update(json.dumps(plain, sort_keys=True, default=repr).encode())
        names = [channel.name for channel in self.inputs]
        content.update(np.ascontiguousarray(trial.t, dtype=np.float64).tobytes())
        if self.identity is None:
            # What a function of Python reads of a trial, nobody knows.
            content.update(f"{trial.name} {sorted(trial.inputs)} {sorted(trial.outputs)}".encode())
            names = sorted(trial.inputs)
            for name in sorted(trial.outputs):
                content.update(np.ascontiguousarray(trial.outputs[name], dtype=np.float64).tobytes())
        for name in names:
            content.update(np.ascontiguousarray(trial.inputs[name], dtype=np.float64).tobytes())
        return content.hexdigest()


class _Home:
    """Processes, kept runs and counts of one simulator, shared by all copies of its model in this process."""

    def __init__(self, model: IsolatedBlackBox) -> None:
        self.workers = Workers(model.base.run)
        self.counts = RunCounts()
        self._disk = KeptRuns() if model.identity is not None else None
        self._memory: OrderedDict[str, Array] = OrderedDict()
        self._bytes = 0
        self.anew = False
        self._lock = threading.Lock()

    def kept(self, key: str) -> Array | None:
        """A run that was made before, copied."""
        if self.anew:
            return None
        with self._lock:
            found = self._memory.get(key)
            if found is not None:
                self._memory.move_to_end(key)
                self.counts.kept += 1
                return np.array(found)
        if self._disk is None:
            return None
        found = self._disk.get(key)
        if found is None:
            return None
        with self._lock:
            self.counts.kept += 1
            self._remember(key, found)
        return np.array(found)

    def note(self, key: str, outputs: Array, failure: str, wall_s: float, cpu_s: float) -> None:
        """Counts a run and keeps it; a failed one in memory alone, as another day may be better."""
        with self._lock:
            self.counts.simulated += 1
            self.counts.wall_s += wall_s
            self.counts.cpu_s += cpu_s
            if failure:
                self.counts.failures[failure] += 1
            self._remember(key, outputs)
        if self._disk is not None and not failure:
            self._disk.put(key, outputs)

    def _remember(self, key: str, outputs: Array) -> None:
        if key in self._memory:
            return
        self._memory[key] = np.array(outputs)
        self._bytes += outputs.nbytes
        while self._bytes > _MEMORY and len(self._memory) > 1:
            _, old = self._memory.popitem(last=False)
            self._bytes -= old.nbytes


_HOMES: dict[str, _Home] = {}
_HOMES_LOCK = threading.Lock()


def _home(model: IsolatedBlackBox) -> _Home:
    with _HOMES_LOCK:
        if model._number not in _HOMES:
            _HOMES[model._number] = _Home(model)
        return _HOMES[model._number]


def isolated_in(model: Model) -> IsolatedBlackBox | None:
    """The part of a model that runs in processes of its own; None where there is none.

    Example:
        >>> from seatruth import load_model
        >>> from seatruth.models.isolated import isolated_in
        >>> print(isolated_in(load_model("mmg")))
        None
    """
    part: Any = model
    while part is not None and not isinstance(part, IsolatedBlackBox):
        part = getattr(part, "base", None)
    return part


def failures_of(model: Model) -> str:
    """Which runs of a simulator failed in this process, in one sentence; empty where none did.

    Example:
        >>> from seatruth import load_model
        >>> from seatruth.models.isolated import failures_of
        >>> failures_of(load_model("mmg"))
        ''
    """
    part = isolated_in(model)
    if part is not None:
        failures, runs = part.counts.failures, part.counts.simulated
    else:
        inner = model.innermost if isinstance(model, BlackBox) else None
        failures = Counter({} if inner is None else inner.failed)
        runs = failures.total() + (0 if inner is None else sum(inner.succeeded.values()))
    if not failures:
        return ""
    reasons = "; ".join(f"{number} times {reason}" for reason, number in failures.most_common(4))
    return f"{failures.total()} of {runs} runs of the simulator failed: {reasons}."
