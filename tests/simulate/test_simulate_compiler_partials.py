"""Derivatives by states and parameters, and which of them vanish when."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.models import load_model
from seatruth.simulate.compiler.graph import Graph
from seatruth.simulate.compiler.lanes import NARROW
from seatruth.simulate.compiler.node import LANE
from seatruth.simulate.compiler.partials import by_lane, entries, matrix, partials, vanishing
from seatruth.simulate.compiler.trace import trace


def test_what_vanishes_with_a_parameter() -> None:
    graph = Graph()
    a, b = (graph.leaf("parameter", k, LANE) for k in range(2))
    gone, left = (a * b, a / b, graph.select(a > 0.0, b, a * b)), (a + b, b - a, b / a)
    found = vanishing([*gone, *left], [a])
    assert all(id(node) in found for node in gone)
    assert not any(id(node) in found for node in left)


def test_every_rate_depends_on_what_its_equation_holds() -> None:
    """A ship's track follows from its speeds and heading alone, and no parameter enters it."""
    model = load_model("mmg")
    e = trace(model)
    found = partials(e, e.rates, ())
    names = [state.name for state in model.states]
    track = {names[k] for root, k in zip(found.by_state.root, found.by_state.by) if root == names.index("x")}
    assert track == {"u", "v", "psi"}
    assert names.index("x") not in set(found.by_parameter.root.tolist())
    assert found.by_acting.root.size == 0
    assert len(found.nodes) == len({id(node) for node in found.nodes})


def test_entries_stand_in_compressed_rows() -> None:
    some = entries([(2, 0, 5), (0, 1, 6), (2, 3, 7)])
    rows = matrix("a", some, 3)
    assert np.asarray(rows["a_start"]).tolist() == [0, 1, 1, 3]
    assert np.asarray(rows["a_from"]).tolist() == [1, 0, 3]
    assert np.asarray(rows["a_place"]).tolist() == [6, 5, 7]
    both = some.beside(some.only(np.array([True, False, False])))
    assert both.root.tolist() == [2, 0, 2, 2]


@pytest.mark.parametrize("column", [0, NARROW + 1])
def test_entries_by_a_parameter_stand_in_its_lane(column: int) -> None:
    """Direction k moves parameter k: its entries stand in block k // width, at lane k % width."""
    some, columns = entries([(1, column, 4)]), np.arange(NARROW + 2)
    rows = by_lane("b", some, 2, columns, 2)
    row = column // NARROW * 2 + 1
    starts = np.asarray(rows["b_start"])
    assert (np.diff(starts) == (np.arange(4) == row)).all()
    assert np.asarray(rows["b_lane"]).tolist() == [column % NARROW]
