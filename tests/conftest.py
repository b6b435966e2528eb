"""What all tests share."""

from __future__ import annotations

import os

from hypothesis import settings

# Workers of pytest-xdist share the processors already: more threads in each would only wait for one another.
if "PYTEST_XDIST_WORKER" in os.environ:
    for _library in ("SEATRUTH", "OPENBLAS_NUM", "OMP_NUM", "MKL_NUM"):
        os.environ.setdefault(f"{_library}_THREADS", "1")

# On a busy machine a single example may take long for reasons that are not the code's.
settings.register_profile("seatruth", settings(deadline=None))
settings.load_profile("seatruth")
