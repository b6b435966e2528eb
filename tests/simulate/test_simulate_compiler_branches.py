"""The ways through the conditions of the functions that equations call."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from known_models import plain_model

from seatruth.simulate import evaluate_rhs
from seatruth.simulate.compiler.branches import MOST_WAYS
from seatruth.simulate.compiler.node import ordered
from seatruth.simulate.compiler.trace import trace

ROWS = np.random.default_rng(3).uniform(-1.0, 1.0, (200, 2))


class Point:
    def __init__(self, **values: float) -> None:
        vars(self).update(values)


class Forces(NamedTuple):
    X: Any
    Y: Any


def thrust(command: Any, full: Any) -> Any:
    """Three ways: within the dead band, ahead, astern."""
    if abs(command) <= 0.1:
        return 0.0 * full
    size = (abs(command) - 0.1) * full
    return size if command > 0.0 else -0.8 * size


def many_thrusters(s: Any, i: Any, p: Any) -> Any:
    """Nine thrusters: 3^9 ways, if the equations were followed along each of them."""
    total = 0.0
    for k in range(9):
        total = total + thrust(s.x + 0.1 * (k - 4), p.a)
    return total, s.y


def forces(x: Any, y: Any) -> Forces:
    if x > y:
        return Forces(x, 0.0)
    return Forces(y, 1.0)


def a_record(s: Any, i: Any, p: Any) -> Any:
    both = forces(s.x, s.y)
    return p.a * both.X, both.Y


def place(x: Any) -> int:
    """A place in a table, which no number in between can be."""
    return 1 if x > 0.0 else 0


def a_table(s: Any, i: Any, p: Any) -> Any:
    return p.a * (3.0, 5.0)[place(s.x)], s.y * (0.5, 0.25)[place(s.y)]


def inside(x: Any) -> Any:
    if x < -0.5:
        return False
    return x < 0.5


def an_answer(s: Any, i: Any, p: Any) -> Any:
    return (p.a if inside(s.x) else s.y), s.y


def note(kept: list[Any], x: Any) -> None:
    if x > 0.0:
        kept.append(x)
    else:
        kept.append(2.0 * x)


def a_list_that_is_filled(s: Any, i: Any, p: Any) -> Any:
    kept: list[Any] = []
    note(kept, s.x)
    note(kept, s.y)
    return p.a * kept[0], kept[1] * len(kept)


def half(x: Any) -> Any:
    return x / 2.0 if x > 0.0 else x


def known_before(s: Any, i: Any, p: Any) -> Any:
    """The same condition before a function and inside it."""
    if s.x > 0.0:
        return half(s.x), p.a
    return half(s.x) + 1.0, half(half(s.y))


@pytest.mark.parametrize(
    "rates",
    [many_thrusters, a_record, a_table, an_answer, a_list_that_is_filled, known_before],
    ids=lambda f: f.__name__,
)
def test_equations_are_those_of_python(rates: Any) -> None:
    model = plain_model(rates, ("x", "y"), ("a",))
    found = evaluate_rhs(model, np.zeros(0), (), {"a": 1.3}, ROWS, np.zeros((len(ROWS), 0)))
    expected = [rates(Point(x=x, y=y), Point(), Point(a=1.3)) for x, y in ROWS.tolist()]
    assert found == pytest.approx(np.array(expected, dtype=float), rel=1e-13, abs=1e-15)


def test_functions_are_merged_where_they_return() -> None:
    """Nine thrusters of three ways each: nine times the equations of one, of 3^9 ways together."""
    assert MOST_WAYS < 3**9
    nodes = ordered(trace(plain_model(many_thrusters, ("x", "y"), ("a",))).rates)
    assert sum(node.op == "select" for node in nodes) <= 2 * 9
    assert len(nodes) < 20 * 9


def test_what_is_known_before_is_not_asked_again() -> None:
    nodes = ordered(trace(plain_model(known_before, ("x", "y"), ("a",))).rates)
    assert sum(node.op == "gt" for node in nodes) <= 3  # s.x, s.y, half(s.y)
