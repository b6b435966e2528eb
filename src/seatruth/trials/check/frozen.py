"""Channels that stand still beside channels that say that they must move."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import at_all_times, degrees, has_channels, integral, make_finding
from seatruth.trials.check.rates import euler_rate
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

_ANGLES = {"psi": "r", "theta": "q", "phi": "p"}
_RATES = {rate: angle for angle, rate in _ANGLES.items()}
_STEADY = 0.02
"""Part of a rate of turn over which it ranges, up to which a turn is steady without any noise. [S] Six deviations of a
gyro's white noise of 0.05 deg/s are 0.03 of 10 deg/s."""


def check_constant(trial: Trial, name: str) -> Iterator[Finding]:
    """A channel with one value throughout: frozen if another says that it must move; nothing if others say it rests."""
    value = float(trial.outputs[name][np.isfinite(trial.outputs[name])][0])
    moved, judged = moving(trial, name, float(trial.t[0]), float(trial.t[-1]))
    if moved:
        yield make_finding(
            trial,
            "warning",
            "constant",
            f"It is {value:.4g} at every sample, while {moved}.",
            "A sensor that is off or stuck has no information: leave it out.",
            channel=name,
        )
    elif not judged:
        yield make_finding(
            trial,
            "note",
            "constant",
            f"It is {value:.4g} at every sample, and no other channel tells whether it should move.",
            "If the sensor is off or stuck, leave it out.",
            channel=name,
        )


def moving(trial: Trial, name: str, begin: float, end: float) -> tuple[str, bool]:
    """What shows that a channel must move between two times, s, in words ("" if nothing does); whether anything can."""
    part = trial.section(*np.searchsorted(trial.t, [begin, np.nextafter(end, np.inf)]).tolist())
    if name in _ANGLES:
        return _turning(part, name) if has_channels(part, _ANGLES[name]) else ("", False)
    if name in _RATES:
        return _swinging(part, name) if has_channels(part, _RATES[name]) else ("", False)
    if name in ("x", "y", "z", "depth"):
        return _travelling(part, name)
    if name in ("u", "v"):
        return _sailing(part, name)
    return "", False


def _turning(part: Trial, angle: str) -> tuple[str, bool]:
    turned = float(np.ptp(integral(part.t, euler_rate(part, angle))))
    return (f"{_ANGLES[angle]} turns it by {turned:.2g} rad" if turned > limits.ROTATION_NEEDED else ""), True


def _swinging(part: Trial, rate: str) -> tuple[str, bool]:
    angle = _RATES[rate]
    values = np.unwrap(part.channel(angle)[np.isfinite(part.channel(angle))])
    expected = float(np.nanmean(part.channel(rate))) * part.duration
    steady = np.linspace(values[0], values[0] + expected, values.size)
    off = float(np.max(np.abs(values - steady)))
    return (f"{angle} moves by {np.ptp(values):.2g} rad" if off > limits.ROTATION_NEEDED else ""), True


def _travelling(part: Trial, name: str) -> tuple[str, bool]:
    """Distance along one axis that velocities and attitude say."""
    flat = name in ("x", "y")
    if not has_channels(part, "u", "psi" if flat else "theta"):
        return _pointing(part, name) if flat and has_channels(part, "x", "y", "psi") else ("", False)
    u, across = at_all_times(part, "u"), "v" if flat else "w"
    sway = at_all_times(part, across) if has_channels(part, across) else np.zeros(len(part))
    angle = at_all_times(part, "psi" if flat else "theta")
    along = {
        "x": u * np.cos(angle) - sway * np.sin(angle),
        "y": u * np.sin(angle) + sway * np.cos(angle),
    }.get(name, sway * np.cos(angle) - u * np.sin(angle))
    gone = float(np.ptp(integral(part.t, along)))
    path = float(np.ptp(integral(part.t, np.hypot(u, sway))))
    moved = gone > max(limits.FROZEN_PATH * path, limits.FROZEN_DISTANCE)
    return (f"the velocities carry it by {gone:.3g} m" if moved else ""), True


def _pointing(part: Trial, name: str) -> tuple[str, bool]:
    """Distance along one axis that the other axis and the heading say, where no speed was recorded."""
    other, psi = at_all_times(part, "y" if name == "x" else "x"), at_all_times(part, "psi")
    along, across = (np.sin(psi), np.cos(psi)) if name == "x" else (np.cos(psi), np.sin(psi))
    known = np.isfinite(other) & np.isfinite(psi)
    steps, ratio = np.diff(other[known]), (across / along)[known][1:]
    usable = np.abs(along[known][1:]) > limits.FROZEN_ALONG  # elsewhere the other axis says little
    gone = float(np.ptp(np.cumsum(np.where(usable, steps * ratio, 0.0)))) if steps.size else 0.0
    moved = gone > max(limits.FROZEN_PATH * float(np.sum(np.abs(steps))), limits.FROZEN_DISTANCE)
    return (f"the heading and the other position carry it by {gone:.3g} m" if moved else ""), True


def _sailing(part: Trial, name: str) -> tuple[str, bool]:
    """Surge against the speed over the positions, sway against the turn."""
    if name == "v":
        if not has_channels(part, "psi"):
            return "", False
        if has_channels(part, "r"):
            rate = part.channel("r")[np.isfinite(part.channel("r"))]
            if np.ptp(rate) <= _STEADY * abs(float(rate.mean())):
                return "", True  # in a turn so steady that no noise is in it, all stand still
        turned = float(np.ptp(np.unwrap(part.channel("psi")[np.isfinite(part.channel("psi"))])))
        return (f"the heading changes by {degrees(turned)}" if turned > limits.FROZEN_TURN else ""), True
    if not has_channels(part, "x", "y"):
        return "", False
    speed = _speed(part)
    if speed.size < limits.MIN_WINDOWS:
        return "", False
    low, middle, high = np.quantile(speed, [0.1, 0.5, 0.9])
    changed = high - low > limits.FROZEN_SPEED * middle
    return (f"the speed over x and y changes from {low:.3g} to {high:.3g} m/s" if changed else ""), True


def _speed(part: Trial) -> Array:
    """Speed over windows of a fortieth of the samples."""
    place = at_all_times(part, "x") + 1j * at_all_times(part, "y")
    known = np.flatnonzero(np.isfinite(place))
    ends = known[:: max(1, known.size // limits.WINDOWS)]
    return np.asarray(np.abs(np.diff(place[ends])) / np.diff(part.t[ends]), dtype=np.float64)
