"""Angles against rates, and the rudder against the turn."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import (
    Channels,
    has_channels,
    integral,
    make_finding,
    rms,
    squared_correlation,
    windows,
)
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

_PAIRS = (("psi", "r"), ("theta", "q"), ("phi", "p"))
_DEGREES = 180.0 / np.pi


def check_rates(trial: Trial) -> Iterator[Finding]:
    """Sign, scale and agreement of each angle with its rate."""
    for angle, rate in _PAIRS:
        if has_channels(trial, angle, rate):
            yield from _angle_against_rate(trial, angle, rate)


def euler_rate(trial: Trial, angle: str) -> Array:
    """Rate (n,) of an Euler angle from body rates; attitudes and rates that are not recorded count as zero."""

    def get(name: str) -> Array:
        return trial.channel(name) if has_channels(trial, name) else np.zeros(len(trial))

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
    change, expected = change[quiet], expected[quiet]
    if change.size < limits.MIN_WINDOWS or min(rms(change), rms(expected)) == 0.0:
        return
    if max(rms(change), rms(expected)) < limits.ROTATION_NEEDED:
        return
    agreement = squared_correlation(change, expected)
    scale = float(np.sign(change @ expected)) * rms(change) / rms(expected)
    if agreement < limits.AGREEMENT:
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
    for factor, text, other in ((_DEGREES, angle, rate), (1.0 / _DEGREES, rate, angle)):
        if abs(size / factor - 1.0) < 4 * limits.KNOWN_SCALE:
            unit, other_unit = ("deg", "rad/s") if text == angle else ("deg/s", "rad")
            yield make_finding(
                trial,
                "error",
                "unit",
                f"Changes of {angle} are {size:.3g} times the integral of {rate}: {text} is in {unit}, or {other} in "
                f"{other_unit}.",
                f"State unit = '{unit}' for {text}; or, if {other} is in {other_unit}, '{other_unit}' for {other}.",
                channel=text,
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
                "Check the scale of the rate sensor, and whether the rate is measured about the body's axis.",
                channel=rate,
            )


def check_steering(trial: Trial, model: Channels | None = None) -> Iterator[Finding]:
    """Whether a positive rudder turns to starboard: turning acceleration against rudder at the same turning rate."""
    if not (
        has_channels(trial, "delta")
        and has_channels(trial, "u")
        and (has_channels(trial, "r") or has_channels(trial, "psi"))
    ):
        return
    for channel in model.inputs if model is not None else ():
        if channel.name == "delta" and "port" in channel.description.lower():
            return  # the model's own rudder is positive to port
    fit = steering_gain(trial)
    if fit is None:
        return
    gain, error, partial = fit
    if gain < 0 and abs(gain) > limits.SIGNIFICANT * error and abs(partial) > limits.STEERING_CORRELATION:
        yield make_finding(
            trial,
            "warning",
            "rudder-sign",
            f"A positive rudder turns the bow to port (turning acceleration {gain:.3g} rad/s2 for a radian of rudder, "
            f"standard error {error:.2g}).",
            "Positive delta turns to starboard in seatruth unless the model says otherwise: set sign = -1 for delta, "
            "or correct the sign of r and psi.",
            channel="delta",
        )


def steering_gain(trial: Trial) -> tuple[float, float, float] | None:
    """Change of turning rate for a radian of rudder, 1/s2, its standard error, and their partial correlation.

    From windows while the vehicle runs ahead: change of r over a window against the mean of delta and of r in it.
    None where there is too little to tell.
    """
    t, delta, u = trial.t, trial.channel("delta"), trial.channel("u")
    fast = float(np.nanquantile(np.abs(u), 0.9))
    ahead = u > 0.3 * fast
    if has_channels(trial, "n"):
        ahead &= trial.channel("n") > 0  # a propeller astern turns the flow at the rudder round
    step = float(np.median(np.diff(t)))
    if has_channels(trial, "r"):
        r = trial.channel("r")
    else:
        psi = trial.channel("psi")
        r = np.gradient(np.unwrap(np.where(np.isfinite(psi), psi, 0.0)), t)
        r = np.where(np.isfinite(psi), r, np.nan)
    # Turning builds up over ship lengths: windows near a tenth of the time of the rudder's own movements.
    length = _window(delta, step)
    starts = np.arange(0, t.size - 2 * length, length)
    if starts.size < limits.MIN_WINDOWS:
        return None
    mean_delta, mean_r = _means(delta, starts, length), _means(r, starts, length)
    good = _means(ahead.astype(np.float64), starts, length) > 0.99
    change = (_means(r, starts + length // 2, length) - _means(r, np.maximum(starts - length // 2, 0), length)) / (
        length * step
    )
    good &= np.isfinite(mean_delta + mean_r + change) & (starts >= length // 2)
    if good.sum() < 2 * limits.MIN_WINDOWS or np.ptp(mean_delta[good]) < limits.SMALL_ANGLE_INPUT:
        return None
    a = np.column_stack([mean_delta[good], mean_r[good], np.ones(int(good.sum()))])
    y = change[good]
    coefficients, _, rank, _ = np.linalg.lstsq(a, y, rcond=None)
    rest = y - a @ coefficients
    freedom = y.size - 3
    if rank < 3 or freedom < limits.MIN_WINDOWS:
        return None
    variance = float(rest @ rest) / freedom
    error = float(np.sqrt(variance * np.linalg.inv(a.T @ a)[0, 0]))
    gain = float(coefficients[0])
    partial = gain / np.sqrt(gain**2 + freedom * error**2) if gain or error else 0.0
    return gain, error, float(partial)


def _window(delta: Array, step: float) -> int:
    """Samples over which to average: a quarter of the median time between reversals of the rudder, 0.5 to 5 s."""
    middle = delta - np.nanmean(delta)
    crossings = int(np.sum(np.diff(np.sign(middle[np.isfinite(middle)])) != 0))
    between = delta.size * step / max(crossings, 1)
    return int(np.clip(0.1 * between, max(0.5, 2 * step), max(5.0, 2 * step)) / step) or 1


def _means(values: Array, starts: NDArray[np.int64], length: int) -> Array:
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(values))])
    broken = np.concatenate([[0], np.cumsum(~np.isfinite(values))])
    stop = np.minimum(starts + length, values.size)
    means = (total[stop] - total[starts]) / np.maximum(stop - starts, 1)
    return np.where(broken[stop] == broken[starts], means, np.nan)
