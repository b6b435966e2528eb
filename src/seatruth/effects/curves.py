"""What stands for the unknown, and is never named as a cause: another drag curve, and forces of turns to one side."""

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
    title = "drag that rises otherwise with the speed than the model's"
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


class OneSidedTurns(Effect):
    """Forces that differ between turns to port and to starboard: no cause, the trace of one that has no name here.

    A flank that is fouled, a fin that stalls on one side, a jet that draws air in starboard turns: each acts in turns
    to one side only. An error that is the same in all turns, as an offset of a rudder, shows a part of that, and so do
    two such errors between them. It takes part in a diagnosis so that these are not named for it.
    """

    name = "one_sided_turns"
    title = "forces that differ between turns to port and to starboard"
    cause = "hydrodynamics.one_sided"
    number = 28
    equation = (
        "X = surge rho/2 L^3 V r, Y = force rho/2 L^3 V |r|, N = moment rho/2 L^4 V |r|, V the speed through the water"
    )
    source = (
        "[S] chosen here: a fifth of what a hull has in turns to both sides; [L] Y_r, N_r of the Mariner, 5e-3 and "
        "1.7e-3 (Chislett and Strom-Tejsen 1965)"
    )
    acts_on = ("surge", "sway", "yaw")
    confused_with = ("lateral_asymmetry", "rudder_offset", "bank", "heading_bias", "thrust_misalignment")
    distinguished_by = "nothing in straight runs; of what acts there, an error of the same size in turns to both sides"
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter(
            "surge", 5e-4, "1", -0.1, 0.1, source="[S] chosen here", description="forward, in turns to starboard"
        ),
        Parameter("force", 1e-3, "1", -0.1, 0.1, source="[S] a fifth of Y_r", description="to starboard"),
        Parameter("moment", 3e-4, "1", -0.1, 0.1, source="[S] a fifth of N_r", description="bow to starboard"),
    )
    null: Mapping[str, float] = {"surge": 0.0, "force": 0.0, "moment": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        u, v = s.u - e.u_c, s.v - e.v_c
        unit = 0.5 * d.rho * d.length**3 * math.sqrt(u * u + v * v + 1e-12)
        one, both = unit * s.r, unit * abs(s.r)
        return e._replace(X=e.X + one * q.surge, Y=e.Y + both * q.force, N=e.N + d.length * both * q.moment)
