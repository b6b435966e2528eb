"""What all tests share."""

from __future__ import annotations

import os
import signal

from hypothesis import settings

# Workers of pytest-xdist share the processors already: more threads in each would only wait for one another.
if "PYTEST_XDIST_WORKER" in os.environ:
    for _library in ("SEATRUTH", "OPENBLAS_NUM", "OMP_NUM", "MKL_NUM"):
        os.environ.setdefault(f"{_library}_THREADS", "1")

# What a shell starts in the background ignores interrupts, and so do its children: those that test one need it back.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# On a busy machine a single example may take long for reasons that are not the code's.
settings.register_profile("seatruth", settings(deadline=None))
settings.load_profile("seatruth")
