"""How much the inputs and the vehicle moved, and whether the record is fast enough for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import (
    Channels,
    at_all_times,
    degrees,
    has_channels,
    make_finding,
    own_samples,
    squared_correlation,
    unit_of,
)
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial


def beside_others(findings: Sequence[Finding], trials: Sequence[Trial]) -> list[Finding]:
    """Findings, as they are in sight of the other trials.

    An input that hardly moves in a trial, but does in another, is only noted: its unit is right. One that jumps over
    much of its small range in a trial, and over little of what it ranges over in all, moves as any servo does.
    """
    moves = {
        name
        for trial in trials
        for name, values in trial.inputs.items()
        if np.isfinite(values).any() and np.ptp(values[np.isfinite(values)]) >= limits.SMALL_ANGLE_INPUT
    }
    return [
        replace(one, severity="note", do="Expect little from this trial about what the input does.")
        if one.code == "input-small" and one.channel in moves
        else one
        for one in findings
        if one.code != "input-jumps" or _jumps_beside(one, trials)
    ]


def _jumps_beside(finding: Finding, trials: Sequence[Trial]) -> bool:
    """Whether an input jumps over much of what it ranges over in all trials."""
    values = [one.inputs[finding.channel] for one in trials if finding.channel in one.inputs]
    known = np.concatenate([one[np.isfinite(one)] for one in values])
    own = next(one.inputs[finding.channel] for one in trials if one.name == finding.trial)
    jump = np.abs(np.diff(own[np.isfinite(own)]))
    return bool((jump[jump <= np.pi] > limits.COARSE_INPUT_STEP * np.ptp(known)).any())


def check_inputs(trial: Trial, model: Channels | None = None) -> Iterator[Finding]:
    """Inputs that never move, hardly move, or move faster than they are sampled."""
    still = []
    for name, values in trial.inputs.items():
        finite = values[np.isfinite(values)]
        if finite.size < 2:
            continue
        span = float(np.ptp(finite))
        if span <= limits.STILL * max(1.0, float(np.abs(finite).max())):
            still.append(name)
            continue
        if unit_of(name, model) == "rad" and span < limits.SMALL_ANGLE_INPUT:
            yield make_finding(
                trial,
                "warning",
                "input-small",
                f"It moves by {degrees(span)} only.",
                "Expect little from this trial about what the input does; check the unit.",
                channel=name,
            )
        jump = np.abs(np.diff(finite))
        # A rudder at rest crosses its range in every sample: that is its noise and its last digit, and no command.
        crossing = np.flatnonzero(
            (jump > max(limits.COARSE_INPUT_STEP * span, limits.SMALL_ANGLE_INPUT))
            & (jump <= np.pi)  # beyond, it is told that it turns the long way
        )
        if crossing.size and unit_of(name, model) == "rad":
            yield make_finding(
                trial,
                "note",
                "input-jumps",
                f"It crosses more than {100 * limits.COARSE_INPUT_STEP:.0f} % of its range between two samples in "
                f"{crossing.size} place(s): it is a command, or sampled more slowly than the actuator moves.",
                f'If it is a command, say so: {name} = "order" in [actuators], with lag and rate_limit of its servo if '
                'they are known, and hold = "zoh" in [cost] if it steps. A measured angle stays as it is.',
                channel=name,
                samples=crossing[:1] + 1,
            )
    if still and len(still) == len(trial.inputs):
        names = ", ".join(still)
        yield make_finding(
            trial,
            "warning",
            "input-constant",
            f"No input moves ({names}): the trial shows the vehicle's own motion from its first state only.",
            "Use trials in which the inputs move as well.",
        )


def check_rate(trial: Trial) -> Iterator[Finding]:
    """Whether the vehicle turns faster than it is recorded.

    A rate that is sensor noise alone, as on a straight run, has no correlation between samples either, and nothing is
    wrong with it. So the angle must turn with the rate from sample to sample: noise of two sensors does not agree.
    """
    for angle, rate in (("psi", "r"), ("theta", "q"), ("phi", "p")):
        if rate not in trial.outputs or angle not in trial.outputs or not has_channels(trial, angle, rate):
            continue
        alone = own_samples(trial, rate)
        samples = correlation_samples(alone.outputs[rate])
        if samples is None or samples >= limits.CORRELATION_SAMPLES:
            continue
        values = at_all_times(trial, angle)[np.isin(trial.t, alone.t)]
        if not _turns(alone.t, values, alone.outputs[rate]):
            continue
        step = float(np.median(np.diff(alone.t)))
        yield make_finding(
            trial,
            "warning",
            "slow-sampling",
            f"It loses its correlation within {samples:.1f} samples of {step:.3g} s, and {angle} turns with it: the "
            "motion is faster than the record.",
            "Record faster.",
            channel=rate,
        )


def _turns(t: Array, values: Array, rate: Array) -> bool:
    """Whether an angle (n,) changes with its rate (n,) from one sample to the next, beyond chance."""
    change, expected = np.diff(values), 0.5 * (rate[1:] + rate[:-1]) * np.diff(t)
    known = np.isfinite(change) & np.isfinite(expected) & (np.abs(change) < np.pi)
    if known.sum() < limits.FEW_SAMPLES:
        return False
    change, expected = change[known] - change[known].mean(), expected[known] - expected[known].mean()
    return bool(squared_correlation(change, expected) > max(limits.SIGNIFICANT**2 / known.sum(), limits.TURNING_PART))


def correlation_samples(values: Array) -> float | None:
    """Samples after which the autocorrelation of a channel falls below 1/e; None if it is constant or too short."""
    x = values - np.nanmean(values)
    ok = np.isfinite(x)
    if ok.sum() < limits.FEW_SAMPLES or not np.nanstd(x) > 0:
        return None
    x = np.where(ok, x, 0.0)
    most = min(x.size // 2, 200)
    previous = 1.0
    for lag in range(1, most):
        both = ok[lag:] & ok[:-lag]
        if not both.any():
            return None
        power = float(np.mean(x[ok] ** 2))
        now = float(np.sum(x[lag:] * x[:-lag]) / both.sum()) / power
        if now < np.exp(-1.0):
            return float(lag - 1 + (previous - np.exp(-1.0)) / max(previous - now, 1e-12))
        previous = now
    return float(most)


def narrow_headings(trials: Sequence[Trial]) -> float | None:
    """The angle (rad) within which all headings lie, where it is so small that all trials are on one course.

    None where they are not, or where no trial has both a heading and a track.
    """
    headings = [t.channel("psi") for t in trials if has_channels(t, "x", "y", "psi")]
    if not headings:
        return None
    turned = max(float(np.nanmax(psi) - np.nanmin(psi)) for psi in headings)
    if turned >= limits.HEADING_COVERAGE:
        return None
    span = float(np.ptp(np.concatenate([psi[np.isfinite(psi)] for psi in headings])))
    return span if span < limits.HEADING_COVERAGE else None


def check_coverage(trials: Sequence[Trial]) -> Iterator[Finding]:
    """Headings and speeds over all trials together."""
    span = narrow_headings(trials)
    if span is not None:
        yield Finding(
            "note",
            "heading-coverage",
            f"All headings lie within {degrees(span)}: a steady current cannot be distinguished from "
            "a speed error or a heading offset.",
            "all trials",
            "Add a run on another course, best a full turn.",
            channel="psi",
        )
    moving = [t.channel("u")[np.isfinite(t.channel("u"))] for t in trials if has_channels(t, "u")]
    if moving:
        speeds = np.concatenate(moving)
        low, middle, high = np.quantile(speeds, [0.01, 0.5, 0.99])
        if middle > 0 and high - low < limits.SPEED_RANGE * middle:
            yield Finding(
                "note",
                "speed-range",
                f"The speed stays within {100 * (high - low) / middle:.0f} % of {middle:.3g} m/s: what depends on "
                "speed, such as linear and quadratic drag, cannot be separated.",
                "all trials",
                "Add a run with a change of speed.",
                channel="u",
            )


def excitation_table(trials: Sequence[Trial]) -> pd.DataFrame:
    """One row a trial and input: range, reversals, part of the time in motion, and 95 % of its power below f95 (Hz)."""
    rows = []
    for trial in trials:
        for name, values in trial.inputs.items():
            finite = values[np.isfinite(values)]
            span = float(np.ptp(finite)) if finite.size else 0.0
            steps = np.diff(finite)
            rows.append(
                {
                    "trial": trial.name,
                    "input": name,
                    "min": float(finite.min()) if finite.size else np.nan,
                    "max": float(finite.max()) if finite.size else np.nan,
                    "reversals": reversals(finite),
                    "moving": float(np.mean(np.abs(steps) > 1e-4 * span)) if span else 0.0,
                    "f95_Hz": _f95(trial.t, values),
                }
            )
    return pd.DataFrame(rows, columns=["trial", "input", "min", "max", "reversals", "moving", "f95_Hz"])


def reversals(values: Array) -> int:
    """How often an input turns back by more than a fifth of its range."""
    if values.size < 2 or np.ptp(values) == 0.0:
        return 0
    needed = 0.2 * float(np.ptp(values))
    count, sense = 0, 0
    low = high = float(values[0])
    for value in values[np.concatenate([[True], np.diff(values) != 0.0])].tolist():
        low, high = min(low, value), max(high, value)
        if sense >= 0 and high - value > needed:
            count += sense > 0
            sense, low, high = -1, value, value
        elif sense <= 0 and value - low > needed:
            count += sense < 0
            sense, low, high = 1, value, value
    return count


def _f95(t: Array, values: Array) -> float:
    if values.size < limits.FEW_SAMPLES or not np.isfinite(values).all() or np.ptp(values) == 0.0:
        return float("nan")
    even = np.linspace(t[0], t[-1], values.size)
    power = np.abs(np.fft.rfft(np.interp(even, t, values) - values.mean())) ** 2
    part = np.cumsum(power) / power.sum()
    return float(np.searchsorted(part, 0.95) / (t[-1] - t[0]))
