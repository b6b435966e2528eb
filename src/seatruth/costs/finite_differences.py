"""Accelerations from recorded states by finite differences: what a regression compares with the equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

Form = Literal["euler", "central", "trapezoid"]

_MAX_INTERVAL = 3.5
"""Intervals above this many median ones are gaps; a difference across a gap is no acceleration (chosen here [S])."""


@dataclass(frozen=True)
class Recorded:
    """Recorded states of all trials, one after another, and the accelerations that they give.

    `states` (N, S) are NaN where a state was not measured, `inputs` (N, I), `t` (N,), `trial` (N,) the value of
    `e.trial`. `targets` (N, S) belong to the sample that a difference starts from (its middle one for "central"), NaN
    where there is none. `next_weight` (N, S) is the weight of the next sample's rate in the rate to compare with: 1/2
    for the trapezoid form, 0 otherwise.
    """

    states: Array
    inputs: Array
    t: Array
    targets: Array
    next_weight: Array
    rows: list[slice]
    trial: Array

    def compared(self, rates: Array) -> Array:
        """Rates to compare with the targets, from the rates at the samples: (..., N, S) -> the same shape."""
        following = np.empty_like(rates)
        following[..., :-1, :] = rates[..., 1:, :]
        following[..., -1, :] = rates[..., -1, :]
        return np.where(self.next_weight > 0, rates + self.next_weight * (following - rates), rates)


def recorded(model: Model, trials: Sequence[Trial], form: Form) -> Recorded:
    """States and accelerations of the trials. A trial that recorded "u_dot" gives the acceleration of u itself."""
    states, inputs, targets, next_weight, rows = [], [], [], [], []
    total = 0
    for trial in trials:
        n = len(trial)
        nothing = np.full(n, np.nan)
        x = np.stack([trial.outputs.get(channel.name, nothing) for channel in model.states], axis=1)
        part_targets, part_next_weight = np.full(x.shape, np.nan), np.zeros(x.shape)
        difference, shared = differences(np.asarray(trial.t), x, form)
        for k, channel in enumerate(model.states):
            measured = trial.outputs.get(f"{channel.name}_dot")
            if measured is not None and np.isfinite(measured).any():
                part_targets[:, k] = measured
            else:
                part_targets[:, k], part_next_weight[:, k] = difference[:, k], shared
        states.append(x)
        names = [channel.name for channel in model.inputs]
        inputs.append(np.stack([trial.inputs[name] for name in names], axis=1) if names else np.zeros((n, 0)))
        targets.append(part_targets)
        next_weight.append(part_next_weight)
        rows.append(slice(total, total + n))
        total += n
    return Recorded(
        states=np.concatenate(states),
        inputs=np.concatenate(inputs),
        t=np.concatenate([trial.t for trial in trials]),
        targets=np.concatenate(targets),
        next_weight=np.concatenate(next_weight),
        rows=rows,
        trial=np.repeat([model.number_of(trial.name) for trial in trials], [len(trial) for trial in trials]),
    )


def differences(t: Array, x: Array, form: Form) -> tuple[Array, Array]:
    """Difference quotients (n, S) of x (n, S) at t (n,), and the weight of the next sample's rate in each (n,).

    euler: (x[k+1] - x[k]) / h against the rate at k, first order; central: (x[k+1] - x[k-1]) / 2h against the rate at
    k, second order; trapezoid: (x[k+1] - x[k]) / h against the mean of the rates at k and k+1, second order.
    """
    quotients, next_weight = np.full(x.shape, np.nan), np.zeros(len(t))
    if len(t) < 2:
        return quotients, next_weight
    h = np.diff(t)
    good = h <= _MAX_INTERVAL * np.median(h)
    step = np.where(good[:, None], np.diff(x, axis=0) / h[:, None], np.nan)
    if form == "central":
        both = good[1:] & good[:-1]
        wide = (x[2:] - x[:-2]) / (t[2:] - t[:-2])[:, None]
        quotients[1:-1] = np.where(both[:, None], wide, np.nan)
    else:
        quotients[:-1] = step
        if form == "trapezoid":
            next_weight[:-1] = 0.5
    return quotients, next_weight
