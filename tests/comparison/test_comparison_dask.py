"""A real scheduler and workers, each in a folder of its own; one of them is killed and nothing is lost."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from distributed import Client
from small_comparison import numbers, slow, small

from seatruth import BadInput
from seatruth.comparison import compare
from seatruth.progress import ProgressEvent

pytestmark = pytest.mark.slow
HERE = Path(__file__).parent
DASK = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
WORKER = [sys.executable, "-m", "distributed.cli.dask_worker"]


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Address of a scheduler with two workers, and their processes."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    before = os.environ.get("PYTHONPATH")
    paths = [str(HERE), str(HERE.parent), *([before] if before else [])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": environment}
    port = address.rpartition(":")[2]
    scheduler = subprocess.Popen([*DASK, "--host", "127.0.0.1", "--port", port, "--no-dashboard"], **quiet)
    options = ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
    workers = []
    for name in ("one", "other"):
        # Nothing is shared: each has a working folder, kept kernels and temporary files of its own.
        own = tmp_path / name
        own.mkdir()
        apart = environment | {"XDG_CACHE_HOME": str(own / "cache"), "TMPDIR": str(own), "HOME": str(own)}
        place: dict[str, Any] = quiet | {"env": apart, "cwd": own}
        workers.append(subprocess.Popen([*WORKER, address, *options, "--local-directory", str(own)], **place))
    try:
        yield address, workers
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


def test_a_worker_killed_midway_costs_nothing(
    cluster: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path
) -> None:
    address, workers = cluster
    with Client(address, timeout=60) as client:
        client.wait_for_workers(2, timeout=60)
        killed: list[int] = []

        def progress(now: ProgressEvent) -> None:
            if now.done >= 6 and not killed:
                killed.append(now.done)
                workers[0].kill()

        results = compare(slow(), tmp_path / "dask", backend="dask", progress=progress)
        assert killed
        assert killed[0] < len(slow().runs)
        assert len(client.scheduler_info()["workers"]) == 1
    assert results.left == 0
    assert not len(results.failures)
    here = compare(slow(), tmp_path / "here")
    pd.testing.assert_frame_equal(numbers(results), numbers(here), check_exact=True)


def test_without_a_client_it_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no dask client"):
        compare(small(), tmp_path, backend="dask")
