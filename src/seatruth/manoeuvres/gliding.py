"""Manoeuvres of buoyancy-driven gliders: sawtooth and spiral.

They order the net buoyancy `m_b` (kg), the place `x_p` (m) of the sliding mass and the rudder; pump and slide move at
their own speeds, which the orders follow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from seatruth.errors import BadInput
from seatruth.manoeuvres.plans import Helm, Manoeuvre, Orders

PUMP = 0.02
"""kg/s, [S]: how fast the net buoyancy changes."""
SLIDE = 0.002
"""m/s, [S]: how fast the sliding mass moves."""


@dataclass(frozen=True)
class Trim:
    """Net buoyancy (kg, positive sinks) and place of the sliding mass (m) of a glide."""

    m_b: float
    x_p: float


@dataclass(frozen=True)
class Sawtooth(Manoeuvre):
    """Glides down and up between two depths; `halves` glides in all, the first one down.

    `dive` is ordered at the start and whenever the depth falls below `shallow` (m), `climb` when it exceeds `deep`. The
    glider overshoots both, as pump and slide take their time. A change of `headings` steers by the rudder: at the start
    of glide k the heading ordered is `headings[k]` (rad; the last one stays), proportionally within `rudder`.
    """

    dive: Trim
    climb: Trim
    deep: float = 190.0
    shallow: float = 8.0
    halves: int = 4
    headings: tuple[float, ...] = ()
    rudder: float = math.radians(30.0)

    def __post_init__(self) -> None:
        if not self.deep > self.shallow:
            raise BadInput(f"a sawtooth from {self.deep:g} to {self.shallow:g} m has no height", where="manoeuvre")
        if self.halves < 1:
            raise BadInput(f"{self.halves} glides", where="manoeuvre", do="Ask for 1 or more.")

    @property
    def label(self) -> str:
        return f"sawtooth {self.dive.m_b:g}/{self.climb.m_b:g} kg, {self.shallow:g} to {self.deep:g} m"

    def helm(self) -> Helm:
        mover = _Mover(self.dive)
        down = [True]
        done = [0]

        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            if (y["z"] > self.deep) if down[0] else (y["z"] < self.shallow):
                down[0] = not down[0]
                done[0] += 1
                if done[0] == self.halves:
                    return None
            orders = mover.towards(self.dive if down[0] else self.climb, t)
            if self.headings:
                away = self.headings[min(done[0], len(self.headings) - 1)] - y["psi"]
                turn = math.atan2(math.sin(away), math.cos(away))
                orders["delta"] = max(-self.rudder, min(self.rudder, turn))
            return orders

        return helm


@dataclass(frozen=True)
class GlideSpiral(Manoeuvre):
    """A glide with the rudder held at each of `rudders` (rad) for `hold` (s), after `approach` (s) straight ahead."""

    trim: Trim
    rudders: tuple[float, ...]
    hold: float = 300.0
    approach: float = 60.0

    def __post_init__(self) -> None:
        if not self.hold > 0 or not self.rudders:
            raise BadInput("a spiral needs rudder angles and a time to hold them", where="manoeuvre")

    @property
    def label(self) -> str:
        angles = "/".join(f"{round(math.degrees(rudder), 6):g}" for rudder in self.rudders)
        return f"spiral {angles}, {self.trim.m_b:g} kg"

    def helm(self) -> Helm:
        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            part = math.floor((t - self.approach) / self.hold + 1e-9)
            if part >= len(self.rudders):
                return None
            rudder = 0.0 if part < 0 else self.rudders[part]
            return {"m_b": self.trim.m_b, "x_p": self.trim.x_p, "delta": rudder}

        return helm


class _Mover:
    """Pump and slide on their way: it starts where it is first sent and then moves at their speeds."""

    def __init__(self, start: Trim) -> None:
        self.m_b, self.x_p, self.t = start.m_b, start.x_p, 0.0

    def towards(self, trim: Trim, t: float) -> dict[str, float]:
        pump, slide = PUMP * (t - self.t), SLIDE * (t - self.t)
        self.m_b += max(-pump, min(pump, trim.m_b - self.m_b))
        self.x_p += max(-slide, min(slide, trim.x_p - self.x_p))
        self.t = t
        return {"m_b": self.m_b, "x_p": self.x_p}
