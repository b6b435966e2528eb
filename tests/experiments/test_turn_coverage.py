"""The experiment on the coverage of predicted turns: its ships are the same each time, and one case goes through."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments"))

import turn_coverage as experiment

from seatruth.models import load_model


def test_ships_are_the_same_each_time_and_inside_the_bounds() -> None:
    model = load_model("mmg")
    for number in range(20):
        same, other, fresh = (experiment.ship(number, form) for form in experiment.FORMS)
        assert fresh["Y_v"] != other["Y_v"]
        assert same == experiment.ship(number, experiment.FORMS[0])
        assert all(model.parameter(name).min < value < model.parameter(name).max for name, value in same.items())
        assert set(other) - set(same) == set(experiment.TAKEN_AS_KNOWN)
        assert all(other[name] == value for name, value in same.items())


@pytest.mark.slow
def test_intervals_of_turns_predicted_from_zigzags_hold() -> None:
    """Four ships, seven figures each: of intervals that hold 95 %, fewer than 75 % would be one chance in thousands."""
    rows = [row for number in range(4) for row in experiment.case(experiment.FORMS[0], number)]
    known = [row for row in rows if math.isfinite(row["lower"])]
    assert len(known) >= 14
    inside = sum(row["lower"] <= row["true"] <= row["upper"] for row in known)
    assert inside >= 0.75 * len(known)
