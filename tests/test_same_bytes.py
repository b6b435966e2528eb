"""The same study and seed give the same numbers: whatever the hash seed, the threads, the workers, the folder."""

from __future__ import annotations

import json
import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from seatruth import sample

COMPARISON = """
[[problems]]
study = "study.toml"
start = "study"

[[solvers]]
use = "least_squares"

[[solvers]]
use = "particle_swarm"

[[noise]]
kind = "white"
levels = [0.01]

[comparison]
seeds = 2
budgets = [60]
"""
COMMANDS = {
    "identify": ["--seed", "3", "--cross-validate", "--profile", "current_north"],
    "diagnose": ["--effects", "current,wind,heading_bias"],
    "compare": [],
}
SURROUNDINGS = (
    ("", {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1"}, {"--threads": "1", "--workers": "1"}),
    ("elsewhere", {"PYTHONHASHSEED": "4242", "OPENBLAS_NUM_THREADS": "4"}, {"--threads": "3", "--workers": "3"}),
)
TIMES = {"wall_s", "cpu_s", "time_utc", "seconds", "checksum", "traces_checksum", "sha256"}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_the_same_numbers_in_other_surroundings(tmp_path: Path, command: str) -> None:
    sample.copy_to(tmp_path)
    (tmp_path / "comparison.toml").write_text(COMPARISON)
    (tmp_path / "elsewhere").mkdir()
    file = {"identify": "study.toml", "diagnose": "diagnose.toml", "compare": "comparison.toml"}[command]
    found = []
    for number, (folder, environment, options) in enumerate(SURROUNDINGS):
        out = tmp_path / str(number)
        taken = {name: value for name, value in options.items() if command != "compare" or name == "--workers"}
        chosen = [word for option in taken.items() for word in option]
        done = subprocess.run(
            [sys.executable, "-m", "seatruth", command, str(tmp_path / file), "--out", str(out), "--quiet"]
            + COMMANDS[command]
            + chosen,
            cwd=tmp_path / folder,
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        found.append(_numbers(out))
    assert found[0] == found[1]
    assert len(str(found[0])) > 1000


def _numbers(folder: Path) -> Any:
    if (folder / "comparison.sqlite").exists():
        with closing(sqlite3.connect(folder / "comparison.sqlite")) as base:
            runs = base.execute("SELECT key, value, evaluations, open_loop, held_out, error FROM runs ORDER BY key")
            estimates = base.execute("SELECT * FROM estimates ORDER BY key, parameter")
            return [*runs.fetchall(), *estimates.fetchall()]
    (name,) = (name for name in ("estimate.json", "diagnosis.json") if (folder / name).exists())
    tables = {
        path.name: path.read_bytes().hex()
        for path in sorted(folder.glob("*.parquet"))
        if path.name != "history.parquet"  # it holds seconds
    }
    return _timeless(json.loads((folder / name).read_text())), tables


def _timeless(value: Any) -> Any:
    """A result without the times that it took; the keys as pairs, so that their order counts too."""
    if isinstance(value, dict):
        return [(key, _timeless(entry)) for key, entry in value.items() if key not in TIMES]
    return [_timeless(entry) for entry in value] if isinstance(value, list) else value
