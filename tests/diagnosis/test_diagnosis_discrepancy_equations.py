"""The equations in which forces may be missing."""

from __future__ import annotations

import boat_case as boat

from seatruth.diagnosis.discrepancy.equations import acceleration_unit, equations


def test_equations_are_those_of_the_motion() -> None:
    assert equations(boat.Boat()) == {"u": "surge", "v": "sway", "r": "yaw"}


def test_units() -> None:
    assert acceleration_unit(boat.Boat(), "u") == "m/s2"
    assert acceleration_unit(boat.Boat(), "r") == "rad/s2"
