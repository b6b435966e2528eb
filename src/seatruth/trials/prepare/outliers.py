"""Samples far from a line through their neighbours."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.trials.prepare.base import Options, chosen_channels, counted, preparation, refuse_wrapped, with_channels
from seatruth.trials.trial import Trial

MAD_TO_SD = 1.4826
"""Standard deviation of a normal sample over its median absolute deviation."""
_ALL_PAIRS = 21
"""Widest window of which all pairs tell the slope; of a wider one those half a window apart do. [S] Time and memory."""
_BLOCK = 2_000_000
"""Numbers that are held at once: so a long record needs little memory. [S]"""
_ROUNDING = 1e-9
"""Deviation over the range of a channel that is rounding."""
_ONE_FIX = ("x", "y")
"""Channels of one measurement: where one of them is far off, the other is not valid either."""


class Hampel(Options):
    """`window` samples (odd), `sigmas`; outputs become not valid ("nan") or the line's value, inputs always that.

    The samples of a window are those that a channel has: of a position once a second among rows at 10 Hz, eleven are
    ten seconds. `least`: deviations below it, in the channel's unit, are never outliers; by default the channel's
    typical bend from sample to sample, or its last digit, each of which would count in a quantised channel. Where x or
    y is an outlier, both become not valid.
    """

    channels: list[str] | None = None
    window: int = Field(default=11, ge=3)
    sigmas: float = Field(default=3.0, gt=0)
    replace: Literal["nan", "median"] = "nan"
    least: float | None = Field(default=None, ge=0)

    @model_validator(mode="after")
    def _odd(self) -> Hampel:
        if self.window % 2 == 0:
            raise ValueError("window must be odd")
        return self


@preparation("hampel", Hampel)
def hampel(trial: Trial, options: Hampel) -> tuple[Trial, str]:
    """Removes outliers: samples far from a line through their neighbours (Hampel filter, outputs by default)."""
    names = chosen_channels(trial, options.channels, trial.outputs)
    refuse_wrapped(trial, names, "a median")
    if options.window > len(trial):
        raise BadInput(f"window {options.window} is longer than the trial, {len(trial)} samples", do="Shorten it.")
    found = {
        name: hampel_outliers(trial.channel(name), options.window, options.sigmas, options.least, t=trial.t)
        for name in names
    }
    together = [name for name in _ONE_FIX if name in found and name in trial.outputs]
    if len(together) == len(_ONE_FIX) and options.replace == "nan":
        bad = np.logical_or.reduce([found[name][0] for name in together])
        found.update({name: (bad & np.isfinite(trial.channel(name)), found[name][1]) for name in together})
    changed: dict[str, Array] = {}
    for name, (bad, line) in found.items():
        use_line = options.replace == "median" or name in trial.inputs
        changed[name] = np.where(bad, line if use_line else np.nan, trial.channel(name))
    verb = "replaced by the median" if options.replace == "median" else "removed"
    return with_channels(trial, changed), counted(
        {n: int(bad.sum()) for n, (bad, _) in found.items()}, len(trial), verb
    )


def hampel_outliers(
    values: Array, window: int = 11, sigmas: float = 3.0, least: float | None = None, t: Array | None = None
) -> tuple[NDArray[np.bool_], Array]:
    """Which samples are outliers, and the value of a line through each sample's window there; missing ones are no part.

    A line through the median of slopes between samples (Theil 1950, Proc. Ned. Akad. Wet. 53, 386-392; Sen 1968,
    J. Am. Stat. Assoc. 63, 1379-1389) is taken off the window first: in the position of a boat under way, the motion
    between eleven fixes would hide a jump of several metres.

    Args:
        values: a channel (n,); NaN where it has no sample.
        window: samples of the channel around each, itself among them; odd.
        sigmas: distance from the line from which one is an outlier, in robust standard deviations of its window, or of
            the channel's usual one where that is wider.
        least: distance below which none is, in the channel's unit; by default `typical_bend`.
        t: times (n,), s; by default the samples are as far apart as each other.

    Example:
        >>> import numpy as np
        >>> x = 0.5 * np.arange(40.0) + 0.02 * np.sin(np.arange(40.0) ** 2)
        >>> x[[20, 21]] += 3.0
        >>> np.flatnonzero(hampel_outliers(x)[0])
        array([20, 21])
    """
    own = np.flatnonzero(np.isfinite(values))
    bad, line = np.zeros(values.size, dtype=np.bool_), np.full(values.size, np.nan)
    window = min(window, own.size - 1 + own.size % 2)
    if window < 3:
        return bad, values.copy()
    y, at = values[own], (np.arange(values.size, dtype=np.float64) if t is None else t)[own]
    floor = _ROUNDING * float(np.ptp(y))
    least = max(typical_bend(y), floor) if least is None else least
    half = window // 2
    edge = np.full(half, np.nan)
    ys, ts = (np.lib.stride_tricks.sliding_window_view(np.concatenate([edge, one, edge]), window) for one in (y, at))
    apart = range(1, window) if window <= _ALL_PAIRS else (half,)
    block = max(1, _BLOCK // sum(window - step for step in apart))
    away_from, spread = np.empty(y.size), np.empty(y.size)
    for start in range(0, y.size, block):
        rows = slice(start, start + block)
        away, there = ys[rows], ts[rows] - at[rows, None]
        slopes = np.concatenate(
            [(away[:, step:] - away[:, :-step]) / (there[:, step:] - there[:, :-step]) for step in apart], axis=1
        )
        rest = away - _middle(np.sort(slopes, axis=1))[:, None] * there
        middle = _middle(np.sort(rest, axis=1))
        spread[rows] = _middle(np.sort(np.abs(rest - middle[:, None]), axis=1))
        away_from[rows], line[own[rows]] = np.abs(y[rows] - middle), middle
    # Few samples may lie on a line by chance: none counts for less than the channel's windows usually have.
    spread = np.maximum(spread, np.median(spread))
    bad[own] = away_from > np.maximum(sigmas * MAD_TO_SD * spread, least * 1.000001)
    return bad, line


def typical_bend(values: Array) -> float:
    """By how much a channel (n,) typically departs from a line through two samples, or its last digit if that is more.

    Example:
        >>> import numpy as np
        >>> typical_bend(np.array([0.0, 1.0, 2.5, 3.0, 4.5, np.nan]))
        1.0
        >>> typical_bend(np.array([0.0, 0.0, 0.0, 0.5, 0.5, 0.5]))
        0.5
    """
    own = values[np.isfinite(values)]
    steps = np.abs(np.diff(own))
    digit = float(steps[steps > 0.0].min(initial=math.inf))
    bends = np.abs(np.diff(own, n=2))
    return max(float(np.median(bends)) if bends.size else 0.0, digit if math.isfinite(digit) else 0.0)


def _middle(rows: Array) -> Array:
    """Median of each sorted row, in which missing values stand last."""
    count = np.isfinite(rows).sum(axis=1)
    low = np.maximum((count - 1) // 2, 0)
    high = np.maximum(count // 2, 0).clip(max=rows.shape[1] - 1)
    index = np.arange(rows.shape[0])
    return np.asarray(0.5 * (rows[index, low] + rows[index, high]), dtype=np.float64)
