"""Which effects are worth a fit."""

from __future__ import annotations

import boat_case as boat
import pytest
import small_case as small

from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.effects import available


@pytest.mark.slow
def test_currents_that_point_anywhere_are_tried_without_a_common_one() -> None:
    """Days whose currents cancel in the mean: no current that is the same in all leads there."""
    model, truth = boat.Boat(), {}
    own = available()["trial_current"].of_trials([f"run_{k}" for k in range(4)])
    for k, (north, east) in enumerate([(0.2, 0.0), (-0.2, 0.02), (0.0, 0.2), (0.02, -0.2)]):
        truth |= {f"trial_current_north_run_{k}": north, f"trial_current_east_run_{k}": east}
    angles = [{"delta": boat.zigzag(40, 0.3, 8.0)} for _ in range(4)]
    runs = boat.trials(model, angles, headings=(0.0, 2.0, 4.0, 5.0), effects=truth, specs=(own,))
    settings = Settings(most_effects=1)
    problem = Problem(boat.study(model, runs), [available()["current"], own], settings, threads=1)
    assert search(problem, small.silent).leader.effects == ("trial_current",)
