"""Algebra that makes a node simpler, and groups the factors that are constant for a candidate."""

from __future__ import annotations

from seatruth.simulate.compiler.node import ROW, Node, is_constant

_LARGEST_POWER = 16
"""Up to here whole and half powers are multiplied out: at most eight multiplications. Chosen here [S]."""


def simplified(op: str, args: tuple[Node, ...]) -> Node | None:
    """A simpler node of the same value; None where there is none, and the operation itself is kept."""
    if op == "neg":
        return args[0].args[0] if args[0].op == "neg" else None
    if op == "abs":
        return args[0] if args[0].op == "abs" else None
    if op == "add":
        return _add(*args)
    if op == "sub":
        return _sub(*args)
    if op == "mul":
        return _mul(*args)
    if op == "div":
        return _div(*args)
    if op == "pow":
        return _power(*args)
    return None


def _add(a: Node, b: Node) -> Node | None:
    if is_constant(a, 0.0):
        return b
    if is_constant(b, 0.0):
        return a
    return a.graph.make("sub", a, b.args[0]) if b.op == "neg" else None


def _sub(a: Node, b: Node) -> Node | None:
    if is_constant(b, 0.0):
        return a
    if is_constant(a, 0.0):
        return a.graph.make("neg", b)
    return a.graph.make("add", a, b.args[0]) if b.op == "neg" else None


def _mul(a: Node, b: Node) -> Node | None:
    make, number = a.graph.make, a.graph.node
    if is_constant(a, 0.0) or is_constant(b, 0.0):
        # An effect at its null and a coefficient of zero vanish, whatever they multiply.
        return number(0.0)
    if is_constant(a, 1.0):
        return b
    if is_constant(b, 1.0):
        return a
    if is_constant(a, -1.0):
        return make("neg", b)
    if is_constant(b, -1.0):
        return make("neg", a)
    if not b.level & ROW and a.level & ROW:
        return make("mul", b, a)  # what is constant for a candidate stands first ...
    if not a.level & ROW and b.op == "mul" and not b.args[0].level & ROW and b.level & ROW:
        return make("mul", make("mul", a, b.args[0]), b.args[1])  # ... and is multiplied once
    if a.op == "mul" and not a.args[0].level & ROW and a.level & ROW and b.level & ROW:
        return make("mul", a.args[0], make("mul", a.args[1], b))
    return None


def _div(a: Node, b: Node) -> Node | None:
    make, number = a.graph.make, a.graph.node
    if is_constant(b, 1.0):
        return a
    if is_constant(a, 0.0):
        return number(0.0)
    if not b.level & ROW and a.level & ROW and not is_constant(b, 0.0):
        return make("mul", make("div", number(1.0), b), a)
    return None


def _power(a: Node, b: Node) -> Node | None:
    make, number = a.graph.make, a.graph.node
    if b.op != "constant":
        return None
    n = float(b.value)
    if n == 0.0:
        return number(1.0)
    if n < 0.0 and (2 * n).is_integer() and -n <= _LARGEST_POWER:
        return make("div", number(1.0), make("pow", a, number(-n)))
    if n.is_integer() and n <= _LARGEST_POWER:
        half = a if n < 4 else make("pow", a, number(float(int(n) // 2)))
        if n == 1:
            return a
        if n == 2:
            return make("mul", a, a)
        if n == 3:
            return make("mul", make("mul", a, a), a)
        square = make("mul", half, half)
        return square if int(n) % 2 == 0 else make("mul", square, a)
    if n == 0.5:
        return make("sqrt", a)
    if (2 * n).is_integer() and n <= _LARGEST_POWER:
        return make("mul", make("pow", a, number(n - 0.5)), make("sqrt", a))
    return None
