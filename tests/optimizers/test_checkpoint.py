"""Checkpoints: replay, refusal, damage, full disks, kills."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.optimizers import Budget, Problem, StaleCheckpoint, from_callable, make, minimise
from seatruth.testing.problems import rosenbrock

BUDGET = Budget(2000)


def test_a_finished_run_is_replayed_without_one_evaluation(tmp_path: Path) -> None:
    file = tmp_path / "deep" / "folder" / "run.checkpoint"
    whole = minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4, checkpoint=file)
    calls: list[Array] = []
    again = minimise(noting(calls), "differential_swarm", budget=BUDGET, seed=4, checkpoint=file)
    assert whole.same_as(again)
    assert not calls


def test_a_larger_budget_goes_on_from_the_smaller_one(tmp_path: Path) -> None:
    file = tmp_path / "run.checkpoint"
    minimise(rosenbrock().cost, "differential_swarm", budget=Budget(730), seed=4, checkpoint=file)
    calls: list[Array] = []
    more = minimise(noting(calls), "differential_swarm", budget=BUDGET, seed=4, checkpoint=file)
    assert more.same_as(minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4))
    assert sum(map(len, calls)) == 2000 - 730


@pytest.mark.parametrize(
    ("change", "word"),
    [({"seed": 5}, "seed"), ({"optimizer": "particle_swarm"}, "optimizer"), ({"cost": rosenbrock(3).cost}, "study")],
)
def test_another_run_is_refused(tmp_path: Path, change: dict[str, Any], word: str) -> None:
    file = tmp_path / "run.checkpoint"
    given: dict[str, Any] = {"cost": rosenbrock().cost, "optimizer": "differential_swarm", "seed": 4}
    minimise(**given, budget=BUDGET, checkpoint=file)
    before = file.read_bytes()
    with pytest.raises(StaleCheckpoint, match=word):
        minimise(**(given | change), budget=BUDGET, checkpoint=file)
    assert file.read_bytes() == before


def test_other_options_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "run.checkpoint"
    minimise(rosenbrock().cost, make("differential_swarm", particles=20), budget=BUDGET, checkpoint=file)
    with pytest.raises(StaleCheckpoint, match="optimizer"):
        minimise(rosenbrock().cost, make("differential_swarm", particles=21), budget=BUDGET, checkpoint=file)


@pytest.mark.parametrize("content", ["t,u,v\n0,1,2\n", "[" * 100_000 + "\n"], ids=["log", "nested"])
def test_a_file_that_is_no_checkpoint_is_left_alone(tmp_path: Path, content: str) -> None:
    file = tmp_path / "log.csv"
    file.write_text(content)
    with pytest.raises(StaleCheckpoint, match="not a seatruth checkpoint"):
        minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, checkpoint=file)
    assert file.read_text() == content


def test_an_optimizer_that_cannot_repeat_itself_is_found_out(tmp_path: Path) -> None:
    entropy = np.random.default_rng()

    def forgetful(problem: Problem, rng: np.random.Generator) -> str:
        problem.values(entropy.random((5, 2)))
        return ""

    file = tmp_path / "run.checkpoint"
    minimise(rosenbrock().cost, from_callable(forgetful), checkpoint=file)
    with pytest.raises(StaleCheckpoint, match="proposes other candidates"):
        minimise(rosenbrock().cost, from_callable(forgetful), checkpoint=file)


@pytest.mark.parametrize("cut", [1, 10, 100, 441, 5000])
def test_a_torn_end_is_dropped(tmp_path: Path, cut: int) -> None:
    file = tmp_path / "run.checkpoint"
    whole = minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4, checkpoint=file)
    content = file.read_bytes()
    file.write_bytes(content[:-cut])
    assert whole.same_as(minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4, checkpoint=file))
    assert len(file.read_bytes()) == len(content)


def test_a_flipped_bit_is_noticed(tmp_path: Path) -> None:
    file = tmp_path / "run.checkpoint"
    whole = minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4, checkpoint=file)
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    assert whole.same_as(minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4, checkpoint=file))


def test_two_runs_do_not_share_a_checkpoint(tmp_path: Path) -> None:
    file = tmp_path / "run.checkpoint"

    def nested(problem: Problem, rng: np.random.Generator) -> str:
        problem.value(problem.start)
        with pytest.raises(BadInput, match="another run"):
            minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, checkpoint=file)
        return "done"

    assert minimise(rosenbrock().cost, from_callable(nested), checkpoint=file).code == "converged"


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for wrong in (tmp_path, Path(os.devnull), tmp_path / "file" / "run.checkpoint"):
        with pytest.raises(BadInput, match=r"the checkpoint (must be a file|cannot be opened)"):
            minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, checkpoint=wrong)


FULL_DISK = """
import resource, signal, sys
from seatruth.errors import BadInput
from seatruth.optimizers import Budget, minimise
from seatruth.testing.problems import rosenbrock
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
before = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), before[1]))
try:
    outcome = minimise(rosenbrock().cost, "differential_swarm", budget=Budget(2000), seed=4, checkpoint=sys.argv[1])
    print(outcome.evaluations, outcome.code, *outcome.notes)
except BadInput as problem:
    print(problem.message)
resource.setrlimit(resource.RLIMIT_FSIZE, before)  # what measures coverage writes at the end
"""
"""A limit on the size of files stands for a disk that fills up: a write comes back short, then fails."""


def on_a_full_disk(file: Path, size: int) -> str:
    pytest.importorskip("resource")
    command = [sys.executable, "-c", FULL_DISK, str(file), str(size)]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout


def test_a_full_disk_at_the_start_is_one_message(tmp_path: Path) -> None:
    assert "the checkpoint cannot be written" in on_a_full_disk(tmp_path / "run.checkpoint", 100)


def test_a_disk_that_fills_up_ends_the_checkpoint_and_not_the_run(tmp_path: Path) -> None:
    file = tmp_path / "run.checkpoint"
    said = on_a_full_disk(file, 3000)
    assert said.startswith("2000 budget The checkpoint")
    assert "could not be continued" in said
    resumed = minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4, checkpoint=file)
    assert resumed.same_as(minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4))


def test_a_killed_process_continues(tmp_path: Path) -> None:
    code = """
import sys, time
from seatruth.optimizers import Budget, minimise
from seatruth.testing.problems import rosenbrock
slow = rosenbrock().cost
plain = slow.values
slow.values = lambda X: (time.sleep(0.005), plain(X))[1]
minimise(slow, "genetic", budget=Budget(100000), seed=4, checkpoint=sys.argv[1])
"""
    file = tmp_path / "run.checkpoint"
    process = subprocess.Popen([sys.executable, "-c", code, str(file)])
    try:
        waited = time.monotonic() + 30
        while (not file.exists() or file.stat().st_size < 20_000) and time.monotonic() < waited:
            time.sleep(0.01)
    finally:
        process.kill()
        process.wait()
    held = file.stat().st_size
    assert held >= 20_000
    calls: list[Array] = []
    budget = Budget(6000)
    resumed = minimise(noting(calls), "genetic", budget=budget, seed=4, checkpoint=file)
    assert sum(map(len, calls)) < 6000 - 2000
    assert resumed.same_as(minimise(rosenbrock().cost, "genetic", budget=budget, seed=4))


def noting(calls: list[Array]) -> Any:
    """The same cost, which notes the candidates that it is asked for."""
    cost = rosenbrock().cost
    plain = cost.values

    def values(X: Array) -> Array:
        calls.append(X)
        return plain(X)

    cost.values = values
    return cost


def test_a_smaller_budget_is_kept_on_replay(tmp_path: Path) -> None:
    file = tmp_path / "run.checkpoint"
    minimise(rosenbrock().cost, "differential_swarm", budget=BUDGET, seed=4, checkpoint=file)
    calls: list[Array] = []
    less = minimise(noting(calls), "differential_swarm", budget=Budget(730), seed=4, checkpoint=file)
    assert less.same_as(minimise(rosenbrock().cost, "differential_swarm", budget=Budget(730), seed=4))
    assert not calls
