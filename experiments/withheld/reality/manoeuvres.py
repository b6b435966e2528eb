"""Manoeuvres: who gives which order when, from what the sensors read.

Each manoeuvre starts with a steady approach. `closed` says that a pilot steers by what is read, so that noise gets
into the orders all the time; in the others orders depend on what is read only at the moments of reversal, or not at
all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

Read = Mapping[str, float]


@dataclass
class Orders:
    """Order of the steering actuator (rad) and share of the approach's revolutions."""

    delta: float
    n: float = 1.0


@dataclass(frozen=True)
class Craft:
    """What a pilot knows of the craft: reading to steer by, its rate, gains, sign (+1 turns up the reading)."""

    angle: str
    rate: str
    gain: float
    damping: float
    sense: float
    largest: float
    time: float
    """L / U, s."""


Manoeuvre = Callable[[float, Read, Craft], Orders]


def _pilot(read: Read, wanted: float, craft: Craft) -> float:
    error = wanted - read[craft.angle]
    order = craft.sense * (craft.gain * error - craft.damping * craft.time * read[craft.rate])
    return max(-craft.largest, min(craft.largest, order))


@dataclass
class Zigzag:
    """Rudder over at `delta`, reversed at `angle` off the first heading; begins to the side of `side`."""

    delta: float
    angle: float
    side: float
    approach: float
    heading: float
    closed = False

    def __post_init__(self) -> None:
        self._to = self.side

    def __call__(self, t: float, read: Read, craft: Craft) -> Orders:
        if t < self.approach:
            return Orders(0.0)
        off = read[craft.angle] - self.heading
        if off * self._to > self.angle:
            self._to = -self._to
        return Orders(craft.sense * self._to * self.delta)


@dataclass
class Fixed:
    """Orders by the clock: (from s, delta, share of revolutions)."""

    plan: list[tuple[float, float, float]]
    closed = False

    def __call__(self, t: float, read: Read, craft: Craft) -> Orders:
        now = Orders(0.0)
        for start, delta, n in self.plan:
            if t >= start:
                now = Orders(craft.sense * delta, n)
        return now


@dataclass
class Steered:
    """A pilot on a list of headings and revolutions by the clock: (from s, heading, share of revolutions)."""

    plan: list[tuple[float, float, float]]
    closed = True

    def __call__(self, t: float, read: Read, craft: Craft) -> Orders:
        heading, n = self.plan[0][1:]
        for start, angle, share in self.plan:
            if t >= start:
                heading, n = angle, share
        return Orders(_pilot(read, heading, craft), n)


@dataclass
class DepthSteered:
    """A pilot on a list of depths by the clock: (from s, m below the first depth)."""

    plan: list[tuple[float, float]]
    steepest: float
    """rad: largest angle that it dives or climbs at."""
    reach: float
    """m: how far from the wanted depth it begins to level out, per radian of angle."""
    closed = True

    def __post_init__(self) -> None:
        self._first: float | None = None

    def __call__(self, t: float, read: Read, craft: Craft) -> Orders:
        if self._first is None:
            self._first = read["z"]
        below = 0.0
        for start, depth in self.plan:
            if t >= start:
                below = depth
        wanted = (read["z"] - self._first - below) / self.reach
        return Orders(_pilot(read, max(-self.steepest, min(self.steepest, wanted)), craft))


@dataclass(frozen=True)
class Trial:
    """One trial: what is done, from which heading (rad) and share of the usual speed, over how long (s)."""

    name: str
    manoeuvre: Callable[[], Manoeuvre]
    heading: float
    seconds: float
    speed: float = 1.0

    @property
    def closed(self) -> bool:
        return bool(getattr(self.manoeuvre(), "closed", False))


def ship_trial(name: str, heading: float, time: float) -> Trial:
    """A ship's manoeuvre by name; `time` is L / U, s."""
    deg, a = math.radians, 3 * time
    long, short = 33 * time, 22 * time
    starboard = -1.0 if name.endswith("_port") else 1.0
    plans: dict[str, tuple[Callable[[], Manoeuvre], float]] = {
        "zigzag_10_10": (lambda: Zigzag(deg(10), deg(10), starboard, a, heading), 27 * time),
        "zigzag_20_20": (lambda: Zigzag(deg(20), deg(20), starboard, a, heading), 27 * time),
        "zigzag_20_10": (lambda: Zigzag(deg(20), deg(10), starboard, a, heading), 27 * time),
        "turn_35": (lambda: Fixed([(a, starboard * deg(35), 1.0)]), long),
        "turn_25": (lambda: Fixed([(a, starboard * deg(25), 1.0)]), long),
        "turn_20": (lambda: Fixed([(a, starboard * deg(20), 1.0)]), long),
        "straight_run": (lambda: Steered([(0.0, heading, 1.0)]), short),
        "reciprocal_run": (lambda: Steered([(0.0, heading, 1.0)]), short),
        "beam_heading_run": (lambda: Steered([(0.0, heading, 1.0)]), short),
        "speed_steps": (
            lambda: Steered([(0.0, heading, 1.0), (a, heading, 0.6), (14 * time, heading, 1.15)]), 27 * time,
        ),
        "course_changes": (
            lambda: Steered(
                [(0.0, heading, 1.0), (a, heading + deg(25), 1.0), (12 * time, heading - deg(15), 1.0),
                 (21 * time, heading, 1.0)]
            ), 30 * time,
        ),
        "coast_down": (lambda: Steered([(0.0, heading, 1.0), (a, heading, 0.0)]), short),
        "rudder_staircase": (
            lambda: Fixed([(a + 3 * k * time, deg(x), 1.0) for k, x in enumerate((2, 4, 6, 0, -2, -4, -6, 0))]),
            30 * time,
        ),
    }  # fmt: skip
    base = name.removesuffix("_port").removesuffix("_starboard")
    manoeuvre, seconds = plans[base]
    return Trial(name, manoeuvre, heading, min(seconds, 200.0 * time / 5.94))


def auv_trial(name: str, time: float, speed: float = 1.0) -> Trial:
    """A manoeuvre of the vehicle in the diving plane."""
    deg, a = math.radians, 5 * time
    first = -1.0 if name.endswith("_down") else 1.0
    plans: dict[str, tuple[Callable[[], Manoeuvre], float]] = {
        "pitch_zigzag_5": (lambda: Zigzag(deg(5), deg(5), first, a, 0.0), 44 * time),
        "pitch_zigzag_15": (lambda: Zigzag(deg(15), deg(12), first, a, 0.0), 44 * time),
        "level_run": (lambda: Steered([(0.0, 0.0, 1.0)]), 34 * time),
        "pitch_steps": (
            lambda: Steered([(0.0, 0.0, 1.0), (a, deg(8), 1.0), (16 * time, deg(-8), 1.0), (30 * time, 0.0, 1.0)]),
            44 * time,
        ),
        "dive": (lambda: Steered([(0.0, 0.0, 1.0), (a, deg(-12), 1.0)]), 34 * time),
        "climb": (lambda: Steered([(0.0, 0.0, 1.0), (a, deg(12), 1.0)]), 34 * time),
        "plane_staircase": (
            lambda: Fixed([(a + 4 * k * time, deg(x), 1.0) for k, x in enumerate((2, 5, 9, 0, -2, -5, -9, 0))]),
            44 * time,
        ),
        "plane_step": (lambda: Fixed([(a, first * deg(6), 1.0)]), 34 * time),
    }
    base = name.removesuffix("_down").removesuffix("_up").removesuffix("_slow")
    manoeuvre, seconds = plans[base]
    return Trial(name, manoeuvre, 0.0, seconds, speed)


def torpedo_trial(name: str, time: float, speed: float = 1.0) -> Trial:
    """A manoeuvre of the torpedo-like vehicle; angles and orders count from its trim."""
    deg, a = math.radians, 5 * time
    first = -1.0 if name.endswith("_down") else 1.0
    level, reach = deg(10), 20.0
    doublets = (4, -4, 0, 8, -8, 0, -4, 4, 0, -10, 10, 0)
    # Each pulse is taken back by one twice as long at half the angle, and by its mirror later.
    pulses = (
        (0, 6), (1.5, -3), (4.5, 0), (10, -6), (11.5, 3), (14.5, 0), (20, -10), (21.5, 5), (24.5, 0), (30, 10),
        (31.5, -5), (34.5, 0),
    )  # fmt: skip
    plans: dict[str, tuple[Callable[[], Manoeuvre], float]] = {
        "pitch_zigzag_5": (lambda: Zigzag(deg(5), deg(5), first, a, 0.0), 44 * time),
        "pitch_zigzag_15": (lambda: Zigzag(deg(10), deg(15), first, a, 0.0), 44 * time),
        "level_run": (lambda: DepthSteered([(0.0, 0.0)], level, reach), 34 * time),
        "depth_steps": (lambda: DepthSteered([(0.0, 0.0), (a, 5.0), (26 * time, 2.0)], level, reach), 50 * time),
        "pitch_steps": (
            lambda: Steered([(0.0, 0.0, 1.0), (a, deg(15), 1.0), (18 * time, deg(-15), 1.0), (32 * time, 0.0, 1.0)]),
            44 * time,
        ),
        "dive": (lambda: Steered([(0.0, 0.0, 1.0), (a, deg(-15), 1.0), (25 * time, 0.0, 1.0)]), 34 * time),
        "plane_doublets": (
            lambda: Fixed([(a + 2.5 * k * time, deg(x), 1.0) for k, x in enumerate(doublets)]), 38 * time,
        ),
        "plane_pulses": (lambda: Fixed([(a + t * time, first * deg(x), 1.0) for t, x in pulses]), 44 * time),
    }  # fmt: skip
    base = name.removesuffix("_down").removesuffix("_up").removesuffix("_slow")
    manoeuvre, seconds = plans[base]
    return Trial(name, manoeuvre, 0.0, seconds, speed)
