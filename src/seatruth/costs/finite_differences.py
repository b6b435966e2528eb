"""Accelerations out of recorded states: what the equations of motion are held against without simulating."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

Form = Literal["euler", "central", "trapezoid"]

_LONG = 3.5
"""Intervals longer than this many usual ones are gaps: a difference across one is no acceleration."""


@dataclass(frozen=True)
class Recorded:
    """Recorded states of all trials, one after another, and the accelerations that they give.

    `states` (N, S) are NaN where a state was not measured, `inputs` (N, I), `t` (N,). `targets` (N, S) belong to the
    sample that a difference starts from (its middle one for "central"), NaN where there is none. `ahead` (N, S) is the
    part that the next sample's rate has in the one to compare with: 1/2 for the trapezoid form, 0 otherwise.
    """

    states: Array
    inputs: Array
    t: Array
    targets: Array
    ahead: Array
    rows: list[slice]

    def compared(self, rates: Array) -> Array:
        """What is compared with the targets, from rates (..., N, S, k) with N at `axis` -3 or (..., N, S) at -2."""
        following = np.empty_like(rates)
        following[..., :-1, :] = rates[..., 1:, :]
        following[..., -1, :] = rates[..., -1, :]
        return np.where(self.ahead > 0, rates + self.ahead * (following - rates), rates)


def recorded(model: Model, trials: Sequence[Trial], form: Form) -> Recorded:
    """States and accelerations of the trials. A trial that recorded "u_dot" gives the acceleration of u itself."""
    states, inputs, targets, ahead, rows = [], [], [], [], []
    total = 0
    for trial in trials:
        n = len(trial)
        nothing = np.full(n, np.nan)
        x = np.stack([trial.outputs.get(channel.name, nothing) for channel in model.states], axis=1)
        part_targets, part_ahead = np.full(x.shape, np.nan), np.zeros(x.shape)
        difference, shared = differences(np.asarray(trial.t), x, form)
        for k, channel in enumerate(model.states):
            measured = trial.outputs.get(f"{channel.name}_dot")
            if measured is not None and np.isfinite(measured).any():
                part_targets[:, k] = measured
            else:
                part_targets[:, k], part_ahead[:, k] = difference[:, k], shared
        states.append(x)
        names = [channel.name for channel in model.inputs]
        inputs.append(np.stack([trial.inputs[name] for name in names], axis=1) if names else np.zeros((n, 0)))
        targets.append(part_targets)
        ahead.append(part_ahead)
        rows.append(slice(total, total + n))
        total += n
    t = np.concatenate([trial.t for trial in trials])
    return Recorded(
        np.concatenate(states), np.concatenate(inputs), t, np.concatenate(targets), np.concatenate(ahead), rows
    )


def differences(t: Array, x: Array, form: Form) -> tuple[Array, Array]:
    """Difference quotients (n, S) of x (n, S) at t (n,), and the part of the next sample's rate in each (n,).

    euler: (x[k+1] - x[k]) / h against the rate at k, first order; central: (x[k+1] - x[k-1]) / 2h against the rate at
    k, second order; trapezoid: (x[k+1] - x[k]) / h against the mean of the rates at k and k+1, second order.
    """
    found, ahead = np.full(x.shape, np.nan), np.zeros(len(t))
    if len(t) < 2:
        return found, ahead
    h = np.diff(t)
    good = h <= _LONG * np.median(h)
    step = np.where(good[:, None], np.diff(x, axis=0) / h[:, None], np.nan)
    if form == "central":
        both = good[1:] & good[:-1]
        wide = (x[2:] - x[:-2]) / (t[2:] - t[:-2])[:, None]
        found[1:-1] = np.where(both[:, None], wide, np.nan)
    else:
        found[:-1] = step
        if form == "trapezoid":
            ahead[:-1] = 0.5
    return found, ahead
