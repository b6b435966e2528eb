"""Derivatives of many parameters at once: by the linearized equations along the run.

A simulation with derivatives in its lanes (`Program.jacobian`) repeats the run, and every derivative of every
parameter, in each block of lanes. Here the run is made once, the derivatives of the rates and outputs by each state and
each parameter are evaluated on all its stages, and a kernel of sparse products carries them through time
(`propagation.py`). What a parameter that stands at zero switches off is left out beforehand: a model that holds forty
effects at their null costs little more than the model alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from seatruth.arrays import Array, Flags, Indices
from seatruth.simulate.compiler.derivatives import partial_derivatives
from seatruth.simulate.compiler.lanes import NARROW, last_axis_from_lanes
from seatruth.simulate.compiler.machine_code import Kernel, kernel
from seatruth.simulate.compiler.node import Node, is_constant, ordered
from seatruth.simulate.compiler.operations import fold
from seatruth.simulate.compiler.pool import Buffer, run_kernel
from seatruth.simulate.compiler.program import Derivatives, Program
from seatruth.simulate.compiler.propagation import PROPAGATION_CONTEXT, propagation_kernel
from seatruth.simulate.compiler.system import Directions
from seatruth.simulate.time_grid import Integers, TimeGrid

_STRETCH = 256
"""Steps whose coefficients are evaluated at once: some MB. Chosen here [S]."""


@dataclass(frozen=True)
class _Entries:
    """Derivatives that do not vanish: of which root, by which state or parameter, at which place among the values."""

    root: Indices
    by: Indices
    place: Indices

    def only(self, chosen: Flags) -> _Entries:
        """Those that are chosen (n,)."""
        return _Entries(self.root[chosen], self.by[chosen], self.place[chosen])


@dataclass(frozen=True)
class _Derivatives:
    """Derivatives of some roots: `nodes` to evaluate, and entries by states and by parameters."""

    nodes: tuple[Node, ...]
    by_state: _Entries
    by_parameter: _Entries


@dataclass(frozen=True)
class _Pattern:
    """What does not vanish where certain parameters are zero; `live` (L,): the states that reach an output."""

    live: Indices
    a: _Entries
    b: _Entries
    c: _Entries
    d: _Entries


class Sensitivities:
    """Derivatives of one program's equations by every state and parameter, and which of them vanish when."""

    def __init__(self, program: Program) -> None:
        e = self._equations = program.equations
        self._rates = _derivatives(program, e.rates, ())
        self._outputs = _derivatives(program, e.outputs, e.outputs)
        self._patterns: dict[bytes, _Pattern] = {}

    def jacobian(
        self,
        program: Program,
        grid: TimeGrid,
        values: Array,
        x0: Array,
        along: Directions,
        threads: int,
    ) -> Derivatives:
        """As `Program.jacobian`, with its arguments; `dx_end` is empty (T, 0, K + F)."""
        e, size = self._equations, along.size
        stage_states, states, x_end = program.stages(grid, values, x0, threads)
        pattern = self._pattern(values)
        live = len(pattern.live)
        blocks = max(1, -(-size // NARROW))
        start = np.zeros((len(e.states), blocks * NARROW))
        start[:, :size] = along.first_states(len(e.states)).T
        begin_x = start[pattern.live].reshape(live, blocks, NARROW).transpose(1, 0, 2)
        y = np.empty((len(grid.t), len(e.outputs)))
        record = np.empty((blocks, len(grid.t), len(e.outputs), NARROW))
        sizes = {"tasks": blocks, "states": live, "outputs": len(e.outputs), "record_size": len(grid.t)}
        fixed: dict[str, Buffer] = {
            "record": record,
            "scratch": np.empty((blocks, 3, live, NARROW)),
            **_matrix("a", pattern.a, live),
            **_matrix("c", pattern.c, len(e.outputs)),
            **_by_lane("b", pattern.b, live, along.columns, blocks),
            **_by_lane("d", pattern.d, len(e.outputs), along.columns, blocks),
        }
        for trial, rows in enumerate(grid.rows):
            fixed["x"] = np.array(begin_x, order="C")
            step = int(grid.stage_start[trial]) // 3
            for begin, end in _stretches(grid.substeps[rows]):
                part = slice(rows.start + begin, rows.start + end)
                count = int(grid.substeps[part].sum())
                rates = self._rate_values(program, grid, values, stage_states, slice(step, step + count), threads)
                row = np.stack([*grid.inputs[part].T, grid.t[part], grid.trial[part]])
                found = self._values(program, self._outputs, values, states[part].T, row, threads)
                y[part] = found[: len(e.outputs)].T
                buffers: dict[str, Buffer] = {
                    **fixed,
                    "counter": np.zeros(1, dtype=np.int64),
                    "length": grid.length[part],
                    "substeps": grid.substeps[part],
                    "rate_values": rates,
                    "output_values": found,
                }
                for name in "abcd":
                    stride = (rates if name in "ab" else found).strides[0] // 8
                    buffers[f"{name}_place"] = fixed[f"{name}_place"] * stride
                stretch = {**sizes, "samples": end - begin, "first": part.start}
                run_kernel(_kernel(), PROPAGATION_CONTEXT, buffers, stretch, threads, blocks)
                step += count
        dy = last_axis_from_lanes(record, size)
        return Derivatives(y, dy, x_end, np.empty((len(grid.rows), 0, size)))

    def _rate_values(
        self, program: Program, grid: TimeGrid, values: Array, stage_states: Array, steps: slice, threads: int
    ) -> Array:
        """Derivatives of the rates (nodes, 4 steps) at the stages of some steps."""
        # A step has three rows of inputs; its second and third stage share the middle one.
        rows = (3 * np.arange(steps.start, steps.stop)[:, None] + np.array([0, 1, 1, 2])).ravel()
        states = stage_states[:, 4 * steps.start : 4 * steps.stop]
        row = np.stack([*grid.stage_inputs[rows].T, grid.stage_t[rows], grid.stage_trial[rows]])
        return self._values(program, self._rates, values, states, row, threads)

    def _values(
        self,
        program: Program,
        wanted: _Derivatives,
        values: Array,
        states: Array,
        row: Array,
        threads: int,
    ) -> Array:
        """Values (nodes, N) of derivatives on rows: states (S, N); inputs, time and trial (I + 2, N)."""
        e = self._equations
        if not wanted.nodes or not row.shape[1]:
            return np.zeros((len(wanted.nodes), row.shape[1]))
        leaves = np.concatenate([states, row])
        by_row = (*e.states, *e.inputs, e.time, e.trial)
        found = program.evaluate(id(wanted), by_row, e.parameters, wanted.nodes, values[None], leaves, threads)
        return np.asarray(found[0])

    def _pattern(self, values: Array) -> _Pattern:
        """What does not vanish at these values (n_parameters,)."""
        e, zero = self._equations, values == 0.0
        key = zero.tobytes()
        if key not in self._patterns:
            leaves = [node for node, off in zip(e.parameters, zero) if off]
            a, b = _left(self._rates, leaves)
            c, d = _left(self._outputs, leaves)
            alive = np.zeros(len(e.states), dtype=np.bool_)
            alive[c.by] = True
            for _ in e.states:
                alive[a.by[alive[a.root]]] = True
            live = np.flatnonzero(alive)
            number = np.cumsum(alive) - 1
            a, b = a.only(alive[a.root]), b.only(alive[b.root])
            self._patterns[key] = _Pattern(
                live,
                _Entries(number[a.root], number[a.by], a.place),
                _Entries(number[b.root], b.by, b.place),
                _Entries(c.root, number[c.by], c.place),
                d,
            )
        return self._patterns[key]


def _derivatives(program: Program, roots: Sequence[Node], first: Sequence[Node]) -> _Derivatives:
    """Derivatives of roots by all states and parameters; `first` are nodes that are evaluated beside them."""
    e = program.equations
    nodes: dict[int, Node] = {}
    table: dict[str, list[tuple[int, int, Node]]] = {"state": [], "parameter": []}
    for r, root in enumerate(roots):
        found = partial_derivatives(root, (*e.states, *e.parameters)) if root.level else {}
        for kind, leaves in (("state", e.states), ("parameter", e.parameters)):
            for k, leaf in enumerate(leaves):
                if id(leaf) in found and not is_constant(found[id(leaf)], 0.0):
                    table[kind].append((r, k, found[id(leaf)]))
    wanted = [e.graph.number(node) for node in first]
    places: dict[int, int] = {}
    for entries in table.values():
        for _, _, node in entries:
            if id(node) not in nodes:
                nodes[id(node)] = node
                places[id(node)] = len(wanted) + len(nodes) - 1

    def entries_of(kind: str) -> _Entries:
        rows = [(r, k, places[id(node)]) for r, k, node in table[kind]]
        columns = np.array(rows, dtype=np.intp).reshape(-1, 3).T
        return _Entries(columns[0], columns[1], columns[2])

    return _Derivatives((*wanted, *nodes.values()), entries_of("state"), entries_of("parameter"))


def _left(wanted: _Derivatives, zero: Iterable[Node]) -> list[_Entries]:
    """The entries by states, and by parameters, that do not vanish where these leaves are zero."""
    gone = vanishing(wanted.nodes, zero)
    left = np.array([id(node) not in gone for node in wanted.nodes], dtype=np.bool_)
    return [entries.only(left[entries.place]) for entries in (wanted.by_state, wanted.by_parameter)]


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


def _stretches(substeps: Integers) -> list[tuple[int, int]]:
    """Samples (begin, end) of the parts of a trial, each of about `_STRETCH` steps."""
    part = (np.cumsum(substeps) - substeps) // _STRETCH
    edges = [0, *(np.flatnonzero(np.diff(part)) + 1).tolist(), len(substeps)]
    return list(pairwise(edges))


def _matrix(name: str, entries: _Entries, rows: int) -> dict[str, Buffer]:
    """The entries in compressed rows."""
    order = np.argsort(entries.root, kind="stable")
    return {
        f"{name}_start": _starts(entries.root, rows),
        f"{name}_from": entries.by[order].astype(np.int64),
        f"{name}_place": entries.place[order].astype(np.int64),
    }


def _by_lane(name: str, entries: _Entries, rows: int, columns: Indices, blocks: int) -> dict[str, Buffer]:
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


@cache
def _kernel() -> Kernel:
    return kernel(propagation_kernel(NARROW))


_sensitivities: WeakKeyDictionary[Program, Sensitivities] = WeakKeyDictionary()


def sensitivities(program: Program) -> Sensitivities:
    """The derivatives of a program's equations, made once for each program."""
    if program not in _sensitivities:
        _sensitivities[program] = Sensitivities(program)
    return _sensitivities[program]
