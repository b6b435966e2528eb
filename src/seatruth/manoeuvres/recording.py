"""A recording as manoeuvres are sought in it: its parts between pauses, and where the rudder is held."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.manoeuvres.steering import Steering, ThrustSteering, steering_in
from seatruth.trials.check.limits import GAP_STEPS
from seatruth.trials.prepare.base import bridged
from seatruth.trials.trial import Trial
from seatruth.units import PULSES

PLAY = math.radians(2.5)
"""Within this (peak to peak) a rudder is held: play, noise and the last digit of its indicator."""
AS_ANGLE = math.radians(100.0)
"""rad: full thrust in yaw, where thrusters steer. One per cent of it counts as one degree of rudder, so that what is
known of rudders (their play, what is amidships) holds for it. Chosen here [S]: a boat underway steers by 5 to 40 %."""
SPEED_CHANGES = 0.2
"""Part of its mean by which a speed differs between the ends of a stretch that is told with both. Chosen here [S]."""
_ROUNDING = 1e-6
"""Part of the drive within which it rests: no log has as many digits."""
FEWEST = 20
"""Samples of a part of a log; fewer hold no manoeuvre."""


@dataclass(frozen=True)
class Recording:
    """One recording without a pause: control with its sense, heading or pitch, speed and drive where there are any.

    `control` is an angle in rad; of thrusters, which steer in shares of full thrust, `AS_ANGLE` times that share.
    `drive` counts from the value at which it rests, `rest`, in `drive_unit`. `ahead` and `aside` are the ways made
    along the bow and to starboard, m, where the log tells both; `others` are
    further channels that were asked for.
    """

    t: Array
    control: Array | None
    angle: Array | None
    speed: Array | None
    drive: Array | None
    by: Literal["rudder", "plane", "thrust"]
    drive_unit: str = "rev/s"
    rest: float = 0.0
    ahead: Array | None = None
    aside: Array | None = None
    others: Mapping[str, Array] = field(default_factory=dict)

    @property
    def vertical(self) -> bool:
        """Whether the plane and the pitch stand for rudder and heading."""
        return self.by == "plane"

    def level(self, control: float) -> str:
        """A size of the control as labels have it: "20" (degrees), or "20 %" of full thrust."""
        size = f"{abs(round(math.degrees(control))):g}"
        return f"{size} %" if self.by == "thrust" else size

    def control_words(self, control: float) -> str:
        """The control in words, with its sign."""
        what, unit = ("thrust difference", "%") if self.by == "thrust" else (self.by, "deg")
        return f"{what} {math.degrees(control):.1f} {unit}"

    def drive_words(self, *drives: float) -> str:
        """One value of the drive in words, or the first and the last: "9 rev/s", "from 1710 to 1500 us", "0.5"."""
        size = max(1.0, abs(self.rest), *(abs(drive) for drive in drives))
        known = [self.rest + (drive if abs(drive) > _ROUNDING * size else 0.0) for drive in drives]
        said = " to ".join(f"{value:.4g}" if self.rest else f"{value:.3g}" for value in known)
        unit = "" if self.drive_unit == "1" else f" {self.drive_unit}"
        return f"{'from ' if len(drives) > 1 else ''}{said}{unit}"

    @property
    def drive_name(self) -> str:
        """What the numbers of the drive are."""
        return {"rev/s": "revolutions", **dict.fromkeys(PULSES, "pulse")}.get(self.drive_unit, "command")

    def rows(self, first: int, stop: int) -> tuple[float, float]:
        return float(self.t[first]), float(self.t[stop - 1])


@dataclass(frozen=True)
class Hold:
    first: int
    stop: int
    level: float


def recordings(
    log: Trial,
    steering: Steering | None = None,
    drives: Mapping[str, float] = MappingProxyType({}),
    unit: str = "rev/s",
    others: Sequence[str] = (),
) -> list[Recording]:
    """The log between its pauses, with the channels that recognition rests on. Its channels tell what steers.

    `drives` are the inputs that drive the vehicle where none is called n, with those at which they rest, in `unit`.
    `others` are channels that each part keeps as well, where they are recorded.
    """
    names = {*log.inputs, *log.outputs}
    if isinstance(steering, ThrustSteering) and not set(steering.layout.full) <= names:
        steering = None  # a log of the track alone still has straight runs
    steering = steering or steering_in(log)
    by_thrust = isinstance(steering, ThrustSteering)
    log = steering.recorded(log)
    names = {*log.inputs, *log.outputs}
    vertical = not by_thrust and "delta" not in names and {"delta_s", "theta"} <= names
    control = _channel(log, "delta_s" if vertical else steering.channel)
    if by_thrust and control is not None:
        control = AS_ANGLE * control
    angle = _channel(log, "theta" if vertical else "psi", turns=True)
    if vertical and angle is not None:
        angle = -angle  # a positive plane pitches the nose down
    if angle is None and not vertical and "r" in log.outputs:
        rate = bridged(log.t, log.outputs["r"])
        angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(log.t))])
    if angle is not None and not np.isfinite(angle).all():
        angle = None
    speed = _channel(log, "u")
    x, y = (_channel(log, name) if speed is None else None for name in ("x", "y"))
    if speed is None and (x is None or y is None):
        speed = _over_ground(log)
    ahead, aside = _ways(log)
    kept = {name: values for name in others if (values := _channel(log, name, turns=name == "theta")) is not None}
    drive, rest = _channel(log, "n"), 0.0
    if drive is not None and isinstance(steering, ThrustSteering):
        unit, rest = steering.unit, steering.rest
        drive = drive - rest
    if drive is None and drives and all(name in names for name in drives):
        each = [_channel(log, name) for name in drives]
        known = [values - rest for values, rest in zip(each, drives.values()) if values is not None]
        drive = np.mean(known, axis=0) if len(known) == len(drives) else None
        rest = float(np.mean([*drives.values()]))
    steps = np.diff(log.t)
    pauses = np.flatnonzero(steps > GAP_STEPS * float(np.median(steps))) + 1
    edges = [0, *pauses.tolist(), len(log)]

    def cut(values: Array | None, first: int, stop: int) -> Array | None:
        return None if values is None else values[first:stop]

    def going(first: int, stop: int) -> Array | None:
        # Only from the positions of the part: the vehicle may have sailed on in the pause, at no known speed.
        if x is None or y is None:
            return cut(speed, first, stop)
        rates = (smooth(np.gradient(values[first:stop], log.t[first:stop]), 5) for values in (x, y))
        return np.asarray(np.hypot(*rates), dtype=np.float64)

    return [
        Recording(
            *(log.t[a:b], cut(control, a, b), cut(angle, a, b), going(a, b), cut(drive, a, b)),
            by="plane" if vertical else steering.by,
            drive_unit=unit,
            rest=rest,
            ahead=cut(ahead, a, b),
            aside=cut(aside, a, b),
            others={name: values[a:b] for name, values in kept.items()},
        )
        for a, b in itertools.pairwise(edges)
        if b - a >= FEWEST
    ]


def _over_ground(log: Trial) -> Array | None:
    """The speed over ground (n,) of a receiver."""
    north, east = _channel(log, "v_n"), _channel(log, "v_e")
    return _channel(log, "sog") if north is None or east is None else np.asarray(np.hypot(north, east))


def _ways(log: Trial) -> tuple[Array, Array] | tuple[None, None]:
    """The ways (n,) along the bow and to starboard, m, from velocities, or positions and the heading; else None."""
    speeds = _channel(log, "u"), _channel(log, "v")
    if speeds[0] is not None and speeds[1] is not None:
        ahead, aside = (0.5 * (v[1:] + v[:-1]) * np.diff(log.t) for v in (speeds[0], speeds[1]))
    else:
        psi, x, y = _channel(log, "psi", turns=True), _channel(log, "x"), _channel(log, "y")
        if speeds[0] is not None or psi is None or x is None or y is None:
            return None, None
        heading, north, east = 0.5 * (psi[1:] + psi[:-1]), np.diff(x), np.diff(y)
        ahead = north * np.cos(heading) + east * np.sin(heading)
        aside = east * np.cos(heading) - north * np.sin(heading)
    return np.concatenate([[0.0], np.cumsum(ahead)]), np.concatenate([[0.0], np.cumsum(aside)])


def _channel(log: Trial, name: str, *, turns: bool = False) -> Array | None:
    """A channel without gaps; None where it was not recorded, or hardly."""
    if name not in log.inputs and name not in log.outputs:
        return None
    values = log.channel(name)
    known = np.isfinite(values)
    if known.sum() < max(FEWEST, 0.5 * values.size):
        return None
    whole = np.array(values)
    if turns:
        whole[known] = np.unwrap(whole[known])
    return bridged(log.t, whole)


def holds(t: Array, control: Array) -> list[Hold]:
    """Where the rudder stays within its play for longer than it takes to move through twice the play.

    None where the control itself is noise beyond the play: whatever seems to be held there is so by chance.
    """
    if noise(control) > PLAY:
        return []
    calm = scipy.ndimage.median_filter(control, size=5, mode="nearest")
    fastest = float(np.abs(calm[5:] - calm[:-5]).max()) / 5
    window = min(max(5, math.ceil(2.0 * PLAY / fastest)), t.size) if fastest > 0 else 5
    before, after = window // 2, (window - 1) // 2
    found = []
    for first, stop in runs(spread(calm, window) <= PLAY):
        first, stop = max(0, first - before), min(t.size, stop + after)
        found.append(Hold(first, stop, float(np.median(calm[first:stop]))))
    return found


def merged(found: Sequence[Hold]) -> list[Hold]:
    """Holds to one side that follow one another at nearly the same rudder, as one."""
    joined: list[Hold] = []
    for hold in found:
        last = joined[-1] if joined else None
        near = last is not None and abs(hold.level - last.level) < max(2 * PLAY, 0.2 * abs(hold.level))
        if last is not None and near and hold.level * last.level > 0:
            longer = max((last, hold), key=lambda one: one.stop - one.first)
            joined[-1] = Hold(last.first, hold.stop, longer.level)
        else:
            joined.append(hold)
    return joined


def means(log: Recording, first: int, stop: int) -> str:
    """Mean speed, rudder, rate and revolutions of a stretch, in words."""
    said: list[tuple[Array | None, Callable[[float], str]]] = [
        (log.control, log.control_words),
        (log.drive, lambda x: log.drive_words(x) if log.drive_unit != "1" else f"command {log.drive_words(x)}"),
    ]
    words = [] if log.speed is None else [_speed_words(log.speed[first:stop])]
    words += [text(float(np.mean(values[first:stop]))) for values, text in said if values is not None]
    if "theta" in log.others and (log.angle is None or log.vertical):
        words.append(f"pitch {math.degrees(float(np.mean(log.others['theta'][first:stop]))):.0f} deg")
    elif log.angle is not None and not log.vertical:
        words.append(f"heading changes by {math.degrees(float(log.angle[stop - 1] - log.angle[first])):.0f} deg")
    return ", ".join(words)


def _speed_words(speed: Array) -> str:
    """The mean of a speed (n,); where it changes, that at both ends."""
    part = max(1, speed.size // 10)
    start, end, whole = (float(np.mean(values)) for values in (speed[:part], speed[-part:], speed))
    if abs(end - start) > SPEED_CHANGES * abs(whole):
        return f"speed from {start:.3g} to {end:.3g} m/s"
    return f"speed {whole:.3g} m/s"


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Where a mask (n,) is true, as (first, one past the last)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def spread(values: Array, window: int) -> Array:
    """Largest less smallest value (n,) in a window about each sample."""
    top = scipy.ndimage.maximum_filter1d(values, window, mode="nearest")
    return np.asarray(top - scipy.ndimage.minimum_filter1d(values, window, mode="nearest"), dtype=np.float64)


def smooth(values: Array, window: int) -> Array:
    return np.asarray(scipy.ndimage.uniform_filter1d(values, max(1, window), mode="nearest"), dtype=np.float64)


def noise(values: Array) -> float:
    """Standard deviation of a channel's white noise, from its second differences; robust against steps."""
    second = np.abs(np.diff(values, 2))
    return float(np.median(second)) / 0.6745 / math.sqrt(6.0) if second.size else 0.0
