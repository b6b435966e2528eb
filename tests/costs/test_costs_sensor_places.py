"""A sensor that is farther away than its vehicle is long has a place in another unit."""

from __future__ import annotations

from dataclasses import replace

import pytest

import seatruth.sample
from seatruth.analysis import check_study
from seatruth.costs.sensor_places import far_sensors, receiver_in_two_places
from seatruth.models import Observation, observed
from seatruth.study import Study
from seatruth.trials import Trial


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


def placed(sample: Study, trials: list[Trial], observations: list[Observation]) -> Study:
    model = observed(sample.model, observations)
    return replace(sample, model=model, trials=trials, noise={})


def test_one_receiver_in_two_places_is_told() -> None:
    """Of a ship whose antenna is aft, the `at` of its course and speed over ground was forgotten."""
    sample, aft = seatruth.sample.load("study.toml"), (-3.0, 0.2, -1.0)
    base = [Observation(name, at=aft) for name in ("x", "y")]
    outputs = {**sample.trials[0].outputs, "v_n": sample.trials[0].outputs["u"]}
    trials = [replace(sample.trials[0], outputs=outputs)]
    forgotten = placed(sample, trials, [*base, Observation("v_n")])
    (found,) = receiver_in_two_places(forgotten)
    assert (found.severity, found.channel) == ("note", "v_n")
    assert "a receiver at [-3, 0.2, -1] m" in found.message
    assert "one at the model's origin" in found.message
    both = placed(sample, trials, [*base, Observation("v_n", at=aft)])
    assert receiver_in_two_places(both) == []
    assert receiver_in_two_places(sample) == []
