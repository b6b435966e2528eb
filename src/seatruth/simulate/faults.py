"""Whether the equations of a model are such that the engine can take them, before anything is simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from seatruth.errors import SeatruthError
from seatruth.models.actuators import Thruster
from seatruth.models.base import Environment, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.geometry import Dimensions
from seatruth.simulate.compiler.graph import Graph
from seatruth.simulate.compiler.node import BOTH, Node
from seatruth.simulate.compiler.trace import Shims, explored, trace


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
        _try_vehicle(model)
    except SeatruthError as problem:
        return problem
    return None


def _try_vehicle(model: Model) -> None:
    """Tries what a model declares for effects alone: its dimensions, thrust, thrusts and drag.

    Effects call these within the equations. So PluginError is raised, with the file and line, where one of them cannot
    be compiled or does not give what it should.
    """
    graph = Graph()

    def leaves(kind: str, channels: Sequence[Any]) -> tuple[Node, ...]:
        return tuple(graph.leaf(kind, k, BOTH) for k in range(len(channels)))

    s = record("States", model.states)(*leaves("state", model.states))
    i = record("Inputs", model.inputs)(*leaves("input", model.inputs))
    p = record("Parameters", model.parameters)(*leaves("parameter", model.parameters))
    thrusters = [one for one in model.actuators if isinstance(one, Thruster)]

    dimensions = model.dimensions
    if dimensions is not None:

        def sizes(p: Any) -> tuple[Any, ...]:
            return tuple(value for value in Dimensions(*dimensions(p)) if value is not None)

        explored(graph, model, "dimensions", Shims(graph).rebuilt(sizes), (p,), None)
    for role, one in (("thrust", model.thrust), ("drag", model.drag)):
        if one is not None:
            explored(graph, model, role, _alone(Shims(graph).rebuilt(one)), (s, i, p, Environment()), 1)
    if model.thrusts is not None:
        arguments = s, i, p, Environment()
        explored(graph, model, "thrusts", Shims(graph).rebuilt(model.thrusts), arguments, len(thrusters))


def _alone(function: Callable[..., Any]) -> Callable[..., tuple[Any]]:
    """The same, for a function that gives one value, which stands alone."""

    def value(*arguments: Any) -> tuple[Any]:
        return (function(*arguments),)

    return value
