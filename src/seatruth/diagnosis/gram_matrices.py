"""Gram matrices of whitened errors and derivatives, each trial's apart: all that a likelihood needs of the samples."""

from __future__ import annotations

import copy
import math

import numpy as np
from scipy.linalg.blas import daxpy

from seatruth.arrays import Array, Flags, Indices
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.sizes import Sizes, noise_shapes
from seatruth.statistics.state_space_noise import whiten

_KEPT = 4
"""Shapes of a channel's noise whose Gram matrices are kept: where it stands, and those tried last. [S] Of an AUV with
ten channels a diagnosis with three effects took 1077 MB with those of all shapes, and 851 MB so."""
_Noises = dict[int, tuple[int, float]]
"""Channel -> shape of its noise and logarithm of its white deviation."""


class GramMatrices:
    """Gram matrices of [errors, derivatives by shared unknowns, by each trial's own], m columns.

    Args:
        problem: the trials, channels and shapes of noise.
        errors: measured minus simulated (N,).
        shared: derivatives by shared unknowns (N, S').
        own: derivatives by each trial's own unknowns (N, L).
        keep: which errors count (N,); all where None.
    """

    def __init__(self, problem: Problem, errors: Array, shared: Array, own: Array, keep: Flags | None) -> None:
        self._shapes = noise_shapes(problem.settings)
        self._blocks: dict[tuple[int, int], tuple[Array, Array]] = {}
        self._found: dict[tuple[int, int], tuple[Array, Array]] = {}
        self._white: dict[tuple[int, int], dict[int, Array]] = {}
        self._rows: dict[tuple[int, int], Indices] = {}
        self._others: tuple[GramMatrices, Array] | None = None
        self._last: _Noises = {}
        self._rest: tuple[int, _Noises, Array] | None = None
        self.size = 1 + shared.shape[1] + own.shape[1]
        """How many columns they have, m."""
        self.counts = np.zeros((len(problem.trials), len(problem.outputs)))
        """Errors that count (T, C)."""
        for one in problem.series:
            rows = one.rows if keep is None else one.rows[keep[one.rows]]
            t = one.t if keep is None else one.t[keep[one.rows]]
            block = np.empty((len(rows), self.size), order="F")  # series by series, as they are whitened
            first = 1 + shared.shape[1]
            block[:, 0], block[:, 1:first], block[:, first:] = errors[rows], shared[rows], own[rows]
            self._blocks[one.trial, one.channel] = block, t
            self._rows[one.trial, one.channel] = rows
            self.counts[one.trial, one.channel] = len(rows)

    def with_errors(self, errors: Array) -> GramMatrices:
        """The same with other errors (N,): the derivatives, which are nearly all of them, are whitened once for all."""
        found = copy.copy(self)
        found._found, found._others = {}, (self if self._others is None else self._others[0], errors)
        found._last, found._rest = {}, None
        return found

    def residuals(self, channel: int, place: Array) -> list[tuple[Array, Array]]:
        """What is left of a channel's errors in each trial, not whitened, and its times, both (n,).

        `place` (T, m) is [1, distance of every column's unknown from the point].
        """
        found = []
        for (trial, which), (block, t) in self._blocks.items():
            if which == channel:
                left = block @ place[trial]
                if self._others is not None:
                    left += self._others[1][self._rows[trial, channel]] - block[:, 0]
                found.append((left, t))
        return found

    def _whitened(self, channel: int, shape: int) -> dict[int, Array]:
        """The columns of one channel in each trial, whitened."""
        key = channel, shape
        if key not in self._white:
            blocks = {trial: found for (trial, which), found in self._blocks.items() if which == channel}
            self._white[key] = {trial: whiten(*found, self._shapes[shape])[0] for trial, found in blocks.items()}
        return self._white[key]

    def _of_others(self, whole: GramMatrices, errors: Array, channel: int, shape: int) -> tuple[Array, Array]:
        """As `of`, from those of the derivatives that `whole` holds, and other errors."""
        grams, logs = whole.of(channel, shape)
        grams = grams.copy()
        for trial, columns in whole._whitened(channel, shape).items():
            rows = self._rows[trial, channel]
            white, _ = whiten(errors[rows], self._blocks[trial, channel][1], self._shapes[shape])
            grams[trial, 0] = white @ columns
            grams[trial, 0, 0] = white @ white
            grams[trial, :, 0] = grams[trial, 0]
        return grams, logs

    def of(self, channel: int, shape: int) -> tuple[Array, Array]:
        """Those of one channel (T, m, m) under noise of one shape, and log-determinants of the noise (T,)."""
        key = channel, shape
        found = self._found.pop(key, None)  # the last one used stands last
        if found is None:
            for oldest in [one for one in list(self._found) if one[0] == channel][: -(_KEPT - 1)]:
                self._found.pop(oldest, None)
            whole = self._others
            found = self._anew(channel, shape) if whole is None else self._of_others(*whole, channel, shape)
        self._found[key] = found
        return found

    def _anew(self, channel: int, shape: int) -> tuple[Array, Array]:
        grams, logs = np.zeros((len(self.counts), self.size, self.size)), np.zeros(len(self.counts))
        for (trial, which), (block, t) in self._blocks.items():
            if which == channel:
                white, logs[trial] = whiten(block, t, self._shapes[shape])
                grams[trial] = white.T @ white
        return grams, logs

    def weighted(self, sizes: Sizes) -> tuple[Array, Array]:
        """Those of all channels (T, m, m) by their noise, and the noise's part of the log-likelihood (T,).

        Shapes of noise are tried channel by channel: the sum over the channels that stay is kept between calls.
        """
        noises = {c: (k, float(sizes.white[c])) for c, k in enumerate(sizes.shape) if self.counts[:, c].any()}
        base = np.zeros(len(self.counts))
        for c, (shape, white) in noises.items():
            base -= 0.5 * self.of(c, shape)[1] + self.counts[:, c] * (white + 0.5 * math.log(2.0 * math.pi))
        changing = self._changing(noises)
        if changing is None:
            return self._sum(noises), base
        c, rest = changing
        return self._sum({c: noises[c]}, rest), base

    def _changing(self, noises: _Noises) -> tuple[int, Array] | None:
        """The only channel whose noise differs from that of the last call, or calls, and the sum over the others."""
        rest = self._rest
        if rest is None or _without(noises, rest[0]) != rest[1]:
            changed = [c for c, noise in noises.items() if noise != self._last.get(c)]
            others = _without(noises, changed[0]) if len(changed) == 1 else {}
            rest = (changed[0], others, self._sum(others)) if len(changed) == 1 else None
            self._rest = rest
        self._last = noises
        return None if rest is None else (rest[0], rest[2])

    def _sum(self, noises: _Noises, beside: Array | None = None) -> Array:
        """Sum (T, m, m) over channels, by their noise, and what is beside them."""
        total = np.zeros((len(self.counts), self.size, self.size)) if beside is None else beside.copy()
        weights = [(self.of(c, shape)[0], math.exp(-2.0 * white)) for c, (shape, white) in noises.items()]
        for trial, sums in enumerate(total.reshape(len(total), -1)):
            # One trial after the other: its sum stays in the processor's cache.
            for grams, weight in weights:
                daxpy(grams[trial].reshape(-1), sums, a=weight)
        return total


def _without(noises: _Noises, channel: int) -> _Noises:
    return {c: noise for c, noise in noises.items() if c != channel}
