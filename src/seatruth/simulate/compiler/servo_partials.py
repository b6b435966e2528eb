"""Derivatives of the rates through servos: what acts within a step moves with the servo's state and its parameters.

A servo's values in a step are functions of its state where the step begins, of parameters, and of the step's orders.
So a rate that depends on what acts depends on the servo's state, which stays as it is within the step, and on the
servo's parameters, by the chain rule at each stage. At the end of the step the state takes the servo's last value: a
change in one piece, which a rate at the last stage alone makes, of six times the change over the step's length, as that
stage has a sixth of the weight and no stage follows it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.simulate.compiler.derivatives import directional_derivatives
from seatruth.simulate.compiler.kernels import STAGES, servo_values
from seatruth.simulate.compiler.node import Node, is_constant, ordered
from seatruth.simulate.compiler.partials import Entries, Partials, entries, remaining
from seatruth.simulate.compiler.program import Program
from seatruth.simulate.compiler.trace import Driven, Equations
from seatruth.simulate.time_grid import TimeGrid

_AT_STAGES = np.array([row for _, _, row in STAGES])
"""Which of a servo's three values in a step (start, middle, end) acts at each stage."""


class ServoPartials:
    """What the servos of some equations add to the derivatives of the rates; nothing where there are none.

    Its rows of values stand behind those of `rates`. `states` (K,): the states of the K servos.
    """

    def __init__(self, e: Equations, rates: Partials) -> None:
        self._equations, self._rates = e, rates
        places = {id(state): k for k, state in enumerate(e.states)}
        self.states: Indices = np.array([places[id(servo.state)] for servo in e.driven], dtype=np.intp)
        nodes: list[Node] = servo_values(e.driven)
        through: list[tuple[int, int]] = []
        own: list[tuple[int, float]] = []
        by_state: list[tuple[int, int, int]] = []
        by_parameter: list[tuple[int, int, int]] = []
        parameters = {id(leaf): k for k, leaf in enumerate(e.parameters)}
        size = len(rates.nodes)
        couplings = rates.by_acting
        for k, servo in enumerate(e.driven):
            coupled = np.flatnonzero(couplings.by == k)
            for leaf, moved in _moves(servo):
                first = len(nodes)
                nodes.extend(moved)
                rows = by_state if leaf is servo.state else by_parameter
                by = places[id(leaf)] if leaf is servo.state else parameters[id(leaf)]
                for entry in coupled:
                    rows.append((int(couplings.root[entry]), by, len(through)))
                    through.append((int(couplings.place[entry]), first))
                rows.append((int(self.states[k]), by, -1 - len(own)))
                own.append((first + 2, float(leaf is servo.state)))
        self._nodes = tuple(e.graph.number(node) for node in nodes)
        # Rows of values: those through the rates, then those of the servos' own states.
        self._through = np.array(through, dtype=np.intp).reshape(-1, 2)
        self._own = np.array([place for place, _ in own], dtype=np.intp)
        self._stays = np.array([stays for _, stays in own])

        def numbered(rows: list[tuple[int, int, int]]) -> Entries:
            count = len(through)
            return entries((r, by, size + (n if n >= 0 else count - 1 - n)) for r, by, n in rows)

        self._by_state, self._by_parameter = numbered(by_state), numbered(by_parameter)

    @property
    def count(self) -> int:
        """How many rows `values` has."""
        return len(self._through) + len(self._own)

    def left(self, zero: Iterable[Node]) -> tuple[Entries, Entries]:
        """Entries of the rates, by states and by parameters, that do not vanish where these leaves are zero."""
        zero = list(zero)
        direct, moves = self._rates.left(zero), remaining(self._nodes, zero)
        rates, first = self._through.T
        through = direct[rates] & moves[first[:, None] + np.arange(3)].any(axis=1)
        own = moves[self._own] | (self._stays != 0.0)
        left = np.concatenate([direct, through, own])
        by_state = self._rates.by_state.beside(self._by_state)
        by_parameter = self._rates.by_parameter.beside(self._by_parameter)
        return by_state.only(left[by_state.place]), by_parameter.only(left[by_parameter.place])

    def moves(self, program: Program, grid: TimeGrid, values: Array, begin: Array, steps: slice, threads: int) -> Array:
        """The servos' values and their derivatives (nodes, M) in some steps, from the states (S, M) that begin them."""
        e = self._equations
        size = begin.shape[1]
        if not self._nodes or not size:
            return np.zeros((len(self._nodes), size))
        first, last = (grid.stage_inputs[3 * steps.start + k : 3 * steps.stop : 3].T for k in (0, 2))
        rows = np.concatenate([begin[self.states], first, last, grid.step[None, steps]])
        leaves = (*(servo.state for servo in e.driven), *e.orders, *e.later, e.length)
        found = program.evaluate(id(self), leaves, e.parameters, self._nodes, values[None], rows, threads)
        return np.asarray(found[0])

    def acting(self, moves: Array) -> Array:
        """What acts (K, 4 M) at the stages, from `moves`."""
        return self._at_stages(moves, 3 * np.arange(len(self.states)))

    def values(self, moves: Array, rates: Array, length: Array) -> Array:
        """The rows of values (rows, 4 M), from `moves`, the values of `rates` (nodes, 4 M) and the steps' lengths."""
        direct, first = self._through.T
        with np.errstate(invalid="ignore", over="ignore"):  # a run that diverged has no derivatives
            through = rates[direct] * self._at_stages(moves, first)
        own = np.zeros((len(self._own), rates.shape[1]))
        own[:, 3::4] = (moves[self._own] - self._stays[:, None]) / (STAGES[3][1] * length)
        return np.concatenate([through, own])

    def _at_stages(self, moves: Array, first: Indices) -> Array:
        """Three rows from each of `first` (n,), at the stages (n, 4 M)."""
        three = moves[first[:, None] + _AT_STAGES]
        return np.ascontiguousarray(three.transpose(0, 2, 1)).reshape(len(first), 4 * moves.shape[1])


def _moves(servo: Driven) -> Iterator[tuple[Node, list[Node]]]:
    """Each leaf that moves a servo, its state or a parameter, and the derivatives of its three values by it.

    Forwards through the graph: the servo's guards against division by zero have derivatives of zero times numbers that
    are not finite backwards.
    """
    values = [servo.start, servo.middle, servo.end]
    one = servo.state.graph.node(1.0)
    for leaf in ordered(values):
        if leaf is servo.state or (leaf.op == "leaf" and leaf.value[0] == "parameter"):
            moved = directional_derivatives(values, {id(leaf): one})
            if not all(is_constant(node, 0.0) for node in moved):
                yield leaf, moved
