"""One pool of threads that runs the kernels of all simulations of a process."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np
from numpy.typing import NDArray

from seatruth.simulate.compiler.machine_code import Kernel
from seatruth.simulate.threads import MOST_THREADS

Buffer = NDArray[np.float64] | NDArray[np.int64]
_lock = threading.Lock()
_pool: ThreadPoolExecutor | None = None
_owner = 0


class Kept:
    """Buffers that many runs of a kernel read, by word, and their addresses: to ask for one takes a microsecond."""

    def __init__(self, buffers: Mapping[str, Buffer]) -> None:
        self._buffers = dict(buffers)  # keeps the memory
        self.addresses = {word: _address(buffer) for word, buffer in self._buffers.items()}


def run_kernel(
    kernel: Kernel,
    words: Sequence[str],
    buffers: dict[str, Buffer],
    sizes: dict[str, int],
    threads: int,
    tasks: int,
    kept: Kept | None = None,
) -> None:
    """Runs a kernel until its tasks are done, on this thread and up to `threads - 1` others.

    Its context is a table of `words`: addresses of buffers, or sizes.
    """
    known = sizes if kept is None else {**sizes, **kept.addresses}
    table = [_address(buffers[word]) if word in buffers else known.get(word, 0) for word in words]
    context = np.array(table, dtype=np.int64)
    place = _address(context)
    helpers = min(threads, tasks) - 1
    if helpers <= 0:
        kernel(place)
        return
    pool = _shared()
    # A helper holds all memory that the context points to, so that an interrupt of this thread cannot free what the
    # helper still writes to.
    others = [pool.submit(_help, kernel, place, (context, buffers, kept)) for _ in range(helpers)]
    kernel(place)
    # All tasks are taken now: a helper that has not begun is not needed.
    wait([other for other in others if not other.cancel()])


def _address(array: Buffer) -> int:
    return int(array.__array_interface__["data"][0])  # several times faster than array.ctypes.data


def _help(kernel: Kernel, context: int, memory: object) -> None:
    kernel(context)


def _shared() -> ThreadPoolExecutor:
    global _pool, _owner
    with _lock:
        if _pool is None or _owner != os.getpid():  # a forked child has the pool but not its threads
            _pool = ThreadPoolExecutor(MOST_THREADS, thread_name_prefix="seatruth")
            _owner = os.getpid()
        return _pool
