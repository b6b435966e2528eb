"""Time axis, missing samples, and channels that a model needs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import nearest
from seatruth.readers.csv_fields import CUT_OFF
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import Channels, has_channels, is_slower, make_finding, on_own_clock, pauses
from seatruth.trials.finding import Finding
from seatruth.trials.prepare.base import gaps
from seatruth.trials.trial import Trial

_AROUND, _PART = 5, 0.25
"""Positions on either side of a pause, at least, and part of its time, that tell the speed and the turn there. [S]"""
_AHEAD = 0.8
"""Part of the way from position to position that leads on, from which a vehicle moves; noise leads nowhere. [S]"""
_HARDLY = 0.25
"""Part of the way that a vehicle comes in a pause, within which it came as far as in no time. [S]"""
_FEWEST_OWN = 3
"""Samples from which an output's usual step is known."""


def check_time(trial: Trial) -> Iterator[Finding]:
    """Increasing, regular, without pauses, long enough."""
    if len(trial) < limits.FEW_SAMPLES:
        yield make_finding(
            trial, "warning", "few-samples", f"It has only {len(trial)} samples.", "Use a longer record."
        )
    for said in (part for step in trial.steps for part in step.effect.split("; ") if CUT_OFF in part):
        yield make_finding(trial, "note", "cut-off", said, "If its end is missing, export the log again.")
    if len(trial) < 3:
        return
    steps = np.diff(trial.t)
    if not (np.isfinite(trial.t).all() and (steps > 0).all()):
        back = np.flatnonzero(~(steps > 0)) + 1
        yield make_finding(
            trial,
            "error",
            "time-order",
            f"Time does not increase at {back.size} sample(s).",
            "Sort the file by time and delete repeated samples.",
            samples=back[:1],
        )
        return
    before, step = pauses(trial)
    if before.size:
        longest = before[np.argmax(steps[before])]
        jumped = _jumped(trial, int(longest))
        yield make_finding(
            trial,
            "warning",
            "time-gap",
            f"{before.size} pause(s) without samples; the longest is {steps[longest]:.3g} s against a sampling step "
            f"of {step:.3g} s.{jumped}",
            "Take the jump out of the times after it."
            if jumped
            else "What the inputs did in a pause is not known: split_at_gaps = true in [[trials]] begins a new trial "
            "after each.",
            samples=np.array([longest, longest + 1]),
        )
    if any(on_own_clock(trial, name) for name in trial.outputs):
        return  # the times of several clocks are never even
    usual = np.delete(steps, before)
    uneven = float(np.mean(np.abs(usual - step) > limits.JITTER * step))
    if uneven > 0.01:
        yield make_finding(
            trial,
            "note",
            "time-irregular",
            f"Sampling is uneven: {100 * uneven:.0f} % of the steps differ from {step:.3g} s by more than "
            f"{100 * limits.JITTER:.0f} %.",
            "A fit takes each sample at its own time; the steps low_pass and differentiate need 'resample' first.",
        )


def _jumped(trial: Trial, last: int) -> str:
    """That a clock jumped after a sample, in words; "" where the vehicle moved on, or nobody can say.

    From its speed and rate of turn on either side of the pause a vehicle would have come so far. One that has hardly
    moved went on at the next sample: no time passed. One at rest, whose positions wander, is not asked.
    """
    if not has_channels(trial, "x", "y"):
        return ""
    x, y = (np.asarray(trial.outputs[name]) for name in ("x", "y"))
    there = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    t, track = trial.t, x + 1j * y
    near = _PART * float(t[last + 1] - t[last])
    before, after = there[there <= last], there[there > last]
    if min(before.size, after.size) < _AROUND:
        return ""
    before = before[min(before.size - _AROUND, int(np.searchsorted(t[before], t[last] - near))) :]
    after = after[: max(_AROUND, int(np.searchsorted(t[after], t[last + 1] + near)))]
    if any(abs(complex(track[side][-1] - track[side][0])) < _AHEAD * _path(track[side]) for side in (before, after)):
        return ""  # at rest, or as slow as its noise
    seconds = float(t[after[0]] - t[before[-1]])
    at_once = seconds - float(t[last + 1] - t[last]) + float(np.median(np.diff(t)))
    moved = abs(complex(track[after[0]] - track[before[-1]]))
    on, none = (min(_way(t[side], track[side], s) for side in (before, after)) for s in (seconds, at_once))
    return (
        f" Over it the vehicle moved by {moved:.2g} m, where its speed gives {on:.2g} m: its clock jumped."
        if abs(moved - none) < _HARDLY * (on - none) and on < max(float(np.ptp(x[there])), float(np.ptp(y[there])))
        else ""
    )


def _path(track: NDArray[np.complex128]) -> float:
    """Sum of the ways from position to position, m."""
    return float(np.abs(np.diff(track)).sum())


def _way(t: Array, track: NDArray[np.complex128], seconds: float) -> float:
    """How far a vehicle comes, m, that goes on for a time, s, with the speed and the turn of these positions."""
    nodes = np.linspace(0, len(t) - 1, _AROUND).round().astype(int)
    v = np.diff(track[nodes]) / np.diff(t[nodes])
    turn = float(np.angle(v[-1] * np.conj(v[0]))) / float(t[-1] - t[0])
    return float(np.median(np.abs(v))) * seconds * abs(float(np.sinc(0.5 * turn * seconds / np.pi)))


def check_missing(trial: Trial) -> Iterator[Finding]:
    """Missing samples of inputs and outputs."""
    yield from _codes(trial)
    for name, values in trial.inputs.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            yield make_finding(
                trial,
                "error",
                "input-missing",
                f"{bad.size} of {values.size} samples are missing, and a simulation needs them all.",
                "Use 'fill_gaps' for short gaps or 'cut' for long ones.",
                channel=name,
                samples=bad,
            )
    for name, values in trial.outputs.items():
        if not np.isfinite(values).any():
            yield make_finding(
                trial,
                "error",
                "output-empty",
                "No sample is valid.",
                f'Check the column. A trial that did not record it says so in its [[trials]]: without = ["{name}"].',
                channel=name,
            )
        elif not np.isfinite(values).all():
            yield from _output_missing(trial, name, values)


def _output_missing(trial: Trial, name: str, values: Array) -> Iterator[Finding]:
    found = _at_usual_steps(trial.t, values) if is_slower(trial, name) else _among_all(values)
    if found.part > limits.MISSING_PART:
        yield make_finding(
            trial,
            "warning",
            "output-missing",
            f"{100 * found.part:.0f} % of the samples are not valid.",
            "They take no part in the fit. Check that this is meant.",
            channel=name,
        )
        return
    if found.late > limits.LATE_START:
        first = int(np.flatnonzero(np.isfinite(values))[0])
        yield make_finding(
            trial,
            "warning",
            "output-late",
            f"Its first valid sample is {trial.t[first] - trial.t[0]:.4g} s after the trial's start.",
            "An initial state that it gives is that of the later moment: cut the trial's start, or set "
            'initial = "free".',
            channel=name,
            samples=np.arange(first),
        )
    if found.gap.size and found.longest > max(10, limits.LONG_MISSING_PART * found.size):
        yield make_finding(
            trial,
            "note",
            "output-gap",
            f"No valid sample from t = {trial.t[found.gap[0]]:.4g} to {trial.t[found.gap[-1]]:.4g} s.",
            "They take no part in the fit. Check that this is meant.",
            channel=name,
            samples=found.gap,
        )


class _Missing(NamedTuple):
    """Which samples of an output are missing, counted at the rate at which it is sampled."""

    size: int
    """Samples that it would have with none missing."""
    part: float
    """Part of these that is missing."""
    late: int
    """How many are missing at the start."""
    longest: int
    """How many are missing in the longest gap, ..."""
    gap: NDArray[np.int64]
    """... and the trial's rows there."""


def _among_all(values: Array) -> _Missing:
    """What is missing among the samples (n,) of a trial whose channels share one clock."""
    there = np.flatnonzero(np.isfinite(values))
    first, stop = max(gaps(values), key=lambda gap: gap[1] - gap[0])
    part = 1.0 - there.size / values.size
    return _Missing(values.size, part, int(there[0]), stop - first, np.arange(first, stop, dtype=np.int64))


def _at_usual_steps(t: Array, values: Array) -> _Missing:
    """The same for an output that has values (n,) at its own times alone: only what its usual step skips is missing."""
    there = np.flatnonzero(np.isfinite(values))
    if there.size < _FEWEST_OWN:
        return _among_all(values)
    steps = np.diff(t[there])
    usual = float(np.median(steps))
    ends = np.floor(np.array([t[there[0]] - t[0], t[-1] - t[there[-1]]]) / usual)
    lost = np.concatenate([ends[:1], np.maximum(np.round(steps / usual) - 1, 0), ends[1:]])
    k = int(np.argmax(lost))
    bounds = np.concatenate([[-1], there, [values.size]])
    size = there.size + float(lost.sum())
    gap = np.arange(bounds[k] + 1, bounds[k + 1], dtype=np.int64)
    return _Missing(int(size), 1.0 - there.size / size, int(lost[0]), int(lost[k]), gap)


def _codes(trial: Trial) -> Iterator[Finding]:
    """Numbers that a logger writes for a missing value and that reading has taken out."""
    for step in trial.steps:
        for name, codes in step.options.get("missing_codes", {}).items():
            text = " and ".join(f"{code:.10g}" for code in codes)
            yield make_finding(
                trial,
                "note",
                "missing-code",
                f"The file holds {text} where it has no value; those samples are taken as missing.",
                "They take no part in the fit. If the logger wrote them for another reason, ask what it is.",
                channel=name,
            )


def check_model_channels(trial: Trial, model: Channels) -> Iterator[Finding]:
    """Channels that the model needs and the trial has not."""
    for channel in model.inputs:
        if channel.name not in trial.inputs:
            yield make_finding(
                trial,
                "error",
                "channel-missing",
                f"The model needs the input {channel.name!r} ({channel.description or channel.unit}).",
                f"Map a column to it. {nearest(channel.name, trial.inputs)}".strip(),
                channel=channel.name,
            )
    for channel in model.outputs:
        if channel.name not in trial.outputs and channel.name not in trial.absent:
            yield make_finding(
                trial,
                "warning",
                "channel-missing",
                f"The trial did not record the model's output {channel.name!r}.",
                "It takes no part in the fit; initial states that it would give must come from elsewhere.",
                channel=channel.name,
            )
