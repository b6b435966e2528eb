"""The equations of a model as a graph of operations, simplified and without duplicates.

A `Node` behaves like a number, so a model's plain functions run on nodes and record their equations. Equal operations
on equal arguments are one node. `level` says with what a node varies, which decides where it is computed: once for
each candidate (parameters only), once for each row for all candidates (inputs and time only), or everywhere.

A comparison is a node of its own kind, a condition: true or false in each lane. It becomes a number, 1 or 0, wherever
equations calculate with it, as in Python.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from seatruth.simulate.compiler.operations import COMPARISONS, fold

CONSTANT: Final = 0
LANE: Final = 1
"""Varies with the candidate only: parameters."""
ROW: Final = 2
"""Varies with time only: inputs and the time itself."""
BOTH: Final = 3

_LARGEST_POWER = 16
"""Up to here whole and half powers are multiplied out: at most eight multiplications. Chosen here [S]."""


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


class Graph:
    """Makes nodes: folds constants, shares equal nodes, and groups factors that are constant for a candidate."""

    most_decisions = 64
    """Conditions on variables that one run of the equations may branch on. Chosen here [S]."""
    most_questions = 100_000
    """How often one run may ask for the truth of a condition: `while s.r:` asks for ever. Chosen here [S]."""
    most_nodes = 20_000
    """Operations of one model; the largest built-in one has 1300, a ship with 36 effects 2900. Chosen here [S]: so
    many take 4 s of processor time to compile with their derivatives, which grows faster than their number."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[Any, ...], Node] = {}
        self.path: list[tuple[Node, bool]] = []
        """Conditions met in this run of the equations, and the way taken at each; see `trace`."""
        self.planned: tuple[bool, ...] = ()
        """Ways to take at the first conditions of this run."""
        self.asked = 0

    def node(self, value: Any) -> Node:
        """A number as a node."""
        if isinstance(value, Node):
            return value
        if isinstance(value, (bool, int, float)) or (hasattr(value, "dtype") and getattr(value, "ndim", 1) == 0):
            return self._keep("constant", (), float(value), CONSTANT)
        raise NotTraceable(f"it mixes variables with {type(value).__name__}")

    def leaf(self, kind: str, index: int, level: int) -> Node:
        """A variable: state, input, parameter, time, or a direction of one."""
        return self._keep("leaf", (), (kind, index), level)

    def decide(self, condition: Node) -> bool:
        """Which way an `if` goes in this run: as planned, else true first; `trace` explores the other way later."""
        test = self.condition(condition)
        if test.op == "constant":
            return bool(test.value)
        self.asked += 1
        if self.asked > self.most_questions:
            raise NotTraceable("a loop depends on its variables without end")
        for earlier, way in self.path:
            if earlier is test:
                return way
        way = self.planned[len(self.path)] if len(self.path) < len(self.planned) else True
        self.path.append((test, way))
        if len(self.path) > self.most_decisions:
            raise NotTraceable("a loop or a chain of `if` depends on its variables without end")
        return way

    def number(self, value: Any) -> Node:
        """A number as a node; a condition becomes 1 or 0."""
        node = self.node(value)
        return self._choose(node, self.node(1.0), self.node(0.0)) if node.is_condition else node

    def condition(self, value: Any) -> Node:
        """A node as a condition (or a constant): a number is true where it is not zero."""
        node = self.node(value)
        return node if node.is_condition or node.op == "constant" else self.make("ne", node, self.node(0.0))

    def make(self, op: str, *args: Node) -> Node:
        """The node of an operation on numbers, simplified."""
        args = tuple(self.number(a) if a.is_condition else a for a in args)
        if all(a.op == "constant" for a in args):
            folded = fold(op, [a.value for a in args])
            if folded is not None:
                return self.node(folded)
        simple = self._simplify(op, args)
        if simple is not None:
            return simple
        level = 0
        for a in args:
            level |= a.level
        return self._keep(op, args, None, level)

    def select(self, condition: Node, yes: Node, no: Node) -> Node:
        """`yes if condition else no`, as deep in the two as they differ: f(a) or f(b) is f(a or b)."""
        return self._merge(self.condition(condition), yes, no, {})

    def smaller(self, a: Node, b: Node) -> Node:
        """min(a, b) as Python has it: b if b < a else a, so that NaN in a stays."""
        return self._choose(self.make("lt", b, a), b, a)

    def larger(self, a: Node, b: Node) -> Node:
        """max(a, b) as Python has it: b if b > a else a."""
        return self._choose(self.make("gt", b, a), b, a)

    def _merge(self, condition: Node, yes: Node, no: Node, done: dict[tuple[int, int], Node]) -> Node:
        if yes is no:
            return yes
        key = (id(yes), id(no))
        if key in done:
            return done[key]
        same = yes.op == no.op and len(yes.args) == len(no.args) and yes.args
        if same and yes.op not in COMPARISONS:
            parts = [self._merge(condition, a, b, done) for a, b in zip(yes.args, no.args)]
            result = self._choose(*parts) if yes.op == "select" else self.make(yes.op, *parts)
        else:
            result = self._choose(condition, yes, no)
        done[key] = result
        return result

    def _choose(self, condition: Node, yes: Node, no: Node) -> Node:
        if yes is no:
            return yes
        if condition.op == "constant":
            return yes if condition.value else no
        if yes.is_condition is not no.is_condition:
            yes, no = self.number(yes), self.number(no)
        return self._keep("select", (condition, yes, no), None, condition.level | yes.level | no.level)

    def _keep(self, op: str, args: tuple[Node, ...], value: Any, level: int) -> Node:
        # Zeros of either sign are told apart, so the key of a constant is its text.
        key = (op, repr(value) if op == "constant" else value, *(id(a) for a in args))
        node = self._nodes.get(key)
        if node is None:
            if len(self._nodes) >= self.most_nodes:
                raise NotTraceable(f"they grow beyond {self.most_nodes} operations")
            node = self._nodes[key] = Node(self, op, args, value, level, len(self._nodes))
        return node

    def _simplify(self, op: str, args: tuple[Node, ...]) -> Node | None:
        if op == "neg":
            return args[0].args[0] if args[0].op == "neg" else None
        if op == "abs":
            return args[0] if args[0].op == "abs" else None
        if op == "add":
            return self._add(*args)
        if op == "sub":
            return self._sub(*args)
        if op == "mul":
            return self._mul(*args)
        if op == "div":
            return self._div(*args)
        if op == "pow":
            return self._power(*args)
        return None

    def _add(self, a: Node, b: Node) -> Node | None:
        if is_constant(a, 0.0):
            return b
        if is_constant(b, 0.0):
            return a
        return self.make("sub", a, b.args[0]) if b.op == "neg" else None

    def _sub(self, a: Node, b: Node) -> Node | None:
        if is_constant(b, 0.0):
            return a
        if is_constant(a, 0.0):
            return self.make("neg", b)
        return self.make("add", a, b.args[0]) if b.op == "neg" else None

    def _mul(self, a: Node, b: Node) -> Node | None:
        if is_constant(a, 0.0) or is_constant(b, 0.0):
            # An effect at its null and a coefficient of zero vanish, whatever they multiply.
            return self.node(0.0)
        if is_constant(a, 1.0):
            return b
        if is_constant(b, 1.0):
            return a
        if is_constant(a, -1.0):
            return self.make("neg", b)
        if is_constant(b, -1.0):
            return self.make("neg", a)
        if not b.level & ROW and a.level & ROW:
            return self.make("mul", b, a)  # what is constant for a candidate stands first ...
        if not a.level & ROW and b.op == "mul" and not b.args[0].level & ROW and b.level & ROW:
            return self.make("mul", self.make("mul", a, b.args[0]), b.args[1])  # ... and is multiplied once
        if a.op == "mul" and not a.args[0].level & ROW and a.level & ROW and b.level & ROW:
            return self.make("mul", a.args[0], self.make("mul", a.args[1], b))
        return None

    def _div(self, a: Node, b: Node) -> Node | None:
        if is_constant(b, 1.0):
            return a
        if is_constant(a, 0.0):
            return self.node(0.0)
        if not b.level & ROW and a.level & ROW and not is_constant(b, 0.0):
            return self.make("mul", self.make("div", self.node(1.0), b), a)
        return None

    def _power(self, a: Node, b: Node) -> Node | None:
        if b.op != "constant":
            return None
        n = float(b.value)
        if n == 0.0:
            return self.node(1.0)
        if n < 0.0 and (2 * n).is_integer() and -n <= _LARGEST_POWER:
            return self.make("div", self.node(1.0), self.make("pow", a, self.node(-n)))
        if n.is_integer() and n <= _LARGEST_POWER:
            half = a if n < 4 else self.make("pow", a, self.node(float(int(n) // 2)))
            if n == 1:
                return a
            if n == 2:
                return self.make("mul", a, a)
            if n == 3:
                return self.make("mul", self.make("mul", a, a), a)
            square = self.make("mul", half, half)
            return square if int(n) % 2 == 0 else self.make("mul", square, a)
        if n == 0.5:
            return self.make("sqrt", a)
        if (2 * n).is_integer() and n <= _LARGEST_POWER:
            return self.make("mul", self.make("pow", a, self.node(n - 0.5)), self.make("sqrt", a))
        return None


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
