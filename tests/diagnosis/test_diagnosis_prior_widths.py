"""Standard deviations of the priors of all shared unknowns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import small_case as small

from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.trials.trial import Trial


def test_only_the_magnitudes_of_an_effect_are_wider_and_what_is_believed_stays(
    ship_folder: Path, offset_runs: list[Trial]
) -> None:
    plain = small.problem(ship_folder, offset_runs)
    wider = Problem(
        plain.study, list(plain.effects.values()), Settings(wider=(("rudder_offset", 5.0), ("no_effect", 9.0)))
    )
    own = plain.columns["rudder_offset"]
    assert np.array_equal(wider.believed_sd, plain.believed_sd)
    assert np.array_equal(plain.sd, plain.believed_sd)
    assert np.array_equal(wider.sd[own], 5.0 * plain.sd[own])
    others = np.delete(np.arange(len(plain.sd)), own)
    assert np.array_equal(wider.sd[others], plain.sd[others])


def test_a_typical_magnitude_is_a_part_of_its_deviation(ship_folder: Path, offset_runs: list[Trial]) -> None:
    problem = small.problem(ship_folder, offset_runs)
    (offset,) = load_effects(["rudder_offset"])
    typical = offset.priors(problem.study.model)["angle"].sd
    assert problem.sd[problem.columns["rudder_offset"]].tolist() == [Settings().prior_width * typical]
