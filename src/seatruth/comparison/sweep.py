"""A solver with several values of its options, as one entry of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

from seatruth.errors import BadInput

_MOST = 200
"""Solvers that one sweep may make. Chosen here [S]: a typing error must not start thousands of searches."""


def swept(sweep: Mapping[str, Sequence[Any]], where: str = "sweep") -> list[tuple[str, dict[str, Any]]]:
    """All combinations of the options' values: a label such as "particles = 20, omega = 1" and the options.

    Args:
        sweep: by option its values.
        where: named in errors.

    Raises:
        BadInput: an option has no list of values, or there are too many combinations.

    Example:
        >>> swept({"particles": [20, 50], "omega": [1.0]})[1]
        ('particles = 50, omega = 1.0', {'particles': 50, 'omega': 1.0})
    """
    size = 1
    for name, values in sweep.items():
        if isinstance(values, str) or not isinstance(values, Sequence) or not values:
            raise BadInput(f"{name!r} has no list of values", where=where, do=f"Write {name} = [value, value].")
        size *= len(values)
    if not sweep or size > _MOST:
        raise BadInput(f"it makes {size if sweep else 0} solvers", where=where, do=f"Ask for 1 to {_MOST}.")
    return [
        (", ".join(f"{name} = {value}" for name, value in zip(sweep, chosen)), dict(zip(sweep, chosen)))
        for chosen in product(*sweep.values())
    ]
