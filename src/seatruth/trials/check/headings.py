"""Headings that stand at an angle to the course made good, on every course alike, where no speed ahead is recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from seatruth.trials.check import limits
from seatruth.trials.check.ground_track import velocity_over_ground
from seatruth.trials.check.helpers import at_all_times, degrees, has_channels, integral, make_finding, windows
from seatruth.trials.check.positions import Complex, displacements
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

_STRAIGHT = 0.1
"""rad that the heading may change over a window of a straight run. [S]"""
_COURSES = 0.75
"""Length of the mean of the headings' unit vectors above which they are one course. Two a quarter turn apart: 0.71."""
_ALIKE = 0.9
"""The same of the angles between course and heading, from which these are one angle: they scatter by 25 deg. [S]"""


def check_headings(trials: Sequence[Trial]) -> Iterator[Finding]:
    """Whether the vehicle moves at one large angle to psi, whatever its course: a current turns with the course."""
    asked = [trial for trial in trials if has_channels(trial, "psi") and not has_channels(trial, "u")]
    parts = [part for trial in asked if (part := _straight(trial)) is not None]
    if not parts:
        return
    moved, heading = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    fast = np.abs(moved) > 0.5 * math.sqrt(float(np.mean(np.abs(moved) ** 2)))
    moved, heading = moved[fast], heading[fast]
    if moved.size < limits.FEW_SAMPLES or abs(heading.mean()) > _COURSES:
        return
    off = _one_angle(moved * heading.conj())
    if off is None or abs(off) >= np.pi - limits.HALF_TURN:
        return
    side = "starboard" if off > 0.0 else "port"
    yield make_finding(
        asked[0],
        "warning",
        "heading-offset",
        f"On every course the vehicle moves {degrees(abs(off))} to {side} of psi.",
        f"Add {off:.3g} (rad) to the `offset` of psi, or correct its declination; a number without a unit is in rad.",
        channel="psi",
    )


def heading_offset(trials: Sequence[Trial]) -> float | None:
    """Angle (rad) from psi to where vehicles move, the same all the time: by their speeds, or on straight runs.

    What it is the offset of, psi, a log or the axes of the positions, it does not say. None where no angle holds for
    all trials, or it is no larger than what a compass, or a drift, makes of it.
    """
    away = []
    for trial in trials:
        if has_channels(trial, "x", "y", "psi", "u"):
            known = displacements(trial)
            if known is not None:
                away.append(known[1] * known[0].conj())
        elif has_channels(trial, "psi") and (part := _straight(trial)) is not None:
            away.append(part[0] * part[1].conj())
    found = np.concatenate(away) if away else np.zeros(0, dtype=np.complex128)
    return _one_angle(found) if found.size >= limits.FEW_SAMPLES else None


def _one_angle(away: Complex) -> float | None:
    """The angle (rad) of ways made, turned back by the heading (n,), that is theirs all and large; None without one."""
    total = complex(away.sum())
    angle = float(np.angle(total))
    alike = abs(total) >= _ALIKE * float(np.abs(away).sum())
    return angle if alike and abs(angle) > limits.HEADING_APART else None


def _straight(trial: Trial) -> tuple[Complex, Complex] | None:
    """Mean velocity over ground and unit vector of the heading over windows of straight runs; None without any."""
    psi, velocity = at_all_times(trial, "psi"), velocity_over_ground(trial)
    if velocity is not None:
        w = windows(trial.t, [psi, velocity.real, velocity.imag])
    elif has_channels(trial, "x", "y"):
        w = windows(trial.t, [psi], [trial.channel("x"), trial.channel("y")])
    else:
        return None
    if w is None:
        return None
    if velocity is not None:
        moved = w.change(integral(trial.t, velocity.real)) + 1j * w.change(integral(trial.t, velocity.imag))
    else:
        moved = w.change(trial.channel("x")) + 1j * w.change(trial.channel("y"))
    first, last = np.exp(1j * psi[w.first]), np.exp(1j * psi[w.last])
    straight = np.abs(np.angle(last / first)) < _STRAIGHT
    if not straight.any():
        return None
    middle = first + last
    return np.asarray((moved / w.seconds)[straight]), np.asarray((middle / np.abs(middle))[straight])
