"""How a run starts and ends processes: scripts of its own, safe paths for workers, and its own end on a signal.

Python's own workers (loky's, dask's, the trackers of their resources) start with the working directory in front of
their search path: a file called pickle.py beside a study would be run instead of Python's own.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from seatruth.errors import BadInput

_SAFE_PATH = "PYTHONSAFEPATH"
"""Environment variable of Python (3.11 and later): a process puts no folder of its own before its search path."""
_WATCH_S = 0.5
"""s between two looks at the parent. Chosen here [S]: a killed run soon frees the machine; looks cost nothing."""
END_S = 1.0
"""s in which a script of ours that has nothing left to do may end by itself, before it is ended. It takes milliseconds;
chosen here [S]."""
MOST_WORKERS = 1000
"""Jobs at once. Chosen here [S]: more than any machine has processors; each takes memory of its own."""
_SAFE_DEPTH_LOCK = threading.Lock()
_safe_depth = 0
_before: str | None = None


def require_workers(workers: int) -> None:
    """BadInput for a number of workers that cannot be started.

    Example:
        >>> require_workers(2)
    """
    if not 1 <= workers <= MOST_WORKERS:
        raise BadInput(f"{workers} workers are not possible", do=f"Ask for 1 to {MOST_WORKERS}.")


def started(script: str) -> subprocess.Popen[bytes]:
    """A script of ours in a process of its own, whose input and output are pipes.

    It imports nothing from the working directory, computes in one thread, and what it complains of goes nowhere. Its
    parent sends it `search_path()`, so that it finds what the parent does.
    """
    return subprocess.Popen(
        [sys.executable, "-P", script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"},
    )


def search_path() -> list[str]:
    """Folders of modules without the working directory, whose files must not be taken for modules."""
    return [entry for entry in sys.path if entry]


@contextmanager
def safe_search_path() -> Iterator[None]:
    """Python processes that are started inside do not import from the working directory.

    What the parent itself may import still reaches its workers: they get the parent's search path after their start.

    Example:
        >>> import subprocess, sys
        >>> from seatruth.processes import safe_search_path
        >>> code = "import sys; print(sys.flags.safe_path)"
        >>> with safe_search_path():
        ...     subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip()
        'True'
    """
    _enter()
    try:
        yield
    finally:
        _leave()


def _enter() -> None:
    global _safe_depth, _before
    with _SAFE_DEPTH_LOCK:
        if _safe_depth == 0:
            _before = os.environ.get(_SAFE_PATH)
            os.environ[_SAFE_PATH] = "1"
        _safe_depth += 1


def _leave() -> None:
    global _safe_depth
    with _SAFE_DEPTH_LOCK:
        _safe_depth -= 1
        if _safe_depth == 0:
            if _before is None:
                os.environ.pop(_SAFE_PATH, None)
            else:
                os.environ[_SAFE_PATH] = _before


def end_with(parent: int) -> None:
    """Ends this process within a second of the end of its parent, however that ends (`kill -9`, memory).

    Args:
        parent: process number of the parent; a worker runs this first.
    """
    threading.Thread(target=_watch, args=(parent,), name="watch of the parent", daemon=True).start()


def _watch(parent: int) -> None:
    while _is_parent(parent):
        time.sleep(_WATCH_S)
    os._exit(1)  # nobody is left who could take a result, and nothing is half written: workers write no files


def _is_parent(parent: int) -> bool:
    if os.name == "posix":
        return os.getppid() == parent  # an orphan gets another parent
    import psutil

    return bool(psutil.pid_exists(parent))


def interrupt_at_signals() -> None:
    """SIGTERM and SIGHUP interrupt this process as Ctrl-C does: what was reached is kept, and one line says why.

    A signal that the caller ignores (`nohup`) stays ignored. For the main thread of a program.
    """
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _interrupt)


def _interrupt(number: int, frame: FrameType | None) -> None:
    name = signal.Signals(number).name
    with suppress(OSError):
        # Not through Python's streams, in whose midst the signal may have come.
        os.write(2, f"seatruth: {name} ends this run; what was reached is kept.\n".encode())
    if name == "SIGHUP":
        _leave_the_terminal()
    raise KeyboardInterrupt(name)


def _leave_the_terminal() -> None:
    """A terminal that has gone cannot be written to; the result must be saved all the same."""
    with suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):
            if os.isatty(stream):
                os.dup2(nowhere, stream)
