"""The equations of a model as a graph of operations: folded and shared.

A `Node` behaves like a number, so a model's plain functions run on it and leave their equations behind. Equal
operations on equal arguments are one node. `level` says what a node changes with, which decides where it is computed:
once a candidate (parameters only), once a row for all candidates (inputs and time only), or everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

CONSTANT: Final = 0
LANE: Final = 1
"""Changes with the candidate only."""
ROW: Final = 2
"""Changes with time only: inputs and the time itself."""
BOTH: Final = 3

COMPARISONS: Final = {"lt": "olt", "le": "ole", "gt": "ogt", "ge": "oge", "eq": "oeq", "ne": "une"}
UNARY: Final[Mapping[str, Callable[[float], float]]] = {
    "neg": lambda a: -a,
    "abs": abs,
    "sqrt": math.sqrt,
    "cbrt": math.cbrt,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "asinh": math.asinh,
    "acosh": math.acosh,
    "atanh": math.atanh,
    "exp": math.exp,
    "expm1": math.expm1,
    "log": math.log,
    "log1p": math.log1p,
    "log10": math.log10,
    "log2": math.log2,
    "floor": lambda a: float(math.floor(a)),
    "ceil": lambda a: float(math.ceil(a)),
    "trunc": lambda a: float(math.trunc(a)),
}
BINARY: Final[Mapping[str, Callable[[float, float], float]]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": math.pow,
    "atan2": math.atan2,
    "hypot": math.hypot,
    "copysign": math.copysign,
    "fmod": math.fmod,
}
_RELATIONS: Final[Mapping[str, Callable[[float, float], bool]]] = {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
}
_LARGEST_POWER = 16


class NotTraceable(TypeError):
    """The equations did something that only a plain number can do."""


class Node:
    """One operation (or leaf, or constant) that stands for a number in a model's equations."""

    __slots__ = ("args", "graph", "level", "op", "order", "value")
    __array_ufunc__ = None  # so that NumPy's scalars leave arithmetic with a node to the node

    def __init__(self, graph: Graph, op: str, args: tuple[Node, ...], value: Any, level: int, order: int) -> None:
        self.graph, self.op, self.args, self.value, self.level, self.order = graph, op, args, value, level, order

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

    def __bool__(self) -> bool:
        return self.graph.decide(self)

    def __float__(self) -> float:
        raise NotTraceable("it turns a variable into a plain float")

    def __int__(self) -> int:
        raise NotTraceable("it turns a variable into an integer")

    __index__ = __int__

    def _do(self, op: str, a: Any, b: Any) -> Node:
        return self.graph.make(op, self.graph.node(a), self.graph.node(b))


class Graph:
    """Makes nodes: folds constants, shares equal ones, and moves what is constant for a candidate together."""

    def __init__(self) -> None:
        self._known: dict[tuple[Any, ...], Node] = {}
        self.path: list[tuple[Node, bool]] = []
        """Decisions taken in the run of the equations under way, see `trace`."""
        self.given: tuple[bool, ...] = ()
        self.most_decisions = 64
        self.most_questions = 100_000
        """How often one run may ask: `while s.r:` asks the same question for ever."""
        self.asked = 0
        self.most_nodes = 200_000

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
        """Which way an `if` goes in this run: as given, or the first way, to be explored later."""
        if condition.op == "constant":
            return bool(condition.value)
        test = condition if condition.op in COMPARISONS else self.make("ne", condition, self.node(0.0))
        if test.op == "constant":
            return bool(test.value)
        self.asked += 1
        if self.asked > self.most_questions:
            raise NotTraceable("a loop depends on its variables without end")
        for known, way in self.path:
            if known is test:
                return way
        way = self.given[len(self.path)] if len(self.path) < len(self.given) else True
        self.path.append((test, way))
        if len(self.path) > self.most_decisions:
            raise NotTraceable("a loop or a chain of `if` depends on its variables without end")
        return way

    def make(self, op: str, *args: Node) -> Node:
        """The node of an operation, simplified."""
        if all(a.op == "constant" for a in args):
            folded = _fold(op, [a.value for a in args])
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
        return self._merge(condition, yes, no, {})

    def less(self, a: Node, b: Node) -> Node:
        return self.make("lt", a, b)

    def smaller(self, a: Node, b: Node) -> Node:
        """min(a, b) as Python has it: b if b < a else a, so that not-a-number in a stays."""
        return self._choose(self.make("lt", b, a), b, a)

    def larger(self, a: Node, b: Node) -> Node:
        return self._choose(self.make("gt", b, a), b, a)

    def _merge(self, condition: Node, yes: Node, no: Node, done: dict[tuple[int, int], Node]) -> Node:
        if yes is no:
            return yes
        key = (id(yes), id(no))
        found = done.get(key)
        if found is not None:
            return found
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
        return self._keep("select", (condition, yes, no), None, condition.level | yes.level | no.level)

    def _keep(self, op: str, args: tuple[Node, ...], value: Any, level: int) -> Node:
        # Zeros of either sign are told apart, so the key of a constant is its text.
        key = (op, repr(value) if op == "constant" else value, *(id(a) for a in args))
        node = self._known.get(key)
        if node is None:
            if len(self._known) >= self.most_nodes:
                raise NotTraceable(f"they grow beyond {self.most_nodes} operations")
            node = self._known[key] = Node(self, op, args, value, level, len(self._known))
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
    return node.op == "constant" and bool(node.value == value)


def _fold(op: str, values: list[float]) -> float | bool | None:
    """The operation on constants; None where it has no finite result, which is then left to the run."""
    try:
        if op in UNARY:
            found = UNARY[op](values[0])
        elif op in BINARY:
            found = BINARY[op](values[0], values[1])
        elif op in _RELATIONS:
            return _RELATIONS[op](values[0], values[1])
        else:
            return None
    except (ValueError, OverflowError, ZeroDivisionError):
        return None
    return found if isinstance(found, float) and math.isfinite(found) else None


def ordered(roots: Iterable[Node]) -> list[Node]:
    """Every node below the roots, arguments before what uses them."""
    seen: dict[int, Node] = {}
    ahead = list(roots)
    while ahead:
        node = ahead.pop()
        if id(node) not in seen:
            seen[id(node)] = node
            ahead.extend(node.args)
    return sorted(seen.values(), key=lambda node: node.order)
