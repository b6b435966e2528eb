"""Free, fixed and tied parameters, priors and constraints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.costs.parameter_space import ParameterSpace
from seatruth.errors import BadInput
from seatruth.models.parameter import Parameter, Prior

PARAMETERS = (
    Parameter("a", 1.5, vary=True, prior=Prior(1.0, 0.5)),
    Parameter("twice", 0.0, expr="2 * a + c", prior=Prior(3.0, 0.1)),
    Parameter("b", -2.0, vary=True),
    Parameter("c", 4.0, prior=Prior(9.0, 1.0)),
    Parameter("deep", 0.0, expr="abs(b) * sqrt(twice)"),
    Parameter("still", 0.0, expr="c / 8"),
)
SPACE = ParameterSpace(PARAMETERS, ["a * b < 0", "-10 < b <= 0"])


def test_what_moves_and_what_stays() -> None:
    assert SPACE.free_names == ("a", "b")
    assert SPACE.varying == ("a", "b", "twice", "deep")
    assert SPACE.nominal() == {"a": 1.5, "twice": 7.0, "b": -2.0, "c": 4.0, "deep": 2 * 7.0**0.5, "still": 0.5}
    assert SPACE.priors == ("a", "twice")  # c is fixed: its prior says nothing about x
    np.testing.assert_allclose(SPACE.prior_residuals(np.array([[1.5, -2.0]])), [[1.0, 40.0]])


@given(st.floats(0.1, 5), st.floats(-9, -0.1))
@settings(max_examples=50, deadline=None)
def test_derivatives_go_through_ties_of_ties(a: float, b: float) -> None:
    x = np.array([a, b])
    jacobian = SPACE.jacobian(x)
    for k in range(2):
        h = 1e-6 * np.eye(2)[k]
        expected = (SPACE.values(np.array([x + h])) - SPACE.values(np.array([x - h])))[0] / 2e-6
        np.testing.assert_allclose(jacobian[:, k], expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(SPACE.varying_jacobian(x)[:2], np.eye(2))
    expected = jacobian[[0, 1]] / np.array([[0.5], [0.1]])
    np.testing.assert_allclose(SPACE.prior_jacobian(x), expected)


def test_populations_keep_constraints_or_not() -> None:
    X = np.array([[1.0, -1.0], [-1.0, -1.0], [1.0, -11.0], [1.0, 0.5]])
    np.testing.assert_array_equal(SPACE.feasible(X), [True, False, False, False])
    values = SPACE.values(X)
    assert values.shape == (4, 6)
    np.testing.assert_allclose(values[:, 1], 2 * X[:, 0] + 4)
    np.testing.assert_allclose(SPACE.varying_values(X)[:, 2], values[:, 1])
    assert SPACE.by_name(X[0])["deep"] == pytest.approx(6**0.5)


@pytest.mark.parametrize(
    ("parameters", "constraints", "message"),
    [
        ([Parameter("a", 1.0, expr="b"), Parameter("b", 1.0, expr="a")], [], "back to itself"),
        ([Parameter("a", 1.0, expr="a + 1")], [], "back to itself"),
        ([Parameter("a", 1.0), Parameter("a", 2.0)], [], "called 'a'"),
        ([Parameter("a", 1.0, expr="2 * bb"), Parameter("b", 1.0)], [], "Did you mean 'b'"),
        ([Parameter("a", 1.0, expr="sqrt(b)"), Parameter("b", -1.0)], [], "no value at the start"),
        ([Parameter("a", 1.0, vary=True)], ["a > 2"], "start values break"),
        ([Parameter("a", 1.0, vary=True)], ["a"], "no relation"),
    ],
)
def test_what_does_not_fit_is_said(parameters: list[Parameter], constraints: list[str], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        ParameterSpace(parameters, constraints)
