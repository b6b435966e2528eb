"""One pool of threads for all simulations of a process."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor, wait

from seatruth.errors import BadInput
from seatruth.simulate.compiler.compiled import Kernel

THREADS = "SEATRUTH_THREADS"
"""Environment variable: threads of a simulation where none are asked for."""
_MOST = 64
_lock = threading.Lock()
_pool: ThreadPoolExecutor | None = None
_owner = 0


def thread_count(asked: int | None) -> int:
    """How many threads: as asked, as the environment says, or one a processor that this process may use."""
    if asked is None:
        text = os.environ.get(THREADS, "").strip()
        if text:
            try:
                asked = int(text)
            except ValueError:
                raise BadInput(f"{THREADS} is {text!r}", where="environment", do="Set it to a number.") from None
    if asked is None:
        processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        return max(1, min(processors, _MOST))
    if asked < 1:
        raise BadInput(f"{asked} threads are not possible", do="Ask for 1 or more.")
    return min(asked, _MOST)


def run(kernel: Kernel, context: int, threads: int, tasks: int, keep: object) -> None:
    """Runs the kernel on a context until its tasks are done, on this thread and up to `threads - 1` others.

    `keep` owns the memory that the context points to: a helper holds it, so that an interrupt of this thread cannot
    free what a helper still writes to.
    """
    helpers = min(threads, tasks) - 1
    if helpers <= 0:
        kernel(context)
        return
    pool = _shared()
    others = [pool.submit(_help, kernel, context, keep) for _ in range(helpers)]
    kernel(context)
    # The tasks are all taken now: a helper that has not begun is not needed.
    wait([other for other in others if not other.cancel()])


def _help(kernel: Kernel, context: int, keep: object) -> None:
    kernel(context)


def _shared() -> ThreadPoolExecutor:
    global _pool, _owner
    with _lock:
        if _pool is None or _owner != os.getpid():  # a forked child has the pool but not its threads
            _pool = ThreadPoolExecutor(_MOST, thread_name_prefix="seatruth")
            _owner = os.getpid()
        return _pool
