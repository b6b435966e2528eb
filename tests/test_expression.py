"""The one parser of users' arithmetic: what it gives, its derivatives, and what it refuses."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.expression import FUNCTIONS, Expression, Relation, equation, names_in

NAMES = ("a", "b", "Y_v")
CASES = {
    "-0.5 * a + b ** 2": lambda a, b: -0.5 * a + b**2,
    "a / (b - 3) - -b": lambda a, b: a / (b - 3) + b,
    "max(a, b, 0.1) * min(a, 2)": lambda a, b: max(a, b, 0.1) * min(a, 2),
    "sqrt(abs(a)) + exp(-b) * log(hypot(a, b))": lambda a, b: (
        math.sqrt(abs(a)) + math.exp(-b) * math.log(math.hypot(a, b))
    ),
    "sin(a) * cos(b) + tan(a / 3) + atan2(a, b)": lambda a, b: (
        math.sin(a) * math.cos(b) + math.tan(a / 3) + math.atan2(a, b)
    ),
    "sinh(a) - cosh(b) + tanh(a) + asin(b / 9) + acos(a / 9) + atan(b)": lambda a, b: (
        math.sinh(a) - math.cosh(b) + math.tanh(a) + math.asin(b / 9) + math.acos(a / 9) + math.atan(b)
    ),
    "copysign(a, b) * pi": lambda a, b: math.copysign(a, b) * math.pi,
    "a ** -2 + (a * a) ** 0.3": lambda a, b: a**-2 + (a * a) ** 0.3,
}
POINTS = [(1.3, 0.7), (-0.8, 1.9), (2.5, -1.1), (-1.7, -0.4)]


@pytest.mark.parametrize("text", CASES)
def test_values_are_those_of_the_same_formula_in_python(text: str) -> None:
    expression = Expression(text, NAMES)
    for a, b in POINTS:
        assert expression.evaluate({"a": a, "b": b}) == pytest.approx(CASES[text](a, b), rel=1e-14)
    a, b = np.array(POINTS).T
    column = expression.evaluate({"a": a, "b": b})
    np.testing.assert_allclose(column, [CASES[text](*point) for point in POINTS], rtol=1e-14)
    population = expression.evaluate({"a": a[:, None], "b": b})
    np.testing.assert_allclose(np.diag(np.broadcast_to(population, (4, 4))), column, rtol=1e-14)


@pytest.mark.parametrize("text", CASES)
@pytest.mark.parametrize("name", ["a", "b"])
def test_derivatives_are_exact(text: str, name: str) -> None:
    expression = Expression(text, NAMES)
    for a, b in POINTS:
        at = {"a": a, "b": b}
        h = 1e-6
        ahead, behind = (expression.evaluate({**at, name: at[name] + sign * h}) for sign in (1, -1))
        expected = (ahead - behind) / (2 * h)
        assert expression.derivative(at, name) == pytest.approx(expected, rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("text", ["a ** 9 ** 9 ** 9", "a ** (1 / 0)", "a ** (0 / 0)"])
def test_a_power_without_a_finite_exponent_has_no_finite_value(text: str) -> None:
    assert not np.isfinite(Expression(text, NAMES).evaluate({"a": 5.0}))


def test_names_in_the_order_in_which_they_stand() -> None:
    assert Expression("b + a * b + pi", NAMES).names == ("b", "a")
    assert names_in("(a1*Fr**3 + max(a2, Fr)) / pi") == ("a1", "Fr", "a2")
    assert Expression("pi * 2", ("pi",)).names == ("pi",)  # a parameter of that name is meant
    assert equation("D = a * Fr") == ("D", "a * Fr")
    for text in ("a * Fr", "2 D = a", "= a"):
        with pytest.raises(BadInput):
            equation(text)


def test_relations_hold_or_not_for_each_candidate() -> None:
    relation = Relation("0 < a <= b", NAMES)
    a = np.array([1.0, -1.0, 2.0, 2.0, np.nan])
    np.testing.assert_array_equal(relation.holds({"a": a, "b": 2.0}), [True, False, True, True, False])
    assert Relation("a < b", NAMES).holds({"a": 1.0, "b": 2.0})
    for text in ("a", "a == b", "a < b and b < a", "not a < b"):
        with pytest.raises(BadInput, match="no relation"):
            Relation(text, NAMES)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("c + 1", "parameter of the model"),
        ("Y_w", "Did you mean 'Y_v'"),
        ("sqr(a)", "Did you mean 'sqrt'"),
        ("atan2(a)", "It takes 2"),
        ("abs(a, b)", "It takes 1"),
        ("a ^ 2", r"Write \*\* for powers"),
        ("1e999 * a", "too large"),
        ("a if b else 2", "more than arithmetic"),
        ("a.real", "more than arithmetic"),
        ("a = 3", "no arithmetic expression"),
        ("-" * 300 + "a", "nested too deeply"),
        ("a +" * 200 + "a", "too long"),
    ],
)
def test_what_is_no_arithmetic_is_refused(text: str, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        Expression(text, NAMES)


def test_no_value_is_not_a_number_without_noise() -> None:
    assert np.isnan(Expression("sqrt(a)", NAMES).evaluate({"a": -1.0}))
    assert not np.isfinite(Expression("1 / a", NAMES).evaluate({"a": np.zeros(2)})).any()


_leaf = st.sampled_from(["a", "b", "0.3", "2"])
_terms = st.recursive(
    _leaf,
    lambda inner: (
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda p: f"({p[0]} {p[1]} {p[2]})")
        | st.tuples(st.sampled_from(["abs", "sin", "exp", "tanh"]), inner).map(lambda p: f"{p[0]}({p[1]})")
    ),
    max_leaves=12,
)


@given(_terms, st.floats(-3, 3), st.floats(-3, 3))
@settings(max_examples=150, deadline=None)
def test_any_arithmetic_gives_what_python_gives(text: str, a: float, b: float) -> None:
    allowed = {"abs": abs, "sin": math.sin, "exp": math.exp, "tanh": math.tanh, "a": a, "b": b}
    try:
        expected = eval(text, {"__builtins__": {}}, allowed)  # the test's own text, never a user's
    except (ZeroDivisionError, OverflowError):
        return
    found = Expression(text, NAMES).evaluate({"a": a, "b": b})
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12, nan_ok=True)


@given(st.text(st.sampled_from("ab()[]{}.,:'\"+-*/<>=! \n0123_import^@"), max_size=40))
@settings(max_examples=300, deadline=None)
def test_any_text_is_an_expression_or_bad_input(text: str) -> None:
    with contextlib.suppress(BadInput):
        Expression(text, NAMES).evaluate({"a": 1.0, "b": 2.0, "Y_v": 3.0})
    with contextlib.suppress(BadInput):
        Relation(text, NAMES)


def test_functions_are_those_of_the_vocabulary() -> None:
    assert {"abs", "min", "max", "sqrt", "atan2", "hypot"} <= FUNCTIONS
    assert not FUNCTIONS & {"eval", "open", "exec"}
