"""Expressions and constraints: arithmetic over the parameters, nothing that could run."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.models.parameter import Parameter
from seatruth.study import expressions
from seatruth.study.validation import Problems

NAMES = ("Y_v", "N_v", "T")


def test_names_that_an_expression_uses() -> None:
    assert expressions.arithmetic("-0.5 * Y_v**2 + max(N_v, 1e-3) / 2", NAMES) == {"Y_v", "N_v"}
    assert expressions.relation("0 < Y_v * N_v <= T", NAMES) == {"Y_v", "N_v", "T"}


HOSTILE = [
    "__import__('os').system('true')",
    "().__class__.__bases__[0].__subclasses__()",
    "open('/etc/passwd')",
    "exec('1')",
    "Y_v.real",
    "Y_v[0]",
    "[x for x in (1,)]",
    "lambda: 1",
    "(Y_v := 3)",
    "f'{Y_v}'",
    "'text'",
    "True",
    "1 if Y_v else 2",
    "Y_v; N_v",
    "max(Y_v, key=abs)",
    "max(*[1, 2])",
    "Y_v // 2",
    "Y_v @ N_v",
    "(" * 400 + ")" * 400,
    "1" * 1000,
    "",
    "\x00",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_anything_but_arithmetic_is_refused(text: str) -> None:
    with pytest.raises(BadInput):
        expressions.arithmetic(text, NAMES)
    with pytest.raises(BadInput):
        expressions.relation(f"{text} > 0", NAMES)


@pytest.mark.parametrize("text", ["Y_v", "Y_v == N_v", "Y_v != 0", "Y_v in N_v", "Y_v > 0 and N_v > 0"])
def test_what_is_no_relation_is_refused(text: str) -> None:
    with pytest.raises(BadInput):
        expressions.relation(text, NAMES)


def test_misspelt_names_and_functions_get_the_nearest() -> None:
    with pytest.raises(BadInput, match="Did you mean 'Y_v'"):
        expressions.arithmetic("2 * Y_vv", NAMES)
    with pytest.raises(BadInput, match="Did you mean 'sqrt'"):
        expressions.arithmetic("sqr(T)", NAMES)


def test_expressions_that_go_in_circles_are_refused() -> None:
    declared = [Parameter("a", 1.0, expr="2 * b"), Parameter("b", 1.0, expr="c"), Parameter("c", 1.0, expr="a + 1")]
    problems = Problems("study.toml")
    expressions.check(declared, [], problems)
    with pytest.raises(BadInput, match="leads back"):
        problems.stop()
    problems = Problems("study.toml")
    expressions.check([Parameter("a", 1.0, expr="2 * b"), Parameter("b", 1.0)], ["a > b"], problems)
    problems.stop()


@given(st.text(st.sampled_from("Y_vN()[]{}.,:'\"+-*/<>=! \n0123abs_import"), max_size=40))
@settings(max_examples=300, deadline=None)
def test_any_text_is_arithmetic_or_bad_input(text: str) -> None:
    with contextlib.suppress(BadInput):
        expressions.arithmetic(text, NAMES)
    with contextlib.suppress(BadInput):
        expressions.relation(text, NAMES)
