"""What an error of a sensor explains of trials left out in the channels of that sensor."""

from __future__ import annotations

from pathlib import Path

import pytest
import small_case as small

from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.search import search
from seatruth.diagnosis.sensor_errors import errors_of_sensor

EFFECTS = ("gyro_scale", "rudder_offset")


@pytest.fixture(scope="module")
def found(ship_folder: Path) -> Search:
    """A search on a ship whose gyro reads 10 % too much."""
    runs = small.trials(ship_folder, {"gyro_scale_k": 0.1}, specs=EFFECTS)
    return search(small.problem(ship_folder, runs, EFFECTS), small.silent)


def test_an_error_of_the_gyro_closes_what_terms_leave_of_the_rate(found: Search) -> None:
    errors = errors_of_sensor(found, "gyro_scale", ("gyro_scale",))
    assert len(errors) == len(found.problem.trials)
    for one in errors[:3]:  # the small steps of the last one hardly turn the ship
        assert one.without > 1.3 * one.noise
        assert one.having < 1.1 * one.noise
        assert one.noise == pytest.approx(1.0, abs=0.2)


def test_of_what_is_no_sensor_or_was_not_fitted_with_terms_nothing_is_said(
    found: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert errors_of_sensor(found, "rudder_offset", ("rudder_offset",)) == []
    monkeypatch.delitem(found.fits, (("gyro_scale",), True))
    assert errors_of_sensor(found, "gyro_scale", ("gyro_scale",)) == []
