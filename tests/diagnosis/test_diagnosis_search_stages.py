"""What a search tries beside a leading set, and what stays of it where a stage fails."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis import search as search_module
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.effects import available
from seatruth.trials.trial import Trial


def test_the_first_of_each_family_is_added_to_a_set_whatever_stands_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ranked = ["rudder_dead_band", "rudder_lag", "thruster_lag", "rudder_offset", "wind", "current", "gyro_bias"]
    monkeypatch.setattr(search_module, "screen", lambda *_: ranked)
    problem = SimpleNamespace(effects=available(), settings=Settings(additions=3))
    values = {(name,): -100.0 * k for k, name in enumerate(ranked)}
    faked = SimpleNamespace(problem=problem, expected=values.__getitem__)
    chosen = search_module._additions(faked, SimpleNamespace(effects=()))
    assert chosen == ["rudder_dead_band", "rudder_lag", "thruster_lag", "wind", "current", "gyro_bias"]


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("waves_beside", "waves"),
        ("_additions", "effects beside rudder_offset"),
        ("_refit_parts", "parts of the leading sets"),
        ("nest", "sets within others"),
    ],
)
def test_where_the_algebra_of_a_stage_fails_the_fits_stay(
    ship_folder: Path, offset_runs: list[Trial], monkeypatch: pytest.MonkeyPatch, name: str, what: str
) -> None:
    """Of a boat in wind four minutes were lost to one matrix: the model alone was said not to be fitted."""

    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    monkeypatch.setattr(search_module, name, fails)
    got = search(small.problem(ship_folder, offset_runs, ["rudder_offset", "gyro_bias"]), small.silent)
    assert got.leader.effects == ("rudder_offset",)
    assert got.failed[what,] == "Matrix is not positive definite"
