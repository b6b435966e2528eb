"""Search coordinates: what a solver moves in, so that every parameter has a scale of about one.

A parameter with both bounds runs from 0 to 1 (in the logarithm of its size where its scale is "log"); one without runs
in units of max(|value|, prior sd) around its value. A solver minimises the same cost in these coordinates: they are a
change of variables of a *function*, so no log-Jacobian is ever added to it (adding one would turn the maximum of the
likelihood, which does not depend on coordinates, into one that does).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.models.parameter import Parameter

REACH = 10.0
"""How many scales either side of its value a parameter without bounds is searched by solvers that need a box."""


class Coordinates:
    """The map between parameters x (K,) and search coordinates z (K,), both ways, row by row of any leading shape.

    `lower`, `upper` (K,) are the bounds in z, infinite where there are none; `box_lower`, `box_upper` are finite;
    `region_lower`, `region_upper` bound the region of random starts. `start` (K,) is where a search begins: at the
    parameters' values, or at the `start` (K,) given in their units.
    """

    def __init__(self, parameters: Sequence[Parameter], start: Array | None = None) -> None:
        self.parameters = tuple(parameters)
        self._minimum = np.array([p.min for p in self.parameters])
        self._maximum = np.array([p.max for p in self.parameters])
        self._log = np.array([p.scale == "log" for p in self.parameters], dtype=bool)
        self._any_log = bool(self._log.any())
        self._sign = np.where(self._log & (self._maximum < 0), -1.0, 1.0)
        value = np.array([p.value for p in self.parameters])
        low, high = self._straight(self._minimum), self._straight(self._maximum)
        low, high = np.minimum(low, high), np.maximum(low, high)
        bounded = np.isfinite(low) & np.isfinite(high)
        centre = self._straight(value)
        width = np.where(self._log, 1.0, [_scale(p) for p in self.parameters])
        self._offset = np.where(bounded, low, centre)
        with np.errstate(invalid="ignore"):
            self._scale = np.where(bounded, high - low, width)
        # A log coordinate on the negative side runs from -log|min| to -log|max|, so that z still rises with x.
        self.lower = np.where(bounded, 0.0, (low - self._offset) / self._scale)
        self.upper = np.where(bounded, 1.0, (high - self._offset) / self._scale)
        self.start = self.z_of(value)
        self.region_lower, self.region_upper = self._region()
        if start is not None:
            self.start = self.z_of(start)
        self.box_lower = np.where(np.isfinite(self.lower), self.lower, np.minimum(-REACH, self.region_lower))
        self.box_upper = np.where(np.isfinite(self.upper), self.upper, np.maximum(REACH, self.region_upper))

    @property
    def dimension(self) -> int:
        return len(self.parameters)

    def x_of(self, z: Array) -> Array:
        """Parameters of search coordinates, never outside their bounds: (..., K) -> (..., K)."""
        straight = self._offset + np.asarray(z, dtype=float) * self._scale
        if self._any_log:
            with np.errstate(over="ignore"):
                straight = np.where(self._log, self._sign * np.exp(self._sign * straight), straight)
        inside: Array = np.minimum(np.maximum(straight, self._minimum), self._maximum)
        return inside

    def z_of(self, x: Array) -> Array:
        """Search coordinates of parameters: (..., K) -> (..., K)."""
        z = (self._straight(np.asarray(x, dtype=float)) - self._offset) / self._scale
        return np.minimum(np.maximum(z, self.lower), self.upper)

    def slope(self, z: Array) -> Array:
        """dx/dz at z: (K,) -> (K,)."""
        return np.where(self._log, np.abs(self.x_of(z)) * self._scale, self._scale)

    def clip(self, Z: Array) -> Array:
        """The nearest point inside the bounds."""
        return np.minimum(np.maximum(Z, self.lower), self.upper)

    def sample(self, rng: np.random.Generator, n: int) -> Array:
        """n random starts (n, K), uniform in z over the region of starts."""
        return self.region_lower + rng.random((n, self.dimension)) * (self.region_upper - self.region_lower)

    def _straight(self, x: Array) -> Array:
        """x itself, or sign * log|x| on log scale, which rises with x on both sides of zero."""
        if not self._any_log:
            return x
        with np.errstate(divide="ignore", invalid="ignore"):
            size = np.where(self._log, np.abs(x), 1.0)
            return np.where(self._log, self._sign * np.log(size), x)

    def _region(self) -> tuple[Array, Array]:
        """Where random starts are drawn: the start region, else the bounds, else around the prior or the value."""
        low, high = self.lower.copy(), self.upper.copy()
        for k, p in enumerate(self.parameters):
            if p.start is not None:
                low[k], high[k] = (self._one(k, edge) for edge in p.start)
            elif not (np.isfinite(low[k]) and np.isfinite(high[k])):
                around = (
                    (self.start[k] - 1.0, self.start[k] + 1.0)
                    if p.prior is None or p.scale == "log"
                    else tuple(self._one(k, p.prior.mean + sign * 2 * p.prior.sd) for sign in (-1, 1))
                )
                low[k], high[k] = max(low[k], around[0]), min(high[k], around[1])
        return low, high

    def _one(self, k: int, value: float) -> float:
        x: NDArray[np.float64] = self.x_of(self.start)
        x[k] = value
        return float(self.z_of(x)[k])


def _scale(p: Parameter) -> float:
    """The natural step of a parameter without both bounds, in its own unit."""
    sizes = [abs(p.value)]
    if p.prior is not None:
        sizes.append(p.prior.sd)
    if max(sizes) < 1e-12 and p.start is not None:
        sizes.append(p.start[1] - p.start[0])
    sizes.extend(abs(edge) for edge in (p.min, p.max) if max(sizes) < 1e-12 and np.isfinite(edge))
    return max(sizes) if max(sizes) >= 1e-12 else 1.0
