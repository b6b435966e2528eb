"""One pool of threads that runs the kernels of all simulations of a process."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor, wait

from seatruth.simulate.compiler.machine_code import Kernel
from seatruth.simulate.threads import MOST_THREADS

_lock = threading.Lock()
_pool: ThreadPoolExecutor | None = None
_owner = 0


def run(kernel: Kernel, context: int, threads: int, tasks: int, memory: object) -> None:
    """Runs the kernel on a context until its tasks are done, on this thread and up to `threads - 1` others.

    `memory` owns the memory that the context points to: a helper thread holds it, so that an interrupt of this thread
    cannot free what a helper still writes to.
    """
    helpers = min(threads, tasks) - 1
    if helpers <= 0:
        kernel(context)
        return
    pool = _shared()
    others = [pool.submit(_help, kernel, context, memory) for _ in range(helpers)]
    kernel(context)
    # All tasks are taken now: a helper that has not begun is not needed.
    wait([other for other in others if not other.cancel()])


def _help(kernel: Kernel, context: int, memory: object) -> None:
    kernel(context)


def _shared() -> ThreadPoolExecutor:
    global _pool, _owner
    with _lock:
        if _pool is None or _owner != os.getpid():  # a forked child has the pool but not its threads
            _pool = ThreadPoolExecutor(MOST_THREADS, thread_name_prefix="seatruth")
            _owner = os.getpid()
        return _pool
