"""A sensor that is farther away than its vehicle is long has a place in another unit."""

from __future__ import annotations

from dataclasses import replace

import pytest

import seatruth.sample
from seatruth.analysis import check_study
from seatruth.costs.sensor_places import far_sensors
from seatruth.models import Observation, observed
from seatruth.study import Study


def study(*at: float) -> Study:
    sample = seatruth.sample.load("study.toml")
    x, y, z = at
    return replace(sample, model=observed(sample.model, [Observation("u", at=(x, y, z))]))


@pytest.mark.parametrize("at", [(-500.0, 0.0, 0.0), (0.0, 0.0, -1200.0)])
def test_a_place_beyond_the_vehicle_is_told(at: tuple[float, float, float]) -> None:
    (found,) = [one for one in check_study(study(*at)) if one.code == "sensor-place"]
    assert (found.severity, found.channel) == ("warning", "u")
    assert f"{at[0]:g}, 0, {at[2]:g}" in found.message


def test_a_place_aboard_is_not() -> None:
    assert not far_sensors(study(1.0, 0.0, -1.0))
    assert not far_sensors(seatruth.sample.load("study.toml"))
