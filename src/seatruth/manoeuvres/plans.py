"""Manoeuvres as closed-loop plans: the orders at each time, from the time and the outputs of the ship.

Angles in rad, times in s. Rudder angles are positive for a turn to starboard, stern plane angles for nose down. Turns,
zigzags and spirals are steered `by` a rudder, or by thrust: then `rudder` is no angle but the share of full thrust in
yaw, -1 to 1, that comes on top of what each thruster gives ahead. For a boat with two thrusters, 0.2 is a fifth of full
thrust more to port and as much less to starboard.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from seatruth.errors import BadInput

Orders = Mapping[str, float]
Helm = Callable[[float, Mapping[str, float]], Orders | None]
"""From the time since the start and the outputs to the orders by input name; None ends the run.

Three orders go to whatever steers and drives the vehicle: "delta", "yaw" and "n" (`seatruth.manoeuvres.steering`).
"""
BY_RUDDER, BY_THRUST = "delta", "yaw"
"""What is ordered where a rudder steers, rad, and where thrusters do, a share of full thrust in yaw; to starboard."""
By = Literal["rudder", "thrust"]

_CONTROL: Mapping[By, str] = {"rudder": BY_RUDDER, "thrust": BY_THRUST}


class Manoeuvre(ABC):
    """One planned run. `helm()` makes a helmsman for one run, who keeps the state of that run."""

    @abstractmethod
    def helm(self) -> Helm:
        """A new helmsman for one run: a function of the time (s) and the outputs by name."""

    @property
    @abstractmethod
    def label(self) -> str:
        """Short name for a trial, in degrees ("zigzag 10/10 starboard first")."""


@dataclass(frozen=True)
class TurningCircle(Manoeuvre):
    """Straight approach, rudder hard over and held until the heading has changed by `turn`."""

    rudder: float
    turn: float = math.radians(540.0)
    approach: float = 10.0
    by: By = "rudder"

    def __post_init__(self) -> None:
        _positive(self.turn, "turn")
        _steered(self.by, self.rudder)

    @property
    def label(self) -> str:
        return f"turning circle {_level(self.by, self.rudder)}"

    def helm(self) -> Helm:
        start: list[float] = []
        control = _CONTROL[self.by]

        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            if t < self.approach - 1e-9:
                return {control: 0.0}
            start[:] = start or [y["psi"]]
            return None if abs(y["psi"] - start[0]) >= self.turn else {control: self.rudder}

        return helm


@dataclass(frozen=True)
class Zigzag(Manoeuvre):
    """Rudder `rudder` until the heading has changed by `heading`, then as much the other way, `executes` times.

    The run ends when the heading has come back after the last execute, or at the time limit of the run.
    """

    rudder: float
    heading: float
    first: Literal["starboard", "port"] = "starboard"
    executes: int = 5
    approach: float = 10.0
    by: By = "rudder"

    def __post_init__(self) -> None:
        _positive(self.rudder, "rudder")
        _steered(self.by, self.rudder)
        _positive(self.heading, "heading")

    @property
    def label(self) -> str:
        return f"zigzag {_level(self.by, self.rudder)}/{_degrees(self.heading)} {self.first} first"

    def helm(self) -> Helm:
        side = 1.0 if self.first == "starboard" else -1.0
        return _reversing(_CONTROL[self.by], "psi", self.rudder * side, self.heading, 1.0, self.executes, self.approach)


@dataclass(frozen=True)
class PitchZigzag(Manoeuvre):
    """The same with the stern plane, reversed when the pitch angle has changed by `pitch`."""

    plane: float
    pitch: float
    first: Literal["up", "down"] = "down"
    executes: int = 1_000
    approach: float = 0.0

    def __post_init__(self) -> None:
        _positive(self.plane, "plane")
        _positive(self.pitch, "pitch")

    @property
    def label(self) -> str:
        return f"pitch zigzag {_degrees(self.plane)}/{_degrees(self.pitch)} {self.first} first"

    def helm(self) -> Helm:
        side = 1.0 if self.first == "down" else -1.0
        return _reversing("delta_s", "theta", self.plane * side, self.pitch, -1.0, self.executes, self.approach)


@dataclass(frozen=True)
class Straight(Manoeuvre):
    """Constant orders for a time."""

    duration: float
    rudder: float = 0.0

    def __post_init__(self) -> None:
        _positive(self.duration, "duration")

    @property
    def label(self) -> str:
        return "straight run" if self.rudder == 0 else f"straight run, rudder {_degrees(self.rudder)}"

    def helm(self) -> Helm:
        return _schedule([(self.duration, {"delta": self.rudder})])


@dataclass(frozen=True)
class SpeedSteps(Manoeuvre):
    """Propeller revolutions `revolutions` (rev/s), each held for `hold`."""

    revolutions: tuple[float, ...]
    hold: float
    rudder: float = 0.0

    def __post_init__(self) -> None:
        _positive(self.hold, "hold")

    @property
    def label(self) -> str:
        return "speed steps " + "/".join(f"{n:g}" for n in self.revolutions) + " rev/s"

    def helm(self) -> Helm:
        return _schedule([(self.hold, {"n": n, "delta": self.rudder}) for n in self.revolutions])


@dataclass(frozen=True)
class CoastDown(Manoeuvre):
    """Straight approach, then the propeller stopped for `duration`."""

    duration: float
    approach: float = 10.0
    rudder: float = 0.0

    def __post_init__(self) -> None:
        _positive(self.duration, "duration")

    @property
    def label(self) -> str:
        return "coast-down"

    def helm(self) -> Helm:
        straight = {"delta": self.rudder}
        return _schedule([(self.approach, straight), (self.duration, {**straight, "n": 0.0})])


@dataclass(frozen=True)
class CrashStop(Manoeuvre):
    """Straight approach, then the propeller at `revolutions` (rev/s) until the ship is dead in the water.

    Where thrusters drive the vehicle, `revolutions` are the order of those that push ahead, in their inputs' unit.

    Ahead these are negative, for full astern; for a ship that goes astern, positive. Zero is a stop by resistance
    alone, which ends at the time limit of the run.
    """

    revolutions: float
    approach: float = 10.0
    rudder: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.revolutions):
            raise BadInput(f"revolutions must be a number, not {self.revolutions}", where="manoeuvre", do="Give rev/s.")

    @property
    def label(self) -> str:
        return f"crash stop {self.revolutions:g} rev/s"

    def helm(self) -> Helm:
        sense: list[float] = []

        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            if t < self.approach - 1e-9:
                return {"delta": self.rudder}
            sense[:] = sense or [math.copysign(1.0, y["u"])]
            stopped = y["u"] * sense[0] <= 0
            return None if stopped else {"delta": self.rudder, "n": self.revolutions}

        return helm


@dataclass(frozen=True)
class Spiral(Manoeuvre):
    """A staircase of rudder angles, each held for `hold` (the direct spiral where they step through zero)."""

    rudders: tuple[float, ...]
    hold: float
    by: By = "rudder"

    def __post_init__(self) -> None:
        _positive(self.hold, "hold")
        _steered(self.by, *self.rudders)

    @property
    def label(self) -> str:
        return "spiral " + "/".join(_level(self.by, rudder) for rudder in self.rudders)

    def helm(self) -> Helm:
        return _schedule([(self.hold, {_CONTROL[self.by]: rudder}) for rudder in self.rudders])


def _reversing(
    control: str, angle: str, order: float, change: float, sense: float, executes: int, approach: float
) -> Helm:
    """Reverses `control` whenever `angle` has changed by `change` in the direction in which the order turns it."""
    now = {"order": order, "done": 0.0, "start": math.nan}

    def helm(t: float, y: Mapping[str, float]) -> Orders | None:
        if t < approach - 1e-9:
            return {control: 0.0}
        if now["done"] == 0:
            now.update(start=y[angle], done=1.0)
        gone = (y[angle] - now["start"]) * sense * math.copysign(1.0, now["order"])
        if now["done"] < executes:
            if gone >= change:
                now.update(order=-now["order"], done=now["done"] + 1)
        elif gone >= 0:
            return None
        return {control: now["order"]}

    return helm


def _schedule(parts: list[tuple[float, Orders]]) -> Helm:
    """Orders one after the other, each for its time."""

    def helm(t: float, y: Mapping[str, float]) -> Orders | None:
        end = 0.0
        for duration, orders in parts:
            end += duration
            if t < end - 1e-9:
                return orders
        return None

    return helm


def _positive(value: float, name: str) -> None:
    if not (math.isfinite(value) and value > 0):
        do = "Give a positive number; from Python, angles are in rad and times in s."
        raise BadInput(f"{name} must be positive, not {value}", where="manoeuvre", do=do)


def _steered(by: By, *levels: float) -> None:
    if by not in _CONTROL:
        do = 'Give by="rudder" or by="thrust".'
        raise BadInput(f"nothing steers by {by!r}", where="manoeuvre", do=do)
    if by == "thrust" and not all(abs(level) <= 1.0 for level in levels):
        raise BadInput("a share of full thrust is beyond 1", where="manoeuvre", do="Give -1 to 1, as 0.2.")


def _level(by: By, level: float) -> str:
    return f"{100.0 * level:.6g} %" if by == "thrust" else _degrees(level)


def _degrees(angle: float) -> str:
    return f"{round(math.degrees(angle), 6):g}"
