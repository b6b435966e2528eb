"""The most probable sizes of noise and discrepancy: coordinate ascent from where they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import Sizes, noise_shapes

_STEPS = {"white": (0.05, 1.0), "terms": (0.3, 2.0), "forces": (0.3, 2.0), "coupling": (0.3, 0.6)}
"""Difference over which a slope is taken, and the longest step, in logarithms of sizes and in Fisher's z. [S]"""
_NEARLY = 3.0
"""nats by which a proposed shape may be behind: setting its white deviation may bring as much. [S]"""
_SWEPT = 0.1
"""nats that a sweep must bring for another one. [S] A tenth of what could change an answer."""
_DONE = 0.1 * _SWEPT
"""nats that a coordinate must have brought in one sweep to be moved in the next one, not only in the one after. [S]
It takes ten such to make a sweep."""
_ROUNDING = 1e-9
"""nats within which two values of the objective are the same."""


def maximise(
    objective: Callable[[Sizes], float],
    sizes: Sizes,
    settings: Settings,
    *,
    channels: Sequence[int],
    noise: bool = True,
    shapes: bool = True,
    sweeps: int = 2,
    proposals: Mapping[int, Sequence[tuple[int, float]]] | None = None,
) -> tuple[Sizes, float]:
    """Coordinate ascent: parabolic steps in the logarithms of sizes, shapes of noise to neighbours of the grid.

    Returns the best sizes and the objective there. `channels` are those that were recorded; `proposals` are shapes
    with the logarithm of their white deviation that are tried first (`proposed_shapes`).
    """
    best, value = sizes, objective(sizes)
    for c, options in (proposals or {}).items():
        found = [_with_shape(best, c, shape, white) for shape, white in options if shape != best.shape[c]]
        if found:
            values = [objective(one) for one in found]
            top = int(np.argmax(values))
            # What is near may be better once its white deviation has been set.
            if values[top] > value - _NEARLY:
                tried, reached = _climb(objective, found[top], values[top], "white", c)
                best, value = (tried, reached) if reached > value else (best, value)
    resting = set[tuple[str, int]]()
    for _ in range(sweeps):
        before, rested = value, resting
        resting = set()
        for part, k in _coordinates(best, channels, noise=noise, shapes=shapes):
            if (part, k) in rested:
                continue
            last = value
            if part == "shape":
                best, value = _reshape(objective, best, value, k, settings)
            else:
                best, value = _climb(objective, best, value, part, k)
            if value < last + _DONE:
                resting.add((part, k))
        if value < before + _SWEPT:
            break
    return best, value


def _coordinates(sizes: Sizes, channels: Sequence[int], *, noise: bool, shapes: bool) -> list[tuple[str, int]]:
    """What a sweep moves, in its order: each channel's noise and its shape, then each size of the discrepancy."""
    found: list[tuple[str, int]] = []
    if noise:
        found += [(part, c) for c in channels for part in (("white", "shape") if shapes else ("white",))]
    if sizes.discrepancy:
        found += [(part, e) for part in ("terms", "forces") for e in range(len(sizes.terms))]
        found += [("coupling", k) for k in range(len(sizes.coupling))]
    return found


def _with_shape(sizes: Sizes, c: int, shape: int, log_white: float) -> Sizes:
    white = sizes.white.copy()
    white[c] = log_white
    return replace(sizes, white=white, shape=(*sizes.shape[:c], shape, *sizes.shape[c + 1 :]))


def _climb(objective: Callable[[Sizes], float], best: Sizes, value: float, part: str, k: int) -> tuple[Sizes, float]:
    """A Newton step along one coordinate, from differences, and parts of it; correlations move in Fisher's z."""
    here = float(getattr(best, part)[k])
    here = math.atanh(here) if part == "coupling" else here
    h, reach = _STEPS[part]

    def at(x: float) -> Sizes:
        values = getattr(best, part).copy()
        values[k] = math.tanh(x) if part == "coupling" else x
        return replace(best, **{part: values})

    left, right = at(here - h), at(here + h)
    a, b = objective(left), objective(right)
    top, top_value = max(((best, value), (left, a), (right, b)), key=lambda entry: entry[1])
    curvature = a + b - 2.0 * value
    move = 0.5 * h * (a - b) / curvature if curvature < 0.0 else math.copysign(reach, b - a)
    move = min(max(move, -reach), reach)
    for shorter in (1.0, 0.4):
        there = at(here + shorter * move)
        found = objective(there)
        if found > top_value:
            return there, found
    return top, top_value


def _reshape(
    objective: Callable[[Sizes], float], best: Sizes, value: float, c: int, settings: Settings
) -> tuple[Sizes, float]:
    """The first neighbouring shape of one channel's noise that is better, at the same white or the same total size."""
    shapes = noise_shapes(settings)
    ratios, times, now = len(settings.noise_ratios), len(settings.noise_times), best.shape[c]
    if now == 0:
        options = [1 + r * times + t for r in (1, 3) for t in (1, 3) if r < ratios and t < times]
    else:
        r, t = divmod(now - 1, times)
        near = ((r, t + 1), (r, t - 1), (r + 1, t), (r - 1, t))
        options = [1 + i * times + j for i, j in near if 0 <= i < ratios and 0 <= j < times] + [0]
    for option in options:
        shape = (*best.shape[:c], option, *best.shape[c + 1 :])
        total = 0.5 * math.log(shapes[now].correlation(0.0) / shapes[option].correlation(0.0))
        for shift in (0.0, total):
            white = best.white.copy()
            white[c] += shift
            trial = replace(best, shape=shape, white=white)
            found = objective(trial)
            if found > value + _ROUNDING:
                return trial, found
    return best, value
