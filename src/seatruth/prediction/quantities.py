"""The figures of each kind of manoeuvre by name, with unit and power of Froude's scale, as numbers of one run."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from seatruth.errors import BadInput
from seatruth.manoeuvres import (
    AxisSteps,
    CrashStop,
    Manoeuvre,
    Spiral,
    TurningCircle,
    Zigzag,
    spiral_figures,
    stopping_figures,
    turning_circle_figures,
    zigzag_figures,
)
from seatruth.manoeuvres.steering import Steering
from seatruth.trials.prepare.full_scale import FROUDE
from seatruth.trials.trial import Trial


@dataclass(frozen=True)
class Quantity:
    """One figure of a manoeuvre: its name in results, its title, its SI unit."""

    name: str
    title: str
    unit: str

    @property
    def power(self) -> float:
        """Power of the scale with which it grows under Froude's law."""
        return FROUDE[self.unit]


TURN = (
    Quantity("advance", "advance at 90 deg", "m"),
    Quantity("transfer", "transfer at 90 deg", "m"),
    Quantity("tactical_diameter", "tactical diameter at 180 deg", "m"),
    Quantity("time_90", "time to 90 deg", "s"),
    Quantity("time_180", "time to 180 deg", "s"),
    Quantity("steady_diameter", "diameter of the steady turn", "m"),
    Quantity("drift_angle", "drift angle in the steady turn", "rad"),
    Quantity("rate", "yaw rate in the steady turn", "rad/s"),
    Quantity("speed_loss", "speed loss in the steady turn", "1"),
)
ZIGZAG = (
    Quantity("first_overshoot", "first overshoot", "rad"),
    Quantity("second_overshoot", "second overshoot", "rad"),
    Quantity("initial_turning_time", "initial turning time", "s"),
    Quantity("initial_turning_distance", "initial turning distance", "m"),
    Quantity("reach", "reach (heading back after the second execute)", "s"),
    Quantity("period", "period", "s"),
)
STOP = (
    Quantity("track_reach", "track reach", "m"),
    Quantity("head_reach", "head reach", "m"),
    Quantity("lateral_deviation", "lateral deviation", "m"),
    Quantity("heading_change", "heading change", "rad"),
    Quantity("stopping_time", "stopping time", "s"),
)
SPIRAL = (
    Quantity("loop_width", "width of the spiral's loop", "rad"),
    Quantity("loop_height", "height of the spiral's loop", "rad/s"),
)
SPIRAL_BY_THRUST = (replace(SPIRAL[0], unit="1"), SPIRAL[1])
QUANTITIES: Mapping[str, tuple[Quantity, ...]] = {
    "turn": TURN,
    "zigzag": ZIGZAG,
    "stop": STOP,
    "spiral": SPIRAL,
    "spiral by thrust": SPIRAL_BY_THRUST,
}
"""Quantities by kind of manoeuvre."""


def kind_of(plan: Manoeuvre) -> str:
    """The kind of a planned manoeuvre; BadInput for one that has no figures."""
    if (isinstance(plan, AxisSteps) and plan.axis == "yaw") or (isinstance(plan, Spiral) and plan.by == "thrust"):
        return "spiral by thrust"
    for kind, own in (("turn", TurningCircle), ("zigzag", Zigzag), ("stop", CrashStop), ("spiral", Spiral)):
        if isinstance(plan, own):
            return kind
    raise BadInput(
        f"there are no figures of {plan.label}",
        where="predict",
        do="Give a TurningCircle, Zigzag, CrashStop or Spiral, or AxisSteps in yaw.",
    )


def figures_of(
    kind: str, run: Trial | str, steering: Steering | None = None
) -> tuple[dict[str, float], dict[str, str]]:
    """The figures of one run by name (SI, rad), NaN where there are none, and then why, by name.

    `steering`: what steers its model, from `steering_of`; by default the run's channels tell.
    """
    quantities = QUANTITIES[kind]
    none = dict.fromkeys((quantity.name for quantity in quantities), math.nan)
    if isinstance(run, str):
        return none, dict.fromkeys(none, run)
    try:
        found = _READ[kind](run if steering is None else steering.recorded(run))
    except BadInput as problem:
        return none, dict.fromkeys(none, problem.what)
    why: dict[str, str] = found.why
    values = {name: float(getattr(found, name)) for name in none}
    missing = {name: "the run does not hold it" for name, value in values.items() if not math.isfinite(value)}
    if "overshoots" in why:
        missing |= dict.fromkeys(("first_overshoot", "second_overshoot"), why["overshoots"])
    elif "second_overshoot" in missing:
        missing["second_overshoot"] = "the record ends before the second overshoot"
    if "speed_ratio" in why and "speed_loss" in missing:
        missing["speed_loss"] = why["speed_ratio"]
    return values, {name: why.get(name, text) for name, text in missing.items()}


_READ: Mapping[str, Callable[[Trial], Any]] = {
    "turn": turning_circle_figures,
    "zigzag": zigzag_figures,
    "stop": stopping_figures,
    "spiral": spiral_figures,
    "spiral by thrust": spiral_figures,
}
