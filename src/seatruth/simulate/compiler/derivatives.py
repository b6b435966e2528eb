"""Automatic differentiation of a graph of operations: along a direction, and by every variable at once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from seatruth.simulate.compiler.node import Node, NotTraceable, is_constant, ordered
from seatruth.simulate.compiler.operations import COMPARISONS

_FINITE = frozenset(
    {"leaf", "constant", "add", "sub", "mul", "neg", "abs", "sin", "cos", "tanh", "atan", "asinh", "copysign"}
    | {"select", "floor", "ceil", "trunc", *COMPARISONS}
)
"""Operations that are finite wherever their arguments are."""


def directional_derivatives(roots: Iterable[Node], directions: Mapping[int, Node]) -> list[Node]:
    """Derivatives of the roots along a direction: `directions` maps id(leaf) to the leaf's own derivative.

    Exact to rounding. Comparisons, `abs`, `min`, `max` and `if` are differentiated on the side on which the value
    stands; at a square root of zero the derivative is taken as zero.
    """
    roots = list(roots)
    if not roots:
        return []
    graph = roots[0].graph
    zero = graph.node(0.0)
    derivatives: dict[int, Node] = {}
    for node in ordered(roots):
        if node.op == "leaf":
            derivatives[id(node)] = directions.get(id(node), zero)
        elif node.op == "constant" or node.op in COMPARISONS:
            derivatives[id(node)] = zero
        else:
            derivatives[id(node)] = _derivative(node, [derivatives[id(a)] for a in node.args])
    return [derivatives[id(root)] for root in roots]


def partial_derivatives(root: Node, leaves: Iterable[Node]) -> dict[int, Node]:
    """Derivatives of one root by each of these leaves, by id(leaf); those that are zero are left out.

    Backwards through the graph (the adjoint method), with the same conventions as `directional_derivatives`. The side
    of an `if` that is not taken counts for nothing, though zero times its values, such as the root of what is negative
    there, may be no number: x sqrt(x) of a thruster within its dead band.
    """
    wanted = {id(leaf) for leaf in leaves}
    nodes = ordered([root])
    moving: set[int] = set()
    for node in nodes:
        if id(node) in wanted or (node.op not in COMPARISONS and any(id(a) in moving for a in node.args)):
            moving.add(id(node))
    zero, one = root.graph.node(0.0), root.graph.node(1.0)
    adjoints = {id(root): one} if id(root) in moving else {}
    found: dict[int, Node] = {}
    beside: set[int] = set()  # what stands on a side of an `if`, which may not be taken
    finite: dict[int, bool] = {}
    for node in reversed(nodes):
        adjoint = adjoints.pop(id(node), zero)
        if is_constant(adjoint, 0.0):
            continue
        if id(node) in wanted:
            found[id(node)] = adjoint
            continue
        for place, a in enumerate(node.args):
            if id(a) in moving:
                local = _derivative(node, [one if k == place else zero for k in range(len(node.args))])
                passed = adjoint * local
                if id(node) in beside and not _is_finite(local, finite):
                    passed = root.graph.select(adjoint == 0.0, zero, passed)
                if id(node) in beside or node.op == "select":
                    beside.add(id(a))
                adjoints[id(a)] = adjoints.get(id(a), zero) + passed
    return found


def _is_finite(node: Node, known: dict[int, bool]) -> bool:
    """Whether a node is finite wherever the leaves are; `known` (by id) grows."""
    open_nodes = [node]
    while open_nodes:
        part = open_nodes[-1]
        unknown = [a for a in part.args if id(a) not in known]
        if not unknown:
            known[id(part)] = part.op in _FINITE and all(known[id(a)] for a in part.args)
            open_nodes.pop()
        open_nodes.extend(unknown)
    return known[id(node)]


def _derivative(node: Node, d: list[Node]) -> Node:
    make, const = node.graph.make, node.graph.node
    if all(is_constant(x, 0.0) for x in d):
        return const(0.0)
    a = node.args[0]
    match node.op:
        case "add" | "sub":
            return make(node.op, *d)
        case "mul":
            return d[0] * node.args[1] + a * d[1]
        case "div":
            return (d[0] - node * d[1]) / node.args[1]
        case "neg":
            return -d[0]
        case "abs":
            return node.graph.select(a < 0.0, -d[0], d[0])
        case "sqrt":
            return node.graph.select(a > 0.0, d[0] * (0.5 / node), const(0.0))
        case "select":
            return node.graph.select(a, d[1], d[2])
        case "copysign":
            turned = make("copysign", const(1.0), node.args[1]) * make("copysign", const(1.0), a)
            return turned * d[0]
        case "hypot":
            along = (a * d[0] + node.args[1] * d[1]) / node
            return node.graph.select(node > 0.0, along, const(0.0))
        case "atan2":
            b = node.args[1]
            return (b * d[0] - a * d[1]) / (a * a + b * b)
        case "pow":
            return _power_derivative(node, d)
        case "fmod":
            return d[0] - make("trunc", a / node.args[1]) * d[1]
        case "floor" | "ceil" | "trunc":
            return const(0.0)
    return _slope(node, a) * d[0]


def _power_derivative(node: Node, d: list[Node]) -> Node:
    a, b = node.args
    total = b * node.graph.make("pow", a, b - 1.0) * d[0]
    if not is_constant(d[1], 0.0):
        # A power that is zero stays zero whatever its exponent, though its logarithm has no value.
        along = node * node.graph.make("log", a) * d[1]
        total = total + node.graph.select(node == 0.0, node.graph.node(0.0), along)
    return total


def _slope(node: Node, a: Node) -> Node:
    """Derivative of a function of one variable."""
    make = node.graph.make
    match node.op:
        case "sin":
            return make("cos", a)
        case "cos":
            return -make("sin", a)
        case "tan":
            return 1.0 + node * node
        case "asin":
            return 1.0 / make("sqrt", 1.0 - a * a)
        case "acos":
            return -1.0 / make("sqrt", 1.0 - a * a)
        case "atan":
            return 1.0 / (1.0 + a * a)
        case "sinh":
            return make("cosh", a)
        case "cosh":
            return make("sinh", a)
        case "tanh":
            return 1.0 - node * node
        case "asinh":
            return 1.0 / make("sqrt", a * a + 1.0)
        case "acosh":
            return 1.0 / make("sqrt", a * a - 1.0)
        case "atanh":
            return 1.0 / (1.0 - a * a)
        case "exp":
            return node
        case "expm1":
            return node + 1.0
        case "log":
            return 1.0 / a
        case "log1p":
            return 1.0 / (1.0 + a)
        case "log10":
            return 1.0 / (a * math.log(10.0))
        case "log2":
            return 1.0 / (a * math.log(2.0))
        case "cbrt":
            return 1.0 / (3.0 * node * node)
    raise NotTraceable(f"{node.op} has no derivative")
