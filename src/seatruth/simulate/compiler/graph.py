"""The equations of a model as a graph of operations, simplified and without duplicates.

Equal operations on equal arguments are one `Node`.
"""

from __future__ import annotations

from typing import Any

from seatruth.simulate.compiler.node import CONSTANT, Node, NotTraceable
from seatruth.simulate.compiler.operations import COMPARISONS, fold
from seatruth.simulate.compiler.simplify import simplified


class Graph:
    """Makes nodes: folds constants, shares equal nodes, and groups factors that are constant for a candidate."""

    most_decisions = 64
    """Conditions on variables that one run of the equations may branch on. Chosen here [S]."""
    most_questions = 100_000
    """How often one run may ask for the truth of a condition: `while s.r:` asks for ever. Chosen here [S]."""
    most_nodes = 20_000
    """Operations of one model's equations; the largest built-in one has 1300, a ship with 36 effects 2900. [S]"""
    most_with_derivatives = 100_000
    """The same with their derivatives. [S] The vehicle of eight thrusters with 62 effects has 29,000, which take 8 s of
    processor time to compile."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[Any, ...], Node] = {}
        self.path: list[tuple[Node, bool]] = []
        """Conditions met in this run of the equations, and the way taken at each; see `trace`."""
        self.planned: tuple[bool, ...] = ()
        """Ways to take at the first conditions of this run."""
        self.asked = 0

    def open_for_derivatives(self) -> None:
        """Lets it grow further: the equations are complete."""
        self.most_nodes = self.most_with_derivatives

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
        simple = simplified(op, args)
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
                raise NotTraceable(
                    f"they grow beyond {self.most_nodes} operations (conditions multiply: those of each part, such as "
                    "a thruster, belong into a function that returns what they decide)"
                )
            node = self._nodes[key] = Node(self, op, args, value, level, len(self._nodes))
        return node
