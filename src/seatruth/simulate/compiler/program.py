"""A model's kernels, compiled when first needed, and the arrays that they work on."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from functools import cached_property
from typing import Literal, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.models.base import Model
from seatruth.simulate.compiler.compiled import Kernel, kernel, vector_bytes
from seatruth.simulate.compiler.derivatives import directional
from seatruth.simulate.compiler.graph import BOTH, LANE, Node
from seatruth.simulate.compiler.kernels import MAPPING, MARCHING, as_number, mapping, marching, row_features
from seatruth.simulate.compiler.trace import Equations, trace
from seatruth.simulate.grid import Grid
from seatruth.simulate.threads import run

Words = NDArray[np.float64] | NDArray[np.int64]
What = Literal["outputs", "states"]
_NARROW = 8
_STRETCH = 512
"""Rows of one task of a mapping; a multiple of every width."""
_MOST_DIRECTIONS = 512 * 1024 * 1024
"""Bytes of derivatives that one call records at a time."""


class Derivatives(NamedTuple):
    """See `CompiledSimulator.jacobian`."""

    y: Array
    dy: Array
    end: Array
    dend: Array


class Program:
    """Everything compiled of one model."""

    def __init__(self, model: Model) -> None:
        self.equations: Equations = trace(model)
        self._marches: dict[tuple[str, int], _March] = {}
        self._maps: dict[object, Kernel] = {}
        self._features: WeakKeyDictionary[Grid, dict[object, Array]] = WeakKeyDictionary()

    def sums(
        self, grid: Grid, values: Array, x0: Array, weighted: Array, weights: Array, threads: int
    ) -> tuple[Array, Array]:
        """Squares (P, T, D) and last states (P, T, S)."""
        found = [
            self._sums(grid, values[part], x0[part], weighted, weights, threads, width)
            for part, width in _parts(len(values), len(grid.rows), threads)
        ]
        if len(found) == 1:
            return found[0]
        return np.concatenate([part[0] for part in found]), np.concatenate([part[1] for part in found])

    def _sums(
        self, grid: Grid, values: Array, x0: Array, weighted: Array, weights: Array, threads: int, width: int
    ) -> tuple[Array, Array]:
        e = self.equations
        lanes, first = padded(values, width), padded(x0, width)
        blocks, trials = len(lanes), len(grid.rows)
        squares = np.empty((blocks, trials, len(e.outputs), width))
        end = np.empty((blocks, trials, len(e.states), width))
        march = self._marching("sums", width, _System(e.states, e.rates, e.outputs, e.parameters))
        arrays = {"weighted": weighted, "weights": weights, "squares": squares, "end": end}
        self._march(march, grid, lanes, first, threads, arrays)
        return unpadded(squares, len(values)), unpadded(end, len(values))

    def record(self, grid: Grid, values: Array, x0: Array, threads: int, *, what: What) -> tuple[Array, Array]:
        """Outputs (P, N, D) or states (P, N, S), and last states (P, T, S)."""
        e = self.equations
        roots = e.outputs if what == "outputs" else e.states
        width = _NARROW
        lanes, first = padded(values, width), padded(x0, width)
        record = np.full((len(lanes), len(grid.t), len(roots), width), math.nan)
        end = np.empty((len(lanes), len(grid.rows), len(e.states), width))
        march = self._marching(what, width, _System(e.states, e.rates, roots, e.parameters))
        self._march(march, grid, lanes, first, threads, {"record": record, "end": end})
        return unpadded(record, len(values)), unpadded(end, len(values))

    def jacobian(
        self,
        grid: Grid,
        values: Array,
        x0: Array,
        columns: NDArray[np.intp],
        kept: Sequence[int],
        threads: int,
        along: Sequence[tuple[int, int, float]] = (),
    ) -> Derivatives:
        """Derivatives by parameters `columns` and initial states `kept`; a lane is a direction.

        `along` are states (second) that move with a kept one (first, its place in `kept`), so much (third).
        """
        e, size = self.equations, len(columns) + len(kept)
        states, outputs, samples = len(e.states), len(e.outputs), len(grid.t)
        parameters = len(e.parameters)
        seeds = np.zeros((max(size, 1), 2 * parameters))
        seeds[:, :parameters] = values
        seeds[np.arange(len(columns)), parameters + columns] = 1.0
        first = np.zeros((max(size, 1), len(grid.rows), 2 * states))
        first[:, :, :states] = x0
        first[len(columns) + np.arange(len(kept)), :, states + np.array(kept, dtype=np.intp)] = 1.0
        for k, state, sign in along:
            first[len(columns) + k, :, states + state] = sign
        y, end = np.empty((samples, outputs)), np.empty((len(grid.rows), states))
        dy, dend = np.empty((samples, outputs, size)), np.empty((len(grid.rows), states, size))
        d = self._directional
        march = self._marching("jacobian", _NARROW, d)
        at_once = max(1, _MOST_DIRECTIONS // (samples * len(d.outputs) * 8 * _NARROW)) * _NARROW
        for k in range(0, max(size, 1), at_once):
            part = slice(k, min(k + at_once, size))
            lanes, start = padded(seeds[k : k + at_once], _NARROW), padded(first[k : k + at_once], _NARROW)
            record = np.full((len(lanes), samples, len(d.outputs), _NARROW), math.nan)
            last = np.empty((len(lanes), len(grid.rows), len(d.states), _NARROW))
            found = {"record": record, "end": last}
            self._march(march, grid, lanes, start, threads, found)
            y[:], end[:] = record[0, :, :outputs, 0], last[0, :, :states, 0]
            wanted = part.stop - part.start
            if wanted:
                dy[:, :, part] = _spread(record[:, :, outputs:], wanted)
                dend[:, :, part] = _spread(last[:, :, states:], wanted)
        return Derivatives(y, dy, end, dend)

    def rates(self, values: Array, leaves: Array, threads: int) -> Array:
        """Rates (P, S, N) on rows: `leaves` (S + I + 1, N) are states, inputs and time, `values` (P, n_parameters)."""
        e = self.equations
        return self._map("rates", (*e.states, *e.inputs, e.time), e.parameters, e.rates, values, leaves, threads)

    def rate_directions(self, values: Array, leaves: Array, threads: int) -> Array:
        """Derivatives of the rates (P, S, N) along one direction: `values` (P, 2 n_parameters) with the direction."""
        e, d = self.equations, self._directional_rates
        known = (*e.states, *e.inputs, e.time)
        return self._map("rate directions", known, d.parameters, d.rates, values, leaves, threads)

    @cached_property
    def _directional(self) -> _System:
        """The equations with their derivative along a direction in parameters and states."""
        e = self.equations
        dp = [e.graph.leaf("parameter direction", k, LANE) for k in range(len(e.parameters))]
        ds = [e.graph.leaf("state direction", k, BOTH) for k in range(len(e.states))]
        along = {id(leaf): d for leaf, d in (*zip(e.parameters, dp), *zip(e.states, ds))}
        found = directional([*e.rates, *e.outputs], along)
        size = len(e.rates)
        return _System((*e.states, *ds), (*e.rates, *found[:size]), (*e.outputs, *found[size:]), (*e.parameters, *dp))

    @cached_property
    def _directional_rates(self) -> _System:
        e = self.equations
        dp = [e.graph.leaf("parameter direction", k, LANE) for k in range(len(e.parameters))]
        along = {id(leaf): d for leaf, d in zip(e.parameters, dp)}
        return _System(e.states, tuple(directional(e.rates, along)), (), (*e.parameters, *dp))

    def _marching(self, what: str, width: int, of: _System) -> _March:
        key = (what, width)
        if key not in self._marches:
            mode: Literal["sums", "record"] = "sums" if what == "sums" else "record"
            self._marches[key] = _March(
                kernel(marching(width, mode, of.states, of.rates, of.outputs, of.parameters)),
                tuple(row_features(of.rates)),
                tuple(row_features(of.outputs)),
            )
        return self._marches[key]

    def _march(
        self, march: _March, grid: Grid, lanes: Array, first: Array, threads: int, arrays: dict[str, Array]
    ) -> None:
        tasks = len(lanes) * len(grid.rows)
        counter = np.zeros(1, dtype=np.int64)
        held: dict[str, Words] = {
            "counter": counter,
            "parameters": lanes,
            "first": first,
            "start": grid.start,
            "substeps": grid.substeps,
            "length": grid.length,
            "stage_start": grid.stage_start,
            "stage_features": self._feature_rows(grid, march.stage, grid.stage_t, grid.stage_inputs),
            "sample_features": self._feature_rows(grid, march.sample, grid.t, grid.inputs),
            **arrays,
        }
        sizes = {"tasks": tasks, "trials": len(grid.rows), "samples": len(grid.t)}
        _run(march.kernel, MARCHING, held, sizes, threads, tasks)

    def _feature_rows(self, grid: Grid, features: tuple[Node, ...], t: Array, inputs: Array) -> Array:
        """What a kernel needs of inputs and time, (rows, features); kept with the grid."""
        kept = self._features.setdefault(grid, {})
        key = (id(t), id(features))
        if key not in kept:
            kept[key] = self._evaluated(features, t, inputs)
        return kept[key]

    def _evaluated(self, features: Sequence[Node], t: Array, inputs: Array) -> Array:
        e = self.equations
        columns = {id(node): inputs[:, k] for k, node in enumerate(e.inputs)} | {id(e.time): t}
        if not features or not len(t):
            return np.zeros((len(t), len(features)))
        if all(id(node) in columns for node in features):
            return np.ascontiguousarray(np.stack([columns[id(node)] for node in features], axis=1))
        roots = [as_number(node) for node in features]
        leaves = np.stack([*inputs.T, t])
        key = ("features", *(id(node) for node in roots))
        found = self._map(key, (*e.inputs, e.time), (), roots, np.zeros((1, 0)), leaves, 1)
        return np.ascontiguousarray(found[0].T)

    def _map(
        self,
        key: object,
        leaves: Sequence[Node],
        parameters: Sequence[Node],
        roots: Sequence[Node],
        values: Array,
        rows: Array,
        threads: int,
    ) -> Array:
        if key not in self._maps:
            self._maps[key] = kernel(mapping(_NARROW, leaves, parameters, roots))
        size = rows.shape[1]
        full = -(-size // _NARROW) * _NARROW
        if full != size:
            rows = np.concatenate([rows, np.repeat(rows[:, -1:], full - size, axis=1)], axis=1)
        found = np.empty((len(values), len(roots), full))
        stretches = -(-full // _STRETCH)
        tasks = stretches * len(values)
        held: dict[str, Words] = {
            "counter": np.zeros(1, dtype=np.int64),
            "leaves": np.ascontiguousarray(rows),
            "parameters": np.ascontiguousarray(values),
            "values": found,
        }
        sizes = {"tasks": tasks, "stretches": stretches, "stretch": _STRETCH, "rows": full}
        _run(self._maps[key], MAPPING, held, sizes, threads, tasks)
        return found[:, :, :size]


class _March(NamedTuple):
    """A kernel, and what it needs of inputs and time at the stages of a step and at the samples."""

    kernel: Kernel
    stage: tuple[Node, ...]
    sample: tuple[Node, ...]


class _System(NamedTuple):
    """Equations to be marched, with or without their derivatives along a direction."""

    states: tuple[Node, ...]
    rates: tuple[Node, ...]
    outputs: tuple[Node, ...]
    parameters: tuple[Node, ...]


def fingerprint(model: Model) -> str:
    """Hash of a model's equations themselves, whatever functions, files and closures they were written in."""
    e = program(model).equations
    return hashlib.sha256(
        mapping(_NARROW, (*e.states, *e.inputs, e.time), e.parameters, (*e.rates, *e.outputs)).encode()
    ).hexdigest()


_programs: WeakKeyDictionary[Model, Program] = WeakKeyDictionary()


def program(model: Model) -> Program:
    """The compiled program of a model, made once for each model object."""
    found = _programs.get(model)
    if found is None:
        found = _programs[model] = Program(model)
    return found


def padded(values: Array, width: int) -> Array:
    """(P, ...) -> (blocks, ..., width): candidates in lanes; the last one fills what is left."""
    size, shape = len(values), values.shape[1:]
    blocks = -(-size // width)
    lanes = np.empty((blocks, *shape, width))
    whole = size // width
    if whole:
        split = values[: whole * width].reshape(whole, width, *shape)
        lanes[:whole] = split.transpose(0, *range(2, split.ndim), 1)
    if whole != blocks:
        rest = size - whole * width
        lanes[whole, ..., :rest] = values[whole * width :].transpose(*range(1, values.ndim), 0)
        lanes[whole, ..., rest:] = values[-1][..., None]
    return lanes


def unpadded(lanes: Array, size: int) -> Array:
    """(blocks, ..., width) -> (P, ...)."""
    last = lanes.ndim - 1
    return lanes.transpose(0, last, *range(1, last)).reshape(-1, *lanes.shape[1:-1])[:size]


def _spread(lanes: Array, size: int) -> Array:
    """(blocks, rows, columns, width) -> (rows, columns, size)."""
    moved = np.moveaxis(lanes, 0, 2)
    return np.asarray(moved.reshape(*moved.shape[:2], -1)[:, :, :size])


def _parts(size: int, trials: int, threads: int) -> list[tuple[slice, int]]:
    """Candidates and the lanes that they run in, so that all threads end at about the same time.

    Two vectors of the widest kind run together faster than one after the other, but in coarser tasks: they take as
    many candidates as give every thread the same number of them, single vectors the rest. What a lane computes does
    not depend on it.
    """
    wide = 2 * _NARROW
    if vector_bytes() != 64 or size * trials < wide * threads:
        return [(slice(0, size), _NARROW)]
    if size * trials >= 16 * wide * threads:
        return [(slice(0, size), wide)]
    even = wide * threads // math.gcd(trials, threads)
    cut = size // even * even
    return (
        [(slice(0, cut), wide), (slice(cut, size), _NARROW)]
        if 0 < cut < size
        else [(slice(0, size), wide if cut else _NARROW)]
    )


def _run(
    march: Kernel,
    words: Sequence[str],
    held: dict[str, Words],
    sizes: dict[str, int],
    threads: int,
    tasks: int,
) -> None:
    context = np.array([_address(held[word]) if word in held else sizes.get(word, 0) for word in words], dtype=np.int64)
    run(march, _address(context), threads, tasks, (context, held))


def _address(array: Words) -> int:
    return int(array.__array_interface__["data"][0])  # several times faster than array.ctypes.data
