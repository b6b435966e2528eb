"""Stuck, held and quantised sensors, outliers and jumps."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.frozen import check_constant, moving
from seatruth.trials.check.helpers import (
    Channels,
    as_stated,
    make_finding,
    own_samples,
    resolution,
    typical_step,
    white_noise,
)
from seatruth.trials.finding import Finding
from seatruth.trials.prepare.base import WRAP_JUMP, is_angle
from seatruth.trials.prepare.outliers import hampel_outliers, typical_bend
from seatruth.trials.trial import Trial


def check_sensors(trial: Trial, model: Channels | None = None) -> Iterator[Finding]:
    """Each output by itself; a sensor with one fault is not searched for its consequences."""
    compared = None if model is None else {channel.name for channel in model.outputs}
    for name, values in trial.outputs.items():
        finite = values[np.isfinite(values)]
        if finite.size < limits.FEW_SAMPLES:
            continue
        if np.ptp(finite) == 0.0:
            yield from check_constant(trial, name)
            continue
        alone = own_samples(trial, name)  # the neighbours of a sample are those of its own clock
        coarse = list(_quantised(alone, name, alone.outputs[name], model))
        if compared is None or name in compared:  # a channel that is not compared has no noise to state
            yield from coarse
        if not coarse:  # what follows would find the steps of a coarse sensor again
            yield from _held(trial, alone, name)
            yield from _outliers(alone, name, alone.outputs[name])


def _runs_of_same(values: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Starts and lengths (in repeats) of stretches in which a value repeats exactly."""
    same = np.concatenate([[False], np.diff(values) == 0.0, [False]]).astype(np.int8)
    edges = np.diff(same)
    starts = np.flatnonzero(edges == 1)
    return starts, np.flatnonzero(edges == -1) - starts


def _held(trial: Trial, alone: Trial, name: str) -> Iterator[Finding]:
    """Stretches and samples that repeat a value, in the samples `alone` of the channel's own clock."""
    values = alone.outputs[name]
    starts, repeats = _runs_of_same(values)
    if not starts.size:
        return
    longest = int(np.argmax(repeats))
    rows = np.arange(starts[longest], starts[longest] + repeats[longest] + 1)
    begin, end = float(alone.t[rows[0]]), float(alone.t[rows[-1]])
    seconds = end - begin
    long = seconds > max(limits.STUCK_SECONDS, limits.STUCK_PART * trial.duration)
    moved = (moving(trial, name, begin, end)[0] or _falls_silent(trial, alone, name, rows)) if long else ""
    if moved:
        yield make_finding(
            alone,
            "warning",
            "stuck",
            f"It stays exactly {values[rows[0]]:.4g} for {seconds:.3g} s, while {moved}.",
            "Mark that stretch as not valid with 'mark_invalid'.",
            channel=name,
            samples=rows,
        )
        return
    held = held_samples(values)
    if held.size:
        yield make_finding(
            alone,
            "warning",
            "held",
            f"{held.size} samples repeat the one before exactly while the channel is moving, and the next sample "
            "catches up: the sensor gave nothing new there, and the repeated values are not measurements.",
            "Mark them as not valid: invalid_where with the sensor's flag, or 'mark_invalid' with held = true.",
            channel=name,
            samples=held,
        )


def _falls_silent(trial: Trial, alone: Trial, name: str, rows: NDArray[np.int64]) -> str:
    """That a sensor's noise stops in a stretch, in words; "" where it may stand still, as at rest.

    Elsewhere it hardly ever repeats a value, here it repeats one that is not zero, and other sensors go on.
    """
    values = alone.outputs[name]
    steps, outside = np.diff(values) == 0.0, np.ones(len(values) - 1, dtype=np.bool_)
    outside[rows[:-1]] = False
    few = rows.size < limits.FEW_SAMPLES or not outside.any()
    if few or values[rows[0]] == 0.0 or float(steps[outside].mean()) > limits.SELDOM_SAME:
        return ""
    if not _is_noisy(np.delete(values, rows)):
        return ""
    end = np.nextafter(alone.t[rows[-1]], np.inf)
    part = trial.section(*np.searchsorted(trial.t, [alone.t[rows[0]], end]).tolist())
    for other in (one for one in part.outputs if one != name):
        series = part.outputs[other][np.isfinite(part.outputs[other])]
        same = float((np.diff(series) == 0.0).mean()) if series.size > limits.FEW_SAMPLES else 1.0
        if same < limits.SELDOM_SAME and _is_noisy(series):
            return f"elsewhere its noise never stops, and that of {other} goes on"
    return ""


def _is_noisy(values: Array) -> bool:
    """Whether steps from sample to sample are noise, and not motion."""
    finite = values[np.isfinite(values)]
    return white_noise(np.diff(finite, n=2)) > 0.5 * float(np.median(np.abs(np.diff(finite))))


def held_samples(values: Array) -> NDArray[np.int64]:
    """Samples in fast motion that repeat the one before because the sensor held it; none if rounding explains them.

    Rounding repeats values where a channel moves slowly, less than its resolution a sample, and the step after them is
    one resolution like any other. A held value repeats at any speed, and the step after it is twice the usual.
    Rounded noise repeats values at any speed as well, but half as often as it moves them by one resolution, up or down:
    what repeats must surely do so oftener.
    """
    nothing = np.empty(0, dtype=np.int64)
    steps = np.abs(np.diff(values))
    moved = steps[steps > 0]
    reach = limits.TREND_SAMPLES
    if moved.size < limits.FEW_SAMPLES or values.size < 4 * reach:
        return nothing
    trend = np.full(values.size, np.nan)
    trend[reach:-reach] = np.abs(values[2 * reach :] - values[: -2 * reach]) / (2 * reach)
    trend = trend[1:]
    if not np.isfinite(trend).any():
        return nothing
    fast = trend > max(float(np.nanquantile(trend, 0.75)), 3.0 * float(np.quantile(moved, 0.1)))
    same = steps == 0.0
    catching_up = np.concatenate([[False], same[:-1]]) & (steps > 0) & fast
    usual = (steps > 0) & fast & ~catching_up
    held = np.flatnonzero(same & fast) + 1
    enough = catching_up.sum() >= limits.MIN_HOLDS and held.size > limits.HELD_PART * fast.sum()
    one = np.abs(steps - resolution(values)) < 0.5 * resolution(values)
    enough = enough and chance_of_repeats(held.size, int((one & fast).sum())) < limits.HELD_CHANCE
    if not enough or not usual.any():
        return nothing
    ratio = float(np.median(steps[catching_up]) / np.median(steps[usual]))
    return held if ratio > limits.HELD_CATCH_UP else nothing


def chance_of_repeats(repeats: int, others: int) -> float:
    """Bound of the probability that rounded noise repeats a value so often among the steps of 0, 1 and -1 resolution.

    The three are equally probable where the noise is wider than the resolution; where it is not, a repeat while the
    channel moves is rarer. The binomial terms fall faster than a geometric series, which bounds their sum.
    """
    total = repeats + others
    falls = others / (2.0 * (repeats + 1))
    if falls >= 1.0:
        return 1.0
    many = math.lgamma(total + 1) - math.lgamma(repeats + 1) - math.lgamma(others + 1)
    return math.exp(many + others * math.log(2.0) - total * math.log(3.0)) / (1.0 - falls)


def least_noise(values: Array) -> float:
    """Standard deviation of the rounding of a channel (n,) to its resolution: its noise is no smaller."""
    return resolution(values) / math.sqrt(12.0)


def _quantised(trial: Trial, name: str, values: Array, model: Channels | None) -> Iterator[Finding]:
    finite = values[np.isfinite(values)]
    lsb = resolution(values)
    span = float(np.quantile(finite, 0.95) - np.quantile(finite, 0.05))
    coarse = span > 0 and lsb > limits.QUANTISED_PART * span and np.unique(finite).size < 0.2 * finite.size
    # In noise wider than itself rounding is lost: a course that is held has no other range.
    if coarse and white_noise(finite[2:] - 2.0 * finite[1:-1] + finite[:-2]) > lsb:
        return
    if coarse:
        yield make_finding(
            trial,
            "note",
            "quantised",
            f"Its resolution, {as_stated(trial, name, lsb, model)}, is {100 * lsb / span:.0f} % of its range.",
            f"Give it a noise of at least {as_stated(trial, name, least_noise(values), model)} (resolution / sqrt 12).",
            channel=name,
        )
        return
    rows, step = _coarse_stretch(values, lsb)
    if rows.size:
        yield make_finding(
            trial,
            "warning",
            "quantised-part",
            f"{rows.size} of {values.size} samples come in steps of {as_stated(trial, name, step, model)}, the others "
            f"in steps of {as_stated(trial, name, lsb, model)}.",
            f"Give the channel a noise of at least {as_stated(trial, name, step / math.sqrt(12.0), model)}, or mark "
            "the stretch with 'mark_invalid'.",
            channel=name,
            samples=rows,
        )


def _coarse_stretch(values: Array, lsb: float) -> tuple[NDArray[np.int64], float]:
    """Samples between plateaus that are whole coarse steps apart, though the channel resolves finer elsewhere."""
    if lsb <= 0:
        return np.empty(0, dtype=np.int64), 0.0
    edges = np.flatnonzero((np.diff(values) != 0.0) & np.isfinite(np.diff(values)))
    sizes = np.abs(np.diff(values))[edges]
    # A coarse step has a plateau of at least two equal samples on each side.
    before = np.diff(edges, prepend=-1)
    after = np.diff(edges, append=values.size - 1)
    plateau = (before >= 2) & (after >= 2) & (sizes > limits.COARSER * lsb)
    if plateau.sum() < limits.COARSE_STEPS:
        return np.empty(0, dtype=np.int64), 0.0
    step = float(np.median(sizes[plateau]))
    alike = plateau & (np.abs(sizes / step - np.round(sizes / step)) < 0.15) & (sizes > 0.5 * step)
    if alike.sum() < limits.COARSE_STEPS or alike.sum() < 0.8 * plateau.sum():
        return np.empty(0, dtype=np.int64), 0.0
    marked = np.zeros(values.size, dtype=bool)
    for k in np.flatnonzero(alike):
        marked[edges[k] + 1 - before[k] : edges[k] + 1 + after[k]] = True
    if marked.sum() < limits.COARSE_PART * values.size:
        return np.empty(0, dtype=np.int64), 0.0
    return np.flatnonzero(marked), step


def _outliers(trial: Trial, name: str, values: Array) -> Iterator[Finding]:
    bend = typical_bend(values)
    if is_angle(name) and (np.abs(np.diff(values[np.isfinite(values)])) > WRAP_JUMP).any():
        return  # wrapped angles are a finding of their own
    bad, _ = hampel_outliers(values, 11, limits.OUTLIER_SIGMAS, limits.OUTLIER_STEPS * bend, t=trial.t)
    # An outlier comes back: the sample before and the sample after it agree better with each other than with it.
    rows = np.array([k for k in np.flatnonzero(bad) if _comes_back(values, int(k))], dtype=np.int64)
    if rows.size:
        yield make_finding(
            trial,
            "warning",
            "outliers",
            f"{rows.size} sample(s) stand far from their neighbours (first at t = {trial.t[rows[0]]:.4g} s).",
            "Remove them with 'hampel' or 'mark_invalid'.",
            channel=name,
            samples=rows,
        )
    if name in ("x", "y", "z", "depth"):
        yield from _jumps(trial, name, values, rows)


def _comes_back(values: Array, k: int) -> bool:
    around = [j for j in (k - 2, k - 1, k + 1, k + 2) if 0 <= j < values.size and np.isfinite(values[j])]
    left, right = [j for j in around if j < k], [j for j in around if j > k]
    if not left or not right:
        return False
    a, b = values[left[0]], values[right[-1]]
    return bool(abs(values[k] - 0.5 * (a + b)) > 3.0 * abs(a - b))


def _jumps(trial: Trial, name: str, values: Array, outliers: NDArray[np.int64]) -> Iterator[Finding]:
    steps = np.diff(values) / np.diff(trial.t)
    if not np.isfinite(steps).any():
        return
    typical = typical_step(steps)
    bad, median = hampel_outliers(steps, 21, limits.JUMP_SIGMAS, limits.JUMP_STEPS * typical)
    # A vehicle that gathers way from one sample to the next does not jump.
    large = np.abs(steps - median) > limits.JUMP_PART * float(np.nanmedian(np.abs(steps)))
    rows = np.setdiff1d(np.flatnonzero(bad & large) + 1, np.concatenate([outliers, outliers + 1]))
    if not rows.size:
        return
    sizes = np.abs(steps - median)[rows - 1] * np.diff(trial.t)[rows - 1]
    k = int(np.argmax(sizes))
    yield make_finding(
        trial,
        "warning",
        "jumps",
        f"{rows.size} jump(s) against its neighbours, the largest {sizes[k]:.3g} m at t = {trial.t[rows[k]]:.4g} s.",
        "Remove them with 'hampel' where positions come back, mark those before or after as not valid with "
        "'mark_invalid', or let positions weigh less.",
        channel=name,
        samples=rows,
    )
