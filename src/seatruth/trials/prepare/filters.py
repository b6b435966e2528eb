"""Zero-phase smoothing, resampling and derivatives."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import scipy
from pydantic import Field, model_validator

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.memory import require_memory
from seatruth.trials.prepare.base import (
    Options,
    bridged,
    chosen_channels,
    gaps,
    preparation,
    refuse_wrapped,
    regular_step,
    with_channels,
)
from seatruth.trials.trial import Trial

ANTI_ALIAS = 0.4
"""Cut-off of the anti-alias filter over the new rate: four fifths of the new Nyquist frequency."""


class LowPass(Options):
    """`cutoff` Hz (half power of one pass; half amplitude of both), `order` of one pass, `channels`: default all.

    `bridge` s: gaps of outputs up to this long are bridged by a straight line for the filter and are gaps again after
    it; longer gaps are refused.
    """

    cutoff: float = Field(gt=0)
    order: int = Field(default=4, ge=1, le=10)
    channels: list[str] | None = None
    bridge: float = Field(default=0.0, ge=0)


@preparation("low_pass", LowPass)
def low_pass(trial: Trial, options: LowPass) -> tuple[Trial, str]:
    """Smooths inputs and outputs alike with one zero-phase Butterworth filter (run forward and back)."""
    names = chosen_channels(trial, options.channels, (*trial.inputs, *trial.outputs))
    step = regular_step(trial, "a filter")
    if options.cutoff >= 0.5 / step:
        raise BadInput(
            f"cutoff {options.cutoff:g} Hz is not below half the sampling rate, {0.5 / step:g} Hz",
            do="Choose a lower cutoff.",
        )
    refuse_wrapped(trial, names, "a filter")
    changed = {}
    for name in names:
        values = trial.channel(name)
        _refuse_gaps(trial, name, values, options.bridge)
        changed[name] = _zero_phase(trial.t, values, options.cutoff, options.order, step)
    before = {n: float(np.nanstd(trial.channel(n) - changed[n])) for n in names}
    removed = ", ".join(f"{n} {sd:.3g}" for n, sd in before.items())
    return with_channels(trial, changed), f"rms taken away: {removed}"


def _refuse_gaps(trial: Trial, name: str, values: Array, bridge: float) -> None:
    if not np.isfinite(values).any():
        raise BadInput(f"{name!r} has no valid sample", do=f"Leave {name!r} out of the step's channels.")
    for first, stop in gaps(values):
        long = trial.t[min(stop, values.size - 1)] - trial.t[max(first - 1, 0)]
        if long > bridge:
            raise BadInput(
                f"{name!r} has no valid sample from {trial.t[first]:g} to {trial.t[stop - 1]:g} s, "
                f"and gaps are bridged up to {bridge:g} s",
                do="Raise 'bridge' to carry the filter over gaps (they stay gaps), or cut the trial.",
            )


def _zero_phase(t: Array, values: Array, cutoff: float, order: int, step: float) -> Array:
    sections = scipy.signal.butter(order, cutoff, fs=1.0 / step, output="sos")
    # Long enough for the filter to settle on the reflected data before the trial begins.
    pad = min(int(np.ceil(3.0 / (cutoff * step))) * order, values.size - 1)
    if not np.isfinite(values).any():
        return values
    smooth = scipy.signal.sosfiltfilt(sections, bridged(t, values), padtype="odd", padlen=pad)
    return np.where(np.isfinite(values), smooth, np.nan)


class Resample(Options):
    """`rate` Hz; `inputs`: between samples joined by lines ("foh") or held ("zoh").

    `max_gap` s: outputs are only interpolated between valid samples at most this far apart; by default 1.5 sampling
    steps, so that no sample is made up. `anti_alias`: filter before lowering the rate.
    """

    rate: float = Field(gt=0)
    inputs: Literal["foh", "zoh"] = "foh"
    max_gap: float | None = Field(default=None, gt=0)
    anti_alias: bool = True


_FINEST = 1000
"""Samples that a resampling may make of one: more say nothing, and take memory. Chosen here [S]."""


@preparation("resample", Resample)
def resample(trial: Trial, options: Resample) -> tuple[Trial, str]:
    """Resamples a trial at an even rate; before a lower rate, it filters inputs and outputs alike."""
    if len(trial) < 2:
        raise BadInput("it has fewer than two samples", do="Cut less.")
    step = float(np.median(np.diff(trial.t)))
    max_gap = 1.5 * step if options.max_gap is None else options.max_gap
    names = (*trial.inputs, *trial.outputs)
    refuse_wrapped(trial, names, "interpolation")
    for name, values in trial.inputs.items():
        if not np.isfinite(values).all():
            raise BadInput(f"input {name!r} has missing samples", do="Run the step 'fill_gaps' before it.")
    samples = np.floor(trial.duration * options.rate * (1 + 1e-12) + 1e-9) + 1
    if not 2 <= samples <= _FINEST * len(trial):
        raise BadInput(f"{options.rate:g} Hz gives {samples:g} samples of {len(trial)}", do="Choose another rate.")
    # Of every channel the values, and about three more while they are made.
    require_memory(
        32.0 * samples * (len(names) + 1), "the samples", where=f"trial {trial.name!r}", do="Lower the rate."
    )
    count = int(samples)
    source = {name: trial.channel(name) for name in names}
    filtered = options.anti_alias and options.rate * step < 0.9
    if filtered:
        try:
            regular = regular_step(trial, "the anti-alias filter")
        except BadInput as problem:
            raise BadInput(
                problem.what, do=f"First resample to {1 / step:.4g} Hz, its own rate, or set anti_alias to false."
            ) from None
        source = {n: _zero_phase(trial.t, v, ANTI_ALIAS * options.rate, 4, regular) for n, v in source.items()}
    t = trial.t[0] + np.arange(count) / options.rate
    lines = None
    if trial.lines is not None:
        lines = trial.lines[np.clip(np.searchsorted(trial.t, t + 1e-9 * step, side="right") - 1, 0, len(trial) - 1)]
    resampled = replace(
        trial,
        t=t,
        inputs={n: _between(t, trial.t, source[n], options.inputs, np.inf) for n in trial.inputs},
        outputs={n: _between(t, trial.t, source[n], "foh", max_gap) for n in trial.outputs},
        lines=lines,
    )
    effect = f"{len(trial)} samples at {1 / step:.4g} Hz to {count} at {options.rate:g} Hz"
    if filtered:
        effect += f", low-passed at {ANTI_ALIAS * options.rate:g} Hz first"
    pauses = np.diff(trial.t)
    wide = pauses > max(5.0 * step, 5.0 / options.rate)
    if wide.any() and trial.inputs:
        effect += f"; inputs carried over {int(wide.sum())} pause(s) of up to {pauses.max():.3g} s without samples"
    return resampled, effect


def _between(t: Array, known_t: Array, values: Array, how: str, max_gap: float) -> Array:
    """Values at times t; NaN where the valid samples around are farther apart than max_gap."""
    ok = np.isfinite(values)
    if not ok.any():
        return np.full(t.shape, np.nan)
    at, y = known_t[ok], values[ok]
    slack = 1e-9 * float(np.median(np.diff(known_t)))
    before = np.clip(np.searchsorted(at, t + slack, side="right") - 1, 0, at.size - 1)
    if how == "zoh":
        return np.asarray(y[before], dtype=np.float64)
    after = np.clip(np.searchsorted(at, t - slack, side="left"), 0, at.size - 1)
    values = np.interp(t, at, y)
    outside = (t < at[0] - slack) | (t > at[-1] + slack)
    return np.where((at[after] - at[before] > max_gap * (1 + 1e-9)) | outside, np.nan, values)


class Differentiate(Options):
    """`of` a channel `into` another (an output); `window` samples (odd) and `order` of the local polynomial."""

    of: str
    into: str
    window: int = Field(default=11, ge=3)
    order: int = Field(default=3, ge=1)

    @model_validator(mode="after")
    def _fits(self) -> Differentiate:
        if self.window % 2 == 0 or self.order >= self.window:
            raise ValueError("window must be odd and larger than order")
        return self


@preparation("differentiate", Differentiate)
def differentiate(trial: Trial, options: Differentiate) -> tuple[Trial, str]:
    """Computes a missing rate channel as the derivative of another (Savitzky-Golay, zero phase)."""
    if options.into in trial.inputs or options.into in trial.outputs:
        raise BadInput(f"channel {options.into!r} is there already", do="Choose another name for 'into'.")
    if not options.into.isidentifier():
        raise BadInput(f"{options.into!r} cannot name a channel", do="Use letters, digits and underscores.")
    values = trial.channel(options.of)
    refuse_wrapped(trial, [options.of], "a derivative")
    step = regular_step(trial, "a derivative")
    if options.window > len(trial):
        raise BadInput(f"window {options.window} is longer than the trial, {len(trial)} samples", do="Shorten it.")
    slope = savgol_slope(values, step, options.window, options.order)
    lost = int(np.isfinite(values).sum() - np.isfinite(slope).sum())
    effect = f"{options.into} from {options.of}, window {options.window * step:.3g} s"
    return with_channels(trial, {options.into: slope}), effect + (f"; {lost} samples lost near gaps" if lost else "")


def savgol_slope(values: Array, step: float, window: int = 11, order: int = 3) -> Array:
    """Derivative (n,) from local polynomials; NaN where a sample in the window is missing."""
    slope = scipy.signal.savgol_filter(np.nan_to_num(values), window, order, deriv=1, delta=step, mode="interp")
    missing = ~np.isfinite(values)
    near = np.convolve(missing.astype(np.int64), np.ones(window, dtype=np.int64), mode="same") > 0
    if missing[:window].any():
        near[: window // 2] = True
    if missing[-window:].any():
        near[-(window // 2) :] = True
    return np.where(near, np.nan, slope)
