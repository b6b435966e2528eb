"""Sizes of noise and discrepancy: what they are, what is known of them before, and what it costs not to know them."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.problem import Problem, Series
from seatruth.diagnosis.settings import Settings
from seatruth.statistics.state_space_noise import NoiseShape, joined, whiten
from seatruth.trials.prepare.outliers import MAD_TO_SD

PAIRS = (("v", "r"), ("w", "q"), ("v", "p"), ("v_z", "omega_y"), ("v_y", "omega_z"))
"""Equations whose missing forces are correlated: a side force that acts off the origin has a moment."""
_FIRST_SIZE = math.log(0.03)
"""Size of discrepancy from which the search starts, as a part of the usual acceleration. [S] A few per cent."""
_FINEST = 1e-5
"""Least noise, as a part of a record's spread. [S] Finer data, a simulator's own, leave no correct digit in
log-likelihoods: initial states have priors 1e6 times as wide."""
_NO_NOISE = 1e-12
"""Standard deviation of white noise, in SI units, below which there is none: no sensor resolves it. [S]"""
_LARGEST_RESIDUAL = 1e140
"""Size, in SI units, below which the squares of a million residuals can be summed (up to 1.8e308)."""
_PROPOSED = 3
"""Shapes that the residuals alone suggest, of which the likelihood chooses. [S] Far from the optimum the first one may
lead astray: with it alone, two thrusters whose orders are exchanged were never fitted."""
_WIDE = 0.7
"""Difference of a logarithm of a size over which its likelihood is taken as a normal curve. A factor of 2."""
_NARROWEST = 1e-6
"""Least width of that curve as a part of its prior's range: of a size that a million samples fix."""
_OUTSIDE = 50.0
"""Curvature (nats) of the walls beyond which no size goes."""


@dataclass(frozen=True)
class Sizes:
    """Sizes of noise and discrepancy, C channels and E equations.

    `white` (C,): log of the white noise's standard deviation. `shape` (C,): number of its shape among the grid's.
    `terms`, `forces` (E,): log size of the missing acceleration over the usual one, in terms and in forces of time;
    -inf for none. `coupling`: correlation of the pairs of equations that the model has.
    """

    white: Array
    shape: tuple[int, ...]
    terms: Array
    forces: Array
    coupling: Array

    @property
    def discrepancy(self) -> bool:
        """Whether any equation lacks something."""
        return bool(np.isfinite(self.terms).any() or np.isfinite(self.forces).any())

    @property
    def vector(self) -> Array:
        """What a search moves (C + 2 E + pairs,): all logarithms of sizes, and Fisher's z of the correlations."""
        return np.concatenate([self.white, self.terms, self.forces, np.arctanh(self.coupling)])

    def at(self, vector: Array) -> Sizes:
        """The sizes of such a vector, with the same shapes of noise."""
        ends = np.cumsum([len(self.white), len(self.terms), len(self.forces)])
        white, terms, forces, z = np.split(vector, ends)
        return replace(self, white=white, terms=terms, forces=forces, coupling=np.tanh(z))

    @property
    def without_terms(self) -> bytes:
        """All of them but those of terms, as a key: what a likelihood depends on before the shared unknowns' priors."""
        parts = self.white, np.array(self.shape, dtype=np.intp), self.forces, self.coupling
        return b"".join(part.tobytes() for part in parts)

    def without_discrepancy(self) -> Sizes:
        """The same noise, nothing missing."""
        none = np.full_like(self.terms, -math.inf)
        return replace(self, terms=none, forces=none)

    def shrunk(self, part: float) -> Sizes:
        """The same noise, with this part of the discrepancy."""
        return replace(self, terms=self.terms + math.log(part), forces=self.forces + math.log(part))

    def with_discrepancy(self, least: float = math.log(0.01)) -> Sizes:
        """The same noise, with discrepancy from which a search can start."""

        def at_least(values: Array) -> Array:
            return np.where(np.isfinite(values), np.maximum(values, least), least)

        return replace(self, terms=at_least(self.terms), forces=at_least(self.forces))


@dataclass(frozen=True)
class NoisePrior:
    """What is known of the noise before the fit, by channel's number.

    `declared`: standard deviation that the study states (the white part). `least`: below which it cannot be.
    """

    declared: Mapping[int, float]
    least: Mapping[int, float]


@cache
def noise_shapes(settings: Settings) -> tuple[NoiseShape, ...]:
    """The grid of noise shapes: white alone, then each ratio with each time."""
    grid = (NoiseShape(ratio, tau) for ratio in settings.noise_ratios for tau in settings.noise_times)
    return (NoiseShape(), *grid)


def is_no_noise(sizes: Sizes, known: NoisePrior, settings: Settings, *, forces: bool = True) -> bool:
    """Whether what is taken for noise is motion: half of the channels of stated noise have the largest slow part.

    One suffices where no missing `forces` can be tried, since what another form of the model leaves has nowhere else
    to go. Of a boat with a simulator of another form without ports, a heading of 0.5 deg had a slow error of 2.9 deg,
    under which no gap was left, and a compass, a gyro and a rudder, none of which was off, had 97 %.

    Filtered records have slow errors of six times the white ones, but then nobody states the white noise of a data
    sheet: beside that, they are 3.4 prior deviations from what sensors have. Of 37 studies of vehicles that others
    simulated, and whose noise they stated, two were so, each with a cause outside the library that acts in bursts (weed
    that comes and goes, oil that runs fore and aft).
    """
    largest = [noise_shapes(settings)[sizes.shape[c]].ratio >= max(settings.noise_ratios) for c in known.declared]
    return any(largest) and (not forces or 2 * sum(largest) >= len(largest))


def noise_prior(problem: Problem) -> NoisePrior:
    """Declared noise, and the least there can be: rounding to the record's last digit, or to the digits of sums."""
    declared = {
        c: float(problem.study.noise[name])
        for c, name in enumerate(problem.outputs)
        if isinstance(problem.study.noise.get(name), (int, float))
    }
    least: dict[int, float] = {}
    for c, name in enumerate(problem.outputs):
        values = [np.asarray(t.outputs[name]) for t in problem.trials if name in t.outputs]
        finite = np.unique(np.concatenate([v[np.isfinite(v)] for v in values])) if values else np.zeros(0)
        least[c] = _FINEST * max((_spread(v) for v in values), default=1.0)
        steps = np.diff(finite)
        if steps.size and (np.abs(steps / steps.min() - np.rint(steps / steps.min())) < 1e-3).all():
            # Uniform rounding errors: step / sqrt(12).
            least[c] = max(least[c], float(steps.min()) / math.sqrt(12.0))
    return NoisePrior(declared, least)


def _spread(values: Array) -> float:
    """Standard deviation of what was recorded; 0 where nothing was."""
    return float(np.nanstd(values)) if np.isfinite(values).any() else 0.0


def first_sizes(problem: Problem, prior: NoisePrior) -> Sizes:
    """White noise as declared, else of second differences of neighbouring samples; a few per cent of discrepancy."""
    white = []
    for c, name in enumerate(problem.outputs):
        if c in prior.declared:
            white.append(math.log(prior.declared[c]))
            continue
        samples = [np.asarray(t.outputs[name]) for t in problem.trials if name in t.outputs]
        second = np.concatenate([np.diff(y, n=2) for y in samples]) if samples else np.zeros(0)
        second = np.abs(second[np.isfinite(second)])
        # Second differences of white noise have variance 6 sd^2.
        size = MAD_TO_SD * float(np.median(second)) / math.sqrt(6.0) if second.size else 0.0
        white.append(math.log(max(size, prior.least[c], _NO_NOISE)))
    E = len(problem.equations)
    pairs = sum(a in problem.equations and b in problem.equations for a, b in PAIRS)
    start = np.full(E, _FIRST_SIZE)
    return Sizes(np.array(white), (0,) * len(white), start, start.copy(), np.zeros(pairs))


def log_prior(settings: Settings, sizes: Sizes, known: NoisePrior) -> float:
    """Logarithm of the prior density of sizes, up to a constant.

    Declared white noise is log-normal, other noise and discrepancy are uniform in the logarithm between walls; white
    noise alone is as probable as all slow shapes together, and their ratio is log-normal.
    """
    total, least = 0.0, least_white(known)
    shapes = _log_shape_prior(settings)
    for c, log_white in enumerate(sizes.white):
        if c in known.declared:
            total -= 0.5 * ((log_white - math.log(known.declared[c])) / settings.declared_noise_sd) ** 2
        if c in least:
            total -= _OUTSIDE * max(least[c] - log_white, 0.0) * 1e3
        total += shapes[sizes.shape[c]]
    lowest = math.log(settings.smallest_discrepancy)
    for values in (sizes.terms, sizes.forces):
        inside = values[np.isfinite(values)]
        beyond = np.maximum(inside, 0.0) ** 2 + np.maximum(lowest - inside, 0.0) ** 2
        total -= _OUTSIDE * float(beyond.sum())
    # Lewandowski, Kurowicka and Joe 2009 with eta = 2 for each pair: no correlation is likeliest, +-1 impossible.
    return total + float(np.log(np.maximum(1.0 - sizes.coupling**2, 1e-12)).sum())


def least_white(known: NoisePrior) -> dict[int, float]:
    """The least logarithm of each channel's white deviation."""
    return {c: math.log(max(value, _NO_NOISE)) for c, value in known.least.items()}


def log_prior_slopes(settings: Settings, sizes: Sizes, known: NoisePrior) -> tuple[Array, Array]:
    """Slopes (n,) of `log_prior` by `sizes.vector`, and minus its second derivatives, but for the least noise."""
    C, E = len(sizes.white), len(sizes.terms)
    slope, curvature = np.zeros(len(sizes.vector)), np.zeros(len(sizes.vector))
    for c, value in known.declared.items():
        slope[c] = -(sizes.white[c] - math.log(value)) / settings.declared_noise_sd**2
        curvature[c] = settings.declared_noise_sd**-2
    lowest = math.log(settings.smallest_discrepancy)
    values = np.concatenate([sizes.terms, sizes.forces])
    inside = np.where(np.isfinite(values), values, 0.0)
    beyond = np.maximum(inside, 0.0) - np.maximum(lowest - inside, 0.0)
    slope[C : C + 2 * E] = -2.0 * _OUTSIDE * beyond
    curvature[C : C + 2 * E] = np.where(beyond != 0.0, 2.0 * _OUTSIDE, 0.0)
    # log(1 - tanh^2 z) = -2 log cosh z.
    slope[C + 2 * E :] = -2.0 * sizes.coupling
    curvature[C + 2 * E :] = 2.0 * (1.0 - sizes.coupling**2)
    return slope, curvature


@cache
def _log_shape_prior(settings: Settings) -> tuple[float, ...]:
    """Logarithm of the prior probability of each noise shape."""
    z = np.log(np.array(settings.noise_ratios) / settings.noise_ratio) / settings.noise_ratio_spread
    weight = np.repeat(np.exp(-0.5 * z**2), len(settings.noise_times))
    return (math.log(0.5), *(math.log(0.5) + np.log(weight / weight.sum())).tolist())


def proposed_shapes(
    problem: Problem, residuals: Array, of: Collection[int] | None = None
) -> dict[int, list[tuple[int, float]]]:
    """Noise shapes that a channel's residuals (N,) suggest, best first, each with the log of its white deviation.

    Of these channels, or of all.

    The likelihood of the residuals alone, its size profiled out, over the whole grid: a search by neighbours stops on
    the ridge where a smaller white part and a larger slow one look alike. None are proposed where the residuals are
    those of a step that leads nowhere, so large that their squares overflow, and none where there is no noise.
    """
    if not (np.abs(residuals) < _LARGEST_RESIDUAL).all():
        return {}
    shapes = noise_shapes(problem.settings)
    channels = len(problem.outputs)
    squares, logs = np.zeros((len(shapes), channels)), np.zeros((len(shapes), channels))
    counts = np.bincount(problem.channel_of, minlength=channels).astype(np.float64)
    for at, series in _recorded_together(problem, range(channels) if of is None else of):
        found = [joined([(residuals[one.rows], one.t) for one in own]) for own in series]
        columns, (_, t, begins) = np.stack([one[0] for one in found], axis=1), found[0]
        for k, shape in enumerate(shapes):
            white, log_determinant = whiten(columns, t, shape, begins)
            squares[k, at] = (white**2).sum(axis=0)
            logs[k, at] = log_determinant
    with np.errstate(divide="ignore"):
        size = 0.5 * np.log(np.maximum(squares, 1e-300) / np.maximum(counts, 1.0))
    scores = -counts * size - 0.5 * logs + np.array(_log_shape_prior(problem.settings))[:, None]
    order = np.argsort(-scores, axis=0, kind="stable")[:_PROPOSED]
    least = math.log(_NO_NOISE)
    seen = [c for c in range(channels) if counts[c] and (of is None or c in of)]
    return {c: [(int(k), float(size[k, c])) for k in order[:, c] if size[k, c] > least] for c in seen}


def _recorded_together(problem: Problem, channels: Collection[int]) -> list[tuple[list[int], list[list[Series]]]]:
    """Channels of one clock, each with its series in the trials: whitened at once, they cost little more than one."""
    found: dict[tuple[bytes, ...], tuple[list[int], list[list[Series]]]] = {}
    for channel in sorted(channels):
        series = [one for one in problem.series if one.channel == channel and len(one.t)]
        if series:
            at, own = found.setdefault(tuple(one.t.tobytes() for one in series), ([], []))
            at.append(channel)
            own.append(series)
    return list(found.values())


def price_of_sizes(log_likelihood: Callable[[Sizes], float], sizes: Sizes, settings: Settings) -> float:
    """What it costs (nats) that the sizes of discrepancy are not known: their best against the mean over their prior.

    The prior is uniform in the logarithm from `smallest_discrepancy` to 1. One size at a time, the likelihood is taken
    as a normal curve about its best, with a flat foot where the size is too small to matter: Laplace's approximation,
    and what a size that does nothing costs is nothing.
    """
    if not sizes.discrepancy:
        return 0.0
    low = math.log(settings.smallest_discrepancy)
    best, total = log_likelihood(sizes), 0.0
    for part in ("terms", "forces"):
        values = getattr(sizes, part)
        for k in np.flatnonzero(np.isfinite(values)):
            here = min(max(float(values[k]), low), 0.0)

            def at(x: float, part: str = part, values: Array = values, k: int = int(k)) -> float:
                moved = values.copy()
                moved[k] = x
                changed: dict[str, Any] = {part: moved}
                return log_likelihood(replace(sizes, **changed)) - best

            foot = math.exp(min(at(low), 0.0))
            drop = min(at(here - _WIDE), 0.0) + min(at(here + _WIDE), 0.0)
            width = min(math.sqrt(-2.0 * math.pi * _WIDE**2 / drop) if drop < -1e-9 else math.inf, -low)
            # Up to one deviation below the best the curve counts, further down the foot.
            below = max(here - low - 0.5 * width, 0.0)
            # Where the likelihood is not finite beside the best, the curve has no width.
            total -= math.log(min(max((width + foot * below) / -low, _NARROWEST), 1.0))
    return total
