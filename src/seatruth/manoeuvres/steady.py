"""Steady stretches of a log: in which inputs, speed, pitch and rate of turn stay the same."""

from __future__ import annotations

import math

import numpy as np

from seatruth.arrays import Array
from seatruth.manoeuvres.in_a_model import in_a_model
from seatruth.manoeuvres.recognise import SHORTEST
from seatruth.manoeuvres.recording import PLAY, means, noise, runs, smooth, spread
from seatruth.models.base import Model
from seatruth.trials.stretches import Stretch, named
from seatruth.trials.trial import Trial

STEADY = 0.05
"""Part of the greatest speed, rate or revolutions within which a steady stretch keeps them."""


def steady(log: Trial, *, shortest: float = SHORTEST, model: Model | None = None) -> list[Stretch]:
    """Stretches of at least `shortest` s in which inputs, speed, pitch and turning rate stay the same.

    `model`: the model of the vehicle, which knows what its inputs are; without one those of usual names are looked at.
    """
    found: list[Stretch] = []
    for part in in_a_model(log, model, others=True):
        step = float(np.median(np.diff(part.t)))
        window = max(5, math.ceil(shortest / step))
        if part.t.size < window:
            continue
        still = np.ones(part.t.size, dtype=np.bool_)
        rate = None if part.angle is None else np.gradient(smooth(part.angle, window // 4), part.t)
        for values, slack in (
            (part.control, PLAY),
            (part.drive, None),
            (part.speed, None),
            (rate, None),
            *((values, _slack(name, values)) for name, values in part.others.items()),
        ):
            if values is None:
                continue
            mean = smooth(values, window // 4)
            size = STEADY * float(np.quantile(np.abs(mean), 0.95)) if slack is None else slack
            still &= spread(mean, window) <= size + 4.0 * noise(values) / math.sqrt(max(1, window // 4))
        before, after = window // 2, (window - 1) // 2
        for first, stop in runs(still):
            first, stop = max(0, first - before), min(part.t.size, stop + after)
            start, end = part.rows(first, stop)
            if found and start <= found[-1].end:
                start = float(part.t[int(np.searchsorted(part.t, found[-1].end, side="right"))])
            if end - start >= 0.999 * shortest:
                found.append(Stretch("steady", "steady", start, end, means(part, first, stop)))
    return named(found)


def _slack(name: str, values: Array) -> float:
    """How far a pitch, or an input of any unit, may move within a steady stretch."""
    return PLAY if name == "theta" else STEADY * float(np.ptp(np.quantile(values, [0.01, 0.99])))
