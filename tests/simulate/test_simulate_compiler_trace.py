"""Models' plain functions as graphs: every way of writing equations gives the numbers that Python gives."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from math import sin as sine
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_models import plain_model

from seatruth.errors import PluginError
from seatruth.simulate import evaluate_rhs, evaluate_rhs_jacobian
from seatruth.simulate.compiler.node import ordered
from seatruth.simulate.compiler.trace import trace

SLOPE = 2.5
TABLE = (math.sin, math.cos)


def helper(a: Any) -> Any:
    return inner(a) + SLOPE * sine(a)


def inner(a: Any) -> Any:
    return np.exp(-a * a) if a > 0.2 else math.cos(a)


def with_if(s: Any, i: Any, p: Any) -> Any:
    if s.x > 0.5:
        y = s.x * p.a
    elif s.x > 0:
        y = -s.x
    else:
        y = s.y
    z = y + 1.0 if y > s.y else y * y
    return y, z


def with_loops(s: Any, i: Any, p: Any) -> Any:
    total: Any = 0
    for k in range(4):
        total = total + s.x**k / math.factorial(k)
    return total, sum([s.x, s.y, 1.0])


def with_helpers(s: Any, i: Any, p: Any) -> Any:
    return helper(s.x) - helper(s.y), TABLE[0](s.x) * TABLE[1](s.y)


def with_numpy(s: Any, i: Any, p: Any) -> Any:
    turn = np.array([[np.cos(s.y), -np.sin(s.y)], [np.sin(s.y), np.cos(s.y)]])
    return tuple(turn @ np.array([s.x, 1.0]) * np.float64(2.0))


def with_extremes(s: Any, i: Any, p: Any) -> Any:
    return max(-0.5, min(0.5, s.x)), np.clip(s.y, -0.3, np.maximum(s.x, 0.1))


def with_comparisons(s: Any, i: Any, p: Any) -> Any:
    inside = 0.0 < s.x < 0.5 and s.y != 0.25
    return (1.0 if inside or s.y > 0.9 else 0.0), np.where(s.x <= s.y, s.x, s.y) + (s.x != s.y) * 0


def with_signs(s: Any, i: Any, p: Any) -> Any:
    """Comparisons as numbers: the usual way to write a sign."""
    return (s.x > 0) - (s.x < 0), p.a * (s.y >= s.x) * s.y - True * (s.x != s.y) / 2


def with_bare_comparisons(s: Any, i: Any, p: Any) -> Any:
    return s.x > 0.5, not s.y <= p.a


def with_sums_of_comparisons(s: Any, i: Any, p: Any) -> Any:
    count = sum([s.x > 0, s.y > 0, s.x > s.y, 1.0])
    return count**2 + abs(-(s.x > 0)), math.copysign(2.0, (s.x > 0) - 0.5) * float(s.y > 0) + max(s.x > 0, s.y)


def with_comparisons_compared(s: Any, i: Any, p: Any) -> Any:
    same_side = (s.x > 0) == (s.y > 0)
    return same_side + ((s.x > 0) < (s.y > 0)), s.x if same_side else ((s.x > 0.5) if s.y > 0 else s.y)


def with_logic(s: Any, i: Any, p: Any) -> Any:
    inside = (s.x > -0.5) & (s.x < 0.5)
    return np.where(inside | (s.y > 0.9), s.x, s.y) + (inside ^ (s.y > 0)), True & inside | (s.y > s.x)


def with_choices_of_comparisons(s: Any, i: Any, p: Any) -> Any:
    chosen = np.where(s.x > 0, s.y > 0.25, s.y < -0.25)
    return np.where(chosen, s.x, p.a * s.y), np.where(s.x > 0, s.y > 0, 0.5) * s.y


def with_numbers_as_conditions(s: Any, i: Any, p: Any) -> Any:
    return np.where(s.x, 1.0, 2.0), (s.y if (s.x > 0) - (s.y > 0) else s.x)


def with_a_table(s: Any, i: Any, p: Any) -> Any:
    return (0.25, p.a)[s.x > 0] * s.y, [s.x, s.y][int(s.y > s.x)]


def with_a_table_at_a_place_that_is_known(s: Any, i: Any, p: Any) -> Any:
    return (s.x, s.y)[math.log(2.0) > 0], (s.x, p.a, s.y)[int(math.sqrt(5.0))]


def with_a_power_of_nothing(s: Any, i: Any, p: Any) -> Any:
    return ((s.x > 9) * s.y) ** (1.5 + abs(p.a)), abs(s.x) ** p.a


def with_closure(factor: float) -> Callable[..., Any]:
    def scaled(a: Any) -> Any:
        return factor * math.tanh(a)

    def rates(s: Any, i: Any, p: Any) -> Any:
        return scaled(s.x), scaled(s.y) * p.a

    return rates


def with_powers(s: Any, i: Any, p: Any) -> Any:
    return abs(s.x) ** 1.5 * math.copysign(1.0, s.x), pow(s.y, 3) + 2.0**s.x + math.hypot(s.x, s.y)


WAYS = [
    with_if,
    with_loops,
    with_helpers,
    with_numpy,
    with_extremes,
    with_closure(1.7),
    with_powers,
]


COMPARED = [
    with_comparisons,
    with_signs,
    with_bare_comparisons,
    with_sums_of_comparisons,
    with_comparisons_compared,
    with_logic,
    with_choices_of_comparisons,
    with_numbers_as_conditions,
    with_a_table,
    with_a_table_at_a_place_that_is_known,
    with_a_power_of_nothing,
]


class Point:
    def __init__(self, **values: float) -> None:
        vars(self).update(values)


@pytest.mark.parametrize("rates", [*WAYS, *COMPARED])
def test_compiled_equations_are_the_plain_ones(rates: Any) -> None:
    rows = np.random.default_rng(1).uniform(-1.0, 1.0, (300, 2))
    rows[:5] = [[0.0, 0.0], [0.5, 0.25], [0.2, 0.2], [1e-300, -1.0], [-0.0, 0.9]]
    model = plain_model(rates, ("x", "y"), ("a",))
    found = evaluate_rhs(model, np.zeros(0), (), {"a": 1.3}, rows, np.zeros((300, 0)))
    expected = [rates(Point(x=x, y=y), Point(), Point(a=1.3)) for x, y in rows.tolist()]
    assert found == pytest.approx(np.array(expected, dtype=float), rel=1e-13, abs=1e-15)


@pytest.mark.parametrize("rates", [*WAYS, *COMPARED])
def test_derivatives_are_slopes(rates: Any) -> None:
    """Away from the places where a comparison turns, its derivative is zero, as that of Python's True and False."""
    rows = np.random.default_rng(2).uniform(0.01, 0.19, (50, 2))
    model = plain_model(lambda s, i, p: rates(Point(x=s.x * p.a, y=s.y + p.b), i, p), ("x", "y"), ("a", "b"))
    theta, h = np.array([1.3, 0.01]), 1e-6
    exact = evaluate_rhs_jacobian(model, theta, ("a", "b"), {}, rows, np.zeros((50, 0)))
    for k in range(2):
        moved = np.array([theta + h * (np.arange(2) == k), theta - h * (np.arange(2) == k)])
        ahead, behind = evaluate_rhs(model, moved, ("a", "b"), {}, rows, np.zeros((50, 0)))
        assert exact[:, :, k] == pytest.approx((ahead - behind) / (2 * h), rel=1e-6, abs=1e-8)


NAMES = ["sin", "cos", "tan", "tanh", "exp", "expm1", "atan", "sinh", "cosh", "asinh", "log1p", "sqrt", "log", "cbrt"]
NAMES += ["asin", "acos", "atanh", "log10", "log2"]


@pytest.mark.parametrize("name", NAMES)
def test_slope_of_every_function(name: str) -> None:
    function = getattr(math, name)
    model = plain_model(lambda s, i, p: (function(s.x * p.a),), ("x",), ("a",))
    rows = np.linspace(0.1, 0.9, 9)[:, None]
    exact = evaluate_rhs_jacobian(model, np.ones(1), ("a",), {}, rows, np.zeros((9, 0)))[:, 0, 0]
    h = 1e-6
    slopes = [(function(x * (1 + h)) - function(x * (1 - h))) / (2 * h) for x in rows[:, 0].tolist()]
    assert exact == pytest.approx(slopes, rel=1e-8)


def test_kinks_take_the_side_of_the_value() -> None:
    model = plain_model(
        lambda s, i, p: (abs(p.a), math.sqrt(p.b - p.b), min(p.a, p.b), math.hypot(p.a - p.a, 0.0)), list("wxyz"), "ab"
    )
    theta = np.array([-2.0, 3.0])
    found = evaluate_rhs_jacobian(model, theta, ("a", "b"), {}, np.zeros((1, 4)), np.zeros((1, 0)))[0]
    assert found.tolist() == [[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]


@settings(max_examples=60, deadline=None)
@given(
    st.recursive(
        st.sampled_from(["s.x", "s.y", "p.a", "0.5", "-1.25"]),
        lambda inner: st.one_of(
            st.tuples(inner, st.sampled_from(["+", "-", "*"]), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
            inner.map(lambda x: f"math.sin({x})"),
            inner.map(lambda x: f"abs({x})"),
            st.tuples(inner, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), inner).map(
                lambda t: f"({t[0]} {t[1]} {t[2]})"
            ),
            st.tuples(inner, inner, inner, inner).map(lambda t: f"({t[0]} if {t[1]} > {t[2]} else {t[3]})"),
        ),
        max_leaves=12,
    )
)
def test_any_expression(text: str) -> None:
    function = eval(f"lambda s, i, p: ({text},)", {"math": math, "abs": abs})
    rows = np.random.default_rng(4).uniform(-2.0, 2.0, (9, 2))
    model = plain_model(lambda s, i, p: (*function(s, i, p), 0.0), ("x", "y"), ("a",))
    found = evaluate_rhs(model, np.array([0.7]), ("a",), {}, rows, np.zeros((9, 0)))[:, 0]
    expected = [function(Point(x=x, y=y), None, Point(a=0.7))[0] for x, y in rows.tolist()]
    assert found == pytest.approx(np.array(expected, dtype=float), rel=1e-9, abs=1e-12)


def test_a_function_may_import_what_it_needs() -> None:
    """Users write models whose rhs imports math itself: it then works on the functions of nodes as well."""

    def rates(s: Any, i: Any, p: Any) -> Any:
        import math as m
        from math import cos, pi

        import numpy

        return (m.sin(s.x) * cos(pi * s.x) + numpy.tanh(p.a * s.x),)

    rows = np.linspace(-1.0, 1.0, 5)[:, None]
    found = evaluate_rhs(plain_model(rates, ("x",), ("a",)), np.array([0.7]), ("a",), {}, rows, np.zeros((5, 0)))
    x = rows[:, 0]
    assert found[:, 0] == pytest.approx(np.sin(x) * np.cos(np.pi * x) + np.tanh(0.7 * x))


def test_both_ways_of_a_condition_share_what_is_equal() -> None:
    """A choice of one coefficient costs one selection, not the whole equations twice."""

    def rates(s: Any, i: Any, p: Any) -> Any:
        gain = p.a if s.x > 0.0 else p.b
        return (math.sin(gain * s.x) * math.exp(s.x) + gain * s.x,)

    nodes = ordered(trace(plain_model(rates, ("x",), ("a", "b"))).rates)
    assert sum(node.op == "sin" for node in nodes) == 1
    assert sum(node.op == "select" for node in nodes) == 1


def endless(s: Any, i: Any, p: Any) -> Any:
    x = s.x
    while x > 0.0:
        x = x - 1.0
    return (x,)


def endless_question(s: Any, i: Any, p: Any) -> Any:
    while s.x:
        pass
    return (s.x,)


_calls = [0.0]


def counting(s: Any, i: Any, p: Any) -> Any:
    _calls[0] += 1.0
    return (s.x * _calls[0],)


@pytest.mark.parametrize("rates", [counting, lambda s, i, p: (random.random() * s.x,)])
def test_equations_that_change_from_run_to_run_are_refused(rates: Any) -> None:
    with pytest.raises(PluginError, match="other equations each time"):
        trace(plain_model(rates, ("x",)))


@pytest.mark.parametrize(
    ("rates", "words"),
    [
        (endless, "without end"),
        (endless_question, "without end"),
        (lambda s, i, p: s.x, "returns one bare value"),
        (lambda s, i, p: None, "returns nothing"),
        (lambda s, i, p: (float("0" + str(s.x)),), "ValueError"),
        (lambda s, i, p: ([1.0, 2.0][int(s.x)],), "integer"),
        (lambda s, i, p: (np.linalg.norm([s.x, 1.0]),), "plain"),
        (lambda s, i, p: (s.x, s.x), "returns 2 values, 1 are declared"),
        (lambda s, i, p: (s.missing,), "missing"),
        (lambda s, i, p: (sum((s.x + k) ** 2.3 for k in range(9000)),), "grow beyond"),
        (lambda s, i, p: ("text",), "str"),
        (lambda s, i, p: (math.gamma(s.x),), "plain float"),
        (lambda s, i, p: ((s.x > 0) & s.x,), "only conditions"),
    ],
)
def test_what_cannot_be_compiled_is_said(rates: Any, words: str) -> None:
    with pytest.raises(PluginError, match=words) as caught:
        trace(plain_model(rates, ("x",)))
    assert "model 'plain'" in caught.value.where
    assert "test_simulate_compiler_trace.py, line" in caught.value.where or "returns" in words or words == "str"
    assert "BlackBox" in caught.value.do


def test_equations_that_end_the_program_are_said() -> None:
    def ends(s: Any, i: Any, p: Any) -> Any:
        raise SystemExit(0)

    with pytest.raises(PluginError, match="rhs ends the program"):
        trace(plain_model(ends, ("x",)))
