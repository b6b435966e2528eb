"""LS-SVM: the estimator against scikit-learn's checks and the closed form, the optimizer against known regressions."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.utils.estimator_checks import check_estimator

from seatruth.arrays import Array
from seatruth.costs.base import Block, Cost, Regression
from seatruth.models.parameter import Parameter
from seatruth.optimizers import make, minimise
from seatruth.testing.problems import linear_regression, parameters
from seatruth_optimizers.ls_svm import LSSVR


@pytest.mark.parametrize("kernel", ["linear", "rbf"])
def test_scikit_learn_accepts_the_estimator(kernel: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        results = check_estimator(LSSVR(kernel=kernel), on_skip=None)
    assert len(results) > 40
    assert {result["status"] for result in results} <= {"passed", "skipped"}


def dual(X: Array, y: Array, C: float) -> tuple[Array, float]:
    """The system of models.md 2.3 in standardised columns: coefficients and bias in the data's units."""
    m, s, my, sy = X.mean(0), X.std(0), y.mean(), y.std()
    Z, t = (X - m) / s, (y - my) / sy
    n = len(y)
    system = np.zeros((n + 1, n + 1))
    system[0, 1:] = system[1:, 0] = 1.0
    system[1:, 1:] = Z @ Z.T + np.eye(n) / C
    solved = np.linalg.solve(system, np.concatenate([[0.0], t]))
    w = Z.T @ solved[1:] * sy / s
    return w, my + sy * solved[0] - w @ m


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(5, 40), st.integers(1, 4), st.sampled_from([0.3, 30.0, 3e4]))
def test_linear_kernel_is_the_dual_system_and_ridge_with_a_free_bias(seed: int, n: int, k: int, C: float) -> None:
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, k)) * 10.0 ** rng.uniform(-3, 3, k) + rng.normal(size=k)
    y = X @ rng.normal(size=k) + 5.0 + rng.normal(size=n)
    fitted = LSSVR(C=C).fit(X, y)
    w, b = dual(X, y, C)
    assert np.allclose(fitted.coef_ * X.std(0), w * X.std(0), rtol=1e-6, atol=1e-8 * y.std())
    assert fitted.predict(X) == pytest.approx(X @ w + b, abs=1e-7 * y.std())
    Z, t = (X - X.mean(0)) / X.std(0), (y - y.mean()) / y.std()
    ridge = np.linalg.solve(Z.T @ Z + np.eye(k) / C, Z.T @ t)
    assert np.allclose(fitted.coef_ * X.std(0) / y.std(), ridge, rtol=1e-7, atol=1e-9)


def test_coefficients_follow_the_units_of_the_columns() -> None:
    rng = np.random.default_rng(1)
    X, y = rng.normal(size=(30, 3)), rng.normal(size=30)
    units = np.array([1e-4, 1.0, 1e5])
    assert np.allclose(LSSVR().fit(X * units, 7 * y).coef_ * units, 7 * LSSVR().fit(X, y).coef_, rtol=1e-9)


def test_a_small_C_shrinks_and_a_large_one_does_not() -> None:
    rng = np.random.default_rng(2)
    X = rng.normal(size=(200, 2))
    y = X @ [2.0, -1.0]
    assert np.allclose(LSSVR(C=3e4).fit(X, y).coef_, [2.0, -1.0], rtol=1e-6)
    assert np.linalg.norm(LSSVR(C=1e-3).fit(X, y).coef_) < 0.5


def test_the_gaussian_kernel_predicts_a_curve() -> None:
    rng = np.random.default_rng(3)
    x = rng.uniform(-3, 3, (300, 1))
    fitted = LSSVR(kernel="rbf", C=1e3).fit(x, np.sin(2 * x[:, 0]))
    new = np.linspace(-2.8, 2.8, 50)[:, None]
    assert np.abs(fitted.predict(new) - np.sin(2 * new[:, 0])).max() < 0.02


class Blocks(Cost):
    """A cost made of regression blocks."""

    gives = frozenset({"values", "regression"})

    def __init__(self, free: tuple[Parameter, ...], *blocks: Block) -> None:
        self.parameters, self.blocks, self.description = free, blocks, {"blocks": len(blocks)}

    def values(self, X: Array) -> Array:
        total = np.zeros(len(X))
        for b in self.blocks:
            r = b.target - X[:, b.columns] @ b.regressors.T
            if b.intercept_index is not None:
                r = r - X[:, [b.intercept_index]]
            if b.intercept and b.intercept_index is None:
                r = r - np.average(r, axis=1, weights=b.weights**2)[:, None]
            total += 0.5 * ((r * b.weights) ** 2).sum(axis=1)
        return total

    def regression(self) -> Regression:
        return Regression(self.blocks)


def block(name: str, A: Array, y: Array, columns: list[int], **more: object) -> Block:
    weights = more.pop("weights", np.ones(len(y)))
    return Block(name, y, A, np.array(columns), weights, **more)


def test_separate_blocks_are_the_estimator_block_by_block() -> None:
    rng = np.random.default_rng(4)
    A, B = rng.normal(size=(50, 2)), rng.normal(size=(70, 3)) + 1.0
    y, z = rng.normal(size=50), B @ [1.0, 2.0, 3.0] + 4.0 + rng.normal(size=70)
    cost = Blocks(
        parameters([0.0] * 6),
        block("surge", A, y, [4, 0], weights=np.full(50, 20.0)),
        block("pitch", B, z, [1, 2, 3], intercept=True, intercept_index=5, weights=np.full(70, 0.1)),
    )
    outcome = minimise(cost, make("ls_svm", C=10.0))
    first, second = LSSVR(C=10.0, fit_intercept=False).fit(A, y), LSSVR(C=10.0).fit(B, z)
    assert outcome.x[[4, 0]] == pytest.approx(first.coef_, rel=1e-9)
    assert outcome.x[[1, 2, 3, 5]] == pytest.approx([*second.coef_, second.intercept_], rel=1e-9)
    assert "2 independent" in outcome.reason


def test_a_shared_parameter_is_solved_jointly_by_the_weights() -> None:
    rng = np.random.default_rng(5)
    A, B = rng.normal(size=(80, 2)), rng.normal(size=(60, 2))
    y, z = A @ [1.0, 2.0] + 0.1 * rng.normal(size=80), B @ [2.0, 3.0] + 3.0 * rng.normal(size=60)
    cost = Blocks(
        parameters([0.0] * 4),
        block("sway", A, y, [0, 1], weights=np.full(80, 10.0)),
        block("yaw", B, z, [1, 2], weights=np.full(60, 1 / 3), intercept=True),
    )
    outcome = minimise(cost, make("ls_svm", C=1e9))
    stacked = np.zeros((140, 4))
    stacked[:80, :2], stacked[80:, 1:3], stacked[80:, 3] = A * 10, B / 3, 1 / 3
    expected = np.linalg.lstsq(stacked, np.concatenate([y * 10, z / 3]), rcond=None)[0]
    assert outcome.x[:3] == pytest.approx(expected[:3], rel=1e-6)
    assert outcome.x[3] == 0.0  # no block holds it: it keeps its start
    assert "1 independent" in outcome.reason


def test_a_constant_that_is_a_parameter_is_not_penalised() -> None:
    rng = np.random.default_rng(6)
    A = rng.normal(size=(40, 1))
    cost = Blocks(parameters([0.0, 0.0]), block("b", A, A[:, 0] * 0 + 1e6, [0], intercept=True, intercept_index=1))
    assert minimise(cost, make("ls_svm", C=1e-6)).x == pytest.approx([0.0, 1e6], abs=1e-3)


def test_bounds_are_kept_by_solving_within_them() -> None:
    rng = np.random.default_rng(7)
    A = rng.normal(size=(60, 2)) @ np.array([[1.0, 0.9], [0.0, 0.4]])  # correlated: clipping would be wrong
    y = A @ [2.0, -1.0]
    cost = Blocks(parameters([0.5, 0.0], [0.0, -5.0], [1.0, 5.0]), block("b", A, y, [0, 1]))
    outcome = minimise(cost, make("ls_svm", C=1e9))
    assert outcome.x[0] == pytest.approx(1.0)
    assert outcome.x[1] == pytest.approx(float(A[:, 1] @ (y - A[:, 0]) / (A[:, 1] @ A[:, 1])), rel=1e-6)
    assert outcome.x[1] != pytest.approx(-1.0, abs=0.1)
    assert outcome.clipped == 0


def test_it_agrees_with_least_squares_on_a_regression() -> None:
    known = linear_regression()
    assert minimise(known.cost, "ls_svm").x == pytest.approx(minimise(known.cost, "least_squares").x, rel=1e-4)


def test_weights_decide_what_an_outlier_does() -> None:
    A = np.linspace(0, 1, 20)[:, None]
    y = 3.0 * A[:, 0]
    y[7] = 100.0
    weights = np.ones(20)
    weights[7] = 0.0
    cost = Blocks(parameters([0.0]), block("b", A, y, [0], weights=weights, intercept=True))
    assert minimise(cost, "ls_svm").x == pytest.approx([3.0], rel=1e-5)
