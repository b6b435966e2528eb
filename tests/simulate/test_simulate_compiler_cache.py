"""The cache of compiled kernels: survives processes, is never stale, never torn, never in the way."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from known_models import Lag, record_of

from seatruth.errors import SeatruthWarning
from seatruth.simulate import simulator
from seatruth.simulate.compiler import cache, machine_code
from seatruth.simulate.compiler.kernels import simulation_kernel
from seatruth.simulate.compiler.trace import trace
from seatruth.storage import cache_folder

SCRIPT = """
import sys, numpy as np
sys.path.insert(0, {folder!r})
from mine import Mine
from seatruth.errors import SeatruthWarning
from seatruth.simulate import simulator
from seatruth.simulate.compiler import machine_code
from seatruth.trials.trial import Trial
compiles = []
plain = machine_code._compile
machine_code._compile = lambda text: compiles.append(text) or plain(text)
trial = Trial("run", np.arange(11) * 0.1, {{}}, {{}}, synthetic=True)
print(repr(float(simulator(Mine(), [trial]).outputs(np.zeros((1, 0)), np.ones((1, 1))).x_end[0, 0, 0])), len(compiles))
"""
MODEL = """
from seatruth.models.base import Model
from seatruth.trials.channel import Channel
import forces

class Mine(Model):
    name = "mine"
    states = (Channel("x", "1"),)
    outputs = states

    @staticmethod
    def rhs(s, i, p):
        return (forces.drag(s.x),)
"""


def run(folder: Path, **environment: str) -> tuple[float, int]:
    script = textwrap.dedent(SCRIPT.format(folder=str(folder)))
    surroundings = {**os.environ, cache.CACHE: str(folder / "cache"), "PYTHONDONTWRITEBYTECODE": "1", **environment}
    done = subprocess.run([sys.executable, "-c", script], env=surroundings, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    value, compiles = done.stdout.split()
    return float(value), int(compiles)


@pytest.mark.slow
def test_kernels_survive_processes_and_are_never_stale(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MODEL)
    (tmp_path / "forces.py").write_text("RATE = 0.5\ndef drag(x):\n    return -RATE * x\n")
    first, compiles = run(tmp_path)
    assert (first, compiles) == (pytest.approx(np.exp(-0.5), rel=1e-6), 1)
    assert run(tmp_path) == (first, 0)
    # A constant in another file than the model's own is changed, then a function there.
    (tmp_path / "forces.py").write_text("RATE = 1.5\ndef drag(x):\n    return -RATE * x\n")
    assert run(tmp_path)[0] == pytest.approx(np.exp(-1.5), rel=1e-5)
    (tmp_path / "forces.py").write_text("def drag(x):\n    return 2.0 * x\n")
    assert run(tmp_path)[0] == pytest.approx(np.exp(2.0), rel=1e-4)


def lag_kernel() -> str:
    e = trace(Lag())
    return simulation_kernel(8, "squared errors", e.states, e.rates, e.outputs, e.parameters, e.driven)


def test_torn_and_foreign_files_are_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.CACHE, str(tmp_path))
    text = lag_kernel()
    key = machine_code._key(text)
    code = machine_code._object_code(key, text)
    (kernel,) = tmp_path.glob("*.kernel")
    whole = kernel.read_bytes()
    for damaged in (whole[:-7], whole[:200] + b"\0" + whole[201:], b"", b"text"):
        kernel.write_bytes(damaged)
        assert machine_code._object_code(key, text) == code
        assert kernel.read_bytes() == whole


@pytest.mark.skipif(os.name != "posix", reason="rights and owners are POSIX")
def test_a_folder_that_others_may_write_to_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Machine code is run as it stands, and its checksum can be computed by anyone."""
    place = tmp_path / "new" / "kernels"
    monkeypatch.setenv(cache.CACHE, str(place))
    assert cache.folder() == place
    assert place.stat().st_mode & 0o777 == 0o700
    place.chmod(0o777)
    with pytest.warns(SeatruthWarning, match=r"others may write to the folder.*chmod 700"):
        assert cache.folder() is None
    assert cache.folder() is None  # without a second word
    place.chmod(0o755)
    assert cache.folder() == place
    monkeypatch.setattr(os, "geteuid", lambda: place.stat().st_uid + 1)
    monkeypatch.setattr(cache_folder, "_refused", set())
    with pytest.warns(SeatruthWarning, match="belongs to another user"):
        assert cache.folder() is None


@pytest.mark.skipif(os.name != "posix", reason="rights, owners and pipes are POSIX")
def test_a_kernel_that_others_may_have_written_is_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.kernel"
    cache.write(path, b"code")
    assert cache.read(path) == b"code"
    path.chmod(0o660)
    assert cache.read(path) is None
    path.chmod(0o600)
    (tmp_path / "link.kernel").symlink_to(path)
    assert cache.read(tmp_path / "link.kernel") is None
    os.mkfifo(tmp_path / "pipe.kernel")
    assert cache.read(tmp_path / "pipe.kernel") is None
    monkeypatch.setattr(os, "geteuid", lambda: path.stat().st_uid + 1)
    assert cache.read(path) is None


def test_without_a_place_to_keep_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = lag_kernel()
    key = machine_code._key(text)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(cache.CACHE, str(tmp_path / "file" / "below"))
    code = machine_code._object_code(key, text)
    monkeypatch.setenv(cache.CACHE, "off")
    assert machine_code._object_code(key, text) == code
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.slow
def test_other_processors(tmp_path: Path) -> None:
    """Plainer machines, and those that the compiler does not know, give the same numbers up to rounding."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        pytest.skip("the names are those of another family of processors")
    (tmp_path / "mine.py").write_text(MODEL)
    drag = "import math\ndef drag(x):\n    return -math.sin(x) * math.exp(-x) - math.atan2(x, 3)\n"
    (tmp_path / "forces.py").write_text(drag)
    expected, _ = run(tmp_path)
    for processor in ("x86-64", "x86-64-v3", "no-such-processor"):
        assert run(tmp_path, SEATRUTH_CPU=processor)[0] == pytest.approx(expected, rel=1e-13)


def test_old_kernels_make_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "_MOST_FILES", 3)
    for number in range(6):
        cache.write(tmp_path / f"{number}.kernel", b"code")
        os.utime(tmp_path / f"{number}.kernel", (number, number))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["3.kernel", "4.kernel", "5.kernel"]


def test_one_model_is_one_text() -> None:
    """The text that names a kernel does not depend on the process or the run."""
    assert lag_kernel() == lag_kernel()


def test_models_share_a_kernel_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = record_of(np.arange(5.0), np.ones_like)
    before = simulator(Lag(), [trial]).outputs(np.zeros((1, 0)), np.zeros((1, 2)))
    monkeypatch.setattr(machine_code, "_compile", lambda text: pytest.fail("compiled again"))
    monkeypatch.setenv(cache.CACHE, "off")
    again = simulator(Lag(), [trial]).outputs(np.zeros((1, 0)), np.zeros((1, 2)))
    assert np.array_equal(before.y, again.y)
