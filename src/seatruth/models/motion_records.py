"""The motion that a record shows: speeds and rates as recorded, else from positions, velocity over ground and angles.

Most logs hold no speed ahead, only a receiver's position and velocity and a compass. How fast the vehicle usually
moves, and how fast that changes, are the scales of what its model may lack, whatever a log calls them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

Series = tuple[Array, Array]
"""Times (n,), s, and values (n,)."""
BLOCKS = 48
"""Blocks of a trial of which means are taken: four between two knots of the forces of a whole trial."""
_ANGLES: Mapping[str, str] = {"p": "phi", "q": "theta", "r": "psi"}
"""Angle whose rate each rate of turn nearly is. Of a vehicle that heels little; here only a size is asked for."""


def motion(model: Model, trial: Trial, state: str, blocks: int = BLOCKS) -> Series | None:
    """Means of a motion over short blocks of a trial; None where the record does not show it.

    Args:
        model: the model, whose channels say what the record's are.
        trial: the record.
        state: name of a state, or of what a black box shows.
        blocks: how many blocks.

    Returns:
        Times (n,), s, and means (n,), in the unit and with the sign of the state. A velocity over ground is taken for
        that through the water, and the course for the heading where none is recorded.

    Example:
        >>> import numpy as np
        >>> from seatruth import Trial, load_model
        >>> t = np.linspace(0.0, 48.0, 481)
        >>> run = Trial("run", t, {}, {"x": 2.0 * t, "y": 0.0 * t, "psi": 0.01 * t})
        >>> times, u = motion(load_model("mmg"), run, "u")
        >>> bool(np.allclose(u, 2.0 * np.cos(0.01 * times), atol=0.01))
        True
    """
    recorded = trial.outputs.get(state)
    if recorded is not None and np.isfinite(recorded).any():
        return block_means(trial, np.asarray(recorded), blocks)
    name, sign = model.standard_of(state)
    shown = _shown(model, trial, blocks)
    found = _rate_of_turn(name, shown) if name in _ANGLES else _velocity(name, shown)
    return None if found is None else (found[0], sign * found[1])


def unrecorded_range(model: Model, trials: Sequence[Trial], state: str) -> float:
    """How far a state that no record shows moves, in its unit; NaN where nothing tells.

    That is its largest less its smallest value, zero among them: a trial of it begins at zero, for want of a record.

    What an actuator does moves as far as its order; a speed or a rate as what is computed from other records; a speed
    down as the depth changes.

    Example:
        >>> import numpy as np
        >>> from seatruth import Trial, load_model
        >>> t = np.linspace(0.0, 48.0, 481)
        >>> run = Trial("run", t, {}, {"psi": 0.3 * np.sin(0.2 * t)})
        >>> round(unrecorded_range(load_model("mmg"), [run], "r"), 2)
        0.12
    """
    order = next((servo.input for servo in model.servos if servo.state == state), None)
    parts = []
    for trial in trials:
        if order is not None:
            values = trial.inputs.get(order)
            found = None if values is None else np.asarray(values)
        else:
            series = motion(model, trial, state) or _sinking(model, trial, state)
            found = None if series is None else series[1]
        parts += [] if found is None else [found[np.isfinite(found)]]
    whole = np.concatenate(parts) if parts else np.zeros(0)
    return float(np.ptp(np.append(whole, 0.0))) if whole.size else math.nan


def _sinking(model: Model, trial: Trial, state: str) -> Series | None:
    """How the depth changes, of which the speed down in body axes is a part."""
    depth = _shown(model, trial, BLOCKS)("z") if model.standard_of(state)[0] == "w" else None
    return None if depth is None else (depth[0], np.gradient(depth[1], depth[0]))


def block_means(trial: Trial, values: Array, blocks: int) -> Series | None:
    """Means (n,) of a channel over blocks of equal time, and of its times; None with three blocks or fewer."""
    valid = np.isfinite(values)
    if valid.sum() < blocks:
        return None
    edges = np.linspace(trial.t[0], trial.t[-1], blocks + 1)
    block = np.clip(np.digitize(trial.t[valid], edges) - 1, 0, blocks - 1)
    counts = np.bincount(block, minlength=blocks)
    times, means = (
        np.bincount(block, part[valid], minlength=blocks) / np.maximum(counts, 1)
        for part in (np.asarray(trial.t), values)
    )
    full = counts > 0
    return (times[full], means[full]) if full.sum() > 3 else None


def _shown(model: Model, trial: Trial, blocks: int) -> Callable[[str], Series | None]:
    """The function that gives the block means of a standard channel, angles unwrapped."""
    named = {model.standard_of(c.name)[0]: c for c in model.outputs if c.name in trial.outputs}

    def shown(name: str) -> Series | None:
        channel = named.get(name)
        if channel is None:
            return None
        values = model.standard_of(channel.name)[1] * np.asarray(trial.outputs[channel.name], dtype=np.float64)
        if channel.angle:
            values = values.copy()
            valid = np.isfinite(values)
            values[valid] = np.unwrap(values[valid])
        return block_means(trial, values, blocks)

    return shown


def _rate_of_turn(name: str, shown: Callable[[str], Series | None]) -> Series | None:
    angle = shown(_ANGLES[name])
    return None if angle is None else (angle[0], np.gradient(angle[1], angle[0]))


def _velocity(name: str, shown: Callable[[str], Series | None]) -> Series | None:
    """A speed in body axes: through the water where that is recorded, else from the velocity over ground."""
    in_water = shown(f"{name}_w")
    over_ground = _over_ground(shown) if name in ("u", "v") else None
    if in_water is not None or over_ground is None:
        return in_water or (_of_diving(shown) if name == "u" else None)
    t, north, east = over_ground
    heading = shown("psi")
    if heading is None:
        return (t, np.hypot(north, east)) if name == "u" else None
    psi = np.interp(t, *heading)
    ahead, aside = north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi)
    return t, np.asarray(ahead if name == "u" else aside)


def _of_diving(shown: Callable[[str], Series | None]) -> Series | None:
    """The one speed ahead with which pitch angles explain how the depth changes best (least squares), at all times."""
    depth, pitch = shown("z"), shown("theta")
    if depth is None or pitch is None:
        return None
    t, z = depth
    down = -np.sin(np.interp(t, *pitch))
    steep = float(down @ down)
    return (t, np.full(t.shape, float(down @ np.gradient(z, t)) / steep)) if steep > 0.0 else None


def _over_ground(shown: Callable[[str], Series | None]) -> tuple[Array, Array, Array] | None:
    """Times and the velocity north and east: as a receiver gives it, by speed and course, else from positions."""
    if (found := _pair(shown, "v_n", "v_e")) is not None:
        return found
    if (found := _pair(shown, "sog", "cog")) is not None:
        t, speed, course = found
        return t, speed * np.cos(course), speed * np.sin(course)
    if (found := _pair(shown, "x", "y")) is not None:
        t, x, y = found
        return t, np.gradient(x, t), np.gradient(y, t)
    return None


def _pair(shown: Callable[[str], Series | None], one: str, other: str) -> tuple[Array, Array, Array] | None:
    """Two channels at the times of the first."""
    first, second = shown(one), shown(other)
    return None if first is None or second is None else (*first, np.interp(first[0], *second))
