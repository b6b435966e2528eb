"""Candidates in lanes: every candidate has one, and the way back gives the same array."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.simulate.compiler.lanes import FEW, NARROW, WIDE, from_lanes, lane_blocks, to_lanes


@settings(max_examples=200, deadline=None)
@given(size=st.integers(1, 3000), trials=st.integers(1, 12), threads=st.integers(1, 64))
def test_blocks_cover_all_candidates_once(size: int, trials: int, threads: int) -> None:
    parts = lane_blocks(size, trials, threads)
    covered = np.concatenate([np.arange(size)[part] for part, _ in parts])
    assert covered.tolist() == list(range(size))
    assert {width for _, width in parts} <= {FEW, NARROW, WIDE}


@settings(max_examples=50, deadline=None)
@given(size=st.integers(1, 40), width=st.sampled_from([FEW, NARROW, WIDE]))
def test_there_and_back(size: int, width: int) -> None:
    values = np.random.default_rng(size).normal(size=(size, 3, 2))
    lanes = to_lanes(values, width)
    assert lanes.shape == (-(-size // width), 3, 2, width)
    assert np.array_equal(from_lanes(lanes, size), values)
    assert np.isfinite(lanes).all()
