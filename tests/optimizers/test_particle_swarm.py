"""The particle swarm and what it uses of pyswarms: its results depend on the seed alone, and it leaves no traces."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from seatruth.optimizers import Budget, make, minimise
from seatruth.testing.problems import rosenbrock
from seatruth_optimizers.particle_swarm import unlogged_pyswarms


@pytest.mark.parametrize("topology", ["star", "ring"])
def test_the_global_generator_is_neither_used_nor_changed(topology: str) -> None:
    solver = make("particle_swarm", particles=12, topology=topology)
    values = []
    for global_seed in (1, 2):
        np.random.seed(global_seed)  # noqa: NPY002 - the global state is what is tested
        before = np.random.get_state(legacy=False)  # noqa: NPY002
        values.append(minimise(rosenbrock(3).cost, solver, budget=Budget(600), seed=4).value)
        after = np.random.get_state(legacy=False)  # noqa: NPY002
        assert str(before) == str(after)
    assert values[0] == values[1]


def test_a_first_use_leaves_logging_and_the_folder_as_they_were(tmp_path: Path) -> None:
    """In a process of its own, because pyswarms is imported once."""
    code = (
        "import logging, os\n"
        "from seatruth.optimizers import Budget, make, minimise\n"
        "from seatruth.testing.problems import rosenbrock\n"
        "minimise(rosenbrock(2).cost, make('particle_swarm', particles=5), budget=Budget(50), seed=1)\n"
        "root = logging.getLogger()\n"
        "print(root.handlers, root.level, os.environ.get('LOG_CFG'), os.listdir())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=True)
    assert done.stdout.strip() == f"[] {logging.WARNING} None []"


def test_the_users_own_logging_set_up_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LOG_CFG", "mine.yaml")
    with unlogged_pyswarms():
        assert Path(os.environ["LOG_CFG"]).is_file()
    assert os.environ["LOG_CFG"] == "mine.yaml"


def test_a_ring_has_no_more_neighbours_than_particles() -> None:
    solver = make("particle_swarm", particles=4, topology="ring", neighbours=30)
    assert minimise(rosenbrock(2).cost, solver, budget=Budget(80), seed=1).code == "budget"
