"""Derivatives of a model's equations by each state and each parameter, those that do not vanish, as sparse matrices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Flags, Indices
from seatruth.simulate.compiler.derivatives import partial_derivatives
from seatruth.simulate.compiler.lanes import NARROW
from seatruth.simulate.compiler.node import Node, is_constant, ordered
from seatruth.simulate.compiler.operations import fold
from seatruth.simulate.compiler.pool import Buffer
from seatruth.simulate.compiler.trace import Equations
from seatruth.simulate.time_grid import Integers


@dataclass(frozen=True)
class Entries:
    """Derivatives that do not vanish: of which root, by which state or parameter, at which place among the values."""

    root: Indices
    by: Indices
    place: Indices

    def only(self, chosen: Flags) -> Entries:
        """Those that are chosen (n,)."""
        return Entries(self.root[chosen], self.by[chosen], self.place[chosen])

    def beside(self, other: Entries) -> Entries:
        """These and the others; entries of one root by one leaf add up."""
        pairs = zip((self.root, self.by, self.place), (other.root, other.by, other.place))
        return Entries(*(np.concatenate(pair) for pair in pairs))


@dataclass(frozen=True)
class Partials:
    """Derivatives of some roots: `nodes` to evaluate, and entries by states, by parameters and by what acts on the
    inputs behind servos.
    """

    nodes: tuple[Node, ...]
    by_state: Entries
    by_parameter: Entries
    by_acting: Entries

    def left(self, zero: Iterable[Node]) -> Flags:
        """Of the nodes, those that do not vanish where these leaves are zero."""
        return remaining(self.nodes, zero)


def partials(e: Equations, roots: Sequence[Node], first: Sequence[Node]) -> Partials:
    """Derivatives of roots; `first` are nodes that are evaluated beside them."""
    leaves = (e.states, e.parameters, tuple(servo.acting for servo in e.driven))
    every = [leaf for group in leaves for leaf in group]
    wanted = [e.graph.number(node) for node in first]
    nodes: dict[int, Node] = {}
    table: list[list[tuple[int, int, int]]] = [[] for _ in leaves]
    for r, root in enumerate(roots):
        found = partial_derivatives(root, every) if root.level else {}
        for rows, group in zip(table, leaves):
            for k, leaf in enumerate(group):
                node = found.get(id(leaf))
                if node is not None and not is_constant(node, 0.0):
                    nodes.setdefault(id(node), node)
                    rows.append((r, k, id(node)))
    places = {key: len(wanted) + n for n, key in enumerate(nodes)}
    by = [entries((r, k, places[key]) for r, k, key in rows) for rows in table]
    return Partials((*wanted, *nodes.values()), *by)


def entries(rows: Iterable[tuple[int, int, int]]) -> Entries:
    """Entries of rows (root, by, place)."""
    columns = np.array(list(rows), dtype=np.intp).reshape(-1, 3).T
    return Entries(columns[0], columns[1], columns[2])


def remaining(nodes: Sequence[Node], zero: Iterable[Node]) -> Flags:
    """Of these nodes, those that do not vanish where these leaves are zero."""
    gone = vanishing(nodes, zero)
    return np.array([id(node) not in gone for node in nodes], dtype=np.bool_)


def vanishing(roots: Iterable[Node], zero: Iterable[Node]) -> set[int]:
    """By id, the nodes among those that `roots` depend on that are zero where the leaves `zero` are.

    Zero times anything counts as zero, as in `Graph`.
    """
    known: dict[int, float | bool] = {id(leaf): 0.0 for leaf in zero}
    for node in ordered(roots):
        if node.op == "constant":
            known[id(node)] = node.value
        elif node.op != "leaf":
            value = _known(node, [known.get(id(a)) for a in node.args])
            if value is not None:
                known[id(node)] = value
    return {key for key, value in known.items() if value == 0.0}


def _known(node: Node, args: Sequence[float | bool | None]) -> float | bool | None:
    """The value of an operation of which some arguments are known; None where it is not."""
    if node.op == "select":
        if args[0] is not None:
            return args[1] if args[0] else args[2]
        return args[1] if args[1] == args[2] else None
    if node.op == "mul" and 0.0 in args:
        return 0.0
    if node.op == "div" and args[0] == 0.0:
        return 0.0
    numbers = [float(value) for value in args if value is not None]
    return fold(node.op, numbers) if len(numbers) == len(args) else None


def matrix(name: str, entries: Entries, rows: int) -> dict[str, Buffer]:
    """The entries in compressed rows, as the buffers of a kernel."""
    order = np.argsort(entries.root, kind="stable")
    return {
        f"{name}_start": _starts(entries.root, rows),
        f"{name}_from": entries.by[order].astype(np.int64),
        f"{name}_place": entries.place[order].astype(np.int64),
    }


def by_lane(name: str, entries: Entries, rows: int, columns: Indices, blocks: int) -> dict[str, Buffer]:
    """The entries by the parameters in `columns` (K,), each at its lane, in compressed rows of every block."""
    found = [np.flatnonzero(entries.by == column) for column in columns]
    which = np.concatenate([*found, np.zeros(0, dtype=np.intp)])
    direction = np.repeat(np.arange(len(columns)), [len(own) for own in found])
    row = direction // NARROW * rows + entries.root[which]
    order = np.argsort(row, kind="stable")
    return {
        f"{name}_start": _starts(row, blocks * rows),
        f"{name}_lane": (direction % NARROW)[order].astype(np.int64),
        f"{name}_place": entries.place[which][order].astype(np.int64),
    }


def _starts(row: Indices, rows: int) -> Integers:
    """Where the entries of each row begin (rows + 1,)."""
    return np.concatenate([[0], np.cumsum(np.bincount(row, minlength=rows))]).astype(np.int64)
