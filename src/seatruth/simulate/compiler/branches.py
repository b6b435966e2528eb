"""Follows the conditions of a function every way, and merges what it returns.

The conditions of each plain function that a model calls are merged where it returns, not where the whole equations end:
six thrusters of three branches each have 18 ways, not 3^6.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from seatruth.simulate.compiler.graph import Graph
from seatruth.simulate.compiler.node import Node, NotTraceable

MOST_WAYS = 1024
"""Ways through the conditions of one function: ten conditions that are all independent. Chosen here [S]."""
_CHANGEABLE = (list, dict, set, np.ndarray)

Returned = TypeVar("Returned")


class NotMergeable(Exception):
    """What two ways return are not two numbers, nor the same structure of numbers."""


def every_way(
    graph: Graph, call: Callable[[], Returned], merge: Callable[[Node, Returned, Returned], Returned]
) -> Returned:
    """What `call` returns along every way through the conditions that are open when it begins, merged by `merge`.

    Conditions that were decided before stay as they are. Raises NotTraceable where there are more than `MOST_WAYS`.
    """
    known, planned_before, asked = graph.path, graph.planned, graph.asked
    decided = tuple(way for _, way in known)
    runs = 0

    def follow(planned: tuple[bool, ...]) -> Returned:
        nonlocal runs
        runs += 1
        if runs > MOST_WAYS:
            raise NotTraceable(
                f"there are more than {MOST_WAYS} ways through its conditions: put those of each part, such as a "
                "thruster, into a function that returns what they decide"
            )
        graph.path, graph.planned, graph.asked = list(known), (*decided, *planned), asked
        result = call()
        met = graph.path[len(known) :]
        # The last open decision is reversed first, so that the innermost conditions merge first.
        for depth in range(len(met) - 1, len(planned) - 1, -1):
            other = follow((*(way for _, way in met[:depth]), False))
            result = merge(met[depth][0], result, other)
        return result

    try:
        return follow(())
    finally:
        graph.path, graph.planned, graph.asked = known, planned_before, asked


def merging(graph: Graph, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function of nodes whose conditions are followed and merged by themselves, where that is possible.

    It is not where the function is given what it may change (a second run would change it again), and where its ways
    return what is no number: the equations that call it are then followed along each of its ways.
    """
    alone = True

    def called(*args: Any, **named: Any) -> Any:
        nonlocal alone
        if alone and not any(_may_change(value) for value in (*args, *named.values())):
            try:
                return every_way(graph, lambda: function(*args, **named), lambda *parts: _merged(graph, *parts))
            except NotMergeable:
                alone = False
        return function(*args, **named)

    called.__name__ = getattr(function, "__name__", "function")
    return called


def _may_change(value: Any) -> bool:
    if type(value) is tuple:
        return any(_may_change(item) for item in value)
    return isinstance(value, _CHANGEABLE)


def _merged(graph: Graph, condition: Node, yes: Any, no: Any) -> Any:
    """`yes if condition else no`, number by number."""
    if yes is no:
        return yes
    if isinstance(yes, (tuple, list)) and type(yes) is type(no) and len(yes) == len(no):
        parts = [_merged(graph, condition, a, b) for a, b in zip(yes, no)]
        return type(yes)(*parts) if hasattr(yes, "_fields") else type(yes)(parts)
    if type(yes) is type(no) and isinstance(yes, (bool, int, float, str)) and repr(yes) == repr(no):
        return yes
    # Two whole numbers may be places in a table, and truth values are conditions: they must stay what they are.
    if _is_number(yes) and _is_number(no) and any(isinstance(value, (Node, float)) for value in (yes, no)):
        return graph.select(condition, graph.node(yes), graph.node(no))
    raise NotMergeable


def _is_number(value: Any) -> bool:
    return isinstance(value, (Node, int, float)) and not isinstance(value, bool)
