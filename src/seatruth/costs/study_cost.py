"""What every cost of a study has in common, and what uncertainty needs to know of it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.costs.base import Cost
from seatruth.costs.noise import Noise
from seatruth.costs.parameter_space import ParameterSpace
from seatruth.trials.trial import Trial

if TYPE_CHECKING:
    from seatruth.costs.study import Study


@dataclass(frozen=True)
class Group:
    """Residuals that belong together: one channel of one trial in the order of time, one prior, one state's joints.

    `rows` (n,) are their places in the residual vector. `t` (n,) s and `sample` (n,) are the trial's times and samples
    (empty for a prior, whose `channel` is the parameter; `channel` is the state for "continuity", and the state whose
    equation it is in a regression). Residuals are (measured - predicted) / sigma; in a regression the sample is the
    one that the difference starts from. The rows of a table are not `ordered`: neighbours have nothing in common.
    """

    kind: Literal["data", "prior", "continuity"]
    trial: str
    channel: str
    rows: Indices
    t: Array
    sample: Indices
    ordered: bool = True


class StudyCost(Cost):
    """A cost made from a study by `cost_of`.

    x (K,) holds the free parameters of the study (`space.free`), then the `nuisances`. `groups` say what each residual
    is. `sigma` is the standard deviation that now weights each channel, `estimated` names the channels whose deviation
    is estimated: `reweight(x)` brings it up to date, which is needed before residuals are read as errors over noise.
    """

    study: Study
    space: ParameterSpace
    nuisances: tuple[str, ...] = ()
    groups: tuple[Group, ...]
    trials: tuple[Trial, ...]
    _noise: Noise

    @property
    def description(self) -> Mapping[str, Any]:  # type: ignore[override]
        return {"study": self.study.content_hash}

    @property
    def sigma(self) -> dict[str, float]:
        return self._noise.sigma

    @property
    def estimated(self) -> frozenset[str]:
        return self._noise.estimated

    @property
    def noise_known(self) -> bool:  # type: ignore[override]
        return not self._noise.estimated

    @abstractmethod
    def predict(self, x: Array, trials: Sequence[Trial] | None = None) -> list[Array]:
        """Predicted outputs (n, D) of each trial; of those of the cost where `trials` is None."""

    def discretisation(self, x: Array) -> dict[str, float]:
        """Root mean square change of each predicted channel when every integration step is halved; 0 without any."""
        return {channel.name: 0.0 for channel in self.study.model.outputs}

    @abstractmethod
    def errors(self, x: Array) -> Array:
        """Measured less predicted (N, D), finite wherever a sample counts; not finite anywhere where x diverges."""

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
        """Takes the noise of the errors at x as the estimate; True if it changed. Leaves it where x diverges."""
        if self.noise_known:
            return False
        errors = self.errors(np.asarray(x, dtype=np.float64))
        return self._noise.estimate(errors)

    def value_of(self, residuals: Array) -> float:
        """The cost that belongs to these residuals (M,): the same as `values`, whatever the weights are now."""
        split = self._noise.size
        rest = residuals[split:]
        return self._noise.cost_of_residuals(residuals[:split]) + 0.5 * float(rest @ rest)

    def describe(self) -> dict[str, Any]:
        """What the cost is, for results: kind, options, noise as it stands."""
        return {
            **self.study.cost_options,
            "noise": {name: {"sd": sd, "estimated": name in self.estimated} for name, sd in self.sigma.items()},
        }


def prior_groups(names: Sequence[str], first: int) -> list[Group]:
    """One group for each prior; their residuals begin at `first`."""
    none, nothing = np.zeros(0), np.zeros(0, dtype=np.intp)
    return [
        Group("prior", "", name, np.array([first + k], dtype=np.intp), none, nothing) for k, name in enumerate(names)
    ]
