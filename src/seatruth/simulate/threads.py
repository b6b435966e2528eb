"""How many threads a simulation takes."""

from __future__ import annotations

import os

from seatruth.errors import BadInput

THREADS = "SEATRUTH_THREADS"
"""Environment variable: threads of a simulation where the caller asks for none."""
MOST_THREADS = 64
"""Size of the pool of threads that all simulations of a process share; chosen here [S]."""


def thread_count(asked: int | None) -> int:
    """Number of threads: as asked, else as the environment says, else one for each processor the process may use.

    At most `MOST_THREADS`. Raises BadInput for a number below 1, or an environment variable that is no number.
    """
    if asked is None:
        text = os.environ.get(THREADS, "").strip()
        if text:
            try:
                asked = int(text)
            except ValueError:
                raise BadInput(f"{THREADS} is {text!r}", where="environment", do="Set it to a number.") from None
    if asked is None:
        processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        return max(1, min(processors, MOST_THREADS))
    if asked < 1:
        raise BadInput(f"{asked} threads are not possible", do="Ask for 1 or more.")
    return min(asked, MOST_THREADS)
