"""Base class of study costs; shows the residual blocks to the uncertainty analysis."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.costs.base import Cost
from seatruth.costs.noise import Noise
from seatruth.costs.parameter_space import ParameterSpace
from seatruth.costs.problem import EstimationProblem
from seatruth.trials.trial import Trial


@dataclass(frozen=True)
class ResidualBlock:
    """Residuals of one kind: one channel of one trial in the order of time, one prior, or the defects of one state.

    `rows` (n,) are their indices in the residual vector. `t` (n,) s and `sample` (n,) are the times and sample numbers
    in the trial; both are empty for a prior. `channel` is an output of the model; for a prior it is the parameter, for
    "continuity" (the defects between segments) the state, in a regression the state with "_dot". A data residual is
    (measured - predicted) / sigma; in a regression its sample is the one from which the difference quotient starts.
    `ordered` is False for rows of a table: neighbours are independent.
    """

    kind: Literal["data", "prior", "continuity"]
    trial: str
    channel: str
    rows: Indices
    t: Array
    sample: Indices
    ordered: bool = True


class StudyCost(Cost):
    """A cost made from an estimation problem by `cost_of`.

    x (K,) holds the free parameters of the problem (`space.free`), then the `nuisances`. `residual_blocks` say what
    each residual is. `sigma` is the standard deviation that weights each channel now. `estimated` names the channels
    whose standard deviation is estimated; call `reweight(x)` before reading residuals as multiples of the noise.
    """

    problem: EstimationProblem
    space: ParameterSpace
    nuisances: tuple[str, ...] = ()
    residual_blocks: tuple[ResidualBlock, ...]
    trials: tuple[Trial, ...]
    _noise: Noise

    @property
    def description(self) -> Mapping[str, Any]:  # type: ignore[override]  # made of the problem, never set
        return {"study": self.problem.content_hash}

    @property
    def sigma(self) -> dict[str, float]:
        return self._noise.sigma

    @property
    def estimated(self) -> frozenset[str]:
        return self._noise.estimated

    @property
    def noise_known(self) -> bool:  # type: ignore[override]  # made of the noise, never set
        return not self._noise.estimated

    @abstractmethod
    def predict(self, x: Array, trials: Sequence[Trial] | None = None) -> list[Array]:
        """Predicted outputs (n, D) of each trial; None stands for the trials of the cost."""

    def discretisation(self, x: Array) -> dict[str, float]:
        """Root mean square change of each predicted channel when every integration step is halved; 0 without any."""
        return {channel.name: 0.0 for channel in self.problem.model.outputs}

    @abstractmethod
    def errors(self, x: Array) -> Array:
        """Measured minus predicted (N, D), finite for every sample that counts; not finite where x diverges."""

    def residuals(self, x: Array) -> Array:
        """Errors over noise, then priors: (M,); all inf where x breaks a constraint."""
        x = np.asarray(x, dtype=np.float64)
        with np.errstate(all="ignore"):
            found = np.concatenate([self._noise.residuals(self.errors(x)), self.space.prior_residuals(x[None])[0]])
        return found if self.space.feasible(x[None])[0] else np.full(len(found), np.inf)

    def _with_priors(self, found: Array, X: Array) -> Array:
        """Costs (P,) of the data with those of the priors; inf where a candidate breaks a constraint or diverges."""
        with np.errstate(all="ignore"):
            found = found + 0.5 * (self.space.prior_residuals(X) ** 2).sum(axis=1)
        found = np.where(self.space.feasible(X), found, np.inf)
        return np.where(np.isfinite(found), found, np.inf)

    def reweight(self, x: Array) -> bool:
        """Estimates the noise from the errors at x; True if it changed. Keeps the old estimate where x diverges."""
        if self.noise_known:
            return False
        errors = self.errors(np.asarray(x, dtype=np.float64))
        return self._noise.estimate(errors)

    def value_of(self, residuals: Array) -> float:
        """The cost of these residuals (M,): what `values` gives, whatever the present weights are."""
        split = self._noise.size
        rest = residuals[split:]
        return self._noise.cost_of_residuals(residuals[:split]) + 0.5 * float(rest @ rest)

    def describe(self) -> dict[str, Any]:
        """Kind, options and present noise of the cost, for results."""
        return {
            **self.problem.cost.describe(),
            "noise": {name: {"sd": sd, "estimated": name in self.estimated} for name, sd in self.sigma.items()},
        }


def prior_blocks(names: Sequence[str], first: int) -> list[ResidualBlock]:
    """One block for each prior; their residuals start at index `first`."""
    none, nothing = np.zeros(0), np.zeros(0, dtype=np.intp)
    return [
        ResidualBlock("prior", "", name, np.array([first + k], dtype=np.intp), none, nothing)
        for k, name in enumerate(names)
    ]
