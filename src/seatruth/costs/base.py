"""The shared interface between every problem and every optimizer.

A cost is a function of one parameter vector x (K,), in the parameters' own units. What a cost can give is said by its
`gives`; what an optimizer needs is said by its `needs`; anything that fits can be combined.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import PluginError
from seatruth.models.parameter import Parameter

Ability = Literal["values", "residuals", "derivatives", "regression"]


@dataclass(frozen=True)
class Block:
    """One linear regression: targets (n,) from regressors (n, k), whose coefficients are some of the parameters.

    target = regressors @ x[columns] + intercept; `weights` (n,) are 1/sigma. `intercept` says whether an
    unpenalised constant belongs to it (a constant thrust, say); `intercept_index` is the parameter that this
    constant is, or None when it is a nuisance.
    """

    name: str
    target: Array
    regressors: Array
    columns: NDArray[np.intp]
    weights: Array
    intercept: bool = False
    intercept_index: int | None = None


@dataclass(frozen=True)
class Regression:
    """A cost seen as linear regressions over the same parameter vector, one block an equation."""

    blocks: tuple[Block, ...]


class Cost(ABC):
    """Minus the log-likelihood (and log-prior) of the data, up to a constant: half a weighted sum of squares.

    `parameters` are the K free ones, in the order of x; their `value` is the start. `noise_known` says whether the
    weights are 1/sigma of a known noise. Otherwise sigma is estimated, and `values` is the likelihood with the sigma
    that is best for each candidate: it depends on the candidate alone. `residuals` then use the sigma of the last
    `reweight`; half their sum of squares has the slope of `values` where sigma was estimated and lies above it
    elsewhere (up to a constant), so that solving and reweighting in turn reaches the minimum of `values`. `value_of`
    gives the cost of residuals in terms of `values`.

    A cost defines the methods of what it gives; the others raise PluginError, as asking for them breaks this contract.
    """

    parameters: tuple[Parameter, ...]
    gives: frozenset[Ability]
    description: Mapping[str, Any]
    noise_known: bool = True

    @abstractmethod
    def values(self, X: Array) -> Array:
        """Cost of each candidate: X (P, K) -> (P,). A candidate that cannot be simulated costs inf."""

    def residuals(self, x: Array) -> Array:
        """Weighted residuals, data then priors: x (K,) -> (M,); values = 0.5 * sum(residuals**2) if noise is known."""
        raise self._not_given("residuals")

    def residuals_of(self, X: Array) -> Array:
        """`residuals` of each candidate: X (P, K) -> (P, M), all inf where one diverges or breaks a constraint.

        One by one, where a cost does not know better.
        """
        rows = [np.asarray(self.residuals(x), dtype=np.float64) for x in np.asarray(X, dtype=np.float64)]
        size = max((len(row) for row in rows), default=0)
        return np.array([row if len(row) == size and np.isfinite(row).all() else np.full(size, np.inf) for row in rows])

    def jacobian(self, x: Array) -> Array:
        """Derivative of `residuals`: x (K,) -> (M, K)."""
        raise self._not_given("derivatives")

    def regression(self) -> Regression:
        """The same problem as linear regressions, where it is one."""
        raise self._not_given("regression")

    def reweight(self, x: Array) -> bool:
        """Re-estimates the measurement-noise covariance R at x where the criterion asks for it; True if it changed."""
        return False

    def value_of(self, residuals: Array) -> float:
        """What `values` gives for the candidate that has these residuals (M,) under the present weights."""
        return 0.5 * float(residuals @ residuals)

    def _not_given(self, ability: Ability) -> PluginError:
        return PluginError(
            f"it gives no {ability}",
            where=f"cost {type(self).__name__}",
            do="Name in `needs` what an optimizer asks for, and define in the cost what it `gives`.",
        )

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def start(self) -> Array:
        return np.array([parameter.value for parameter in self.parameters])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds (K,), infinite where there are none."""
        return (
            np.array([parameter.min for parameter in self.parameters]),
            np.array([parameter.max for parameter in self.parameters]),
        )
