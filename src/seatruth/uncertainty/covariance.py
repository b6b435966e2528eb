"""Standard errors that hold for autocorrelated residuals, and the Cramer-Rao bound.

With residuals r over their noise and their derivatives J (priors and continuity constraints included), H = J'J and the
estimate's error is H^-1 J' r. Its covariance is H^-1 M H^-1 (the sandwich estimator) with M = J' C J. C is the
covariance of the residuals: an autoregressive model for each channel of each trial, and the correlation of the
channels' innovations (Morelli and Klein 1997 do the same with sample autocovariances). The Cramer-Rao bound takes
C = I: white noise of the stated size.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from seatruth.arrays import Array, Flags
from seatruth.costs.study_cost import ResidualBlock
from seatruth.models.parameter import Parameter
from seatruth.statistics.autoregressive import WHITE, AutoregressiveModel, fit_autoregressive

_RANK_TOLERANCE = 1e-12
"""Eigenvalue of the scaled information, over the largest, below which the data do not determine its direction.
Rounding leaves about 1e-15 times the number of parameters; chosen here [S] with room for derivatives by iteration."""
_AT_BOUND = 1e-6
_ROUNDING = 1e-12
"""Part of a parameter's scale by which a search that ends on a bound may miss it by its arithmetic alone."""
"""Distance from a bound, over the range, below which a parameter is at the bound. Chosen here [S]."""
_NULL_SPACE_SHARE = 1e-4
"""A parameter is unidentifiable if this share of it (squared length) lies in undetermined directions, or less where
rounding cannot give as much. Chosen here [S]: one per cent of its length."""
_ABOVE_ROUNDING = 10.0
"""Times what rounding may give from which a share is one. Chosen here [S]."""
_MIN_CORRELATION = 2.0
"""Correlation of two channels' innovations, in its standard errors 1/sqrt(n), below which it is taken as zero: the
usual two-sided 5 % test."""
_MIN_SHARED_SAMPLES = 5
"""Fewer common samples give no correlation. Chosen here [S]."""


@dataclass(frozen=True)
class Covariance:
    """Uncertainty of the K free parameters and nuisances.

    Attributes:
        covariance: (K, K), in the parameters' units. NaN in the rows and columns of `fixed` and `unidentifiable`.
        crlb: (K,), Cramer-Rao bound of each standard deviation.
        degrees_of_freedom: Effective samples less parameters, at least 1.
        residual_models: The autoregressive model of the residuals by (trial, channel).
        fixed: (K,), parameters that the cost presses on a bound; they count as known.
        unidentifiable: (K,), parameters that the data do not determine.
    """

    covariance: Array
    crlb: Array
    degrees_of_freedom: float
    residual_models: dict[tuple[str, str], AutoregressiveModel]
    fixed: Flags
    unidentifiable: Flags

    @property
    def stderr(self) -> Array:
        """Standard errors (K,); infinite where a parameter is unidentifiable, NaN where it is fixed."""
        with np.errstate(invalid="ignore"):
            errors = np.sqrt(np.diag(self.covariance))
        errors[self.unidentifiable] = math.inf
        return np.asarray(errors)

    @property
    def correlation(self) -> Array:
        """Correlation matrix (K, K) of the estimates; NaN where the covariance is."""
        with np.errstate(invalid="ignore", divide="ignore"):
            sd = np.sqrt(np.diag(self.covariance))
            return np.asarray(np.clip(self.covariance / np.outer(sd, sd), -1.0, 1.0))

    def half_width(self, level: float = 0.95) -> Array:
        """Half the confidence interval of this level, (K,): Student's t with the degrees of freedom."""
        return np.asarray(scipy.special.stdtrit(self.degrees_of_freedom, 0.5 + level / 2.0) * self.stderr)


def at_bound(x: Array, bounds: tuple[Array, Array]) -> Flags:
    """Which entries of x (K,) lie on a bound."""
    low, high = bounds
    width = np.where(np.isfinite(high - low), high - low, 1.0)
    with np.errstate(invalid="ignore"):
        return np.asarray((x - low <= _AT_BOUND * width) | (high - x <= _AT_BOUND * width))


def on_bound(value: float, parameter: Parameter) -> float:
    """The bound, where a parameter's value differs from it by rounding alone: 2e-36 is 0 where 2.5 is usual.

    Example:
        >>> from seatruth.models import Parameter
        >>> on_bound(2e-36, Parameter("C_Da", 2.5, "1", min=0.0, max=10.0)), on_bound(2e-36, Parameter("a", 3e-36, "1"))
        (0.0, 2e-36)
    """
    known = [parameter.value, parameter.max - parameter.min]
    known += [] if parameter.prior is None else [parameter.prior.sd]
    scale = max((abs(size) for size in known if math.isfinite(size)), default=0.0)
    return next((end for end in (parameter.min, parameter.max) if abs(value - end) <= _ROUNDING * scale), value)


def active_bounds(x: Array, bounds: tuple[Array, Array], gradient: Array) -> Flags:
    """Which entries of x (K,) lie on a bound that a step down the cost's gradient (K,) would cross."""
    low, high = bounds
    return at_bound(x, bounds) & np.where(np.abs(x - low) <= np.abs(high - x), gradient > 0, gradient < 0)


def covariance(
    residuals: Array,
    jacobian: Array,
    groups: Sequence[ResidualBlock],
    fixed: Flags | None = None,
    *,
    white: bool = False,
) -> Covariance:
    """Covariance of the estimate at a minimum of the cost.

    Args:
        residuals: (M,), measured less predicted over the noise's standard deviation.
        jacobian: (M, K), their derivatives by the parameters.
        groups: Which rows belong to which channel of which trial, or to a prior.
        fixed: (K,), parameters on an active bound (`active_bounds`); none where None.
        white: Whether to take the noise as white and of the stated size, whatever the residuals show.
    """
    size = jacobian.shape[1]
    fixed = np.zeros(size, dtype=np.bool_) if fixed is None else fixed
    used = np.flatnonzero(~fixed)
    J = jacobian[:, used]
    inverse, undetermined = _inverse(J.T @ J)
    data = [group for group in groups if group.kind == "data" and len(group.rows)]
    models = {
        (group.trial, group.channel): WHITE if white else fit_autoregressive(residuals[group.rows], group.ordered)
        for group in data
    }
    effective = sum(models[group.trial, group.channel].effective_samples(len(group.rows)) for group in data)
    freedom = max(1.0, effective - len(used))
    if white:
        meat = J.T @ J - sum((J[g.rows].T @ J[g.rows] for g in groups if g.kind == "prior"), np.zeros((len(used),) * 2))
    else:
        # The fit has made the residuals smaller than the noise; this factor undoes that on average.
        meat = _meat(residuals, J, groups, models) * (effective / freedom if effective > 0 else 1.0)
    for group in groups:
        if group.kind == "prior":
            meat += J[group.rows].T @ J[group.rows]
    matrix = np.full((size, size), math.nan)
    matrix[np.ix_(used, used)] = inverse @ meat @ inverse
    bound = np.full(size, math.nan)
    bound[used] = np.sqrt(np.diag(inverse))
    unidentifiable = np.zeros(size, dtype=np.bool_)
    unidentifiable[used] = undetermined
    matrix[unidentifiable, :] = math.nan
    matrix[:, unidentifiable] = math.nan
    bound[unidentifiable] = math.inf
    return Covariance(matrix, bound, freedom, models, fixed.copy(), unidentifiable)


def _inverse(information: Array) -> tuple[Array, Flags]:
    """Pseudo-inverse of the information matrix, and the parameters (K,) that lie in its null space."""
    scale = np.sqrt(np.diag(information))
    without_effect = ~(scale > 0)
    scale[without_effect] = 1.0
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    determined = values > _RANK_TOLERANCE * max(1.0, float(values.max(initial=0.0)))
    inverse = (vectors[:, determined] / values[determined]) @ vectors[:, determined].T / np.outer(scale, scale)
    in_null_space = (vectors[:, ~determined] ** 2).sum(axis=1) > _least_share(values, determined)
    return np.asarray(inverse), without_effect | in_null_space


def _least_share(values: Array, determined: Flags) -> float:
    """Share of a parameter in the undetermined directions (squared length) from which it is not one of rounding.

    Rounding that leaves an eigenvalue e in the place of 0 turns its direction towards that of an eigenvalue v by
    sqrt(e / v) at most: changes d of the derivatives leave e = d^2, and turn it by d / sqrt(v).
    """
    if determined.all() or not determined.any():
        return _NULL_SPACE_SHARE
    left = max(float(np.abs(values[~determined]).max()), len(values) * np.finfo(float).eps * float(values.max()))
    return min(_NULL_SPACE_SHARE, _ABOVE_ROUNDING * left / float(values[determined].min()))


def _meat(
    residuals: Array, J: Array, groups: Sequence[ResidualBlock], models: dict[tuple[str, str], AutoregressiveModel]
) -> Array:
    """J' C J, summed over trials; the channels of one trial are correlated through their innovations."""
    total = np.zeros((J.shape[1], J.shape[1]))
    for trial in dict.fromkeys(group.trial for group in groups if group.kind == "data"):
        channels = [group for group in groups if group.kind == "data" and group.trial == trial and len(group.rows)]
        channel_models = [models[trial, group.channel] for group in channels]
        factors = [model.multiply_by_factor_transpose(J[g.rows]) for model, g in zip(channel_models, channels)]
        correlation = _innovation_correlation(residuals, channels, channel_models)
        for a, first in enumerate(channels):
            total += factors[a].T @ factors[a]
            for b in range(a):
                if correlation[a, b] == 0.0:
                    continue
                _, i, j = np.intersect1d(first.sample, channels[b].sample, assume_unique=True, return_indices=True)
                cross = correlation[a, b] * factors[a][i].T @ factors[b][j]
                total += cross + cross.T
    return total


def _innovation_correlation(
    residuals: Array, groups: Sequence[ResidualBlock], models: Sequence[AutoregressiveModel]
) -> Array:
    """Correlation of the channels' innovations (d, d) over the samples that they share."""
    size = len(groups)
    correlation = np.eye(size)
    innovations = [model.innovations(residuals[group.rows]) for group, model in zip(groups, models)]
    for a in range(size):
        for b in range(a):
            _, i, j = np.intersect1d(groups[a].sample, groups[b].sample, assume_unique=True, return_indices=True)
            x, y = innovations[a][i], innovations[b][j]
            length = math.sqrt(float(x @ x) * float(y @ y))
            if length <= 0 or len(i) < _MIN_SHARED_SAMPLES:
                continue
            value = float(x @ y) / length
            # A correlation that chance alone would give is noise, not information.
            if abs(value) > _MIN_CORRELATION / math.sqrt(len(i)):
                correlation[a, b] = correlation[b, a] = value
    return correlation
