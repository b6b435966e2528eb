"""Angles that jump and commands that step, as a first study says it."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.study.infer_columns import InferredColumn
from seatruth.study.template_courses import is_held, jumps_by_a_turn

T = np.arange(0.0, 100.0, 0.1)
STEPS = np.where(T % 20.0 < 10.0, 1500.0, 1650.0) + (np.arange(T.size) % 2)
"""Pulses of an autopilot that holds its depth: they step, and change by 1 us all the time."""


@pytest.mark.parametrize(
    ("numbers", "unit", "order", "held"),
    [
        (STEPS, "us", False, True),
        ((STEPS - 1500.0) / 400.0, "1", False, True),
        (STEPS, "rpm", False, False),
        (1500.0 + 100.0 * np.sin(T), "us", False, False),
        (np.sin(T), "deg", True, True),
    ],
)
def test_commands_that_step_are_held(numbers: np.ndarray, unit: str, order: bool, held: bool) -> None:
    guessed = InferredColumn("c_1", "c", unit, "", order)
    assert is_held({"c": numbers}, guessed) is held


def test_a_heading_that_wraps_jumps() -> None:
    guessed = InferredColumn("psi", "h", "deg", "")
    assert jumps_by_a_turn({"h": (10.0 * T) % 360.0}, guessed, False)
    assert not jumps_by_a_turn({"h": T}, guessed, False)
    assert jumps_by_a_turn({"h": T}, guessed, True)
