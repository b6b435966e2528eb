"""Where the fit of a rate limit begins, at the rates of the orders themselves, and how late it makes them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.effects.base import Effect
from seatruth.effects.targets import targets
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

_MOVING = 0.05
"""Part of the fastest rate from which an order counts as moving. [S] Below, a noisy record stands still."""
_SLOWER = 1.05
"""Slowness over that of an order, from which the limit shows on it. [S]"""
_SHARES = (1.0, 0.9, 0.5)
"""Shares of the moving orders that are slower than the rate at which a fit begins. [S]"""

_LEAST = 1e-12
"""Slowness that limits nothing."""


class RateLimit(Effect):
    """Base of rate limits, whose one magnitude is `slowness`, the time from rest to full input or to 1 rad.

    A limit faster than every order changes nothing, and one that is a little slower than most changes much: the
    likelihood is flat and then falls within a few per cent, so that typical values miss it.
    """

    def starting_points(self, model: Model, trials: Sequence[Trial] = ()) -> list[dict[str, float]]:
        """See `Effect.starting_points`; the first ones are the rates of the orders in these trials."""
        rates = [
            np.abs(np.diff(np.asarray(trial.inputs[target.input]) / target.full) / np.diff(np.asarray(trial.t)))
            for target in targets(self, model)
            for trial in trials
            if target.input in trial.inputs and len(trial) > 1
        ]
        found = np.concatenate(rates) if rates else np.zeros(0)
        found = found[np.isfinite(found)]
        moving = found[found > _MOVING * found.max(initial=0.0)]
        limits = [_SLOWER / float(rate) for rate in np.quantile(moving, _SHARES)] if moving.size else []
        top = next(q.max for q in self.parameters if q.name == "slowness")
        own = [{"slowness": limit} for limit in dict.fromkeys(limits) if limit < top]
        return [*own, *super().starting_points(model, trials)]

    def steps_late(self, model: Model, trials: Sequence[Trial], slowness: float) -> float:
        """How late what is recorded moves under it, in sampling steps; beside a servo's own limit, later still.

        Least squares of what it leaves undone by the rate of the record, over all trials and actuators. Infinite where
        no record moves.

        Args:
            model: the model, whose actuators it limits.
            trials: recorded runs.
            slowness: the effect's parameter.
        """
        undone, moved = 0.0, 0.0
        for target in targets(self, model):
            for trial in trials:
                order = np.asarray(trial.inputs.get(target.input, ()), dtype=np.float64) / target.full
                if len(order) < 2:
                    continue
                steps = np.diff(np.asarray(trial.t))
                rate = np.diff(order) / steps
                left = (order - _limited(order, steps / max(slowness, _LEAST)))[1:]
                undone += float((left * rate).sum())
                moved += float((rate**2).sum() * np.median(steps))
        return undone / moved if moved > 0.0 else math.inf


def _limited(order: Array, most: Array) -> Array:
    """What follows an order (n,) by no more than so much in each step (n - 1,)."""
    found = np.empty_like(order)
    at = found[0] = order[0]
    for k, step in enumerate(most, 1):
        at = found[k] = at + min(max(order[k] - at, -step), step)
    return found
