"""Derivatives of many parameters at once: by the linearized equations along the run.

A simulation with derivatives in its lanes (`Program.jacobian`) repeats the run, and every derivative of every
parameter, in each block of lanes. Here the run is made once, the derivatives of the rates and outputs by each state and
each parameter are evaluated on all its stages, and a kernel of sparse products carries them through time
(`propagation.py`). What a parameter that stands at zero switches off is left out beforehand: a model that holds forty
effects at their null costs little more than the model alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from seatruth.arrays import Array, Flags, Indices
from seatruth.errors import PluginError
from seatruth.simulate.compiler.lanes import NARROW
from seatruth.simulate.compiler.machine_code import Kernel, kernel
from seatruth.simulate.compiler.node import Node, NotTraceable
from seatruth.simulate.compiler.partials import Entries, Partials, by_lane, matrix, partials
from seatruth.simulate.compiler.pool import Buffer, run_kernel
from seatruth.simulate.compiler.program import Derivatives, Program
from seatruth.simulate.compiler.propagation import PROPAGATION_CONTEXT, propagation_kernel
from seatruth.simulate.compiler.servo_partials import ServoPartials
from seatruth.simulate.compiler.system import Directions
from seatruth.simulate.time_grid import Integers, TimeGrid

_STRETCH = 256
"""Steps whose coefficients are evaluated at once, at most. Chosen here [S]: more saves no time of calls."""
_BYTES = 2**21
"""Bytes of the coefficients of these steps, at most: what the processor's cache holds. Chosen here [S]: of a ferry with
73 effects, 28 kB a step, a linearization in stretches of 512, 256, 128 and 64 steps took 189, 152, 134 and 128 ms."""


@dataclass(frozen=True)
class _Pattern:
    """What does not vanish where certain parameters are zero; `live` (L,): the states that reach an output."""

    live: Indices
    a: Entries
    b: Entries
    c: Entries
    d: Entries


class Sensitivities:
    """Derivatives of one program's equations by every state and parameter, and which of them vanish when."""

    def __init__(self, program: Program) -> None:
        e = self._equations = program.equations
        self._rates = partials(e, e.rates, ())
        self._servos = ServoPartials(e, self._rates)
        self._outputs = partials(e, e.outputs, e.outputs)
        self._patterns: dict[bytes, _Pattern] = {}
        # A step has four stages, each with a double for every coefficient.
        self._stretch = int(np.clip(_BYTES // (32 * max(1, len(self._rates.nodes) + self._servos.count)), 1, _STRETCH))

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
        record = np.zeros((len(grid.t), len(e.outputs), blocks, NARROW))
        sizes = {"blocks": blocks, "states": live, "outputs": len(e.outputs)}
        fixed: dict[str, Buffer] = {
            "record": record,
            "scratch": np.empty((blocks, 3, live, NARROW)),
            **matrix("a", pattern.a, live),
            **matrix("c", pattern.c, len(e.outputs)),
            **by_lane("b", pattern.b, live, along.columns, blocks),
            **by_lane("d", pattern.d, len(e.outputs), along.columns, blocks),
        }
        own = [_OfBlocks(fixed, name, rows) for name, rows in (("b", live), ("d", len(e.outputs)))]
        for trial, rows in enumerate(grid.rows):
            fixed["x"] = np.array(begin_x, order="C")
            step = int(grid.stage_start[trial]) // 3
            for begin, end in _stretches(grid.substeps[rows], self._stretch):
                part = slice(rows.start + begin, rows.start + end)
                count = int(grid.substeps[part].sum())
                rates = self._rate_values(program, grid, values, stage_states, slice(step, step + count), threads)
                row = np.stack([*grid.inputs[part].T, grid.t[part], grid.trial[part]])
                leaves = program.acting(np.concatenate([states[part].T, row]))
                found = self._values(program, self._outputs, values, leaves, threads)
                y[part] = found[: len(e.outputs)].T
                todo = _moving(fixed["x"], list(zip(own, (rates, found), strict=True)))
                if not len(todo):
                    step += count
                    continue
                buffers: dict[str, Buffer] = {
                    **fixed,
                    "todo": todo,
                    "counter": np.zeros(1, dtype=np.int64),
                    "length": grid.length[part],
                    "substeps": grid.substeps[part],
                    "rate_values": rates,
                    "output_values": found,
                }
                for name in "abcd":
                    stride = (rates if name in "ab" else found).strides[0] // 8
                    buffers[f"{name}_place"] = fixed[f"{name}_place"] * stride
                stretch = {**sizes, "tasks": len(todo), "samples": end - begin, "first": part.start}
                run_kernel(_kernel(), PROPAGATION_CONTEXT, buffers, stretch, threads, len(todo))
                step += count
        dy = record.reshape(*y.shape, -1)[:, :, :size]
        return Derivatives(y, dy, x_end, np.empty((len(grid.rows), 0, size)))

    def _rate_values(
        self, program: Program, grid: TimeGrid, values: Array, stage_states: Array, steps: slice, threads: int
    ) -> Array:
        """Derivatives of the rates (nodes, 4 steps) at the stages of some steps, followed by those through servos."""
        # A step has three rows of inputs; its second and third stage share the middle one.
        rows = (3 * np.arange(steps.start, steps.stop)[:, None] + np.array([0, 1, 1, 2])).ravel()
        states = stage_states[:, 4 * steps.start : 4 * steps.stop]
        moves = self._servos.moves(program, grid, values, states[:, ::4], steps, threads)
        row = (grid.stage_inputs[rows].T, grid.stage_t[None, rows], grid.stage_trial[None, rows])
        acting = np.concatenate([states, *row, self._servos.acting(moves)])
        found = self._values(program, self._rates, values, acting, threads, beside=self._servos.count)
        direct = found[: len(self._rates.nodes)]
        found[len(direct) :] = self._servos.values(moves, direct, grid.step[steps])
        return found

    def _values(
        self, program: Program, wanted: Partials, values: Array, rows: Array, threads: int, beside: int = 0
    ) -> Array:
        """Values (nodes, N) of derivatives on rows of the leaves of `Program.by_row`, with so many rows beside them."""
        if not wanted.nodes or not rows.shape[1]:
            return np.zeros((len(wanted.nodes) + beside, rows.shape[1]))
        parameters = self._equations.parameters
        found = program.evaluate(
            id(wanted), program.by_row, parameters, wanted.nodes, values[None], rows, threads, beside=beside
        )
        return np.asarray(found[0])

    def _pattern(self, values: Array) -> _Pattern:
        """What does not vanish at these values (n_parameters,)."""
        e, zero = self._equations, values == 0.0
        key = zero.tobytes()
        if key not in self._patterns:
            leaves = [node for node, off in zip(e.parameters, zero) if off]
            a, b = self._servos.left(leaves)
            c, d = self._output_entries(leaves)
            alive = np.zeros(len(e.states), dtype=np.bool_)
            alive[c.by] = True
            for _ in e.states:
                alive[a.by[alive[a.root]]] = True
            live = np.flatnonzero(alive)
            number = np.cumsum(alive) - 1
            a, b = a.only(alive[a.root]), b.only(alive[b.root])
            self._patterns[key] = _Pattern(
                live,
                Entries(number[a.root], number[a.by], a.place),
                Entries(number[b.root], b.by, b.place),
                Entries(c.root, number[c.by], c.place),
                d,
            )
        return self._patterns[key]

    def _output_entries(self, zero: Sequence[Node]) -> tuple[Entries, Entries]:
        """Entries of the outputs, by states and by parameters, that do not vanish where these leaves are zero.

        At a sample a servo's state acts.
        """
        wanted, states = self._outputs, self._servos.states
        through = Entries(wanted.by_acting.root, states[wanted.by_acting.by], wanted.by_acting.place)
        left = wanted.left(zero)
        by_state = wanted.by_state.beside(through)
        return by_state.only(left[by_state.place]), wanted.by_parameter.only(left[wanted.by_parameter.place])


class _OfBlocks:
    """Which entries of the lanes' own belong to which block of directions."""

    def __init__(self, buffers: Mapping[str, Buffer], name: str, rows: int) -> None:
        starts = buffers[f"{name}_start"]
        self.place: Integers = np.array(buffers[f"{name}_place"], dtype=np.int64)
        # Entries stand in the order of their rows, and rows in that of the blocks.
        row = np.searchsorted(starts, np.arange(len(self.place)), side="right") - 1
        self.block = row // max(1, rows)


def _moving(x: Buffer, own: Sequence[tuple[_OfBlocks, Array]]) -> Integers:
    """The blocks of directions in which anything moves over a stretch: from its begin, or by an entry of their own.

    A force between two knots moves nothing before the first of them.
    """
    moves: Flags = np.any(x.reshape(len(x), -1), axis=1)
    for of, values in own:
        still = ~moves[of.block]
        acts = values[of.place[still]].any(axis=1)
        moves[of.block[still][acts]] = True
    return np.flatnonzero(moves).astype(np.int64)


def _stretches(substeps: Integers, steps: int) -> list[tuple[int, int]]:
    """Samples (begin, end) of the parts of a trial, each of about so many steps."""
    part = (np.cumsum(substeps) - substeps) // steps
    edges = [0, *(np.flatnonzero(np.diff(part)) + 1).tolist(), len(substeps)]
    return list(pairwise(edges))


@cache
def _kernel() -> Kernel:
    return kernel(propagation_kernel(NARROW))


_sensitivities: WeakKeyDictionary[Program, Sensitivities] = WeakKeyDictionary()


def sensitivities(program: Program) -> Sensitivities:
    """The derivatives of a program's equations, made once for each program.

    Raises PluginError where they have too many operations.
    """
    if program not in _sensitivities:
        try:
            _sensitivities[program] = Sensitivities(program)
        except NotTraceable as problem:
            raise PluginError(
                f"the derivatives of its equations cannot be compiled: {problem}",
                where="the model with its effects",
                do="Let fewer effects take part (--effects), or wrap the model as a BlackBox.",
            ) from None
    return _sensitivities[program]
