"""Steps that cut, fill, shift or turn the data without filtering them."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.trials.places import place
from seatruth.trials.prepare.base import (
    Options,
    bridged,
    chosen_channels,
    counted,
    gaps,
    is_angle,
    preparation,
    refuse_wrapped,
    with_channels,
)
from seatruth.trials.trial import Trial


class Cut(Options):
    """`start`, `end`: trial time in s, both ends kept; or `first`, `last`: sample numbers, the first is 0."""

    start: float | None = None
    end: float | None = None
    first: int | None = Field(default=None, ge=0)
    last: int | None = Field(default=None, ge=0)


@preparation("cut", Cut)
def cut(trial: Trial, options: Cut) -> tuple[Trial, str]:
    """Keeps the samples between two times, or between two sample numbers; time is not shifted."""
    keep = np.ones(len(trial), dtype=bool)
    number = np.arange(len(trial))
    if options.start is not None:
        keep &= trial.t >= options.start
    if options.end is not None:
        keep &= trial.t <= options.end
    if options.first is not None:
        keep &= number >= options.first
    if options.last is not None:
        keep &= number <= options.last
    if keep.sum() < 2:
        raise BadInput(
            f"it leaves {int(keep.sum())} samples of a trial from {trial.t[0]:g} to {trial.t[-1]:g} s",
            do="Choose limits inside the trial.",
        )
    rows = np.flatnonzero(keep)
    kept = trial.section(int(rows[0]), int(rows[-1]) + 1)
    return kept, f"kept {len(kept)} of {len(trial)} samples, {kept.t[0]:g} to {kept.t[-1]:g} s"


class MarkInvalid(Options):
    """`channels` (outputs) between `start` and `end` s; with `held`, only samples that repeat the one before."""

    channels: list[str]
    start: float | None = None
    end: float | None = None
    held: bool = False


@preparation("mark_invalid", MarkInvalid)
def mark_invalid(trial: Trial, options: MarkInvalid) -> tuple[Trial, str]:
    """Marks samples of outputs as not valid: in an interval of time, or where a sensor repeats its last value."""
    changed: dict[str, Array] = {}
    counts: dict[str, int] = {}
    where = np.ones(len(trial), dtype=bool)
    if options.start is not None:
        where &= trial.t >= options.start
    if options.end is not None:
        where &= trial.t <= options.end
    for name in chosen_channels(trial, options.channels, ()):
        if name in trial.inputs:
            raise BadInput(f"{name!r} is an input, which must be complete", do="Use 'cut' or 'fill_gaps' instead.")
        values = trial.outputs[name]
        bad = where.copy()
        if options.held:
            bad &= np.concatenate([[False], np.diff(values) == 0.0])
        bad &= np.isfinite(values)
        changed[name] = np.where(bad, np.nan, values)
        counts[name] = int(bad.sum())
    return with_channels(trial, changed), counted(counts, len(trial), "marked as not valid")


class FillGaps(Options):
    """`max_gap` s: longest time between the valid samples around a gap; `channels`: default all inputs."""

    max_gap: float = Field(gt=0)
    channels: list[str] | None = None
    method: Literal["linear", "hold"] = "linear"


@preparation("fill_gaps", FillGaps)
def fill_gaps(trial: Trial, options: FillGaps) -> tuple[Trial, str]:
    """Fills short gaps on a straight line, or with the last valid sample; longer gaps stay as they are."""
    changed: dict[str, Array] = {}
    counts: dict[str, int] = {}
    left = 0
    for name in chosen_channels(trial, options.channels, trial.inputs):
        if options.method == "linear":
            refuse_wrapped(trial, [name], "a straight line")
        values = trial.channel(name)
        filled = values.copy()
        line = bridged(trial.t, values)
        for first, stop in gaps(values):
            inside = first > 0 and stop < values.size
            if inside and trial.t[stop] - trial.t[first - 1] <= options.max_gap:
                filled[first:stop] = line[first:stop] if options.method == "linear" else values[first - 1]
            else:
                left += stop - first
        changed[name] = filled
        counts[name] = int(np.isfinite(filled).sum() - np.isfinite(values).sum())
    effect = counted(counts, len(trial), "filled")
    return with_channels(trial, changed), f"{effect}; {left} in longer gaps left" if left else effect


class ChangeSign(Options):
    """`channels` whose sign is changed."""

    channels: list[str]


@preparation("change_sign", ChangeSign)
def change_sign(trial: Trial, options: ChangeSign) -> tuple[Trial, str]:
    """Changes the sign of channels with the opposite sign convention."""
    names = chosen_channels(trial, options.channels, ())
    return with_channels(trial, {n: -trial.channel(n) for n in names}), f"changed the sign of {', '.join(names)}"


class Correct(Options):
    """`multiply` and `add`: numbers by channel; the new value is value * multiply + add, in units of seatruth."""

    multiply: dict[str, float] = Field(default_factory=dict)
    add: dict[str, float] = Field(default_factory=dict)


@preparation("correct", Correct)
def correct(trial: Trial, options: Correct) -> tuple[Trial, str]:
    """Corrects a known scale or offset of channels."""
    names = chosen_channels(trial, [*options.multiply, *options.add], ())
    changed = {n: trial.channel(n) * options.multiply.get(n, 1.0) + options.add.get(n, 0.0) for n in names}
    if any(not np.isfinite(x) for x in (*options.multiply.values(), *options.add.values())):
        raise BadInput("a scale or an offset is not finite", do="Give finite numbers.")
    text = [f"{n} x {options.multiply.get(n, 1.0):g} + {options.add.get(n, 0.0):g}" for n in names]
    return with_channels(trial, changed), ", ".join(text) or "nothing"


_NEARLY_A_TURN = 36.0
"""deg: what a vehicle turns by in a sample beside a jump of 360, a tenth of a turn. Chosen here [S]."""


class Unwrap(Options):
    """`channels`: default phi, theta, psi and cog; name others, as the direction of a pod."""

    channels: list[str] | None = None


@preparation("unwrap", Unwrap)
def unwrap(trial: Trial, options: Unwrap) -> tuple[Trial, str]:
    """Removes jumps of a full turn from angles. Refuses those of 360, which are of an angle in degrees."""
    present = [n for n in (*trial.inputs, *trial.outputs) if is_angle(n)]
    changed: dict[str, Array] = {}
    counts: dict[str, int] = {}
    for name in chosen_channels(trial, options.channels, present):
        values = trial.channel(name).copy()
        ok = np.isfinite(values)
        steps = np.abs(np.diff(values[ok]))
        turns = np.flatnonzero(np.abs(steps - 360.0) < _NEARLY_A_TURN)
        if turns.size:
            raise BadInput(
                f"it jumps by {steps[turns[0]]:.4g} rad: it is in degrees",
                where=f"trial {trial.name!r}, channel {name!r}, t = {trial.t[ok][turns[0] + 1]:.6g} s",
                do=f"State its unit in [channels]: unit = 'deg' for {name}.",
            )
        values[ok] = np.unwrap(values[ok])
        changed[name] = values
        counts[name] = int((np.abs(np.diff((values - trial.channel(name))[ok])) > 1.0).sum())
    jumps = [f"{count} jump(s) of {name}" for name, count in counts.items() if count]
    return with_channels(trial, changed), f"removed {', '.join(jumps)}" if jumps else "no jumps"


class FollowHeading(Options):
    """`channels`: courses over ground (rad)."""

    channels: list[str]


@preparation("follow_heading", FollowHeading)
def follow_heading(trial: Trial, options: FollowHeading) -> tuple[Trial, str]:
    """Adds whole turns to courses, to lie within half a turn of the heading; without one, removes their jumps."""
    changed: dict[str, Array] = {}
    counts: dict[str, int] = {}
    headed = "psi" in trial.outputs and bool(np.isfinite(trial.outputs["psi"]).any())
    if headed:
        refuse_wrapped(trial, ["psi"], "a course that follows it")
    for name in chosen_channels(trial, options.channels, ()):
        values = trial.channel(name).copy()
        ok = np.isfinite(values)
        if headed:
            heading = bridged(trial.t, trial.outputs["psi"])[ok]
            values[ok] -= 2.0 * np.pi * np.round((values[ok] - heading) / (2.0 * np.pi))
        else:
            values[ok] = np.unwrap(values[ok])
        changed[name] = values
        counts[name] = int((np.abs((values - trial.channel(name))[ok]) > 1.0).sum())
    return with_channels(trial, changed), counted(counts, len(trial), "turned by whole turns")


class ShiftTime(Options):
    """`seconds` by which `channels` lag behind the others; they are moved earlier by this time."""

    channels: list[str]
    seconds: float


@preparation("shift_time", ShiftTime)
def shift_time(trial: Trial, options: ShiftTime) -> tuple[Trial, str]:
    """Moves channels that a sensor or a logger delays to an earlier time; interpolates linearly between samples."""
    names = chosen_channels(trial, options.channels, ())
    refuse_wrapped(trial, names, "a straight line")
    wanted = trial.t + options.seconds
    changed: dict[str, Array] = {}
    for name in names:
        values = trial.channel(name)
        if name in trial.inputs:
            changed[name] = np.interp(wanted, trial.t, values)
        else:
            # np.interp hands a NaN on to both sides of it: a sample next to a gap is not known in between.
            changed[name] = np.interp(wanted, trial.t, values, left=np.nan, right=np.nan)
    return with_channels(trial, changed), f"moved {', '.join(names)} by {-options.seconds:g} s"


class ZeroTime(Options):
    """No options."""


@preparation("zero_time", ZeroTime)
def zero_time(trial: Trial, options: ZeroTime) -> tuple[Trial, str]:
    """Counts time from the trial's first sample."""
    if not len(trial):
        raise BadInput("it has no samples", where=place(trial, []))
    return replace(trial, t=trial.t - trial.t[0]), f"{trial.t[0]:g} s subtracted"
