"""Where a fit of waves begins: the frequency and the direction that a narrow band in what is left of the trials shows.

The likelihood of a frequency has a valley for every period of a trial, so that no slope leads to the right one: it is
read from the spectrum first. A wave meets a vehicle on other courses at other frequencies; along the recorded motion
its phase is known, whatever its size. What sinusoids of that phase explain of each channel, in each trial with an
amplitude of their own, is compared over frequencies and directions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.sizes import noise_shapes
from seatruth.effects import Effect
from seatruth.effects.kinematics import G
from seatruth.effects.targets import aliases_of
from seatruth.effects.waves import WaveForces
from seatruth.statistics.state_space_noise import NoiseShape, whiten

_CHANCE = 0.01
"""Probability that noise alone shows a peak in any series at any frequency. [S]"""
_PERIODS = 4.0
"""Periods in the longest trial of the slowest wave. [S] Fewer are no band."""
_STEPS = 2.0
"""Frequencies in the width of a trial's spectral line, 2 pi over its duration. [S]"""
_ALIASED = 2.0
"""Highest frequency over that of two samples in a period. [S] A wave that is sampled less often shows at other
frequencies, but on each course at another one."""
_MET = 2.0
"""Most by which the frequency at which a wave is met differs from its own. [S] Ahead at w U / g = 1."""
_COURSES = 24
"""Directions that are compared."""
_CLOSER = (0.3, 0.1)
"""Parts of these steps over which the best one is sought again, one after the other."""
_FASTEST = 6.0
"""rad/s: the fastest wave. [S] One of 1 s, a metre and a half long."""
_RIDGE = 1e-9
"""Ridge over the trace of sinusoids of one phase that a straight run makes alike: rounding."""


@dataclass(frozen=True)
class _Track:
    """One channel's residual in one trial, with where the vehicle was and headed: arrays (n,)."""

    t: Array
    left: Array
    north: Array
    east: Array
    heading: Array
    shape: NoiseShape
    white: float


def wave_starts(problem: Problem, at: Fit) -> dict[str, Array]:
    """Values (n,) from which each effect of waves is begun; none where what a fit leaves shows no narrow band."""
    found: dict[str, Array] = {}
    if problem.few_runs is not None:
        return found  # the equations of a black box, and the states along its motion, are unknown
    for effect in (one for one in problem.effects.values() if isinstance(one, WaveForces)):
        tracks = _tracks(problem, at, effect)
        grid = _frequencies(tracks)
        showing, near = _bands(tracks, grid) if grid.size > 1 else ([], grid)
        if near.size > 1:
            frequency, towards = _best(tracks, showing, near)
            values = problem.mean[problem.columns[effect.name]].copy()
            order = [q.name for q in effect.parameters]
            values[order.index("ln_frequency")], values[order.index("towards")] = math.log(frequency), towards
            found[effect.name] = values
    return found


def _tracks(problem: Problem, at: Fit, effect: Effect) -> list[_Track]:
    """What a fit leaves of each channel but positions, which hardly follow a wave."""
    aliases = aliases_of(effect, problem.study.model)
    place = {name: aliases.in_model(name) for name in ("x", "y", "psi")}
    order = [channel.name for channel in problem.model.states]
    errors, shapes = problem.errors(at.point), noise_shapes(problem.settings)
    states = problem.states(at.point)
    found = []
    for one in problem.series:
        if problem.outputs[one.channel] in (place["x"], place["y"]) or len(one.t) < 2:
            continue
        t, motion = np.asarray(problem.trials[one.trial].t), states[one.trial]
        x, y, psi = (np.interp(one.t, t, motion[:, order.index(place[name])]) for name in ("x", "y", "psi"))
        track = _Track(
            one.t, errors[one.rows], x, y, psi, shapes[at.sizes.shape[one.channel]],
            math.exp(float(at.sizes.white[one.channel])),
        )  # fmt: skip
        if all(np.isfinite(values).all() for values in (track.left, x, y, psi)):
            found.append(track)
    return found


def _frequencies(tracks: Sequence[_Track]) -> Array:
    """Frequencies (F,), rad/s, that the trials can show: from some periods in a trial on."""
    if not tracks:
        return np.zeros(0)
    longest = max(float(one.t[-1] - one.t[0]) for one in tracks)
    shortest = min(float(np.median(np.diff(one.t))) for one in tracks)
    line = 2.0 * math.pi / longest
    return np.arange(_PERIODS * line, min(_ALIASED * math.pi / shortest, _FASTEST), line / _STEPS)


def _bands(tracks: Sequence[_Track], grid: Array) -> tuple[list[_Track], Array]:
    """The series that have a peak that noise would not show, and the frequencies of waves that may be met there."""
    # What noise has of two amplitudes is a chi-square of two degrees of freedom, exp(-x / 2) beyond x.
    level = -2.0 * math.log(_CHANCE / (len(tracks) * len(grid)))
    met, showing = np.zeros(len(grid), dtype=bool), []
    for one in tracks:
        angle = grid[:, None] * one.t
        peaks = _explained(one, np.stack([np.cos(angle), np.sin(angle)], axis=1)) > level
        met |= peaks
        showing += [one] if peaks.any() else []
    if not met.any():
        return [], grid[:0]
    return showing, np.asarray(grid[(grid >= grid[met].min() / _MET) & (grid <= _MET * grid[met].max())])


def _best(tracks: Sequence[_Track], showing: Sequence[_Track], grid: Array) -> tuple[float, float]:
    """Frequency and direction of the wave that explains most of all series, near the best of those that show one.

    Of a ferry these were 3 of 32 series, and took a twelfth of the time; what was found explained as much of all.
    """
    width, step = float(grid[1] - grid[0]), 2.0 * math.pi / _COURSES
    options = [(*_peak(showing, grid, towards), towards) for towards in np.arange(_COURSES) * step - math.pi]
    _, frequency, towards = max(options)
    for part in _CLOSER:
        near = frequency + width * np.arange(-1.0, 1.0 + part, part)
        ways = towards + step * np.arange(-1.0, 1.0 + part, part)
        _, frequency, towards = max((*_peak(tracks, near, float(way)), float(way)) for way in ways)
        width, step = part * width, part * step
    return frequency, towards


def _peak(tracks: Sequence[_Track], grid: Array, towards: float) -> tuple[float, float]:
    """What the best wave of one direction explains, and its frequency."""
    total = np.zeros(len(grid))
    for one in tracks:
        along = one.north * math.cos(towards) + one.east * math.sin(towards)
        phase = grid[:, None] * one.t - (grid**2 / G)[:, None] * along
        c, s = np.cos(towards - one.heading), np.sin(towards - one.heading)
        cosine, sine = np.cos(phase), np.sin(phase)
        waves = np.stack([c * cosine, c * sine, s * cosine, s * sine], axis=1)
        total += _explained(one, waves)
    best = int(np.argmax(total))
    return float(total[best]), float(grid[best])


def _explained(one: _Track, waves: Array) -> Array:
    """Fall of the whitened squares (F,) of a series by waves (F, k, n), each with amplitudes of its own."""
    many, k, n = waves.shape
    columns, _ = whiten(waves.reshape(many * k, n).T, one.t, one.shape)
    left, _ = whiten(one.left, one.t, one.shape)
    white = columns.T.reshape(many, k, n) / one.white
    seen = white @ (left / one.white)
    gram = white @ white.transpose(0, 2, 1)
    gram[:, np.arange(k), np.arange(k)] += _RIDGE * (1.0 + np.trace(gram, axis1=1, axis2=2))[:, None]
    return np.asarray(np.einsum("fk,fk->f", seen, np.linalg.solve(gram, seen[:, :, None])[:, :, 0]))
