"""Angles against rates."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.clocks import CommonLag, Lag, clock_lag, common_lag
from seatruth.trials.check.helpers import (
    alike,
    at_all_times,
    has_channels,
    integral,
    make_finding,
    rms,
    squared_correlation,
    stated_unit,
    windows,
)
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

_PAIRS = (("psi", "r"), ("theta", "q"), ("phi", "p"))
_DEGREES = 180.0 / np.pi
_PER_MINUTE = 1.0 / 60.0
_NEARLY = 4 * limits.KNOWN_SCALE
_TIMES = 0.3
"""Part of a thousand by which a factor may miss it. [S] No rate has another unit near it, and samples a thousand times
too far apart bring the noise of the angle into every window."""


def check_rates(trial: Trial) -> Iterator[Finding]:
    """Sign, scale and agreement of each angle with its rate."""
    for angle, rate in _PAIRS:
        if has_channels(trial, angle, rate):
            yield from _angle_against_rate(trial, angle, rate)


def check_common_lags(trials: Sequence[Trial], known: Sequence[Finding]) -> list[Finding]:
    """The known findings, and the offset of an angle against its rate that all trials have in common.

    It takes the place of what single trials say of these two clocks.
    """
    findings = list(known)
    for angle, rate in _PAIRS:
        both = [trial for trial in trials if has_channels(trial, angle, rate)]
        lag = common_lag([(trial.t, trial.channel(angle), euler_rate(trial, angle)) for trial in both])
        if lag is not None:
            names = {trial.name for trial in both}
            findings = [
                one
                for one in findings
                if one.code != "clock-offset" or one.channel not in (angle, rate) or one.trial not in names
            ]
            findings.append(_clock_of_all(angle, rate, lag))
    return findings


def euler_rate(trial: Trial, angle: str) -> Array:
    """Rate (n,) of an Euler angle from body rates; attitudes and rates that are not recorded count as zero."""

    def get(name: str) -> Array:
        return at_all_times(trial, name) if has_channels(trial, name) else np.zeros(len(trial))

    phi, theta, p, q, r = (get(name) for name in ("phi", "theta", "p", "q", "r"))
    if angle == "theta":
        rate = q * np.cos(phi) - r * np.sin(phi)
    else:
        turning = q * np.sin(phi) + r * np.cos(phi)
        # Near the vertical, yaw and roll lose their meaning.
        level = np.where(np.abs(theta) < 1.2, np.cos(theta), np.nan)
        rate = turning / level if angle == "psi" else p + np.sin(theta) * turning / level
    return np.asarray(rate, dtype=np.float64)


def _angle_against_rate(trial: Trial, angle: str, rate: str) -> Iterator[Finding]:
    values, speed = trial.channel(angle), euler_rate(trial, angle)
    w = windows(trial.t, [speed], [values])
    if w is None:
        return
    change, expected = w.change(values), w.change(integral(trial.t, speed))
    turning = np.abs(expected) > 0.3 * rms(expected)
    in_degrees = bool(turning.any()) and float(np.median(np.abs(change[turning]) / np.abs(expected[turning]))) > 20.0
    half_turn = 180.0 if in_degrees else np.pi
    quiet = np.abs(change) < half_turn  # a window with the jump of a wrapped angle has no meaning
    change, expected, seconds = change[quiet], expected[quiet], w.seconds[quiet]
    if change.size < limits.MIN_WINDOWS or min(rms(change), rms(expected)) == 0.0:
        return
    if max(rms(change), rms(expected)) < limits.ROTATION_NEEDED:
        return
    lag = clock_lag(trial.t, values, speed)
    if lag is not None:
        yield _clock(trial, angle, rate, lag)
        if lag.before > 1.0 - limits.AGREEMENT:
            return  # what follows would find the offset again
    agreement = squared_correlation(change, expected)
    scale = float(np.sign(change @ expected)) * rms(change) / rms(expected)
    if agreement < limits.AGREEMENT:
        factor, drift, _ = _with_constant(change, expected, seconds)
        if factor > 0.0 and squared_correlation(change - drift * seconds, expected) > limits.AGREEMENT:
            yield from _offset(trial, angle, rate, change, expected, seconds)
            return
        yield make_finding(
            trial,
            "warning",
            f"{angle}-{rate}-disagree",
            f"Changes of {angle} and the integral of {rate} have little in common (squared correlation "
            f"{agreement:.2f}).",
            "Check that both columns are what they are mapped to, and their clocks.",
            channel=angle,
        )
        return
    if scale < 0:
        yield make_finding(
            trial,
            "error",
            f"{angle}-{rate}-sign",
            f"{angle} falls when {rate} is positive.",
            f"Change the sign of one of them: psi is clockwise, r positive to starboard, theta and q nose up (here "
            f"{angle} and {rate}).",
            channel=angle,
        )
    size = abs(scale)
    for factor, far, units in (
        (1e-3, "long", "'ms' and not 's', or 'us' and not 'ms'"),
        (1e3, "short", "'s' and not 'ms', or 'ms' and not 'us'"),
    ):
        if abs(size / factor - 1.0) < _TIMES:
            yield make_finding(
                trial,
                "error",
                "time-unit",
                f"Changes of {angle} are {size:.3g} times the integral of {rate}: all times are a thousand times too"
                f" {far}.",
                f"State the unit of the time in [time]: {units}.",
                channel=rate,
            )
            return
    if abs(size / _PER_MINUTE - 1.0) < abs(size * _DEGREES - 1.0) and abs(size / _PER_MINUTE - 1.0) < _NEARLY:
        yield make_finding(
            trial,
            "error",
            "unit",
            f"Changes of {angle} are {size:.3g} times the integral of {rate}: {rate} is per minute.",
            f"State unit = 'deg/min' for {rate}.",
            channel=rate,
        )
        return
    by_second = stated_unit(trial, rate).endswith("/min") and abs(size * _PER_MINUTE - 1.0) < _NEARLY
    if by_second and abs(size * _PER_MINUTE - 1.0) < abs(size / _DEGREES - 1.0):
        yield make_finding(
            trial,
            "error",
            "unit",
            f"Changes of {angle} are {size:.3g} times the integral of {rate}: {rate} is per second.",
            f"State unit = 'deg/s' for {rate}.",
            channel=rate,
        )
        return
    for factor, text, other in ((_DEGREES, angle, rate), (1.0 / _DEGREES, rate, angle)):
        if abs(size / factor - 1.0) < _NEARLY:
            unit, other_unit = ("deg", "rad/s") if text == angle else ("deg/s", "rad")
            # What the study states already is no remedy: then it is the other one.
            ways = [(name, its) for name, its in ((text, unit), (other, other_unit)) if stated_unit(trial, name) != its]
            (name, its), *rest = ways or [(text, unit)]
            either = "".join(f", or {one} in {in_unit}" for one, in_unit in rest)
            or_else = "".join(f"; or, if {one} is in {in_unit}, '{in_unit}' for {one}" for one, in_unit in rest)
            yield make_finding(
                trial,
                "error",
                "unit",
                f"Changes of {angle} are {size:.3g} times the integral of {rate}: {name} is in {its}{either}.",
                f"State unit = '{its}' for {name}{or_else}.",
                channel=name,
            )
            return
    if agreement > limits.SCALE_AGREEMENT and abs(size - 1.0) > limits.SCALE_OFF:
        error = np.sqrt((1.0 - agreement) / max(change.size - 1, 1)) / np.sqrt(agreement)
        if abs(size - 1.0) > limits.SIGNIFICANT * error * size:
            yield make_finding(
                trial,
                "warning",
                f"{angle}-{rate}-scale",
                f"Changes of {angle} are {size:.3f} times the integral of {rate} (standard error {error * size:.3f}).",
                "Check the scale of the rate sensor, and whether the rate is measured about the body's axis."
                + (" Within a part of a turn the deviation of a compass shows the same." if angle == "psi" else ""),
                channel=rate,
            )
            return
    yield from _offset(trial, angle, rate, change, expected, seconds)


def _with_constant(change: Array, expected: Array, seconds: Array) -> tuple[float, float, float]:
    """Factor on the expected changes of an angle over windows (w,), a constant rate beside it, and that one's error."""
    A = np.stack([expected, seconds], axis=1)
    fitted, *_ = np.linalg.lstsq(A, change, rcond=None)
    left = change - A @ fitted
    variance = float(left @ left) / max(change.size - 2, 1) * np.linalg.pinv(A.T @ A)[1, 1] * alike(left)
    return float(fitted[0]), float(fitted[1]), math.sqrt(variance)


def _offset(trial: Trial, angle: str, rate: str, change: Array, expected: Array, seconds: Array) -> Iterator[Finding]:
    """What a rate shows too much all the time, beside a factor: both change with the windows' (w,) in another way."""
    _, drift, sd = _with_constant(change, expected, seconds)
    whole = abs(drift) * float(seconds.sum())
    if whole < limits.HEADING_OFF or abs(drift) < limits.SIGNIFICANT * sd:
        return
    degrees, error = float(np.degrees(-drift)), float(np.degrees(sd))
    yield make_finding(
        trial,
        "note" if squared_correlation(change, expected) >= limits.AGREEMENT else "warning",
        f"{angle}-{rate}-offset",
        f"{rate} shows {abs(degrees):.2g} deg/s too {'much' if degrees > 0.0 else 'little'} (standard error "
        f"{error:.1g}): its integral leaves {angle} by {np.degrees(whole):.2g} deg over {seconds.sum():.3g} s.",
        f"Take off what {rate} shows at rest: add {drift:.3g} (rad/s) to the `offset` of its channel, in [channels] if "
        "all trials show the same, else in this trial's own `channels`. Or leave it to `seatruth diagnose`, which has "
        "the bias of a rate, one for all trials, among its effects.",
        channel=rate,
    )


def _clock(trial: Trial, angle: str, rate: str, lag: Lag) -> Finding:
    late, early = (angle, rate) if lag.seconds > 0 else (rate, angle)
    return make_finding(
        trial,
        "warning",
        "clock-offset",
        f"{late} comes {abs(lag.seconds):.3g} s after {early} (standard error {lag.error:.1g} s): without that, they "
        f"disagree by {100 * lag.after:.1g} % instead of {100 * lag.before:.2g} %.",
        _shift(late, lag.seconds)
        + (", and so does a column of another run." if lag.before > 1.0 - limits.AGREEMENT else "."),
        channel=late,
    )


def _clock_of_all(angle: str, rate: str, lag: CommonLag) -> Finding:
    late, early = (angle, rate) if lag.mean > 0.0 else (rate, angle)
    each = np.sort(np.abs(lag.seconds))
    return Finding(
        "warning",
        "clock-offset",
        f"{late} comes after {early} in each of {each.size} trials, by {each[0]:.2g} to {each[-1]:.2g} s: without "
        f"that, they disagree by {100 * lag.after:.2g} % instead of {100 * lag.before:.2g} %.",
        "all trials",
        _shift(late, lag.mean) + ".",
        channel=late,
    )


def _shift(late: str, seconds: float) -> str:
    return (
        f"Correct the clock, or add the preparation step 'shift_time' with channels = [\"{late}\"] and seconds = "
        f"{abs(seconds):.2g}. A filter in one of the sensors looks the same"
    )
