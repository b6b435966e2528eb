"""Processes in which somebody else's code runs: it may crash, hang or leak there, and takes nothing with it.

    pool = Workers(function)
    answer = pool.call((1, 2), seconds=5.0)   # answer.value, or answer.failure

Each thread that calls gets a process of its own; processes are started when they are needed and used again. One that
crashes or takes too long is ended, and the next call starts another.
"""

from __future__ import annotations

import atexit
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import ModuleType
from typing import Any, NamedTuple

import cloudpickle

from seatruth import worker_child
from seatruth.errors import PluginError
from seatruth.processes import END_S, search_path, started

START_S = 60.0
"""s that a process may take until its function is there: libraries may load slowly from a cold disk (chosen here [S]).
"""


class Answer(NamedTuple):
    """What came of a call: its value, or why there is none; and the processor and wall time that it took, s."""

    value: Any
    failure: str
    cpu_s: float
    wall_s: float


class Workers:
    """Runs one function in processes.

    Args:
        function: what runs there; pickled by value where it comes from a user's file or a notebook.

    Raises:
        PluginError: it cannot be sent to another process.

    Example:
        >>> from seatruth.workers import Workers
        >>> pool = Workers(lambda a, b: a / b)
        >>> pool.call((6, 3), seconds=30.0).value
        2.0
        >>> pool.call((6, 0), seconds=30.0).failure
        'it raised ZeroDivisionError: division by zero'
        >>> pool.close()
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = by_value(function)
        self._idle: list[_Worker] = []
        self._all: set[_Worker] = set()
        self._lock = threading.Lock()
        self.closed = 0
        """How many times its processes were ended from here: a call during which that happened says nothing."""
        _OPEN.add(self)

    def call(self, arguments: tuple[Any, ...], seconds: float) -> Answer:
        """Calls the function in a process that is free. `seconds` of wall time are what it may take."""
        before = self.closed
        try:
            worker = self._free()
        except PluginError as problem:
            return Answer(None, problem.what, 0.0, 0.0)
        answer, usable = worker.call(arguments, seconds)
        with self._lock:
            if usable and self.closed == before:
                self._idle.append(worker)
                return answer
            self._all.discard(worker)
        worker.end()
        return answer

    def close(self) -> None:
        """Ends all processes, also those that are at work: their calls fail."""
        with self._lock:
            self.closed += 1
            idle, self._idle = self._idle, []
            workers, self._all = self._all, set()
        for worker in workers.difference(idle):
            worker.end()
        for worker in idle:
            worker.dismiss()
        for worker in idle:
            worker.end(END_S)

    def _free(self) -> _Worker:
        with self._lock:
            if self._idle:
                return self._idle.pop()
        worker = _Worker(self._function)
        with self._lock:
            self._all.add(worker)
        return worker


_OPEN: weakref.WeakSet[Workers] = weakref.WeakSet()


@atexit.register
def close_all() -> None:
    """Ends the processes of all pools, as the end of the program does."""
    for pool in list(_OPEN):
        pool.close()


class _Worker:
    """One process."""

    def __init__(self, function: bytes) -> None:
        self._process = started(worker_child.__file__)
        first = {"modules": search_path(), "parent": os.getpid(), "function": function}
        ready, _ = self._ask(pickle.dumps(first), START_S)
        if ready[0] != "ready":
            self.end()
            what = f"{ready[1]}: {ready[2]}" if ready[0] == "raised" else ready[1]
            raise PluginError(f"it cannot be started in a process of its own ({what})")

    def call(self, arguments: tuple[Any, ...], seconds: float) -> tuple[Answer, bool]:
        """The answer, and whether the process can be used again."""
        began = time.perf_counter()
        found, usable = self._ask(by_value(arguments), seconds)
        wall_s = time.perf_counter() - began
        if found[0] == "done":
            return Answer(found[1], "", float(found[2]), wall_s), usable
        why = f"it raised {found[1]}: {found[2]}" if found[0] == "raised" else str(found[1])
        return Answer(None, why, 0.0, wall_s), usable

    def dismiss(self) -> None:
        """Closes the pipe of a process that is idle, which then ends by itself."""
        with suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()

    def end(self, patience_s: float = 0.0) -> None:
        """Ends the process, where it does not end by itself within so many seconds."""
        if patience_s:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(patience_s)
        with suppress(OSError):
            self._process.kill()
        for stream in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                if stream is not None:
                    stream.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(5.0)

    def _ask(self, message: bytes, seconds: float) -> tuple[tuple[Any, ...], bool]:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        late = threading.Event()

        def too_late() -> None:
            late.set()
            with suppress(OSError):
                self._process.kill()

        alarm = threading.Timer(seconds, too_late)
        alarm.daemon = True
        alarm.start()
        try:
            worker_child.send_bytes(self._process.stdin, message)
            return pickle.loads(worker_child.receive(self._process.stdout)), True
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            why = f"it took longer than {seconds:g} s" if late.is_set() else self._death()
            return ("ended", why), False
        finally:
            alarm.cancel()

    def _death(self) -> str:
        """How the process ended, in words."""
        with suppress(subprocess.TimeoutExpired):
            code = self._process.wait(5.0)
            if code < 0:
                with suppress(ValueError):
                    return f"it ended its process ({signal.Signals(-code).name})"
            return f"it ended its process (exit code {code})"
        return "it closed the pipe of its process"


def by_value(what: Any) -> bytes:
    """A pickle that holds what comes from a user's file or the main program, which no other process can import.

    Raises:
        PluginError: it cannot be pickled.

    Example:
        >>> import pickle
        >>> from seatruth.workers import by_value
        >>> pickle.loads(by_value(lambda x: x + 1))(2)
        3
    """
    try:
        with _users_modules():
            return bytes(cloudpickle.dumps(what))
    except Exception as problem:  # pickling calls code of its own for each kind of object
        raise PluginError(
            f"it cannot be sent to another process ({type(problem).__name__}: {problem})",
            do="Keep open files, locks and connections out of what it holds, or make them when it is first called.",
        ) from None


_LOCK = threading.RLock()


@contextmanager
def _users_modules() -> Iterator[None]:
    with _LOCK:
        modules: list[ModuleType] = [m for name, m in list(sys.modules.items()) if name.startswith("seatruth_user_")]
        for module in modules:
            cloudpickle.register_pickle_by_value(module)
        try:
            yield
        finally:
            for module in modules:
                cloudpickle.unregister_pickle_by_value(module)
