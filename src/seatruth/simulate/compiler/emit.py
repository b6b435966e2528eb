"""From nodes to instructions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from seatruth.simulate.compiler.assembly import FLAGS, Writer
from seatruth.simulate.compiler.graph import COMPARISONS, Node, ordered
from seatruth.simulate.compiler.vector_maths import call, sine_and_cosine

_ARITHMETIC = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}


def emit(w: Writer, roots: Iterable[Node], known: Mapping[int, str]) -> dict[int, str]:
    """Instructions for the nodes below `roots`, down to those that `known` already names, as id(node) to name."""
    names = dict(known)
    turned: dict[str, tuple[str, str]] = {}
    for node in _needed(roots, known):
        args = [names[id(a)] for a in node.args]
        if node.op in ("sin", "cos"):
            if args[0] not in turned:
                turned[args[0]] = sine_and_cosine(w, args[0])
            names[id(node)] = turned[args[0]][node.op == "cos"]
        else:
            names[id(node)] = _instruction(w, node, args)
    return names


def frontier(roots: Iterable[Node], inside: int, outside: int) -> list[Node]:
    """Nodes of level `inside` that nodes of a level beyond use, or that are roots themselves."""
    found: dict[int, Node] = {}
    roots = list(roots)
    for node in [*ordered(roots)]:
        if node.level == outside:
            for a in node.args:
                if a.level == inside:
                    found[id(a)] = a
    for root in roots:
        if root.level == inside:
            found[id(root)] = root
    return sorted(found.values(), key=lambda node: node.order)


def _needed(roots: Iterable[Node], known: Mapping[int, str]) -> list[Node]:
    seen: dict[int, Node] = {}
    ahead = [root for root in roots if id(root) not in known]
    while ahead:
        node = ahead.pop()
        if id(node) not in seen:
            seen[id(node)] = node
            ahead.extend(a for a in node.args if id(a) not in known)
    return sorted(seen.values(), key=lambda node: node.order)


def _is_mask(node: Node) -> bool:
    return node.op in COMPARISONS or (node.op == "select" and _is_mask(node.args[1]))


def _instruction(w: Writer, node: Node, args: list[str]) -> str:
    if node.op == "constant":
        return w.constant(node.value)
    if node.op in _ARITHMETIC:
        return w.binary(_ARITHMETIC[node.op], args[0], args[1], FLAGS)
    if node.op in COMPARISONS:
        return w.compare(COMPARISONS[node.op], *args)
    if node.op == "select":
        kind = w.mask if _is_mask(node) else w.vector
        return w.put(f"select {w.mask} {args[0]}, {kind} {args[1]}, {kind} {args[2]}")
    if node.op == "neg":
        return w.put(f"fneg {FLAGS} {w.vector} {args[0]}")
    if node.op == "leaf":
        raise KeyError(f"{node} has no value here")
    return call(w, node.op, args)
