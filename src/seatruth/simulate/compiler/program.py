"""The compiled program of a model: its traced equations, their derivatives, and the kernels made of them so far."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Collection, Sequence
from functools import cached_property
from typing import Literal, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Model
from seatruth.simulate.compiler.kernels import (
    EVALUATION_CONTEXT,
    SIMULATION_CONTEXT,
    Mode,
    evaluation_kernel,
    row_features,
    servo_values,
    simulation_kernel,
)
from seatruth.simulate.compiler.lanes import FEW, NARROW, from_groups, from_lanes, in_groups, lane_blocks, to_lanes
from seatruth.simulate.compiler.machine_code import Kernel, kernel
from seatruth.simulate.compiler.node import Node, leaves_among, ordered
from seatruth.simulate.compiler.pool import Buffer, Kept, run_kernel
from seatruth.simulate.compiler.system import Directions, System, differentiated, differentiated_rates
from seatruth.simulate.compiler.trace import Equations, trace
from seatruth.simulate.time_grid import TimeGrid

_CHUNK = 512
"""Rows of one task of an evaluation; a multiple of every width. Chosen here [S]: long against the task's overhead."""
_MOST_GROUPS = 6
"""Groups of directions in one kernel: more would run little faster and compile longer. Chosen here [S]: with five, the
20 directions of a ship's model take half the time of five kernels' runs (experiments/engine_speed.py)."""
_MOST_OPERATIONS = 6000
"""Operations of a kernel of several groups: with many effects a model has one group, or its kernel would take minutes
to compile. Chosen here [S]: the largest built-in model has 700, and 1900 with one direction."""
_MOST_DERIVATIVES = 512 * 1024 * 1024
"""Bytes of derivatives that one call of a kernel records; more directions take several calls. Chosen here [S]."""


class Derivatives(NamedTuple):
    """See `seatruth.simulate.base.Jacobian`."""

    y: Array
    dy: Array
    x_end: Array
    dx_end: Array


class _SimulationKernel(NamedTuple):
    """A kernel, and the nodes of inputs and time alone that it reads at the stages of a step, for a step, and at the
    samples.
    """

    kernel: Kernel
    stage_features: tuple[Node, ...]
    step_features: tuple[Node, ...]
    sample_features: tuple[Node, ...]


class Program:
    """All kernels of one model; each is compiled when it is first needed."""

    def __init__(self, model: Model) -> None:
        self.equations: Equations = trace(model)
        self._simulation_kernels: dict[tuple[str, int], _SimulationKernel] = {}
        self._systems: dict[int, System] = {}
        self._evaluation_kernels: dict[object, Kernel] = {}
        self._features: WeakKeyDictionary[TimeGrid, dict[object, Array]] = WeakKeyDictionary()
        self._moves: dict[tuple[int, int, frozenset[int]], dict[int, int] | None] = {}
        self._buffers: WeakKeyDictionary[TimeGrid, dict[int, tuple[_SimulationKernel, Kept]]] = WeakKeyDictionary()

    def squared_errors(
        self, grid: TimeGrid, values: Array, x0: Array, weighted_measured: Array, weights: Array, threads: int
    ) -> tuple[Array, Array]:
        """Sums (P, T, D) of (weighted measured - weight x simulated)^2, and last states (P, T, S).

        values (P, n_parameters), x0 (P, T, S), weighted_measured and weights (N, D).
        """
        parts = [
            self._squared_errors(grid, values[part], x0[part], weighted_measured, weights, threads, width)
            for part, width in lane_blocks(len(values), len(grid.rows), threads)
        ]
        if len(parts) == 1:
            return parts[0]
        return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])

    def _squared_errors(
        self,
        grid: TimeGrid,
        values: Array,
        x0: Array,
        weighted_measured: Array,
        weights: Array,
        threads: int,
        width: int,
    ) -> tuple[Array, Array]:
        e = self.equations
        lanes, starts = to_lanes(values, width), to_lanes(x0, width)
        sums = np.empty((len(lanes), len(grid.rows), len(e.outputs), width))
        x_end = np.empty((len(lanes), len(grid.rows), len(e.states), width))
        system = System(e.states, e.rates, e.outputs, e.parameters, e.driven)
        chosen = self._simulation_kernel("squared errors", width, system)
        arrays = {"weighted_measured": weighted_measured, "weights": weights, "sums": sums, "x_end": x_end}
        self._simulate(chosen, grid, lanes, starts, threads, arrays)
        return from_lanes(sums, len(values)), from_lanes(x_end, len(values))

    def record(
        self, grid: TimeGrid, values: Array, x0: Array, threads: int, *, what: Literal["outputs", "states"]
    ) -> tuple[Array, Array]:
        """Outputs (P, N, D) or states (P, N, S), and last states (P, T, S): values (P, n_parameters), x0 (P, T, S)."""
        e = self.equations
        roots = e.outputs if what == "outputs" else e.states
        width = FEW if len(values) <= FEW else NARROW
        lanes, starts = to_lanes(values, width), to_lanes(x0, width)
        record = np.full((len(lanes), len(grid.t), len(roots), width), math.nan)
        x_end = np.empty((len(lanes), len(grid.rows), len(e.states), width))
        chosen = self._simulation_kernel(what, width, System(e.states, e.rates, roots, e.parameters, e.driven))
        self._simulate(chosen, grid, lanes, starts, threads, {"record": record, "x_end": x_end})
        return from_lanes(record, len(values)), from_lanes(x_end, len(values))

    def stages(self, grid: TimeGrid, values: Array, x0: Array, threads: int) -> tuple[Array, Array, Array]:
        """States of one candidate: values (n_parameters,), x0 (T, S).

        Returns them at the four stages of every step (S, 4 M), at the samples (N, S), and the last ones (T, S).
        """
        e = self.equations
        lanes, starts = to_lanes(values[None], FEW), to_lanes(x0[None], FEW)
        record = np.full((1, len(grid.t), len(e.states), FEW), math.nan)
        x_end = np.empty((1, len(grid.rows), len(e.states), FEW))
        stage_states = np.full((len(e.states), 4 * grid.steps), math.nan)
        chosen = self._simulation_kernel("stages", FEW, System(e.states, e.rates, e.states, e.parameters, e.driven))
        arrays = {"record": record, "x_end": x_end, "stage_states": stage_states}
        self._simulate(chosen, grid, lanes, starts, threads, arrays)
        return stage_states, record[0, :, :, 0], x_end[0, :, :, 0]

    def jacobian(
        self,
        grid: TimeGrid,
        values: Array,
        x0: Array,
        along: Directions,
        threads: int,
    ) -> Derivatives:
        """One candidate's derivatives in some directions: values (n_parameters,), x0 (T, S).

        A kernel takes FEW directions in the lanes of each of its groups, so that its lanes need the values once.
        """
        e, size = self.equations, along.size
        states, outputs, samples, parameters = len(e.states), len(e.outputs), len(grid.t), len(e.parameters)
        blocks = max(1, -(-size // (FEW * self._most_groups)))
        groups = max(1, -(-size // (FEW * blocks)))
        moved = np.zeros((blocks * groups * FEW, parameters))
        moved[np.arange(len(along.columns)), along.columns] = 1.0
        first = np.zeros((blocks * groups * FEW, states))
        first[:size] = along.first_states(states)
        lanes = np.empty((blocks, (1 + groups) * parameters, FEW))
        lanes[:, :parameters] = values[:, None]
        lanes[:, parameters:] = in_groups(moved, blocks)
        starts = np.empty((blocks, len(grid.rows), (1 + groups) * states, FEW))
        starts[:, :, :states] = x0[:, :, None]
        starts[:, :, states:] = in_groups(first, blocks)[:, None]
        system = self._differentiated(groups)
        chosen = self._simulation_kernel(f"derivatives in {groups} groups", FEW, system)
        at_once = max(1, _MOST_DERIVATIVES // (samples * len(system.outputs) * 8 * FEW))
        dy, dx_end = [], []
        for k in range(0, blocks, at_once):
            block = slice(k, min(k + at_once, blocks))
            count = block.stop - block.start
            record = np.full((count, samples, len(system.outputs), FEW), math.nan)
            last = np.empty((count, len(grid.rows), len(system.states), FEW))
            self._simulate(chosen, grid, lanes[block], starts[block], threads, {"record": record, "x_end": last})
            dy.append(from_groups(record[:, :, outputs:], groups))
            dx_end.append(from_groups(last[:, :, states:], groups))
        y, x_end = np.array(record[0, :, :outputs, 0]), np.array(last[0, :, :states, 0])
        return Derivatives(y, _joined(dy, size), x_end, _joined(dx_end, size))

    def rates(self, values: Array, leaves: Array, threads: int) -> Array:
        """Rates (P, S, N) on rows: `values` (P, n_parameters); `leaves` (S + I + 2, N): states, inputs, time, trial."""
        e = self.equations
        return self.evaluate("rates", self.by_row, e.parameters, e.rates, values, self.acting(leaves), threads)

    def rate_derivatives(self, directions: Array, leaves: Array, threads: int) -> Array:
        """Derivatives (P, S, N) of the rates, each along one direction: `directions` (P, 2 n_parameters) holds the
        values, then the direction; `leaves` as in `rates`.
        """
        d, rows = self._differentiated_rates, self.acting(leaves)
        return self.evaluate("rate derivatives", self.by_row, d.parameters, d.rates, directions, rows, threads)

    @property
    def by_row(self) -> tuple[Node, ...]:
        """Leaves that change by row where the equations are evaluated without simulation."""
        e = self.equations
        return (*e.states, *e.inputs, e.time, e.trial, *(servo.acting for servo in e.driven))

    def acting(self, leaves: Array) -> Array:
        """Rows of leaves (S + I + 2, N), followed by what acts on the inputs behind servos: the servos' states."""
        order = [id(state) for state in self.equations.states]  # nodes compare as numbers do
        places = [order.index(id(servo.state)) for servo in self.equations.driven]
        return np.concatenate([leaves, leaves[places]]) if places else leaves

    @cached_property
    def _most_groups(self) -> int:
        """Groups of directions for which one kernel is worth its compilation."""
        e, one = self.equations, self._differentiated(1)
        plain = len(ordered([*e.rates, *e.outputs]))
        each = len(ordered([*one.rates, *one.outputs])) - plain
        return int(np.clip((_MOST_OPERATIONS - plain) // max(each, 1), 1, _MOST_GROUPS))

    def _differentiated(self, groups: int) -> System:
        if groups not in self._systems:
            self._systems[groups] = differentiated(self.equations, groups)
        return self._systems[groups]

    @cached_property
    def _differentiated_rates(self) -> System:
        return differentiated_rates(self.equations)

    def _simulation_kernel(self, what: str, width: int, system: System) -> _SimulationKernel:
        key = (what, width)
        if key not in self._simulation_kernels:
            mode: Mode = "squared errors" if what == "squared errors" else "stages" if what == "stages" else "record"
            self._simulation_kernels[key] = _SimulationKernel(
                kernel(simulation_kernel(width, mode, *system)),
                tuple(row_features(system.rates)),
                tuple(row_features(servo_values(system.driven))),
                tuple(row_features(system.outputs)),
            )
        return self._simulation_kernels[key]

    def _simulate(
        self,
        chosen: _SimulationKernel,
        grid: TimeGrid,
        lanes: Array,
        x0: Array,
        threads: int,
        arrays: dict[str, Array],
    ) -> None:
        """Runs a simulation kernel: lanes (blocks, n_parameters, width), x0 (blocks, T, S, width)."""
        tasks = len(lanes) * len(grid.rows)
        buffers: dict[str, Buffer] = {
            "counter": np.zeros(1, dtype=np.int64),
            "parameters": lanes,
            "x0": x0,
            **arrays,
        }
        sizes = {"tasks": tasks, "trials": len(grid.rows), "samples": len(grid.t), "stages": 4 * grid.steps}
        run_kernel(chosen.kernel, SIMULATION_CONTEXT, buffers, sizes, threads, tasks, self._grid_buffers(grid, chosen))

    def _grid_buffers(self, grid: TimeGrid, chosen: _SimulationKernel) -> Kept:
        """What a kernel reads of a grid: kept as long as both."""
        kept = self._buffers.setdefault(grid, {})
        if id(chosen) not in kept:
            buffers = Kept(
                {
                    "start": grid.start,
                    "substeps": grid.substeps,
                    "length": grid.length,
                    "stage_start": grid.stage_start,
                    "stage_features": self._grid_features(
                        grid, chosen.stage_features, grid.stage_t, grid.stage_trial, grid.stage_inputs
                    ),
                    "step_features": self._step_features(grid, chosen.step_features),
                    "sample_features": self._grid_features(
                        grid, chosen.sample_features, grid.t, grid.trial, grid.inputs
                    ),
                }
            )
            kept[id(chosen)] = chosen, buffers  # the kernel too, so that no other one gets its id
        return kept[id(chosen)][1]

    def _grid_features(
        self, grid: TimeGrid, features: tuple[Node, ...], t: Array, trial: Array, inputs: Array
    ) -> Array:
        """Nodes of inputs and time alone, evaluated on the grid's rows (rows, features); kept as long as the grid."""
        kept = self._features.setdefault(grid, {})
        key = (id(t), id(features))
        if key not in kept:
            e = self.equations
            moved = None if grid.base is None else self._moved(features, e.inputs, grid.changed)
            if grid.base is None or moved is None:
                rows = np.stack([*inputs.T, t, trial]) if features else np.zeros((0, len(t)))
                kept[key] = self._feature_values(features, (*e.inputs, e.time, e.trial), rows)
            else:
                before = grid.base.inputs if t is grid.t else grid.base.stage_inputs
                kept[key] = self._grid_features(grid.base, features, t, trial, before)
                if moved:
                    kept[key] = kept[key].copy()
                    for place, k in moved.items():
                        kept[key][:, place] = inputs[:, k]
        return kept[key]

    def _moved(
        self, features: tuple[Node, ...], leaves: Sequence[Node], changed: Collection[int]
    ) -> dict[int, int] | None:
        """Places of the features that are leaves that changed, each with that leaf's; None where others change too."""
        key = (id(features), id(leaves), frozenset(changed))
        if key not in self._moves:
            self._moves[key] = leaves_among(features, {id(leaves[k]): k for k in changed})
        return self._moves[key]

    def _step_features(self, grid: TimeGrid, features: tuple[Node, ...]) -> Array:
        """Nodes of a step's orders and its length alone, for every step (M, features); kept as long as the grid."""
        kept, e = self._features.setdefault(grid, {}), self.equations
        key = ("steps", id(features))
        if key not in kept and not features:
            kept[key] = np.zeros((grid.steps, 0))
        if key not in kept and grid.base is not None:
            moved = [self._moved(features, leaves, grid.changed) for leaves in (e.orders, e.later)]
            if moved == [{}, {}]:
                kept[key] = self._step_features(grid.base, features)
        if key not in kept:
            rows = np.stack([*grid.stage_inputs[0::3].T, *grid.stage_inputs[2::3].T, grid.step])
            kept[key] = self._feature_values(features, (*e.orders, *e.later, e.length), rows)
        return kept[key]

    def _feature_values(self, features: Sequence[Node], leaves: Sequence[Node], rows: Array) -> Array:
        """Nodes (N, features) that depend on leaves alone, whose values are `rows` (leaves, N)."""
        columns = {id(node): row for node, row in zip(leaves, rows)}
        if not features or not rows.shape[1]:
            return np.zeros((rows.shape[1], len(features)))
        if all(id(node) in columns for node in features):
            return np.ascontiguousarray(np.stack([columns[id(node)] for node in features], axis=1))
        roots = [self.equations.graph.number(node) for node in features]
        key = ("features", *(id(node) for node in roots))
        values = self.evaluate(key, leaves, (), roots, np.zeros((1, 0)), rows, 1)
        return np.ascontiguousarray(values[0].T)

    def evaluate(
        self,
        key: object,
        leaves: Sequence[Node],
        parameters: Sequence[Node],
        roots: Sequence[Node],
        values: Array,
        rows: Array,
        threads: int,
        beside: int = 0,
    ) -> Array:
        """Nodes (P, roots, N) on rows: values (P, parameters), rows (leaves, N).

        Of one candidate there may be room for so many rows `beside` them: (1, roots + beside, N).
        """
        if key not in self._evaluation_kernels:
            self._evaluation_kernels[key] = kernel(evaluation_kernel(NARROW, leaves, parameters, roots))
        size = rows.shape[1]
        padded = -(-size // NARROW) * NARROW
        if padded != size:
            rows = np.concatenate([rows, np.repeat(rows[:, -1:], padded - size, axis=1)], axis=1)
        answer = np.empty((len(values), len(roots) + beside, padded))
        chunks = -(-padded // _CHUNK)
        tasks = chunks * len(values)
        buffers: dict[str, Buffer] = {
            "counter": np.zeros(1, dtype=np.int64),
            "leaves": np.ascontiguousarray(rows),
            "parameters": np.ascontiguousarray(values),
            "values": answer,
        }
        sizes = {"tasks": tasks, "chunks": chunks, "chunk": _CHUNK, "rows": padded}
        run_kernel(self._evaluation_kernels[key], EVALUATION_CONTEXT, buffers, sizes, threads, tasks)
        return answer[:, :, :size]


def _joined(parts: Sequence[Array], size: int) -> Array:
    """The first `size` directions of these parts."""
    whole = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2)
    return np.ascontiguousarray(whole[:, :, :size])


def fingerprint(model: Model) -> str:
    """Hash of a model's equations themselves, whatever functions, files and closures they are written in.

    It identifies the equations, not the compiler: other versions of seatruth give the same hash as long as they trace
    the same operations.
    """
    e = program(model).equations
    roots = (*e.rates, *e.outputs, *servo_values(e.driven))
    nodes = ordered(roots)
    number = {id(node): k for k, node in enumerate(nodes)}
    lines = [f"{node.op} {node.value!r} {[number[id(a)] for a in node.args]}" for node in nodes]
    sizes = [len(part) for part in (e.states, e.inputs, e.parameters, e.rates, e.outputs)]
    text = "\n".join([*lines, repr([number[id(root)] for root in roots]), repr(sizes)])
    return hashlib.sha256(text.encode()).hexdigest()


_programs: WeakKeyDictionary[Model, Program] = WeakKeyDictionary()


def program(model: Model) -> Program:
    """The compiled program of a model, made once for each model object."""
    if model not in _programs:
        _programs[model] = Program(model)
    return _programs[model]
