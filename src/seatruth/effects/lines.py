"""The pull of a line: a tether that is taut, a tow, a mooring."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.kinematics import G, to_body_axes
from seatruth.effects.vehicle import dimensions_of
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter, Prior

_PART = 0.01
"""[S] Typical pull over the vehicle's weight: 8 N on an ROV of 80 kg."""


class LinePull(Effect):
    """A pull towards (north, east) that is the same in all trials, at a place ahead of midship or behind it.

    A line that leads to a far point pulls so. One that is towed has the drag of its speed: `tether`.
    """

    name = "line_pull"
    title = "pull of a line"
    cause = "environment.force_fixed_to_earth.line"
    number = 31
    equation = "(X, Y, Z) = R^T (north, east, 0), M = -lever L Z, N = lever L Y"
    source = "[S] chosen here: a hundredth of the weight; attached anywhere between the ends"
    kinds = ("auv",)
    acts_on = ("surge", "sway", "yaw")
    confused_with = ("wave_drift", "current", "tether")
    distinguished_by = "courses all around, and where it is attached; from wave drift by nothing else"
    needs_states = ("u", "v", "psi", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("north", 8.0, "N", -1e5, 1e5, source="[S] chosen here", description="along x of the earth"),
        Parameter("east", 8.0, "N", -1e5, 1e5, source="[S] chosen here", description="along y of the earth"),
        Parameter(
            "lever", 0.0, "1", -0.6, 0.6, prior=Prior(0.0, 0.25), source="[S] chosen here",
            description="where it is attached, before midship / L",
        ),
    )  # fmt: skip
    null: Mapping[str, float] = {"north": 0.0, "east": 0.0}
    direction = ("north", "east")

    def priors(self, model: Model) -> dict[str, Prior]:
        """See `Effect.priors`; as large as the vehicle is heavy."""
        found, size = super().priors(model), dimensions_of(model)
        if size is not None:
            found |= {name: Prior(0.0, _PART * size.mass * G) for name in self.direction}
        return found

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        X, Y, Z = to_body_axes(q.north, q.east, s)
        arm = q.lever * d.length
        return e._replace(X=e.X + X, Y=e.Y + Y, Z=e.Z + Z, M=e.M - arm * Z, N=e.N + arm * Y)
