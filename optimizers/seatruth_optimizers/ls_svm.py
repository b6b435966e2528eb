"""Least-squares support vector machine (Suykens 1999): a scikit-learn estimator and an optimizer (Xu and others 2012).

    min 1/2 |w|^2 + C/2 sum v_i e_i^2,   y_i = w . phi(x_i) + b + e_i

With a linear kernel this is ridge regression with penalty 1/C and an unpenalised bias, and it gives coefficients.
With a Gaussian kernel it gives predictions only. Columns and target are standardised first, because the penalty would
otherwise depend on their units; the coefficients are scaled back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.metrics.pairwise import rbf_kernel
from sklearn.utils.validation import _check_sample_weight, check_is_fitted, validate_data

from seatruth.arrays import Array
from seatruth.costs.base import Ability, Block
from seatruth.errors import BadInput
from seatruth.optimizers import Optimizer, Problem, option

MAX_SAMPLES = 20_000
"""The Gaussian kernel needs a dense n x n system: 3.2 GB at this n."""


class LSSVR(RegressorMixin, BaseEstimator):  # type: ignore[misc]  # scikit-learn has no types
    """LS-SVM regression with the interface of scikit-learn.

    Parameters: C > 0, the weight of the errors; kernel "linear" or "rbf"; gamma, the Gaussian kernel's
    exp(-gamma |x - x'|^2) in standardised columns ("scale" = 1 / n_features); fit_intercept; standardize.
    After `fit`: intercept_, n_features_in_; linear: coef_ (n_features,); rbf: dual_coef_ (n_samples,).
    """

    def __init__(
        self,
        C: float = 3e4,
        kernel: str = "linear",
        gamma: float | str = "scale",
        fit_intercept: bool = True,
        standardize: bool = True,
    ) -> None:
        self.C = C
        self.kernel = kernel
        self.gamma = gamma
        self.fit_intercept = fit_intercept
        self.standardize = standardize

    def fit(self, X: Any, y: Any, sample_weight: Any = None) -> LSSVR:
        """Fits X (n, k) to y (n,); sample_weight (n,) are the v_i."""
        X, y = validate_data(self, X, y, y_numeric=True, dtype=np.float64)
        v = _check_sample_weight(sample_weight, X, dtype=np.float64, ensure_non_negative=True)
        if not self.C > 0:
            raise ValueError(f"C must be positive, not {self.C!r}")
        if not v.sum() > 0:
            raise ValueError("all sample weights are zero")
        y = y.astype(np.float64)
        self._mean, self._scale = _moments(X, v, self.fit_intercept) if self.standardize else _unscaled(X.shape[1])
        target_mean, target_scale = _moments(y[:, None], v, self.fit_intercept) if self.standardize else _unscaled(1)
        self._target = float(target_mean[0]), float(target_scale[0])
        Z, t = (X - self._mean) / self._scale, (y - self._target[0]) / self._target[1]
        if self.kernel == "linear":
            ones = np.ones((len(Z), 1 if self.fit_intercept else 0))
            penalty = np.concatenate([np.ones(Z.shape[1]), np.zeros(ones.shape[1])])
            w = ridge(np.hstack([Z, ones]), t, v, penalty / self.C)
            self.coef_ = w[: Z.shape[1]] * self._target[1] / self._scale
            bias = float(w[-1]) if self.fit_intercept else 0.0
            self.intercept_ = self._target[0] + self._target[1] * bias - float(self.coef_ @ self._mean)
        elif self.kernel == "rbf":
            self._fit_kernel(Z, t, v)
        else:
            raise ValueError(f"kernel must be 'linear' or 'rbf', not {self.kernel!r}")
        return self

    def predict(self, X: Any) -> Array:
        """Predicted targets (n,) of X (n, k)."""
        check_is_fitted(self)
        X = validate_data(self, X, dtype=np.float64, reset=False)
        if self.kernel == "linear":
            linear: Array = X @ self.coef_ + self.intercept_
            return linear
        kernel = rbf_kernel((X - self._mean) / self._scale, self._support, gamma=self._width)
        predicted: Array = kernel @ self.dual_coef_ + self.intercept_
        return predicted

    def _fit_kernel(self, Z: Array, t: Array, v: Array) -> None:
        """Solves [[0, 1'], [1, K + diag(1 / (C v))]] [b, alpha] = [0, t]."""
        keep = v > 0
        Z, t, v = Z[keep], t[keep], v[keep]
        if len(Z) > MAX_SAMPLES:
            raise ValueError(f"{len(Z)} samples are too many for kernel 'rbf': at most {MAX_SAMPLES}")
        self._width = 1.0 / Z.shape[1] if self.gamma == "scale" else float(self.gamma)
        K = rbf_kernel(Z, gamma=self._width)
        K[np.diag_indices_from(K)] += 1.0 / (self.C * v)
        solved = np.linalg.solve(K, np.column_stack([t, np.ones(len(t))]))
        bias = float(solved[:, 0].sum() / solved[:, 1].sum()) if self.fit_intercept else 0.0
        self._support = Z
        self.dual_coef_ = (solved[:, 0] - bias * solved[:, 1]) * self._target[1]
        self.intercept_ = self._target[0] + self._target[1] * bias


@dataclass(frozen=True)
class LSSVM(Optimizer):
    """Solves a cost that is a set of linear regressions, each by LS-SVM with linear kernel, in closed form.

    Regressions that share a parameter are solved together, with their own weights against each other; those that share
    none, one by one. A constant that is a parameter (or a nuisance) is the machine's bias: it is not penalised. Where
    the solution would break a bound, the same problem is solved within the bounds. The answer is the solution
    of the regression, whatever its cost without the penalty.
    """

    name: ClassVar[str] = "ls_svm"
    title: ClassVar[str] = "Least-squares support vector machine (linear kernel)"
    needs: ClassVar[frozenset[Ability]] = frozenset({"regression"})

    C: float = option(3e4, "weight of the errors against the size of the standardised coefficients", low=1e-9)

    def run(self, problem: Problem, rng: np.random.Generator) -> str:
        blocks = problem.regression().blocks
        x = problem.x_of(problem.start)
        low, high = problem.x_of(problem.lower), problem.x_of(problem.upper)
        groups = _groups(blocks)
        for group in groups:
            _solve(group, x, low, high, self.C)
        problem.propose(x)
        return f"the {len(blocks)} regressions are solved in closed form ({len(groups)} independent)"


def ridge(
    A: Array, y: Array, v: Array, penalty: Array, low: Array | float = -np.inf, high: Array | float = np.inf
) -> Array:
    """argmin sum v (y - A w)^2 + sum penalty w^2 within bounds: A (n, k), y, v (n,), penalty (k,) -> w (k,)."""
    root = np.sqrt(v)
    rows = np.vstack([A * root[:, None], np.diag(np.sqrt(penalty))[penalty > 0]])
    right = np.concatenate([y * root, np.zeros(int((penalty > 0).sum()))])
    # Unit columns, so that scales do not decide what counts as singular.
    size = np.linalg.norm(rows, axis=0)
    size[size == 0] = 1.0
    w: Array = np.linalg.lstsq(rows / size, right, rcond=None)[0] / size
    if (w < low).any() or (w > high).any():
        bounds = (np.broadcast_to(low * size, w.shape), np.broadcast_to(high * size, w.shape))
        w = np.clip(lsq_linear(rows / size, right, bounds, method="bvls", tol=1e-14).x / size, low, high)
    return w


def _moments(X: Array, v: Array, centre: bool) -> tuple[Array, Array]:
    """Weighted means (0 unless `centre`) and standard deviations about them; a constant column gets scale 1."""
    mean = np.average(X, axis=0, weights=v) if centre else np.zeros(X.shape[1])
    scale = np.sqrt(np.average((X - mean) ** 2, axis=0, weights=v))
    # A column that is constant to rounding has no scale of its own.
    return mean, np.where(scale > 1e-12 * np.abs(X).max(axis=0, initial=0.0), scale, 1.0)


def _unscaled(k: int) -> tuple[Array, Array]:
    return np.zeros(k), np.ones(k)


def _members(block: Block) -> NDArray[np.intp]:
    """The parameters in a block, its constant included."""
    constant = [] if block.intercept_index is None else [block.intercept_index]
    return np.concatenate([np.asarray(block.columns, dtype=np.intp), np.array(constant, dtype=np.intp)])


def _groups(blocks: tuple[Block, ...]) -> list[list[Block]]:
    """Groups of blocks that share parameters, directly or through other blocks."""
    groups: list[tuple[set[int], list[Block]]] = []
    for block in blocks:
        members, together = set(_members(block).tolist()), [block]
        separate = []
        for parameters, held in groups:
            if parameters & members:
                members |= parameters
                together = held + together
            else:
                separate.append((parameters, held))
        groups = [*separate, (members, together)]
    return [held for _, held in groups]


def _solve(blocks: list[Block], x: Array, low: Array, high: Array, C: float) -> None:
    """Writes the parameters of a group of blocks into x (K,).

    The objective is 1/2 sum_j (theta_j s_j)^2 + C/2 sum_i v_i e_i^2 with s_j the standard deviation of column j about
    its mean in each block and v_i the weights squared over their mean: for one block this is LSSVR on standardised
    columns, in the units of the target.
    """
    parameters = np.unique(np.concatenate([_members(block) for block in blocks]))
    place = {int(p): k for k, p in enumerate(parameters)}
    nuisances = [block.intercept and block.intercept_index is None for block in blocks]
    rows = sum(len(block.target) for block in blocks)
    A = np.zeros((rows, len(parameters) + sum(nuisances)))
    spread, weight, penalised = np.zeros(len(parameters)), np.zeros(len(parameters)), np.zeros(len(parameters), bool)
    v = np.concatenate([np.asarray(block.weights, dtype=float) ** 2 for block in blocks])
    if not v.sum() > 0:
        raise BadInput("all weights of a regression are zero", where=blocks[0].name)
    v = v / v.mean()
    at, extra = 0, len(parameters)
    for block, nuisance in zip(blocks, nuisances):
        here = slice(at, at + len(block.target))
        at += len(block.target)
        columns = [place[int(p)] for p in block.columns]
        for column, regressor in zip(columns, block.regressors.T):
            A[here, column] += regressor
        if block.intercept_index is not None:
            A[here, place[block.intercept_index]] += 1.0
        if nuisance:
            A[here, extra] = 1.0
            extra += 1
        centre = block.intercept or block.intercept_index is not None
        mean = np.average(A[here, : len(parameters)], axis=0, weights=v[here]) if v[here].any() and centre else 0.0
        deviation = (A[here, : len(parameters)] - mean) ** 2
        used = np.unique(columns)
        spread[used] += (v[here] @ deviation)[used]
        weight[used] += v[here].sum()
        penalised[used] = True
    penalty = np.zeros(A.shape[1])
    penalty[: len(parameters)] = np.where(penalised, spread / np.maximum(weight, 1e-300), 0.0) / C
    y = np.concatenate([np.asarray(block.target, dtype=float) for block in blocks])
    free = np.full(sum(nuisances), np.inf)
    w = ridge(A, y, v, penalty, np.concatenate([low[parameters], -free]), np.concatenate([high[parameters], free]))
    used_parameters = A[:, : len(parameters)].any(axis=0)  # a parameter that appears in no sample keeps its start
    x[parameters[used_parameters]] = w[: len(parameters)][used_parameters]
