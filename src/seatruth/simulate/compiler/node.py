"""A number in the equations of a model: one operation of the graph, a variable or a constant.

A `Node` behaves like a number, so a model's plain functions run on nodes and record their equations. `level` says with
what a node varies, which decides where it is computed: once for each candidate (parameters only), once for each row
for all candidates (inputs and time only), or everywhere.

A comparison is a node of its own kind, a condition: true or false in each lane. It becomes a number, 1 or 0, wherever
equations calculate with it, as in Python.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from seatruth.simulate.compiler.operations import COMPARISONS

if TYPE_CHECKING:
    from seatruth.simulate.compiler.graph import Graph

CONSTANT: Final = 0
LANE: Final = 1
"""Varies with the candidate only: parameters."""
ROW: Final = 2
"""Varies with time only: inputs and the time itself."""
BOTH: Final = 3


class NotTraceable(TypeError):
    """The equations do something that only a plain number can do."""


class Node:
    """One operation (or leaf, or constant) that stands for a number in a model's equations."""

    __slots__ = ("args", "graph", "is_condition", "level", "op", "order", "value")
    __array_ufunc__ = None  # so that NumPy's scalars leave arithmetic with a node to the node

    def __init__(self, graph: Graph, op: str, args: tuple[Node, ...], value: Any, level: int, order: int) -> None:
        self.graph, self.op, self.args, self.value, self.level, self.order = graph, op, args, value, level, order
        self.is_condition: bool = op in COMPARISONS or (op == "select" and all(a.is_condition for a in args[1:]))

    def __repr__(self) -> str:
        if self.op == "constant":
            return repr(self.value)
        if self.op == "leaf":
            return f"{self.value[0]}[{self.value[1]}]"
        return f"{self.op}({', '.join(map(repr, self.args))})"

    __hash__ = object.__hash__

    def __add__(self, other: Any) -> Node:
        return self._do("add", self, other)

    def __radd__(self, other: Any) -> Node:
        return self._do("add", other, self)

    def __sub__(self, other: Any) -> Node:
        return self._do("sub", self, other)

    def __rsub__(self, other: Any) -> Node:
        return self._do("sub", other, self)

    def __mul__(self, other: Any) -> Node:
        return self._do("mul", self, other)

    def __rmul__(self, other: Any) -> Node:
        return self._do("mul", other, self)

    def __truediv__(self, other: Any) -> Node:
        return self._do("div", self, other)

    def __rtruediv__(self, other: Any) -> Node:
        return self._do("div", other, self)

    def __pow__(self, other: Any) -> Node:
        return self._do("pow", self, other)

    def __rpow__(self, other: Any) -> Node:
        return self._do("pow", other, self)

    def __mod__(self, other: Any) -> Node:
        """Python's modulo, whose result has the sign of the divisor: a - floor(a / b) b."""
        whole: Node = self.graph.make("floor", self / other)
        return self._do("sub", self, whole * other)

    def __rmod__(self, other: Any) -> Node:
        return self.graph.node(other).__mod__(self)

    def __neg__(self) -> Node:
        return self.graph.make("neg", self)

    def __pos__(self) -> Node:
        return self

    def __abs__(self) -> Node:
        return self.graph.make("abs", self)

    def __lt__(self, other: Any) -> Node:
        return self._do("lt", self, other)

    def __le__(self, other: Any) -> Node:
        return self._do("le", self, other)

    def __gt__(self, other: Any) -> Node:
        return self._do("gt", self, other)

    def __ge__(self, other: Any) -> Node:
        return self._do("ge", self, other)

    def __eq__(self, other: object) -> Any:
        return self._do("eq", self, other)

    def __ne__(self, other: object) -> Any:
        return self._do("ne", self, other)

    def __and__(self, other: Any) -> Node:
        return self._logic("mul", other)

    def __or__(self, other: Any) -> Node:
        return self._logic("add", other)

    def __xor__(self, other: Any) -> Node:
        return self._logic("sub", other)

    __rand__, __ror__, __rxor__ = __and__, __or__, __xor__

    def __bool__(self) -> bool:
        return self.graph.decide(self)

    def __float__(self) -> float:
        if self.op == "constant":
            return float(self.value)
        raise NotTraceable("it turns a variable into a plain float")

    def __int__(self) -> int:
        """1 or 0 for a condition, as in `table[s.r > 0]`: an `if` on it. A variable number cannot become an integer."""
        if self.op == "constant":
            return int(self.value)
        if self.is_condition:
            return int(self.graph.decide(self))
        raise NotTraceable("it turns a variable into an integer")

    def __index__(self) -> int:
        if self.op == "constant" and not float(self.value).is_integer():
            raise NotTraceable("it takes a number with a fraction for a place in a table")
        return int(self)

    def _do(self, op: str, a: Any, b: Any) -> Node:
        return self.graph.make(op, self.graph.node(a), self.graph.node(b))

    def _logic(self, op: str, other: Any) -> Node:
        """`a & b`, `a | b`, `a ^ b` of two conditions: their product, sum, difference as numbers is not zero."""
        if not (self.is_condition and (isinstance(other, bool) or (isinstance(other, Node) and other.is_condition))):
            raise NotTraceable("it combines numbers with &, | or ^, which only conditions can do")
        return self.graph.make("ne", self._do(op, self, other), self.graph.node(0.0))


def is_constant(node: Node, value: float) -> bool:
    """Whether a node is this constant (zeros of both signs are equal)."""
    return node.op == "constant" and bool(node.value == value)


def ordered(roots: Iterable[Node]) -> list[Node]:
    """Every node that the roots depend on, and they themselves; arguments come before what uses them."""
    seen: dict[int, Node] = {}
    open_nodes = list(roots)
    while open_nodes:
        node = open_nodes.pop()
        if id(node) not in seen:
            seen[id(node)] = node
            open_nodes.extend(node.args)
    return sorted(seen.values(), key=lambda node: node.order)


def leaves_among(nodes: Sequence[Node], leaves: Mapping[int, int]) -> dict[int, int] | None:
    """Places of the nodes that are some leaves (by `id`), each with that leaf's number; None if others use these."""
    rest = ordered(node for node in nodes if id(node) not in leaves)
    if any(id(node) in leaves for node in rest):
        return None
    return {place: leaves[id(node)] for place, node in enumerate(nodes) if id(node) in leaves}
