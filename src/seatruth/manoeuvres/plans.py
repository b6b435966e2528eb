"""Manoeuvres as closed-loop plans: the orders at each time, from the time and the outputs of the ship.

Angles in rad, times in s. Rudder angles are positive for a turn to starboard, stern plane angles for nose down.
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
"""From the time since the start and the outputs to the orders by input name; None ends the run."""


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

    def __post_init__(self) -> None:
        _positive(self.turn, "turn")

    @property
    def label(self) -> str:
        return f"turning circle {_degrees(self.rudder)}"

    def helm(self) -> Helm:
        start: list[float] = []

        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            if t < self.approach - 1e-9:
                return {"delta": 0.0}
            start[:] = start or [y["psi"]]
            return None if abs(y["psi"] - start[0]) >= self.turn else {"delta": self.rudder}

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

    def __post_init__(self) -> None:
        _positive(self.rudder, "rudder")
        _positive(self.heading, "heading")

    @property
    def label(self) -> str:
        return f"zigzag {_degrees(self.rudder)}/{_degrees(self.heading)} {self.first} first"

    def helm(self) -> Helm:
        side = 1.0 if self.first == "starboard" else -1.0
        return _reversing("delta", "psi", self.rudder * side, self.heading, 1.0, self.executes, self.approach)


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

    def __post_init__(self) -> None:
        _positive(self.hold, "hold")

    @property
    def label(self) -> str:
        return "spiral " + "/".join(_degrees(rudder) for rudder in self.rudders)

    def helm(self) -> Helm:
        return _schedule([(self.hold, {"delta": rudder}) for rudder in self.rudders])


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


def _degrees(angle: float) -> str:
    return f"{round(math.degrees(angle), 6):g}"
