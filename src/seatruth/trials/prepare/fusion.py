"""One depth from several sources: Kalman filter and Rauch-Tung-Striebel smoother.

State (d, d_dot, b): depth, its rate driven by white acceleration noise, and the bias of the inertial depth, a random
walk. Inertial depth = d + b + noise; pressure, trackers and sounders = d + noise, each with its own standard deviation,
at any times and rates: a sample that is NaN is not used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.trials.prepare.base import Options, preparation, with_channels
from seatruth.trials.trial import Trial


@dataclass(frozen=True)
class DepthFusion:
    """Smoothed depth (n,) m, its rate m/s, the inertial bias m, and the standard deviation of the depth m."""

    depth: Array
    rate: Array
    bias: Array
    sd: Array
    covariance: Array
    """(n, 3, 3) of depth, rate and bias."""
    innovation: Array
    """Mean square of the normalised innovations: near 1 if the standard deviations are right."""


def fuse(
    t: Array,
    sources: Mapping[str, tuple[Array, float]],
    biased: frozenset[str] = frozenset(),
    acceleration: float = 0.05,
    bias_walk: float = 0.01,
) -> DepthFusion:
    """Smoothed depth from sources {name: (samples (n,), sd m)}; those in `biased` share the slow bias.

    `acceleration` m/s2/sqrt(Hz): root spectral density of the vertical acceleration. `bias_walk` m/sqrt(s).
    """
    n = t.size
    first = [float(v[np.flatnonzero(np.isfinite(v))[0]]) for k, (v, _) in sources.items() if np.isfinite(v).any()]
    mean = np.array([first[0] if first else 0.0, 0.0, 0.0])
    # Wide enough to say nothing, small enough to keep double precision: 100 m, 10 m/s, 10 m.
    cov = np.diag([1e4, 1e2, 1e2])
    rows = {k: np.array([1.0, 0.0, 1.0 if k in biased else 0.0]) for k in sources}
    means, covs = np.empty((n, 3)), np.empty((n, 3, 3))
    ahead_means, ahead_covs = np.empty((n, 3)), np.empty((n, 3, 3))
    moves = np.tile(np.eye(3), (n, 1, 1))
    squares, used = 0.0, 0
    for k in range(n):
        if k:
            h = t[k] - t[k - 1]
            move = moves[k - 1]
            move[0, 1] = h
            mean = move @ mean
            cov = move @ cov @ move.T + _noise(h, acceleration, bias_walk)
        ahead_means[k], ahead_covs[k] = mean, cov
        for name, (values, sd) in sources.items():
            if np.isfinite(values[k]):
                row = rows[name]
                innovation = values[k] - row @ mean
                variance = row @ cov @ row + sd**2
                gain = cov @ row / variance
                mean = mean + gain * innovation
                keep = np.eye(3) - np.outer(gain, row)
                cov = keep @ cov @ keep.T + sd**2 * np.outer(gain, gain)
                squares, used = squares + innovation**2 / variance, used + 1
        means[k], covs[k] = mean, cov
    for k in range(n - 2, -1, -1):
        gain = np.linalg.solve(ahead_covs[k + 1], moves[k] @ covs[k]).T
        means[k] += gain @ (means[k + 1] - ahead_means[k + 1])
        covs[k] += gain @ (covs[k + 1] - ahead_covs[k + 1]) @ gain.T
    sd_depth = np.sqrt(np.maximum(covs[:, 0, 0], 0.0))
    score = np.asarray(squares / max(used, 1))
    return DepthFusion(means[:, 0], means[:, 1], means[:, 2], sd_depth, covs, score)


def _noise(h: float, acceleration: float, bias_walk: float) -> Array:
    a, b = acceleration**2, bias_walk**2
    return np.array([[a * h**3 / 3, a * h**2 / 2, 0.0], [a * h**2 / 2, a * h, 0.0], [0.0, 0.0, b * h]])


class FuseDepth(Options):
    """`sources`: standard deviation in m by channel, of every source that measures the depth itself.

    `inertial`: channel with a slow bias and `inertial_sd` m. `acceleration` m/s2/sqrt(Hz) and `bias_walk` m/sqrt(s)
    set how fast depth and bias may change. The fused depth goes `into` an output, its standard deviation into
    `into`_sd. The source channels stay.
    """

    sources: dict[str, float]
    inertial: str | None = None
    inertial_sd: float = Field(default=0.05, gt=0)
    acceleration: float = Field(default=0.05, gt=0)
    bias_walk: float = Field(default=0.01, gt=0)
    into: str = "depth"


@preparation("fuse_depth", FuseDepth)
def fuse_depth(trial: Trial, options: FuseDepth) -> tuple[Trial, str]:
    """Fuses several depth sources into one (Kalman filter and RTS smoother)."""
    if not options.sources:
        raise BadInput("it needs a source that measures the depth itself", do="Name one, as sources = {z_p = 0.03}.")
    if not options.into.isidentifier():
        raise BadInput(f"{options.into!r} cannot name a channel", do="Use letters, digits and underscores.")
    sources: dict[str, tuple[Array, float]] = {}
    for name, sd in options.sources.items():
        if not (np.isfinite(sd) and sd > 0):
            raise BadInput(f"the standard deviation of {name!r} is {sd:g}", do="Give a positive number of metres.")
        sources[name] = (trial.channel(name), sd)
    if not any(np.isfinite(values).any() for values, _ in sources.values()):
        raise BadInput("none of its sources has a valid sample", do="Check the columns.")
    if options.inertial is not None:
        sources[options.inertial] = (trial.channel(options.inertial), options.inertial_sd)
    biased = frozenset([options.inertial] if options.inertial else [])
    fused = fuse(trial.t, sources, biased, options.acceleration, options.bias_walk)
    changed = {options.into: fused.depth, f"{options.into}_sd": fused.sd}
    effect = (
        f"{options.into} from {', '.join(sources)}: sd {float(np.median(fused.sd)):.3g} m, mean square of the "
        f"normalised innovations {float(fused.innovation):.2f} (1 if the standard deviations are right)"
    )
    return with_channels(trial, changed), effect
