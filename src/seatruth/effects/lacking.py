"""What a model does not tell of its vehicle, for want of which effects cannot act on it."""

from __future__ import annotations

from seatruth.effects import available
from seatruth.effects.base import NO_ENVIRONMENT, NO_PARAMETER, UNDECLARED
from seatruth.models.base import Model

_TOLD = (UNDECLARED, NO_ENVIRONMENT, NO_PARAMETER)
_OF_A_BOX = "black box"
"""In every reason that ports would do away with (`port_needs`)."""


def lacking(model: Model) -> dict[str, list[str]]:
    """Reasons that lie in what a model declares, each with the effects that cannot act on it for that.

    What a model of its kind never has, as the planes of a ship, is none.

    Example:
        >>> from seatruth.models import load_model
        >>> lacking(load_model("mmg"))
        {}
    """
    found: dict[str, list[str]] = {}
    for name, effect in available().items():
        reason = effect.missing(model)
        if reason.startswith(_TOLD) or _OF_A_BOX in reason:
            found.setdefault(reason, []).append(name)
    return found
