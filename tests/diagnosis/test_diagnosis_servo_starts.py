"""Where actuators behind servos stand when a trial, or a section of it, begins."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_diagnosis_actuator_starts import problem, runs

from seatruth.diagnosis.settings import Settings
from seatruth.models.base import whole_name
from seatruth.trials.trial import Trial


@pytest.fixture(scope="module")
def whole(ship_folder: Path) -> list[Trial]:
    """From the first sample on."""
    return runs(ship_folder)


def test_an_actuator_begins_as_far_from_its_order_as_it_usually_is(ship_folder: Path, whole: list[Trial]) -> None:
    at = problem(ship_folder, whole)
    place = at.initial_names.index("delta_acting")
    column = [channel.name for channel in at.model.states].index("delta_acting")
    motions = at.states(at.start)
    behind = np.concatenate([np.asarray(t.inputs["delta"]) - x[:, column] for t, x in zip(at.trials, motions)])
    assert at.initial_sd[place] == pytest.approx(np.sqrt(np.mean(behind**2)))
    anywhere = problem(ship_folder, whole, Settings(near_orders=False))
    assert anywhere.initial_sd[place] == pytest.approx(math.radians(40.0))
    assert at.initial_sd[place] < 0.3 * anywhere.initial_sd[place]
    others = [k for k in range(len(at.initial_names)) if k != place]
    np.testing.assert_array_equal(at.initial_sd[others], anywhere.initial_sd[others])


def test_an_actuator_that_never_lags_still_has_some_room(ship_folder: Path, whole: list[Trial]) -> None:
    steady = [replace(trial, inputs={"delta": np.full(len(trial), 0.2)}) for trial in whole]
    at = problem(ship_folder, steady)
    assert at.initial_sd[at.initial_names.index("delta_acting")] == pytest.approx(0.01 * 0.2)


def test_a_section_begins_with_its_actuators_where_they_are_in_the_whole_trial(
    ship_folder: Path, whole: list[Trial]
) -> None:
    """A gear of 1.5 deg/s is far from its order in the middle of a zigzag."""
    at, cut = problem(ship_folder, whole), problem(ship_folder, whole, Settings(sections=2))
    column = [channel.name for channel in at.model.states].index("delta_acting")
    motions = {trial.name: (trial.t, x[:, column]) for trial, x in zip(at.trials, at.states(at.start))}
    place = cut.initial_names.index("delta_acting")
    assert len(cut.trials) == 2 * len(whole)
    away = []
    for trial, first in zip(cut.trials, cut.start.initial[:, place]):
        t, acting = motions[whole_name(trial.name)]
        assert first == pytest.approx(np.interp(trial.t[0], t, acting), abs=math.radians(1.0))
        away.append(abs(first - trial.inputs["delta"][0]))
    assert max(away) > math.radians(3.0)
    np.testing.assert_array_equal(cut.start.initial[::2, place], at.start.initial[:, place])
