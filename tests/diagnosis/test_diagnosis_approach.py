"""Steps before sizes are set: forces give way to an effect that acts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import small_case as small

from seatruth.diagnosis.approach import stepped_under
from seatruth.diagnosis.search import search
from seatruth.diagnosis.steps import likelihood_at, objective
from seatruth.trials.trial import Trial


def test_under_the_sizes_of_the_model_alone_an_effect_takes_the_place_of_forces(
    ship_folder: Path, offset_runs: list[Trial]
) -> None:
    problem = small.problem(ship_folder, offset_runs)
    found, key = search(problem, small.silent), ("rudder_offset",)
    near, good = found.fits[(), True], found.fits[key, True]
    column = problem.columns["rudder_offset"]

    def height(point: object) -> float:
        at = problem.linearize(point, key)
        return objective(problem, point, at.errors, near.sizes, key, likelihood_at(problem, at, near.sizes, key))

    reached = stepped_under(problem, key, near.point, near.sizes, discrepancy=True)
    assert height(reached) < height(near.point)
    assert np.abs(near.point.shared[column]).max() == 0.0
    assert np.abs(reached.shared[column] / good.point.shared[column] - 1.0).max() < 0.2
    assert np.abs(reached.forces).max() < 0.5 * np.abs(near.point.forces).max()
