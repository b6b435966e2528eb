"""Standard errors that hold when residuals are coloured, and the bound that no estimate can beat.

With residuals r over their noise and derivatives J, H = J'J (priors and joints included) and the estimate moves by
H^-1 J' r. Its covariance is H^-1 M H^-1 with M = J' C J, where C is the covariance that the residuals themselves show:
an autoregressive model for each channel of each trial, with the correlation of the channels' innovations (Morelli and
Klein 1997 do the same with raw autocovariances). The Cramer-Rao bound takes C = I: white noise of the stated size.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from seatruth.arrays import Array, Flags
from seatruth.costs.study_cost import ResidualBlock
from seatruth.statistics.autoregressive import Colour, colour_of

_BLIND = 1e-12
"""Directions whose part of the scaled information is below this are not seen by the data."""
_AT_BOUND = 1e-6
"""Distance from a bound, as a part of the range, at which a parameter is at it."""
_WHITE = Colour(np.zeros(0), 1.0, 1.0)
_IN_IT = 1e-4
"""Part of such a direction from which a parameter counts as not seen itself."""


@dataclass(frozen=True)
class Covariance:
    """Of the K free parameters and nuisances. Rows and columns of `held` (at a bound) and `unseen` ones are NaN."""

    covariance: Array
    crlb: Array
    """Cramer-Rao bound of each standard deviation, (K,)."""
    freedom: float
    """Degrees of freedom: effective samples less parameters, at least 1."""
    colours: dict[tuple[str, str], Colour]
    held: Flags
    unseen: Flags

    @property
    def stderr(self) -> Array:
        """Standard errors (K,); infinite where the data do not see the parameter, NaN where it is held."""
        with np.errstate(invalid="ignore"):
            found = np.sqrt(np.diag(self.covariance))
        found[self.unseen] = math.inf
        return np.asarray(found)

    @property
    def correlation(self) -> Array:
        with np.errstate(invalid="ignore", divide="ignore"):
            sd = np.sqrt(np.diag(self.covariance))
            return np.asarray(np.clip(self.covariance / np.outer(sd, sd), -1.0, 1.0))

    def half_width(self, level: float = 0.95) -> Array:
        """Half the interval of this confidence, (K,): Student's t with the degrees of freedom."""
        return np.asarray(student.ppf(0.5 + level / 2.0, self.freedom) * self.stderr)


def at_bound(x: Array, bounds: tuple[Array, Array]) -> Flags:
    """Which entries of x (K,) lie on a bound."""
    low, high = bounds
    width = np.where(np.isfinite(high - low), high - low, 1.0)
    with np.errstate(invalid="ignore"):
        return np.asarray((x - low <= _AT_BOUND * width) | (high - x <= _AT_BOUND * width))


def pressed(x: Array, bounds: tuple[Array, Array], slope: Array) -> Flags:
    """Which entries of x lie on a bound that the cost, of this slope (K,), would cross."""
    low, high = bounds
    return at_bound(x, bounds) & np.where(np.abs(x - low) <= np.abs(high - x), slope > 0, slope < 0)


def covariance(
    residuals: Array,
    jacobian: Array,
    groups: Sequence[ResidualBlock],
    held: Flags | None = None,
    *,
    white: bool = False,
) -> Covariance:
    """Covariance at a minimum: residuals (M,), jacobian (M, K); `held` (K,) marks parameters pressed on a bound.

    With `white` the residuals' own size and colour are left aside: the errors are those of white noise as stated.
    """
    size = jacobian.shape[1]
    held = np.zeros(size, dtype=np.bool_) if held is None else held
    used = np.flatnonzero(~held)
    J = jacobian[:, used]
    inverse, blind = _inverse(J.T @ J)
    colours = {
        (group.trial, group.channel): _WHITE if white else colour_of(residuals[group.rows], group.ordered)
        for group in groups
        if group.kind == "data" and len(group.rows)
    }
    effective = sum(
        colours[group.trial, group.channel].effective(len(group.rows))
        for group in groups
        if group.kind == "data" and len(group.rows)
    )
    freedom = max(1.0, effective - len(used))
    # The parameters have taken their share of the residuals; what is left is smaller than the noise by this much.
    if white:
        meat = J.T @ J - sum((J[g.rows].T @ J[g.rows] for g in groups if g.kind == "prior"), np.zeros((len(used),) * 2))
    else:
        meat = _meat(residuals, J, groups, colours) * (effective / freedom if effective > 0 else 1.0)
    for group in groups:
        if group.kind == "prior":
            meat += J[group.rows].T @ J[group.rows]
    found = np.full((size, size), math.nan)
    found[np.ix_(used, used)] = inverse @ meat @ inverse
    bound = np.full(size, math.nan)
    bound[used] = np.sqrt(np.diag(inverse))
    unseen = np.zeros(size, dtype=np.bool_)
    unseen[used] = blind
    found[unseen, :] = math.nan
    found[:, unseen] = math.nan
    bound[unseen] = math.inf
    return Covariance(found, bound, freedom, colours, held.copy(), unseen)


def _inverse(information: Array) -> tuple[Array, Flags]:
    """Inverse of H on what the data see, and which parameters lie in what they do not."""
    scale = np.sqrt(np.diag(information))
    dead = ~(scale > 0)
    scale[dead] = 1.0
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    seen = values > _BLIND * max(1.0, float(values.max(initial=0.0)))
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T / np.outer(scale, scale)
    blind = dead | ((vectors[:, ~seen] ** 2).sum(axis=1) > _IN_IT)
    return np.asarray(inverse), blind


def _meat(residuals: Array, J: Array, groups: Sequence[ResidualBlock], colours: dict[tuple[str, str], Colour]) -> Array:
    """J' C J: trial by trial, channels of one trial with the correlation of their innovations."""
    total = np.zeros((J.shape[1], J.shape[1]))
    for trial in dict.fromkeys(group.trial for group in groups if group.kind == "data"):
        own = [group for group in groups if group.kind == "data" and group.trial == trial and len(group.rows)]
        spread = [colours[trial, g.channel].spread_back(J[g.rows]) for g in own]
        correlation = _innovations(residuals, own, [colours[trial, g.channel] for g in own])
        for a, first in enumerate(own):
            total += spread[a].T @ spread[a]
            for b in range(a):
                if correlation[a, b] == 0.0:
                    continue
                _, i, j = np.intersect1d(first.sample, own[b].sample, assume_unique=True, return_indices=True)
                cross = correlation[a, b] * spread[a][i].T @ spread[b][j]
                total += cross + cross.T
    return total


def _innovations(residuals: Array, groups: Sequence[ResidualBlock], colours: Sequence[Colour]) -> Array:
    """Correlation of the channels' innovations (d, d) on the samples that they share."""
    size = len(groups)
    found = np.eye(size)
    white = []
    for group, colour in zip(groups, colours):
        series = residuals[group.rows]
        order = len(colour.coefficients)
        innovation = series.copy()
        for lag in range(1, order + 1):
            innovation[lag:] -= colour.coefficients[lag - 1] * series[:-lag]
        innovation[:order] = 0.0
        white.append(innovation)
    for a in range(size):
        for b in range(a):
            _, i, j = np.intersect1d(groups[a].sample, groups[b].sample, assume_unique=True, return_indices=True)
            x, y = white[a][i], white[b][j]
            length = math.sqrt(float(x @ x) * float(y @ y))
            # Correlations that chance alone would give are noise in the result, not information.
            if length > 0 and len(i) > 4 and abs(float(x @ y) / length) > 2.0 / math.sqrt(len(i)):
                found[a, b] = found[b, a] = float(x @ y) / length
    return found
