"""Processes that a run starts: where they find code, and when they end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from seatruth.errors import BadInput
from seatruth.processes import (
    MOST_WORKERS,
    interrupt_at_signals,
    require_workers,
    safe_search_path,
    search_path,
    started,
)


@pytest.mark.parametrize("workers", [-1, 0, MOST_WORKERS + 1, 10**30])
def test_workers_that_cannot_be_started_are_refused(workers: int) -> None:
    require_workers(1)
    require_workers(MOST_WORKERS)
    with pytest.raises(BadInput, match=f"Ask for 1 to {MOST_WORKERS}"):
        require_workers(workers)


def test_inside_another_the_environment_is_restored_by_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    with safe_search_path():
        with safe_search_path():
            pass
        assert os.environ["PYTHONSAFEPATH"] == "1"
    assert "PYTHONSAFEPATH" not in os.environ
    monkeypatch.setenv("PYTHONSAFEPATH", "0")
    with safe_search_path():
        assert os.environ["PYTHONSAFEPATH"] == "1"
    assert os.environ["PYTHONSAFEPATH"] == "0"


@pytest.mark.skipif(os.name == "nt", reason="there a process keeps the number of its parent")
def test_a_script_of_ours_computes_alone_and_sees_no_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "script.py"
    script.write_text("import os, sys\nprint(sys.flags.safe_path, os.environ['OMP_NUM_THREADS'], sys.stdin.read())")
    with started(str(script)) as process:
        said, complaints = process.communicate(b"hello")
    assert said.decode().split() == ["True", "1", "hello"]
    assert complaints is None
    monkeypatch.setattr(sys, "path", ["", "/lib"])
    assert search_path() == ["/lib"]


def test_a_worker_ends_with_its_parent() -> None:
    worker = "import os, time; from seatruth.processes import end_with; end_with(os.getppid()); time.sleep(60)"
    parent = (
        "import subprocess, sys; w = subprocess.Popen([sys.executable, '-c', sys.argv[1]], stdout=subprocess.PIPE);"
        "print(w.pid, flush=True); import time; time.sleep(0.3); import os; os.kill(os.getpid(), 9)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    killed = subprocess.run([sys.executable, "-c", parent, worker], capture_output=True, text=True, env=environment)
    try:
        psutil.Process(int(killed.stdout)).wait(timeout=20)
    except psutil.NoSuchProcess:
        return


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_signals_interrupt_as_ctrl_c_does(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    number = getattr(signal, name)
    before = signal.getsignal(number)
    try:
        signal.signal(number, signal.SIG_IGN)
        interrupt_at_signals()
        os.kill(os.getpid(), number)  # as under nohup
        signal.signal(number, signal.SIG_DFL)
        interrupt_at_signals()
        with pytest.raises(KeyboardInterrupt, match=name):
            os.kill(os.getpid(), number)
    finally:
        signal.signal(number, before)
    assert capfd.readouterr().err == f"seatruth: {name} ends this run; what was reached is kept.\n"
