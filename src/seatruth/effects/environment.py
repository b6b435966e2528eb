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
        return carried(e, s, q.north, q.east)


def carried(e: Any, s: Any, north: Any, east: Any) -> Any:
    """Surroundings e with a steady horizontal current added, m/s along x and y of the earth, at the state s.

    A model without roll or pitch floats upright.
    """
    c, d = math.cos(s.psi), math.sin(s.psi)
    ahead, across = north * c + east * d, east * c - north * d
    if not (hasattr(s, "phi") and hasattr(s, "theta")):
        return e._replace(u_c=e.u_c + ahead, v_c=e.v_c + across, du_c=e.du_c + s.r * across, dv_c=e.dv_c - s.r * ahead)
    cf, sf, ct, st = math.cos(s.phi), math.sin(s.phi), math.cos(s.theta), math.sin(s.theta)
    u_c, v_c, w_c = ct * ahead, st * sf * ahead + cf * across, st * cf * ahead - sf * across
    # what stands still over the earth turns in body axes against the body's own turning
    return e._replace(
        u_c=e.u_c + u_c,
        v_c=e.v_c + v_c,
        w_c=e.w_c + w_c,
        du_c=e.du_c + s.r * v_c - s.q * w_c,
        dv_c=e.dv_c + s.p * w_c - s.r * u_c,
        dw_c=e.dw_c + s.q * u_c - s.p * v_c,
    )
