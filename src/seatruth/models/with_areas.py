"""A model whose areas above water are known."""

from __future__ import annotations

import math
from copy import copy
from typing import TypeVar

from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox

M = TypeVar("M", bound=Model)


def with_areas(model: M, *, frontal_area: float | None = None, lateral_area: float | None = None) -> M:
    """A copy of a model in whose dimensions these areas above water stand; wind then need not estimate them.

    Args:
        model: a model that declares its dimensions.
        frontal_area: area above water seen from ahead, m2; None leaves what the model says.
        lateral_area: the same seen from the side.

    Returns:
        The copy; `model` stays as it is.

    Raises:
        BadInput: an area is not positive, or the model declares no dimensions.

    Example:
        >>> from seatruth import load_model
        >>> from seatruth.effects import dimensions_of
        >>> from seatruth.models import with_areas
        >>> dimensions_of(with_areas(load_model("mmg"), lateral_area=0.9)).lateral_area
        0.9
    """
    where = f"model {model.name!r}"
    stated = {"frontal_area": frontal_area, "lateral_area": lateral_area}
    areas = {name: area for name, area in stated.items() if area is not None}
    for name, area in areas.items():
        if not (math.isfinite(area) and area > 0.0):
            raise BadInput(f"{name} of {area} m2 is not possible", where=where, do="Give a positive number.")
    found, dimensions = copy(model), model.dimensions
    if not areas:
        return found
    if dimensions is None:
        raise BadInput(
            "areas above water belong to a size, and the model declares no dimensions",
            where=where,
            do="Give a simulator [model.dimensions], or a model of Python `dimensions(p)`; or leave the areas out.",
        )
    found.dimensions = lambda p: dimensions(p)._replace(**areas)
    if isinstance(found, BlackBox) and found.base is not None:  # effects on a black box ask the innermost one
        found.base = with_areas(found.base, **areas)
    return found
