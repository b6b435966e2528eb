"""A direction on the earth that trials share where whole runs say nothing."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from searched_by_hand import searched

from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.shared_directions import is_shared
from seatruth.trials.trial import Trial

ALL = np.array([130.0, 95.0, 5.0])


def courses(*degrees: float) -> list[Trial]:
    """Short straight runs on these courses."""
    t = np.arange(0.0, 10.0)
    angles = np.radians(degrees)
    runs = [{"x": t * np.cos(psi), "y": t * np.sin(psi), "psi": np.full(t.size, psi)} for psi in angles]
    return [Trial(f"run {k}", t, {}, run) for k, run in enumerate(runs)]


def shared(
    found: Search, name: str = "current", gains: np.ndarray = ALL, on: tuple[float, ...] = (0.0, 90.0, 200.0)
) -> bool:
    cast(Any, found.problem).trials = courses(*on)
    return is_shared(found, name, found.leader, lambda name, key: gains)


@pytest.fixture
def found() -> Search:
    """A current explains more than one of its own in each trial."""
    sets: dict[Key, float] = {(): 0.0, ("current",): 974.0, ("trial_current",): 962.0}
    return searched(sets)


def test_a_current_on_which_all_trials_agree_is_shared(found: Search) -> None:
    assert shared(found)


def test_it_is_not_where_one_trial_is_as_well_without_it(found: Search) -> None:
    assert not shared(found, gains=np.array([130.0, 95.0, 2.0]))
    assert not shared(found, gains=np.array([130.0]))


def test_it_is_not_where_all_trials_are_on_one_course(found: Search) -> None:
    assert not shared(found, on=(10.0, 12.0, 15.0))


def test_it_is_not_where_a_current_of_its_own_in_each_trial_explains_more() -> None:
    """Nor where that was not fitted."""
    each = searched({(): 0.0, ("current",): 970.0, ("trial_current",): 975.0})
    cast(Any, each.problem).trials = courses(0.0, 90.0, 200.0)
    assert not is_shared(each, "current", each.fits[("current",), True], lambda name, key: ALL)
    assert not shared(searched({(): 0.0, ("current",): 970.0}))


def test_what_has_no_direction_is_not(found: Search) -> None:
    assert not shared(searched({(): 0.0, ("rudder_lag",): 900.0}), name="rudder_lag")
