"""The noise of each channel that was recorded, as a result has it."""

from __future__ import annotations

import math

from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.parts import ChannelNoise
from seatruth.diagnosis.sizes import Sizes, noise_shapes


def noise_of_channels(search: Search, sizes: Sizes) -> tuple[ChannelNoise, ...]:
    """White and slow part of each channel with samples, of these sizes, and the white part that the study declares."""
    problem, shapes, declared = search.problem, noise_shapes(search.problem.settings), search.known.declared
    rows = []
    for c, channel in enumerate(problem.study.model.outputs):
        samples = int((problem.channel_of == c).sum())
        if samples:
            white, shape = math.exp(float(sizes.white[c])), shapes[sizes.shape[c]]
            slow = white * shape.ratio
            tau = shape.tau if slow else math.nan
            rows.append(ChannelNoise(channel.name, channel.unit, white, slow, tau, declared.get(c, math.nan), samples))
    return tuple(rows)
