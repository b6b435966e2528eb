"""The velocity with which a trial starts, where the log has positions and heading and no speed.

A basin's tracker and many a receiver record no speed. A run that starts from rest then misses its record by the whole
way, and a search about rest does not find a ship's speed.
"""

from __future__ import annotations

import math

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

_SECONDS, _PART = 10.0, 0.1
"""Longest time from whose positions the speed is taken, and the part of the trial. [S] Over 10 s white noise of 0.5 m
at 5 Hz leaves 0.02 m/s."""
_TURN = 0.2
"""Change of heading (rad) that ends this time: along an arc of 0.2 rad the chord is 0.2 % short."""
_FEWEST = 5
"""Positions that a speed takes at least. [S]"""
_SURELY = 4.0
"""Standard errors from which a way bends. [S] A parabola's first slope is four times as noisy as a line's."""
_SPEED = "m/s"


def first_velocity(model: Model, trial: Trial) -> dict[str, float]:
    """Velocity over ground ahead and to starboard at the start of a trial, by the model's outputs that lack it.

    That of a straight line through the first positions, turned by the mean heading; where these surely bend in time, as
    from rest, that with which a parabola begins. A start, which a fit with free initial states corrects.

    Args:
        model: has outputs of position, heading and speed.
        trial: from whose first ten seconds, or tenth, they are taken; less where it turns.

    Returns:
        m/s, in the outputs' own signs. Empty where any other speed is recorded, or no position or heading.

    Example:
        >>> import numpy as np
        >>> from seatruth.models import load_model
        >>> from seatruth.trials.trial import Trial
        >>> t = np.arange(0.0, 20.0, 0.5)
        >>> shown = {"x": 0.6 * t, "y": 0.8 * t, "psi": np.full_like(t, np.arctan2(0.8, 0.6))}
        >>> run = Trial("run", t, {"delta": 0.0 * t, "n": 0.0 * t}, shown)
        >>> {name: round(value, 6) + 0.0 for name, value in first_velocity(load_model("mmg"), run).items()}
        {'u': 1.0, 'v': 0.0}
    """
    recorded = {c.name: c for c in model.outputs if np.isfinite(trial.outputs.get(c.name, np.nan)).any()}
    by_standard = {model.standard_of(channel.name)[0]: channel.name for channel in model.outputs}
    shown = {model.standard_of(name)[0] for name in recorded}
    if not {"x", "y", "psi"} <= shown or any(c.unit == _SPEED for c in recorded.values()):
        return {}
    x, y, psi = (
        model.standard_of(by_standard[name])[1] * trial.outputs[by_standard[name]] for name in ("x", "y", "psi")
    )
    seen = np.isfinite(psi)
    heading = np.interp(trial.t, trial.t[seen], np.unwrap(psi[seen]))
    turned = np.flatnonzero(np.abs(heading - heading[0]) > _TURN)
    within = trial.t <= trial.t[0] + min(_SECONDS, _PART * trial.duration)
    rows = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    early = rows[within[rows] & (rows < (turned[0] if turned.size else len(trial)))]
    early = early if early.size >= _FEWEST else rows[:_FEWEST]
    if early.size < _FEWEST or not np.ptp(trial.t[early]) > 0.0:
        return {}
    bent, (north, east) = _slopes(trial.t[early] - trial.t[early[0]], (x[early], y[early]))
    course = float(heading[early[0]] if bent else heading[early].mean())
    found = {
        "u": north * math.cos(course) + east * math.sin(course),
        "v": east * math.cos(course) - north * math.sin(course),
    }
    names = {name: by_standard[name] for name in found if name in by_standard}
    return {channel: model.standard_of(channel)[1] * found[name] for name, channel in names.items()}


def _slopes(t: Array, ways: tuple[Array, Array]) -> tuple[bool, tuple[float, float]]:
    """Whether any of these ways surely bends in time, and with which speed each begins, or goes on the whole."""
    curves = [np.polyfit(t, way, 2, cov=True) for way in ways]
    bent = any(abs(curve[0]) > _SURELY * math.sqrt(max(covariance[0, 0], 0.0)) for curve, covariance in curves)
    north, east = (curve[1] if bent else np.polyfit(t, way, 1)[0] for (curve, _), way in zip(curves, ways, strict=True))
    return bent, (float(north), float(east))
