"""What the tests of the diagnosis share: a small ship, and its trials with a rudder that stands off."""

from __future__ import annotations

from pathlib import Path

import pytest
import small_case as small

from seatruth.trials.trial import Trial


@pytest.fixture(scope="session")
def ship_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds the model of a user."""
    return small.folder_with_model(tmp_path_factory.mktemp("ship"))


@pytest.fixture(scope="session")
def plain_runs(ship_folder: Path) -> list[Trial]:
    """Trials in which no effect acts."""
    return small.trials(ship_folder)


@pytest.fixture(scope="session")
def offset_runs(ship_folder: Path) -> list[Trial]:
    """Trials in which the rudder stands off by small.OFFSET."""
    return small.trials(ship_folder, {"rudder_offset_angle": small.OFFSET}, specs=["rudder_offset"])
