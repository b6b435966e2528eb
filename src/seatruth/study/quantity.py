"""Numbers with units as a study file writes them: 0.5 in SI units, or "2.3 deg/s"."""

from __future__ import annotations

import math
import re

from seatruth.errors import BadInput
from seatruth.units import to_si

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")

_NONE = ("", "1")
"""Units of numbers without one."""


def quantity(value: float | str, unit: str) -> float | None:
    """The number in `unit` that a study file states; None where text is no number with a unit.

    Units with another zero (degC) convert by their factor alone: what is stated is a size, not a place on a scale.
    Raises BadInput for an unknown unit, one of another dimension, and text without the unit of a quantity that has one.

    Example:
        >>> from seatruth.study.quantity import quantity
        >>> round(quantity("2.3 deg/s", "rad/s"), 4)
        0.0401
    """
    if not isinstance(value, str):
        return float(value)
    match = _QUANTITY.fullmatch(value)
    if match is None:
        return None
    if match.group(2):
        return float(match.group(1)) * to_si(match.group(2), unit).factor
    if unit not in _NONE:
        raise BadInput(
            f'"{value}" is text without a unit',
            do=f'Write the unit, as in "{match.group(1)} {unit}", or the number alone, which is in {unit}.',
        )
    return float(match.group(1))


def number(value: float | str, unit: str) -> float:
    """The same as `quantity`, with BadInput for text that is no number with a unit."""
    found = quantity(value, unit)
    if found is None:
        raise BadInput(f'"{value}" is no number with a unit', do=f'Write it as "0.1 {unit}".')
    return found


def positive(value: float | str, unit: str, what: str) -> float:
    """A number > 0 in `unit`; BadInput says what it should have been."""
    found = number(value, unit)
    if not (math.isfinite(found) and found > 0):
        raise BadInput(f"{what} of {value} is not possible", do="Give a positive number.")
    return found
