"""How the numbers of a log run on, as far as a first study says it: angles that jump by a turn, commands that step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from seatruth.costs.stepped_orders import steps_from_rest
from seatruth.study.infer_columns import InferredColumn
from seatruth.units import PULSES

Numbers = NDArray[np.float64]
ANGLES = ("psi", "phi", "theta")
"""Angles that may jump by a turn."""


def jumps_by_a_turn(columns: Mapping[str, Numbers], guessed: InferredColumn, others: bool) -> bool:
    """Whether an angle jumps by most of a turn; a heading that stays within one may do so in other logs."""
    numbers, turn = columns[guessed.column], 360.0 if guessed.unit == "deg" else 2.0 * np.pi
    numbers = numbers[np.isfinite(numbers)]
    jumps = np.abs(np.diff(numbers))
    within = others and guessed.channel == "psi" and bool(numbers.size) and float(np.abs(numbers).max()) <= turn
    return within or (bool(jumps.size) and float(jumps.max()) > 0.75 * turn)


def is_held(columns: Mapping[str, Numbers], guessed: InferredColumn) -> bool:
    """Whether an input keeps its value until the next sample: it is an order, or a command that steps.

    A command has no unit, or is a pulse: no actuator moves so, as it may where the column holds an angle or a speed.
    """
    if guessed.order:
        return True
    numbers = columns[guessed.column]
    return guessed.unit in ("1", *PULSES) and steps_from_rest(numbers[np.isfinite(numbers)]) > 0
