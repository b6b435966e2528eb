"""A drag that rises otherwise with the speed than the model's: a form of the model, and the cause of nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.kinematics import G
from seatruth.models.parameter import Parameter

_FROUDE = 0.3
"""Froude number of the speed U where no trials tell it. [S] Ships and boats under way are at 0.15 to 0.5."""
_SLOW = 0.05
"""Part of the speed U below which the power is that of the model. [S] The drag is next to none there, and of a lower
power than the model's it would have no bound."""


class DragCurve(Effect):
    """Drag that rises with another power of the speed than the model's: no cause, a form that the model has wrong.

    Friction rises with a power of 1.8, waves make it 4 and more. Near one speed it looks like another thrust, and takes
    part in a diagnosis so that this is not named. At the speed `speed` (m/s) it is the model's own; None takes
    0.3 sqrt(g L). What the drag is there is the matter of its coefficient.
    """

    name = "drag_curve"
    title = "drag that rises otherwise with the speed"
    cause = "hydrodynamics.damping_or_lift.drag_curve"
    number = 19
    equation = "X = -(|u / U|^power - 1) times the drag in straight motion, U the usual speed of the trials"
    source = "[L] power of the speed: 1.8 of friction (ITTC 1957), 4 of waves before their hump"
    acts_on = ("surge",)
    equivalent = ("X_uuu",)
    confused_with = ("thrust_gain", "drag_increase", "tether")
    distinguished_by = "steady runs at several speeds"
    needs_states = ("u",)
    needs_vehicle = ("drag", "dimensions")
    parameters = (
        Parameter("power", 0.5, "1", -1.5, 4.0, source="[S] a quarter of the power", description="beyond the model's"),
    )
    null: Mapping[str, float] = {"power": 0.0}

    def __init__(self, speed: float | None = None) -> None:
        self.speed = speed
        super().__init__()

    def at_speed(self, speed: float) -> Effect:
        return type(self)(speed)

    def force(self, e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        u = s.u - e.u_c
        usual = _FROUDE * math.sqrt(G * d.length) if self.speed is None else self.speed
        ratio = (u * u) / (usual * usual) + _SLOW * _SLOW
        return e._replace(X=e.X - (math.exp(0.5 * q.power * math.log(ratio)) - 1.0) * d.drag)
