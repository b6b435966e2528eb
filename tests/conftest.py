"""What all tests share."""

from __future__ import annotations

import os

# Workers of pytest-xdist share the processors already: more threads in each would only wait for one another.
if "PYTEST_XDIST_WORKER" in os.environ:
    for _name in (
        "SEATRUTH_THREADS",
        "OPENBLAS_NUM_THREADS",
        "OMP_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMBA_NUM_THREADS",
    ):
        os.environ.setdefault(_name, "1")
