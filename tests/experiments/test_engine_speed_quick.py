"""The speed experiment: its bound counts what it says, its engines agree, its quick mode leaves a complete result."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

from engines.flops import COSTS, Tape, count  # noqa: E402
from engines.python_peers import NumPyPopulation, PlainPython, SciPy  # noqa: E402
from engines.workloads import workload  # noqa: E402


def test_only_work_of_each_candidate_and_step_is_counted_and_once() -> None:
    tape = Tape()
    candidate, now, both = tape.number(2.0, 1), tape.number(3.0, 2), tape.number(4.0, 3)
    candidate * candidate + 1.0
    now * now
    assert not tape.counts
    assert (both * candidate + both * candidate).value == 16.0
    assert tape.counts == {"mul": 1, "add": 1}
    tape.xp.sin(both), tape.xp.cos(both)
    assert (tape.counts["reduce"], tape.counts["sin"], tape.counts["cos"]) == (1, 1, 1)


@pytest.mark.parametrize(("name", "low", "high"), [("A", 300, 700), ("B", 1000, 2500)])
def test_counted_flops_are_plausible_and_add_up(name: str, low: int, high: int) -> None:
    found = count(workload(name, 1, steps=60))
    flops = found.pop("flops")
    assert flops == sum(COSTS[kind] * times for kind, times in found.items())
    assert low < flops < high


@pytest.mark.parametrize("name", ["A", "B"])
def test_workload_fits_its_record_and_engines_agree(name: str) -> None:
    job = workload(name, 3, steps=200)
    theta = np.vstack([job.nominal, job.population(3, 4)])
    costs = PlainPython(job).costs(theta)
    samples = job.measured.size
    assert abs(costs[0] - samples) < 6 * math.sqrt(2 * samples)
    assert (costs[1:] > costs[0]).all()
    np.testing.assert_allclose(NumPyPopulation(job).costs(theta), costs, rtol=1e-12)
    np.testing.assert_allclose(SciPy(job).costs(theta), costs, rtol=0.05)


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, dict[str, Any], Path]:
    out = tmp_path_factory.mktemp("engine_speed")
    command = [sys.executable, str(ROOT / "experiments" / "engine_speed.py"), "--quick", "--out", str(out)]
    done = subprocess.run([*command, "--workers", "2"], capture_output=True, text=True)
    assert (out / "result.json").exists(), done.stderr
    return done.returncode, json.loads((out / "result.json").read_text()), out


@pytest.mark.slow
def test_quick_mode_writes_a_complete_result(quick: tuple[int, dict[str, Any], Path]) -> None:
    code, record, out = quick
    assert code == (1 if record["failures"] else 0)
    assert all(f["value"] is not None or f["note"] for f in record["figures"].values())
    for name in ("A", "B"):
        assert record["figures"][f"{name}: bound"]["value"] > 0
        for peer in ("numpy", "numba"):
            assert record["figures"][f"{name}: {peer} cost differs"]["met"] is True
        assert f"{name}, P=200: seatruth" in record["figures"]
    files = [*record["tables"].values(), *(file for group in record["pictures"].values() for file in group)]
    assert len(files) == 5
    assert all((out / file).stat().st_size > 0 for file in [*files, "summary.md"])
    assert str(ROOT) not in (out / "result.json").read_text() + (out / "summary.md").read_text()


@pytest.mark.slow
def test_quick_mode_measures_the_engine(quick: tuple[int, dict[str, Any], Path]) -> None:
    _, record, _ = quick
    assert record["failures"] == []
    for name in ("A", "B"):
        assert record["figures"][f"{name}, P=200: seatruth"]["value"] > 0
        assert record["figures"][f"{name}: seatruth cost differs"]["met"] is True
