"""The recorded channels on whose sensors an effect acts."""

from __future__ import annotations

from pathlib import Path

import small_case as small

from seatruth.diagnosis.sensor_channels import sensor_channels


def test_an_error_of_a_sensor_has_its_channel_and_a_rudder_none(ship_folder: Path) -> None:
    problem = small.problem(ship_folder, small.trials(ship_folder))
    assert list(problem.outputs) == ["r", "psi"]
    assert [sensor_channels(problem, name) for name in ("gyro_bias", "heading_bias", "rudder_offset")] == [[0], [1], []]
