"""From nodes to instructions of LLVM IR."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import islice

from seatruth.simulate.compiler.llvm_ir import FLAGS, IRBuilder
from seatruth.simulate.compiler.node import Node, ordered
from seatruth.simulate.compiler.operations import COMPARISONS
from seatruth.simulate.compiler.vector_math import call, sine_and_cosine

_ARITHMETIC = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}


def lower(w: IRBuilder, roots: Iterable[Node], known: Mapping[int, str]) -> dict[int, str]:
    """Writes instructions for all that `roots` depend on, down to the nodes that `known` already names.

    Returns the names of all values by id(node): vectors of doubles, or masks for conditions.
    """
    names = dict(known)
    sincos: dict[str, tuple[str, str]] = {}
    roots = list(roots)
    needed = _needed(roots, known)
    products = _only_added(needed, roots)
    for node in needed:
        if id(node) in products:
            continue
        if node.op in ("add", "sub") and any(id(a) in products for a in node.args):
            names[id(node)] = _multiply_and_add(w, node, products, names)
            continue
        args = [names[id(a)] for a in node.args]
        if node.op in ("sin", "cos"):
            if args[0] not in sincos:
                sincos[args[0]] = sine_and_cosine(w, args[0])
            names[id(node)] = sincos[args[0]][node.op == "cos"]
        else:
            names[id(node)] = _instruction(w, node, args)
    return names


def frontier(roots: Iterable[Node], inside: int, outside: int) -> list[Node]:
    """Nodes of level `inside` that nodes of level `outside` use, or that are roots themselves."""
    border: dict[int, Node] = {}
    roots = list(roots)
    for node in ordered(roots):
        if node.level == outside:
            for a in node.args:
                if a.level == inside:
                    border[id(a)] = a
    for root in roots:
        if root.level == inside:
            border[id(root)] = root
    return sorted(border.values(), key=lambda node: node.order)


def _needed(roots: Iterable[Node], known: Mapping[int, str]) -> list[Node]:
    seen: dict[int, Node] = {}
    open_nodes = [root for root in roots if id(root) not in known]
    while open_nodes:
        node = open_nodes.pop()
        if id(node) not in seen:
            seen[id(node)] = node
            open_nodes.extend(a for a in node.args if id(a) not in known)
    return sorted(seen.values(), key=lambda node: node.order)


def _only_added(needed: list[Node], roots: list[Node]) -> set[int]:
    """Products, by id(node), that a single sum or difference uses and nothing else: at most one of each sum.

    They are fused with it here, not by the compiler, which chooses among them by how many lanes run together.
    """
    uses = Counter(id(a) for node in needed for a in node.args) + Counter(map(id, roots))
    here = {id(node) for node in needed}
    fused: set[int] = set()
    for node in needed:
        if node.op in ("add", "sub"):
            alone = (id(a) for a in node.args if a.op == "mul" and id(a) in here and uses[id(a)] == 1)
            fused.update(islice(alone, 1))
    return fused


def _multiply_and_add(w: IRBuilder, node: Node, products: set[int], names: Mapping[int, str]) -> str:
    """A sum or a difference, one part of which is a product, with one rounding."""
    first, second = node.args
    product, other = (first, second) if id(first) in products else (second, first)
    a, b, c = (names[id(part)] for part in (*product.args, other))
    if node.op == "sub":
        a, c = (a, w.neg(c)) if product is first else (w.neg(a), c)
    return w.fma(a, b, c)


def _instruction(w: IRBuilder, node: Node, args: list[str]) -> str:
    if node.op == "constant":
        return w.constant(node.value)
    if node.op in _ARITHMETIC:
        return w.binary(_ARITHMETIC[node.op], args[0], args[1], FLAGS)
    if node.op in COMPARISONS:
        return w.compare(COMPARISONS[node.op], *args)
    if node.op == "select":
        kind = w.mask if node.is_condition else w.vector
        return w.put(f"select {w.mask} {args[0]}, {kind} {args[1]}, {kind} {args[2]}")
    if node.op == "neg":
        return w.put(f"fneg {FLAGS} {w.vector} {args[0]}")
    if node.op == "leaf":
        raise KeyError(f"{node} has no value here")
    return call(w, node.op, args)
