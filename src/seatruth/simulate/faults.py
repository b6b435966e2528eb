"""Whether the equations of a model are such that the engine can take them, before anything is simulated."""

from __future__ import annotations

from seatruth.errors import SeatruthError
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.simulate.compiler.trace import trace, trace_vehicle


def fault_of(model: Model) -> SeatruthError | None:
    """What is wrong with the equations of a model, with the file and the line; None where nothing is.

    These are its rates and outputs, and what it declares for effects: dimensions, thrust, thrusts and drag. Every way
    through their conditions is followed once. A black box has no equations to look at.

    Example:
        >>> from seatruth.models import load_model
        >>> fault_of(load_model("mmg")) is None
        True
    """
    if isinstance(model, BlackBox):
        return None
    try:
        trace(model)
        trace_vehicle(model)
    except SeatruthError as problem:
        return problem
    return None
