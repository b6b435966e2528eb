"""What surrounds the vehicle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.models.parameter import Parameter


class Current(Effect):
    """A constant current: the water moves over ground, as components so that its null is a regular point."""

    name = "current"
    title = "constant current"
    family = "environment"
    number = 1
    source = "[L] Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control; magnitudes of the catalogue"
    needs_states = ("u", "v", "psi", "r")
    parameters = (
        Parameter("north", 0.1, "m/s", -2.0, 2.0, source="[S] chosen here", description="along x of the earth"),
        Parameter("east", 0.1, "m/s", -2.0, 2.0, source="[S] chosen here", description="along y of the earth"),
    )
    null: ClassVar[Mapping[str, float]] = {"north": 0.0, "east": 0.0}

    @staticmethod
    def surroundings(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        c, d = math.cos(s.psi), math.sin(s.psi)
        u_c, v_c = q.north * c + q.east * d, q.east * c - q.north * d
        return e._replace(u_c=e.u_c + u_c, v_c=e.v_c + v_c, du_c=e.du_c + s.r * v_c, dv_c=e.dv_c - s.r * u_c)
