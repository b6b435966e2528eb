"""Candidates in the lanes of vectors: how many lanes a block has, and the arrays in that order."""

from __future__ import annotations

import math

import numpy as np

from seatruth.arrays import Array
from seatruth.simulate.compiler.machine_code import vector_bytes

NARROW = 8
"""Lanes of a block: doubles in the widest vector of present processors (AVX-512), two or four vectors elsewhere."""
WIDE = 2 * NARROW
FEW = NARROW // 2
"""Lanes where no more candidates are left. Divisions and roots of the widest vectors take longer, and processors that
run them in two halves take twice as long for all else: one candidate takes a fifth to a third less time with these
(experiments/engine_speed.py)."""
_PLENTY = 16
"""Wide tasks a thread from which on uneven ends do not matter: at most a sixteenth of the time. Chosen here [S]."""


def to_lanes(values: Array, width: int) -> Array:
    """(P, ...) -> (blocks, ..., width): candidates in lanes; the last candidate fills the lanes that are left."""
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


def from_lanes(lanes: Array, size: int) -> Array:
    """(blocks, ..., width) -> (P, ...) for P = `size` candidates."""
    last = lanes.ndim - 1
    return lanes.transpose(0, last, *range(1, last)).reshape(-1, *lanes.shape[1:-1])[:size]


def lane_blocks(size: int, trials: int, threads: int) -> list[tuple[slice, int]]:
    """Candidates and the width of the blocks in which they run, so that all threads end at about the same time.

    Two of the widest vectors run together faster than one after the other, but make coarser tasks: they take as many
    candidates as give every thread the same number of tasks, single vectors take the rest. The numbers of a lane do
    not depend on the width.
    """
    if size <= FEW:
        return [(slice(0, size), FEW)]
    if vector_bytes() != 64 or size * trials < WIDE * threads:
        return [(slice(0, size), NARROW)]
    if size * trials >= _PLENTY * WIDE * threads:
        return [(slice(0, size), WIDE)]
    even = WIDE * threads // math.gcd(trials, threads)
    cut = size // even * even
    return (
        [(slice(0, cut), WIDE), (slice(cut, size), NARROW)]
        if 0 < cut < size
        else [(slice(0, size), WIDE if cut else NARROW)]
    )


def in_groups(directions: Array, blocks: int) -> Array:
    """(directions, items) -> (blocks, groups x items, FEW)."""
    items = directions.shape[1]
    split = directions.reshape(blocks, -1, FEW, items)
    return split.transpose(0, 1, 3, 2).reshape(blocks, -1, FEW)


def from_groups(lanes: Array, groups: int) -> Array:
    """(blocks, rows, groups x items, FEW) -> (rows, items, directions)."""
    blocks, rows = lanes.shape[:2]
    split = lanes.reshape(blocks, rows, groups, -1, FEW)
    return split.transpose(1, 3, 0, 2, 4).reshape(rows, split.shape[3], -1)
