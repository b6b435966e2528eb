"""Whether a built-in ship's dimensions suit the log of a first study."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from seatruth.effects.vehicle import dimensions_of
from seatruth.models.base import Model
from seatruth.study.fields import Fields
from seatruth.study.infer_columns import InferredColumn
from seatruth.units import to_si

_GRAVITY = 9.81
_FASTEST = 0.6
"""Froude number beyond which a log is not that of a ship of the model's length. [S] The waves that a hull makes hold it
back beyond 0.4, unless it planes, which these models do not.
"""
_SPEEDS = ("u", "sog", "u_w", "v_n")
"""Channels that show how fast a vessel is, the plainest first."""


def too_fast_for_its_length(model: Model, fields: Fields, guesses: Mapping[str, InferredColumn]) -> list[str]:
    """What to do where a log is faster than a ship of the model's length: its values are those of a ship model."""
    size = dimensions_of(model) if model.kind == "ship" else None
    name = next((name for name in _SPEEDS if name in guesses), None)
    if size is None or not size.length > 0.0 or name is None:
        return []
    hit = guesses[name]
    factor, _ = to_si(hit.unit, "m/s")
    numbers = np.abs(np.asarray(fields[hit.column], dtype=np.float64)) * factor
    finite = numbers[np.isfinite(numbers)]
    fastest = float(np.quantile(finite, 0.95)) if finite.size else 0.0
    froude = fastest / math.sqrt(_GRAVITY * size.length)
    if not froude > _FASTEST:
        return []
    return [
        f"{hit.column!r} reaches {fastest:.3g} m/s, too fast for the ship of {size.length:.3g} m whose values "
        f"{model.name} has (Froude number {froude:.2g}): give your vessel's length, mass and coefficients in "
        "[parameters], or name your own model (docs/models.md)."
    ]
