"""What stays of a search where one of its stages fails."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis import search as search_module
from seatruth.diagnosis.search import search
from seatruth.trials.trial import Trial


@pytest.mark.parametrize(
    ("name", "what"),
    [
        pytest.param("waves_beside", "waves", marks=pytest.mark.slow),
        ("additions", "effects beside rudder_offset"),
        pytest.param("_refit_parts", "parts of the leading sets", marks=pytest.mark.slow),
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
