"""What the checks share: findings with their place, windows, and robust figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.trials.channel import Channel
from seatruth.trials.check import limits
from seatruth.trials.finding import Finding, Severity
from seatruth.trials.places import place
from seatruth.trials.prepare.base import WRAP_JUMP, is_angle
from seatruth.trials.pressure import conversion as to_channel
from seatruth.trials.standard_channels import STANDARD_CHANNELS
from seatruth.trials.trial import Trial

_NORMAL_QUARTILE = 0.6745
"""Median size of a normal number over its standard deviation."""
_MOST_ALIKE = 0.95
"""[S] Correlation of neighbouring windows above which too few of them are left to tell it."""
KNOWN_SCALES = ((1852.0 / 3600.0, "kn"), (1.0 / 3.6, "km/h"), (0.01, "cm/s"), (0.001, "mm/s"))
"""m/s in a unit of speed, and its name."""


class Channels(Protocol):
    """The part of a model that the checks look at."""

    @property
    def inputs(self) -> Sequence[Channel]: ...
    @property
    def outputs(self) -> Sequence[Channel]: ...


def make_finding(
    trial: Trial,
    severity: Severity,
    code: str,
    message: str,
    do: str = "",
    *,
    channel: str = "",
    samples: Sequence[int] | NDArray[np.int64] = (),
) -> Finding:
    """A finding with the trial's file, the lines of the samples and the channel."""
    where = place(trial, np.asarray(samples, dtype=np.int64))
    where = f"{where}, channel {channel!r}" if channel else where
    return Finding(severity, code, message, where, do, trial.name, channel)


def has_channels(trial: Trial, *names: str) -> bool:
    """Whether the trial has all these channels, each with at least two valid samples."""
    return all(
        (name in trial.outputs or name in trial.inputs) and int(np.isfinite(trial.channel(name)).sum()) > 1
        for name in names
    )


def on_own_clock(trial: Trial, name: str) -> bool:
    """Whether an output has values at its own times alone, because the log's channels have clocks of their own."""
    return any(name in step.options.get("own_clocks", ()) for step in trial.steps)


def stated_unit(trial: Trial, name: str) -> str:
    """The unit that the study states for a channel's column; none is ''."""
    return next((str(unit) for step in trial.steps if (unit := step.options.get("stated_units", {}).get(name))), "")


def is_slower(trial: Trial, name: str) -> bool:
    """Whether an output has values at its own times alone: it has a clock of its own, or every so many samples a value.

    The second is how a logger writes a slower sensor into the table of a quicker one: blanks in between.
    """
    if on_own_clock(trial, name):
        return True
    steps = np.diff(np.flatnonzero(np.isfinite(trial.outputs[name])))
    if steps.size < limits.FEW_SAMPLES:
        return False
    usual = float(np.median(steps))
    return usual >= 2.0 and float(np.mean(np.abs(steps - usual) <= 1.0)) >= limits.REGULAR_PART


def own_samples(trial: Trial, name: str) -> Trial:
    """The samples of an output's own times as a trial of their own; the trial itself where it has a value at all."""
    return trial.samples(np.flatnonzero(np.isfinite(trial.outputs[name]))) if is_slower(trial, name) else trial


def own_step(t: Array, values: Array) -> float:
    """Usual time, s, between the samples of an output that has values (n,) at its own times alone; inf below three."""
    there = t[np.isfinite(values)]
    return float(np.median(np.diff(there))) if there.size > 2 else float("inf")


def pauses(trial: Trial) -> tuple[NDArray[np.intp], float]:
    """The samples after which a trial pauses for more than `GAP_STEPS` sampling steps, and that step in s.

    Topics that are recorded one after another and then pause together are no pauses: each has its own step.
    """
    steps = np.diff(trial.t)
    own = [own_step(trial.t, values) for name, values in trial.outputs.items() if on_own_clock(trial, name)]
    step = min([known for known in own if np.isfinite(known)], default=float(np.median(steps)))
    return np.flatnonzero(steps > limits.GAP_STEPS * step), step


def at_all_times(trial: Trial, name: str) -> Array:
    """A channel (n,) to integrate: an output at its own times alone is linear between its samples, but over no pause.

    Elsewhere it is as recorded. An angle that jumps by a turn is unwrapped first, for the line would cross the turn.
    """
    values = trial.channel(name)
    there = np.flatnonzero(np.isfinite(values))
    if name not in trial.outputs or not is_slower(trial, name) or there.size < 2:
        return values
    t, known = trial.t[there], values[there]
    if is_angle(name) and (np.abs(np.diff(known)) > WRAP_JUMP).any():
        known = np.unwrap(known)
    line = np.interp(trial.t, t, known, left=np.nan, right=np.nan)
    after = np.searchsorted(t, trial.t).clip(1, t.size - 1)
    line[t[after] - t[after - 1] > limits.GAP_STEPS * own_step(trial.t, values)] = np.nan
    line[there] = known
    return np.asarray(line, dtype=np.float64)


def filled(trial: Trial, name: str) -> Array:
    """An angle (n,) without jumps by a turn, a straight line where it is not known."""
    values = at_all_times(trial, name)
    known = np.isfinite(values)
    return np.unwrap(np.interp(trial.t, trial.t[known], np.unwrap(values[known])))


def rate_of(trial: Trial, rate: str, angle: str) -> Array:
    """A rate of turn (n,), from its angle where it is not recorded; NaN where that is not known."""
    if has_channels(trial, rate):
        return at_all_times(trial, rate)
    return np.where(np.isfinite(at_all_times(trial, angle)), np.gradient(filled(trial, angle), trial.t), np.nan)


def unit_of(name: str, model: Channels | None) -> str:
    """The unit a channel has inside seatruth, by the model or the standard channels; empty if unknown."""
    for channel in (*model.inputs, *model.outputs) if model is not None else ():
        if channel.name == name:
            return channel.unit
    return STANDARD_CHANNELS[name].unit if name in STANDARD_CHANNELS else ""


def as_stated(trial: Trial, name: str, size: float, model: Channels | None) -> str:
    """A size of a channel with its unit, as the study states it for the column; else in SI units, angles in deg."""
    inside = unit_of(name, model)
    unit = stated_unit(trial, name) or inside.replace("rad", "deg")
    try:
        conversion = to_channel(unit, Channel(name, inside))
    except BadInput:  # "ddmm", or a channel of no known unit
        return f"{size:.3g} {inside}".strip()
    return f"{size / conversion.factor:.3g} {unit}".strip()


def valid_steps(values: Array) -> Array:
    """Differences between neighbouring samples that are both valid."""
    steps = np.diff(values)
    return steps[np.isfinite(steps)]


def typical_step(values: Array) -> float:
    """Median size of the steps that are not zero; 0 if there are none."""
    steps = np.abs(valid_steps(values))
    moved = steps[steps > 0]
    return float(np.median(moved)) if moved.size else 0.0


def resolution(values: Array) -> float:
    """The smallest difference between two values (n,) that are not the same; 0 for a constant."""
    finite = np.unique(values[np.isfinite(values)])
    if finite.size < 2:
        return 0.0
    steps = np.diff(finite)
    distinct = steps[steps > 1e-9 * max(1e-30, float(np.abs(finite).max()))]
    return float(distinct.min()) if distinct.size else 0.0


def integral(t: Array, rate: Array) -> Array:
    """Trapezoidal integral (n,) from the first sample; a missing rate spoils only the windows that contain it."""
    areas = 0.5 * (rate[1:] + rate[:-1]) * np.diff(t)
    # A cumulative sum would carry a NaN on for ever: count the missing areas beside the sum of the known ones.
    return np.concatenate([[0.0], np.cumsum(np.where(np.isfinite(areas), areas, 0.0))])


@dataclass(frozen=True)
class Windows:
    """Windows of a record by their first and last samples, each with every needed sample present."""

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    seconds: Array

    def change(self, values: Array) -> Array:
        """Change of a channel over each window (m,)."""
        return np.asarray(values[self.last] - values[self.first], dtype=np.float64)


def windows(t: Array, inside: Sequence[Array], at_ends: Sequence[Array] = ()) -> Windows | None:
    """About limits.WINDOWS windows in a row, in which `inside` is valid throughout and `at_ends` at both ends.

    None if fewer than limits.MIN_WINDOWS remain.
    """
    if t.size < 2 * limits.MIN_WINDOWS:
        return None
    ends_ok = np.ones(t.size, dtype=bool)
    for values in at_ends:
        ends_ok &= np.isfinite(values)
    ends = np.flatnonzero(ends_ok)
    if ends.size < 2:
        return None
    # Rows and seconds from one possible end to the next: channels with clocks of their own share few rows.
    apart, step = float(np.median(np.diff(ends))), float(np.median(np.diff(t[ends])))
    wanted = max(5, t.size // limits.WINDOWS, round(apart))
    length = int(max(2, min(wanted, round(limits.MAX_WINDOW * apart / step)))) if step > 0 else wanted
    all_ok = np.ones(t.size, dtype=bool)
    for values in inside:
        all_ok &= np.isfinite(values)
    pause = np.concatenate([[False], np.diff(t) > limits.GAP_STEPS * step])
    broken = np.concatenate([[0], np.cumsum(~all_ok | pause)])
    usable = np.flatnonzero(ends_ok & all_ok)
    if usable.size < 2:
        return None
    edges = usable[np.unique(np.searchsorted(usable, np.arange(0, t.size, length)).clip(max=usable.size - 1))]
    first, last = edges[:-1], edges[1:]
    whole = (broken[last + 1] - broken[first + 1] == 0) & (last - first >= max(1, length // 2))
    whole &= last - first <= 2 * length
    if int(whole.sum()) < limits.MIN_WINDOWS:
        return None
    first, last = first[whole], last[whole]
    return Windows(first, last, t[last] - t[first])


def alike(left: Array) -> float:
    """Factor on a variance where what is left of one window is like that of the next, as of a gyro that wanders.

    That of a mean of a first-order series (Bartlett 1946): 1 for noise that forgets itself from window to window.
    """
    whole = float(left @ left)
    rho = min(max(float(left[:-1] @ left[1:]) / whole, 0.0), _MOST_ALIKE) if whole > 0.0 else 0.0
    return (1.0 + rho) / (1.0 - rho)


def white_noise(bends: Array) -> float:
    """Standard deviation of the white noise whose second differences (n,) are these; 0 where there are none."""
    return float(np.median(np.abs(bends))) / (_NORMAL_QUARTILE * math.sqrt(6.0)) if bends.size else 0.0


def rms(values: Array) -> float:
    """Root mean square of the valid samples."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0


def squared_correlation(a: Array, b: Array) -> float:
    """Squared correlation about zero: both are changes, and no change must go with no change."""
    largest = [float(np.abs(values).max(initial=0.0)) for values in (a, b)]
    if min(largest) == 0.0:
        return 0.0
    # Scaled first: the square of a nonsense value of 1e200 is beyond what a double holds.
    a, b = a / largest[0], b / largest[1]
    return float(a @ b) ** 2 / (float(a @ a) * float(b @ b))


def degrees(angle: float) -> str:
    """An angle in degrees, for messages."""
    return f"{np.degrees(angle):.3g} deg"
